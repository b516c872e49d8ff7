"""The virtual machine: runs a program against a motion port and the world until it must wait.

It knows no robot and no time. It trusts its program (`verifier.py` is the check that files pass), and
it never spins: work without motion or waiting is bounded.
"""

from __future__ import annotations

import copy
import operator
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import NamedTuple

from viapoint.vm.cycles import main_loop
from viapoint.vm.instructions import MOTIONS, Decoded, Instruction, decode
from viapoint.vm.ports import (
    BEGINNING,
    AtBarrier,
    AwaitInput,
    AwaitReset,
    Barrier,
    BufferFull,
    Call,
    Dwell,
    End,
    Ended,
    Failed,
    Modal,
    Motion,
    MotionPort,
    RaiseM,
    SelectTool,
    SetOutput,
    Suspension,
    Tangent,
    Track,
    WorldPort,
)
from viapoint.vm.program import Program
from viapoint.vm.shapes import MotionWords, motion_words, parse_shape

DEPTH_LIMIT = 64
"""How deep subroutines nest."""

WORK_LIMIT = 100_000
"""Instructions allowed without motion or waiting, beyond once through the whole program: some 20 ms."""


KEPT_STEPS = 20_000
"""Prepared instructions kept for the next pass: any loop's worth, some 10 MB; then they start afresh."""


class ActiveCall(NamedTuple):
    """One level of the call stack as shown to the user."""

    line: int  # of the SUB statement
    label_line: int  # where the subroutine starts
    remaining: int  # runs still to come, the present one included


@dataclass(slots=True)
class _Frame:
    """A running subroutine, or the main program at the bottom. Counters are keyed by label."""

    entry: int
    returns_to: int
    call_line: int
    remaining: int = 1
    counters: dict[int, tuple[int, int]] = field(default_factory=dict)  # label: (address of REPEAT, runs)


class _Step(NamedTuple):
    """A decoded instruction, ready to run."""

    handler: Callable[[Machine, _Step], Call | AwaitInput | Failed | None]
    operands: tuple[int, ...]
    following: int
    address: int
    line: int
    words: MotionWords | None


