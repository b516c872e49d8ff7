"""The virtual machine: runs a program against a motion port and the world until it must wait.

It knows no robot and no time. It trusts its program (`verifier.py` is the check that files pass), and
it never spins: work without motion or waiting is bounded.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Hashable

from viapoint.vm.calls import CALLS
from viapoint.vm.conditions import BINARY, READINGS, Reading, reading_of
from viapoint.vm.cycles import main_loop
from viapoint.vm.frames import ActiveCall, Frame
from viapoint.vm.instructions import Instruction
from viapoint.vm.ports import (
    BEGINNING,
    AtBarrier,
    AwaitCondition,
    AwaitInput,
    AwaitReset,
    Barrier,
    BufferFull,
    Call,
    Decision,
    Dwell,
    End,
    Ended,
    Failed,
    HandleErrors,
    Handler,
    Modal,
    Motion,
    MotionPort,
    Origin,
    PathAction,
    RaiseM,
    Search,
    SelectTool,
    SetVariable,
    Suspension,
    SwitchOff,
    SwitchOn,
    WorldPort,
    Write,
)
from viapoint.vm.program import Program
from viapoint.vm.steps import Step, Steps

DEPTH_LIMIT = 64
"""How deep subroutines nest."""

WORK_LIMIT = 100_000
"""Instructions allowed without motion or waiting, beyond once through the whole program: some 20 ms."""


_Outcome = Call | AwaitInput | AwaitCondition | Failed | None


class Machine:
    """Runs `program`; `run` returns each time it must wait, and is called again to resume.

    `max_cycles` ends an endless program after so many passes of its main loop (`cycles.main_loop`): at the
    jump back that completes the last of them. `last_line` ends any program when it leaves that line.
    `modal` is what holds where it begins. Before `until`, a line, it waits as if there were no room.
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
        until: int | None = None,
    ) -> None:
        self._program = program
        self._motion = motion
        self._world = world
        self._steps = Steps(program)
        self._address = 0
        self._line = program.line_at(0)
        self._stack: list[float] = []
        self._frames = [Frame(0, 0, 0)]
        self._pending: Call | None = None
        self._finished: Ended | Failed | None = None
        self._speed, self._tool = modal
        self._actions: list[PathAction] = []  # on the next motion
        self._search: Search | None = None  # of the motion that comes now
        self._arrived_at: int | None = None  # address of the motion whose live place is read
        self._awaited: int | None = None  # address of the AWAIT_FOR that is waiting
        self._work = 0
        self._work_limit = WORK_LIMIT + len(program.code)
        self._error = 0  # number of the one that is handled
        self._cycles_left = max_cycles
        self._main_loop = main_loop(program) if max_cycles is not None else None
        self.cut_short = False
        """Whether `max_cycles` or `last_line` ended the program."""
        self._last_line = last_line
        self.until = until

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

    @property
    def next_line(self) -> int:
        """Source line of what is executed next."""
        return self._program.line_at(self._address)

    def twin(self, motion: MotionPort, world: WorldPort, *, until: int | None = None) -> Machine:
        """A machine that goes on from here on other ports; neither has an influence on the other."""
        shared = (self._program, self._steps, self._motion, self._world)
        twin = copy.deepcopy(self, {id(one): one for one in shared})
        twin._motion, twin._world, twin.until = motion, world, until
        return twin

    def handling(
        self, handler: Handler, motion: MotionPort, world: WorldPort, modal: Modal, error: int = 0
    ) -> Machine:
        """A machine that runs a handler to the end of its subroutine, where that is in force.

        `error` is the number of the error that it handles, 0: none.
        """
        machine = Machine(self._program, motion, world, modal=modal)
        machine._steps, machine._error = self._steps, error
        machine._address = machine._frames[0].entry = handler.address
        machine._line = self._program.line_at(handler.address)
        return machine

    @property
    def counters(self) -> tuple[tuple[str, int], ...]:
        """Labels to which a counted GOTO has jumped back, each with the number of the present run."""
        names = self._program.labels
        counters = self._frames[-1].counters
        return tuple((names[label].name, runs) for label, (_, runs) in sorted(counters.items()))

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
        waiting = self._arrived_at, self._awaited, tuple(self._actions)
        counted = self._cycles_left, self._error
        return self._address, tuple(self._stack), frames, self._speed, self._tool, counted, waiting

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
            step = self._steps.at(self._address)
            if self._line == self._last_line != step.line:
                return self._cut(self._line)
            if step.line == self.until:
                return BufferFull()
            self._line = step.line
            self._work += 1
            if self._work > self._work_limit:
                return self._finish(self._endless(step.line))
            self._address = step.following
            outcome = HANDLERS[step.instruction](self, step)
            if outcome is None:
                continue
            if isinstance(outcome, Failed):
                return self._finish(outcome)
            if isinstance(outcome, AwaitInput | AwaitCondition):
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

    def _end(self, step: Step) -> Call | Failed | None:
        frame = self._frames[-1]
        if len(self._frames) == 1:
            if self._actions:
                first = self._actions[0]
                message = f"{first} names a place on the next motion, and no motion follows"
                return Failed(first.call.line, "E403", message)
            return End(line=step.line)
        frame.remaining -= 1
        if frame.remaining:
            frame.counters.clear()
            self._address = frame.entry
        else:
            self._frames.pop()
            self._address = frame.returns_to
        return None

    def _label(self, step: Step) -> None:
        self._frames[-1].counters.pop(step.operands[0], None)

    def _jump(self, step: Step) -> Call | None:
        target = step.operands[0]
        if self._cycles_left is not None and step.address == self._main_loop:
            self._cycles_left -= 1
            if self._cycles_left <= 0:
                self.cut_short = True
                return End(line=step.line)
        self._address = target
        return None

    def _jump_if_false(self, step: Step) -> None:
        if not self._stack.pop():
            self._address = step.operands[0]

    def _repeat(self, step: Step) -> None:
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

    def _call(self, step: Step) -> Failed | None:
        if len(self._frames) > DEPTH_LIMIT:
            return Failed(
                step.line, "E402", f"subroutines are nested deeper than {DEPTH_LIMIT} at line {step.line}"
            )
        target, count = step.operands
        self._frames.append(Frame(target, step.following, step.line, count))
        self._address = target
        return None

    def _move(self, step: Step) -> Call:
        words = step.words
        assert words is not None
        arrived = self._arrived_at == step.address
        live = self._world.live_place(words.points, words.frame, line=step.line, arrived=arrived)
        self._arrived_at = None
        if live is not None and not arrived:
            self._arrived_at = self._address = step.address
            return Barrier(line=step.line, reason=f"{live} is live")
        if words.speed is not None:
            self._speed = words.speed
        search, self._search = self._search, None
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
            actions=self._put_on(),
            search=search,
        )

    def _until(self, step: Step) -> None:
        target, _, kept = step.operands
        assert step.condition is not None
        self._search = Search(step.condition, kept - 1 if kept else None)
        self._address = target

    def _put_on(self) -> tuple[PathAction, ...]:
        """The actions waiting for a motion; it takes them."""
        actions, self._actions = tuple(self._actions), []
        return actions

    def _at(self, step: Step) -> Failed | None:
        origin, number = step.operands
        following = self._steps.at(step.following)
        self._address = following.following
        call = HANDLERS[following.instruction](self, following)
        assert isinstance(call, Write | RaiseM), "the verifier has seen to it"
        if isinstance(call, RaiseM) and call.synchronous:
            message = f"M{call.index} is synchronous: the robot would have to stop on the motion for it"
            return Failed(step.line, "E404", message)
        self._actions.append(PathAction(Origin(origin), self._program.numbers[number], call))
        return None

    def _make_call(self, step: Step) -> Call:
        return CALLS[step.instruction](self._program, self._world, step.line, step.operands)

    def _select_tool(self, step: Step) -> Call:
        self._tool = step.operands[0]
        return SelectTool(line=step.line, tool=self._tool)

    def _on(self, step: Step) -> Call:
        target, _, address = step.operands
        assert step.condition is not None
        self._address = target
        return SwitchOn(line=step.line, condition=step.condition, handler=self._handler(address))

    def _on_error(self, step: Step) -> Call:
        return HandleErrors(line=step.line, handler=self._handler(step.operands[0]))

    def _decide(self, step: Step) -> Call | Failed:
        decision = Decision(step.operands[0])
        if self._error == 0:
            return Failed(step.line, "E413", f"{decision} stands here, and no error is being handled")
        return End(line=step.line, decision=decision)

    def _read_error(self, step: Step) -> None:
        self._stack.append(self._error)

    def _off(self, step: Step) -> Call:
        return SwitchOff(line=step.line, handler=self._handler(step.operands[0]))

    def _handler(self, address: int) -> Handler:
        label = self._steps.at(address).operands[0]
        return Handler(self._program.labels[label].name, address)

    def _await_input(self, step: Step) -> AwaitInput | None:
        index = step.operands[0]
        if self._world.read(Reading("DI", index), line=step.line, ahead=False):
            return None
        return AwaitInput(step.line, index)

    def _await(self, step: Step) -> AwaitCondition | None:
        condition = step.condition
        assert condition is not None
        limited = len(step.operands) > 2
        holds = self._world.holds(condition, line=step.line)
        if not holds and not (limited and self._awaited == step.address):
            self._awaited = step.address
            seconds = self._program.numbers[step.operands[2]] if limited else None
            return AwaitCondition(step.line, condition, seconds)
        self._awaited = None
        self._address = step.operands[0]
        if limited:
            self._stack.append(holds)
        return None

    def _read(self, step: Step) -> None:
        operand, ahead = step.operands
        reading = reading_of(step.instruction, operand, self._program.texts)
        self._stack.append(self._world.read(reading, line=step.line, ahead=bool(ahead)))

    def _write_variable(self, step: Step) -> Call:
        value = self._stack.pop()
        return SetVariable(
            line=step.line,
            name=self._program.texts[step.operands[0]],
            value=bool(value) if step.instruction is Instruction.LET_BOOLEAN else float(value),
            adds=step.instruction is Instruction.INCREMENT,
        )

    def _read_found(self, step: Step) -> None:
        self._stack.append(self._world.found())

    def _push(self, step: Step) -> None:
        self._stack.append(self._program.numbers[step.operands[0]])

    def _push_boolean(self, step: Step) -> None:
        self._stack.append(bool(step.operands[0]))

    def _not(self, step: Step) -> None:
        self._stack.append(not self._stack.pop())