class Machine:
    """Runs `program`; `run` returns each time it must wait, and is called again to resume.

    `max_cycles` ends an endless program after so many passes of its main loop (`cycles.main_loop`): at the
    jump back that completes the last of them. `last_line` ends any program when it leaves that line.
    `modal` is what holds where it begins.
    """

    def __init__(
        self,
        program: Program,
        motion: MotionPort,
        world: WorldPort,
        *,
        max_cycles: int | None = None,
        last_line: int | None = None,
        modal: Modal = BEGINNING,
    ) -> None:
        self._program = program
        self._motion = motion
        self._world = world
        self._steps: dict[int, _Step] = {}
        self._address = 0
        self._line = program.line_at(0)
        self._stack: list[float] = []
        self._frames = [_Frame(0, 0, 0)]
        self._pending: Call | None = None
        self._finished: Ended | Failed | None = None
        self._speed, self._tool = modal
        self._work = 0
        self._work_limit = WORK_LIMIT + len(program.code)
        self._cycles_left = max_cycles
        self._main_loop = main_loop(program) if max_cycles is not None else None
        self.cut_short = False
        """Whether `max_cycles` or `last_line` ended the program."""
        self._last_line = last_line

    @property
    def line(self) -> int:
        """Source line the interpreter has reached."""
        return self._line

    @property
    def modal(self) -> Modal:
        """What holds at the interpreter's place."""
        return Modal(self._speed, self._tool)

    @property
    def cycles_left(self) -> int | None:
        """Passes of the main loop to come, with the present one; None where they are not counted."""
        return self._cycles_left

    def twin(self, motion: MotionPort, world: WorldPort) -> Machine:
        """A machine that goes on from here on other ports; neither has an influence on the other."""
        shared = (self._program, self._steps, self._motion, self._world)
        twin = copy.deepcopy(self, {id(one): one for one in shared})
        twin._motion, twin._world = motion, world
        return twin

    @property
    def call_stack(self) -> tuple[ActiveCall, ...]:
        """The subroutines running, outermost first."""
        return tuple(
            ActiveCall(frame.call_line, self._program.line_at(frame.entry), frame.remaining)
            for frame in self._frames[1:]
        )

    @property
    def state(self) -> Hashable:
        """Everything the machine's further course depends on beside the world: equal states go on equally."""
        frames = tuple(
            (f.entry, f.returns_to, f.remaining, tuple(sorted(f.counters.items()))) for f in self._frames
        )
        return self._address, tuple(self._stack), frames, self._speed, self._tool, self._cycles_left

    def run(self) -> Suspension:
        """Execute until the machine must wait; call it again when what it waits for has happened.

        After `Ended` or `Failed` it answers the same for ever.
        """
        if self._finished is not None:
            return self._finished
        if self._pending is not None:
            suspension = self._submit(self._pending)
            if suspension is not None:
                return suspension
        while True:
            step = self._steps.get(self._address) or self._prepare(self._address)
            if self._line == self._last_line != step.line:
                return self._cut(self._line)
            self._line = step.line
            self._work += 1
            if self._work > self._work_limit:
                return self._finish(self._endless(step.line))
            self._address = step.following
            outcome = step.handler(self, step)
            if outcome is None:
                continue
            if isinstance(outcome, Failed):
                return self._finish(outcome)
            if isinstance(outcome, AwaitInput):
                self._address = step.address
                self._work = 0
                return outcome
            suspension = self._submit(outcome)
            if suspension is not None:
                return suspension

    def _cut(self, line: int) -> Suspension:
        """End here, before the program's own end."""
        self.cut_short = True
        suspension = self._submit(End(line=line))
        assert suspension is not None, "an end is waited for, or ends"
        return suspension

    def _prepare(self, address: int) -> _Step:
        decoded = decode(self._program.code, address)
        line = self._program.line_at(address)
        words = self._words(decoded) if decoded.instruction in MOTIONS else None
        handler = HANDLERS[decoded.instruction]
        step = _Step(handler, decoded.operands, decoded.following, address, line, words)
        if len(self._steps) >= KEPT_STEPS:
            self._steps.clear()
        self._steps[address] = step
        return step

    def _words(self, decoded: Decoded) -> MotionWords:
        number, base = decoded.operands
        shape = parse_shape(decoded.instruction, self._program.shapes[number])
        values = self._program.numbers[base : base + len(shape.keys)]
        return motion_words(decoded.instruction, shape, values)

    def _submit(self, call: Call) -> Suspension | None:
        """Hand `call` over; what to wait for afterwards, or None to go on."""
        if not self._motion.submit(call):
            self._pending = call
            return BufferFull()
        self._pending = None
        match call:
            case Motion():
                self._work = 0
            case Dwell(seconds=seconds) if seconds > 0:
                self._work = 0
            case Barrier(line=line, reason=reason):
                self._work = 0
                return AtBarrier(line, reason)
            case RaiseM(line=line, index=index, synchronous=True):
                self._work = 0
                return AwaitReset(line, index)
            case End(line=line):
                return self._finish(Ended(line))
            case _:
                pass
        return None

    def _finish(self, outcome: Ended | Failed) -> Ended | Failed:
        self._finished = outcome
        return outcome

    def _endless(self, line: int) -> Failed:
        return Failed(
            line,
            "E401",
            f"the program goes round in a loop through line {line} with neither motion nor waiting in it",
        )

    # Handlers: one per instruction, collected in HANDLERS below. The address already stands behind the
    # instruction when one is called.

    def _end(self, step: _Step) -> Call | None:
        frame = self._frames[-1]
        if len(self._frames) == 1:
            return End(line=step.line)
        frame.remaining -= 1
        if frame.remaining:
            frame.counters.clear()
            self._address = frame.entry
        else:
            self._frames.pop()
            self._address = frame.returns_to
        return None

    def _label(self, step: _Step) -> None:
        self._frames[-1].counters.pop(step.operands[0], None)

    def _jump(self, step: _Step) -> Call | None:
        target = step.operands[0]
        if self._cycles_left is not None and step.address == self._main_loop:
            self._cycles_left -= 1
            if self._cycles_left <= 0:
                self.cut_short = True
                return End(line=step.line)
        self._address = target
        return None

    def _jump_if_false(self, step: _Step) -> None:
        if not self._stack.pop():
            self._address = step.operands[0]

    def _repeat(self, step: _Step) -> None:
        label, target, count = step.operands
        counters = self._frames[-1].counters
        owner, runs = counters.get(label, (step.address, 1))
        if owner != step.address:
            runs = 1
        if runs < count:
            counters[label] = (step.address, runs + 1)
            self._address = target
        else:
            counters.pop(label, None)

    def _call(self, step: _Step) -> Failed | None:
        if len(self._frames) > DEPTH_LIMIT:
            return Failed(
                step.line, "E402", f"subroutines are nested deeper than {DEPTH_LIMIT} at line {step.line}"
            )
        target, count = step.operands
        self._frames.append(_Frame(target, step.following, step.line, count))
        self._address = target
        return None

    def _move(self, step: _Step) -> Call:
        words = step.words
        assert words is not None
        if words.speed is not None:
            self._speed = words.speed
        return Motion(
            line=step.line,
            kind=words.kind,
            target=words.target,
            via=words.via,
            speed=self._speed,
            frame=words.frame,
            tool=self._tool if words.tool is None else words.tool,
            angle=words.angle,
            round_edge=words.round_edge,
        )

    def _set_output(self, step: _Step) -> Call:
        return SetOutput(line=step.line, index=step.operands[0], value=bool(step.operands[1]))

    def _select_tool(self, step: _Step) -> Call:
        self._tool = step.operands[0]
        return SelectTool(line=step.line, tool=self._tool)

    def _track(self, step: _Step) -> Call:
        return Track(line=step.line, conveyor=step.operands[0])

    def _tangent(self, step: _Step) -> Call:
        on, offset = step.operands
        return Tangent(line=step.line, on=bool(on), offset=self._program.numbers[offset])

    def _dwell(self, step: _Step) -> Call:
        return Dwell(line=step.line, seconds=self._program.numbers[step.operands[0]])

    def _raise_m(self, step: _Step) -> Call:
        index = step.operands[0]
        return RaiseM(line=step.line, index=index, synchronous=self._world.m_is_synchronous(index))

    def _barrier(self, step: _Step) -> Call:
        return Barrier(line=step.line, reason=self._program.texts[step.operands[0]])

    def _await_input(self, step: _Step) -> AwaitInput | None:
        index = step.operands[0]
        if self._world.read_input(index, line=step.line, ahead=False):
            return None
        return AwaitInput(step.line, index)

    def _read_input(self, step: _Step) -> None:
        index, ahead = step.operands
        self._stack.append(self._world.read_input(index, line=step.line, ahead=bool(ahead)))

    def _read_output(self, step: _Step) -> None:
        index, ahead = step.operands
        self._stack.append(self._world.read_output(index, line=step.line, ahead=bool(ahead)))

    def _read_m(self, step: _Step) -> None:
        index, ahead = step.operands
        self._stack.append(self._world.read_m(index, line=step.line, ahead=bool(ahead)))

    def _push(self, step: _Step) -> None:
        self._stack.append(self._program.numbers[step.operands[0]])

    def _not(self, step: _Step) -> None:
        self._stack.append(not self._stack.pop())