_Handler = Callable[[Machine, Step], _Outcome]


def _binary(function: Callable[[float, float], bool]) -> _Handler:
    def handler(machine: Machine, step: Step) -> None:
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
    **dict.fromkeys(CALLS, Machine._make_call),
    Instruction.AT: Machine._at,
    Instruction.UNTIL: Machine._until,
    Instruction.ON: Machine._on,
    Instruction.OFF: Machine._off,
    Instruction.ON_ERROR: Machine._on_error,
    Instruction.DECIDE: Machine._decide,
    Instruction.READ_ERROR: Machine._read_error,
    Instruction.READ_FOUND: Machine._read_found,
    Instruction.SELECT_TOOL: Machine._select_tool,
    Instruction.AWAIT_INPUT: Machine._await_input,
    **dict.fromkeys(READINGS, Machine._read),
    **dict.fromkeys(
        (Instruction.LET_NUMBER, Instruction.LET_BOOLEAN, Instruction.INCREMENT), Machine._write_variable
    ),
    Instruction.AWAIT: Machine._await,
    Instruction.AWAIT_FOR: Machine._await,
    Instruction.PUSH: Machine._push,
    Instruction.PUSH_BOOLEAN: Machine._push_boolean,
    Instruction.NOT: Machine._not,
    **{instruction: _binary(function) for instruction, function in BINARY.items()},
}
"""What each instruction does; holds exactly the instructions of the table."""