_Handler = Callable[[Machine, _Step], Call | AwaitInput | Failed | None]


def _binary(function: Callable[[float, float], bool]) -> _Handler:
    def handler(machine: Machine, step: _Step) -> None:
        stack = machine._stack
        right = stack.pop()
        stack.append(function(stack.pop(), right))

    return handler


HANDLERS: dict[Instruction, _Handler] = {
    Instruction.END: Machine._end,
    Instruction.LABEL: Machine._label,
    Instruction.JUMP: Machine._jump,
    Instruction.JUMP_IF_FALSE: Machine._jump_if_false,
    Instruction.REPEAT: Machine._repeat,
    Instruction.CALL: Machine._call,
    Instruction.LINE: Machine._move,
    Instruction.JOINT: Machine._move,
    Instruction.CIRCLE: Machine._move,
    Instruction.SPLINE: Machine._move,
    Instruction.HOME: Machine._move,
    Instruction.SET_OUTPUT: Machine._set_output,
    Instruction.SELECT_TOOL: Machine._select_tool,
    Instruction.TRACK: Machine._track,
    Instruction.TANGENT: Machine._tangent,
    Instruction.DWELL: Machine._dwell,
    Instruction.RAISE_M: Machine._raise_m,
    Instruction.BARRIER: Machine._barrier,
    Instruction.AWAIT_INPUT: Machine._await_input,
    Instruction.READ_INPUT: Machine._read_input,
    Instruction.READ_OUTPUT: Machine._read_output,
    Instruction.READ_M: Machine._read_m,
    Instruction.PUSH: Machine._push,
    Instruction.NOT: Machine._not,
    Instruction.AND: _binary(lambda left, right: bool(left and right)),
    Instruction.OR: _binary(lambda left, right: bool(left or right)),
    Instruction.EQUAL: _binary(operator.eq),
    Instruction.NOT_EQUAL: _binary(operator.ne),
    Instruction.LESS: _binary(operator.lt),
    Instruction.LESS_EQUAL: _binary(operator.le),
    Instruction.GREATER: _binary(operator.gt),
    Instruction.GREATER_EQUAL: _binary(operator.ge),
}
"""What each instruction does; holds exactly the instructions of the table."""
