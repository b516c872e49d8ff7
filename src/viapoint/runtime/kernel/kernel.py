"""The motion kernel: everything that has a state while a program runs, behind submit, advance and events.

Order within a tick: outside answers, then the path advances, then actions whose place was passed, then
barriers, then interpreter and planner, which take no simulated time. Ticks are computed in windows: the
path is evaluated far ahead and committed up to the first tick in which something changes it, so that the
length of a window has no influence on the result.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, unique
from typing import Final, Protocol, assert_never

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.cell import Cell, Signal, SignalKind
from viapoint.runtime.kernel.buffer import Entry, MotionBuffer
from viapoint.runtime.kernel.clock import PathClock
from viapoint.runtime.kernel.failure import ExecutionError, MotionError
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.telemetry import Status, Telemetry
from viapoint.runtime.records import Event, EventValue, Floats, Ints, Window
from viapoint.runtime.signals import Change, MFlag, SignalWorld
from viapoint.vm.ports import (
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
    Motion,
    RaiseM,
    SelectTool,
    SetOutput,
    Suspension,
    Tangent,
    Track,
)

_FORGET_EVERY: Final = 64
"""Motions after which the route behind the robot is dropped: seldom, since it moves arrays."""

_ARRIVED: Final = 1e-10
"""m of path within which two places are one: rounding of summed lengths."""


@unique
class State(Enum):
    """What the kernel is doing."""

    READY = "ready"
    MOVING = "moving"
    DWELLING = "dwelling"
    WAITING = "waiting"
    POLLING = "polling"
    HALTED = "halted"
    FINISHED = "finished"
    FAILED = "failed"


class Interpreter(Protocol):
    """The virtual machine as the kernel sees it."""

    @property
    def line(self) -> int: ...
    def run(self) -> Suspension: ...


class Kernel:
    """Runs calls of an interpreter on the robot of a cell.

    It is itself the interpreter's MotionPort and WorldPort. `advance` moves time on; events go to `listener`.
    """

    def __init__(
        self,
        cell: Cell,
        world: SignalWorld,
        listener: Callable[[Event], None],
        *,
        override: float = 1.0,
        stepping: bool = False,
        patient: bool = False,
    ) -> None:
        self.cell = cell
        self.world = world
        self.state = State.READY
        self.failure: MotionError | None = None
        self.tick = 0
        self.tool = 0
        self._listener = listener
        self._patient = patient  # somebody outside may still answer a wait that the scenario never satisfies
        self._buffer: MotionBuffer[None] = MotionBuffer(cell.lookahead)
        q = np.asarray(cell.home, dtype=np.float64)
        self.planner = Planner(cell, self._buffer, q, stepping=stepping)
        self.clock = PathClock(cell.tick, override)
        self.mover = Mover(cell, self.planner.route, self.clock)
        self._interpreter: Interpreter | None = None
        self._suspension: Suspension | None = None
        self._arrived = False  # the barrier the interpreter waits at has been reached
        self._raised = False  # the synchronous M it waits for has been raised
        self._waiting_since = 0
        self._dwell_until: int | None = None
        self._halted = False
        self._answered: dict[
            int, tuple[int, int]
        ] = {}  # barriers by line: tick and statements when last reached
        self._line = 0  # line of the last entry executed
        self.statements = 0
        """Statements executed so far, by the robot."""
        self._block = -1  # number of the block being run
        self._block_tick = 0  # tick and travelled length at which the current block began
        self._block_length = 0.0
        self._block_s = 0.0
        self._last_s = 0.0  # s in the last tick computed
        self.telemetry = Telemetry(cell, q)

    # --- the interpreter's ports -------------------------------------------------------------------

    def submit(self, call: Call) -> bool:
        """MotionPort: take a call into the motion buffer."""
        return self._buffer.put(call)

    def read_input(self, index: int, *, line: int, ahead: bool) -> bool:
        """WorldPort: digital input, traced."""
        return self._read(f"DI{index}", self.world.read_input, index, line, ahead)

    def read_output(self, index: int, *, line: int, ahead: bool) -> bool:
        """WorldPort: digital output, traced."""
        return self._read(f"DO{index}", self.world.read_output, index, line, ahead)

    def read_m(self, index: int, *, line: int, ahead: bool) -> bool:
        """WorldPort: M flag, traced."""
        return self._read(f"M{index}", self.world.read_m, index, line, ahead)

    def m_is_synchronous(self, index: int) -> bool:
        """WorldPort: as the cell declares it; synchronous unless it says otherwise."""
        return self.cell.m_functions.get(index, True)

    # --- running -----------------------------------------------------------------------------------

    @property
    def over(self) -> bool:
        """The run has ended, well or not."""
        return self.state in (State.FINISHED, State.FAILED)

    def halt(self) -> None:
        """Stop on the path within the normal limits; the interpreter keeps running ahead."""
        if not self._halted and not self.over:
            self._halted = True
            if self.state is State.MOVING:
                self.mover.halt(self.tick)

    def resume(self) -> None:
        """Go on from where a halt stopped the path."""
        self._halted = False
        if self.state is State.HALTED:
            self._settle()

    def begin(self, interpreter: Interpreter) -> Window:
        """Take the program on; returns tick 0, after all that happens in it."""
        self._interpreter = interpreter
        self.world.advance(0)
        window = self._standing(0, 1)
        self._settle()
        return window

    def advance(self, ticks: int) -> Window:
        """Let at least one and at most `ticks` ticks pass; ends early where something happens."""
        if self.state is State.MOVING:
            return self._move(ticks)
        return self._stand(ticks)

    def _stand(self, ticks: int) -> Window:
        first = self.tick + 1
        last = self.tick + ticks
        if self._dwell_until is not None:
            last = min(last, self._dwell_until)
        change = first if self.state is State.POLLING else self.world.next_change(self.tick)
        if change is not None:
            last = min(last, max(change, first))
        window = self._standing(first, last - first + 1)
        self.tick = last
        if self._dwell_until == last:
            self._dwell_until = None
        self.world.advance(last)
        self._settle()
        return window

    def _move(self, ticks: int) -> Window:
        first = self.tick + 1
        rows = self.mover.rows(first, ticks)
        if not np.isfinite(rows.columns).all():
            return self._trip(first)
        lines = np.full(len(rows.s), self.line, dtype=np.int64)
        used = self._pass_places(rows.s, first, lines)
        arrived = rows.arrived and used == len(rows.s)
        s = rows.s[:used]
        bound = self.planner.route.speed_bound(np.concatenate(([self._last_s], s)))
        self.telemetry.meter_speed(self._last_s, s, bound)
        self._last_s = self.mover.s = float(s[-1])
        window = self.telemetry.window(first, rows.columns[:used], lines[:used], self._status())
        self.tick = first + used - 1
        self.world.advance(self.tick)
        if arrived:
            self.mover.law = None
            self._settle()
        return window

    def _trip(self, tick: int) -> Window:
        """The last door before the drives: what is not a finite number does not pass; the robot is held."""
        window = self._standing(tick, 1)
        self.tick = tick
        self.mover.law = None
        self._fail(ExecutionError("E490", "a set point is not a finite number", self.line))
        return window

    def _pass_places(self, s: Floats, first: int, lines: Ints) -> int:
        """Execute what stands on the path within rows s (N,), in order; returns how many rows stay valid."""
        row, finished = 0, False
        while True:
            passed = self._next_row(s, row)
            if finished and passed != row:
                if self._look_ahead():
                    return row + 1
                finished = False
            elif passed is None:
                return len(s)
            else:
                row = passed
                self.tick = first + row
                self.mover.s = float(s[row])
                self.world.advance(self.tick)
                entry = self._front()
                assert entry is not None, "a row was found for it"
                self._execute(entry)
                lines[row:] = self.line
                finished |= isinstance(entry.call, Motion)

    def _next_row(self, s: Floats, row: int) -> int | None:
        """Row, not before `row`, in which the path passes the next entry; None if it does not in s (N,)."""
        entry = self._front()
        if entry is None:
            return None
        match entry.call:
            case Motion():
                place = self.planner.route.place(entry.number)
                if place is None:
                    return None
                law = self.mover.law
                assert law is not None, "rows belong to a law"
                if abs(place - law.s_end) < _ARRIVED:  # an exact stop is reached when the path is at rest
                    return len(s) - 1 if s[-1] == law.s_end else None
                passed = max(row, int(np.searchsorted(s, place)))
                return passed if passed < len(s) else None
            case SetOutput():
                return row
            case RaiseM(synchronous=synchronous):
                return None if synchronous else row
            case SelectTool(tool=tool):
                return row if tool == self.tool else None
            case Track() | Tangent():
                return row
            case Barrier() | Dwell() | End():
                return None
            case _:
                assert_never(entry.call)

    def _look_ahead(self) -> bool:
        """Blocks were finished while moving: interpreter and planner go on; True if the law changed."""
        while self._interpret() or self.planner.plan():
            pass
        return not self._halted and self.mover.extend(self.tick)

    def _settle(self) -> None:
        """At rest: everything that takes no time, until something must be waited for."""
        try:
            self._go_on()
        except MotionError as error:
            self._fail(error)

    def _go_on(self) -> None:
        while not self.over:
            entry = None if self._dwell_until is not None else self._front()
            if entry is not None and self._reached(entry):
                self._execute(entry)
            elif self._interpret() or self.planner.plan():
                pass
            elif self._dwell_until is not None:
                self.state = State.DWELLING
                return
            elif self._halted:
                self.state = State.HALTED
                return
            elif entry is not None and isinstance(entry.call, Barrier):
                self._poll(entry.call)
                return
            elif entry is not None and self._set_out(entry):
                self.state = State.MOVING
                return
            elif self.planner.undecided:
                self.planner.stop()
            else:
                self._wait()
                return

    def _reached(self, entry: Entry[None]) -> bool:
        if isinstance(entry.call, Barrier):
            return self._answered.get(entry.call.line, (-1, 0))[0] != self.tick
        if not isinstance(entry.call, Motion):
            return True
        place = self.planner.route.place(entry.number)
        return place is not None and place <= self.mover.s + _ARRIVED

    def _set_out(self, entry: Entry[None]) -> bool:
        """From rest into the motion of `entry`; False if its path is not known yet."""
        call = entry.call
        assert isinstance(call, Motion), "all other entries are executed at once"
        if not self.mover.start(self.tick, call.line):
            return False
        self.tool = call.tool
        if entry.number != self._block:  # not going on within it, after a turn in place
            self._block, self._block_tick = entry.number, self.tick
        return True

    def _poll(self, barrier: Barrier) -> None:
        """The program came back to a barrier in the tick in which it was answered: it polls, once a tick."""
        self.state = State.POLLING
        _, statements = self._answered[barrier.line]
        if statements == self.statements and not self._patient and not self.world.pending():
            what = f"{barrier.reason} asks again and again what nothing in the scenario ever changes"
            self._fail(ExecutionError("E410", what, barrier.line))

    def _wait(self) -> None:
        """Nothing can go on by itself."""
        if self.planner.failure is not None:
            self._fail(self.planner.failure)
            return
        self.state = State.WAITING
        match self._suspension:
            case AwaitInput(line=line, index=index):
                awaited = Change(Signal(SignalKind.DIGITAL_INPUT, index), True)
                what = f"WAIT DI {index} waits for an input that nothing in the scenario sets any more"
            case AwaitReset(line=line, index=index):
                awaited = Change(MFlag(index), False)
                what = f"M {index} waits for a reset that nothing in the scenario gives any more"
            case _:
                raise AssertionError(f"standing still, but not waiting: {self._suspension}")
        if not self._patient and not self.world.pending(awaited):
            self._fail(ExecutionError("E410", what, line))

    # --- interpreter --------------------------------------------------------------------------------

    def _interpret(self) -> bool:
        """Let the interpreter run if it may; True if it did."""
        if self._interpreter is None or not self._may_resume():
            return False
        self._arrived = self._raised = False
        try:
            self._suspension = self._interpreter.run()
        except ExecutionError as error:  # a read that this cell cannot answer
            self._suspension = Failed(error.line, error.code, error.message)
        if isinstance(self._suspension, Failed):
            failed = self._suspension
            self.planner.abort(ExecutionError(failed.code, failed.message, failed.line))
        return True

    def _may_resume(self) -> bool:
        match self._suspension:
            case None:
                return True
            case BufferFull():
                return not self._buffer.full
            case AtBarrier():
                return self._arrived
            case AwaitInput(line=line, index=index):
                return self.world.read_input(index) and self._waited(line, f"DI{index}")
            case AwaitReset(line=line, index=index):
                if not self._raised or self.world.read_m(index):
                    return False
                self._emit("m", line, index=index, action="reset")
                return self._waited(line, f"M{index}")
            case Ended() | Failed():
                return False
            case _:
                assert_never(self._suspension)

    def _waited(self, line: int, reason: str) -> bool:
        since = self._waiting_since
        self._emit("wait", line, tick=since, t_end=self.tick * self.cell.tick, reason=reason)
        return True

    # --- entries ------------------------------------------------------------------------------------

    @property
    def line(self) -> int:
        """Source line the path is in."""
        entry = self._front()
        return entry.call.line if entry is not None and isinstance(entry.call, Motion) else self._line

    def _front(self) -> Entry[None] | None:
        return self._buffer.to_execute()

    def _execute(self, entry: Entry[None]) -> None:
        """The path has reached `entry`: it takes effect in this tick and its slot is free."""
        call = entry.call
        self._line = call.line
        match call:
            case Motion():
                self._finish_block(call, entry.number)
            case SetOutput(line=line, index=index, value=value):
                self.world.write_output(index, value, self.tick)
                self._emit("output", line, signal=f"DO{index}", value=value, s_mm=self._s_mm())
            case SelectTool(line=line, tool=tool):
                self.tool = tool
                self._emit("tool", line, index=tool)
            case RaiseM(line=line, index=index, synchronous=synchronous):
                self.world.raise_m(index, self.tick)
                self._emit("m", line, index=index, action="raised")
                self._raised = synchronous
                self._waiting_since = self.tick
            case Dwell(line=line, seconds=seconds):
                ticks = self.world.ticks(seconds)
                self._dwell_until = self.tick + ticks if ticks else None
                until = (self.tick + ticks) * self.cell.tick
                self._emit("wait", line, t_end=until, reason=f"{seconds:g} s")
            case Barrier():
                self._arrived = True
                self._waiting_since = self.tick
                self._answered[call.line] = (self.tick, self.statements)
            case End():
                self.state = State.FINISHED
            case Track() | Tangent():
                pass  # switching off what is not on
            case _:
                assert_never(call)
        self._buffer.executed()
        self.statements += 0 if isinstance(call, Barrier) else 1

    def _finish_block(self, motion: Motion, tag: int) -> None:
        place = self.planner.route.place(tag)
        assert place is not None, "a finished motion has a place"
        length = float(self.planner.route.axes.everything(np.array([place]))[0, -2])
        self._emit(
            "block",
            motion.line,
            tick=self._block_tick,
            t_end=self.tick * self.cell.tick,
            command=motion.kind.value,
            length_mm=(length - self._block_length) / MM,
            s0_mm=self._block_length / MM,
            limited_by=self.mover.limited_by(self._block_tick, self.tick),
        )
        if tag % _FORGET_EVERY == 0:
            self.planner.route.forget(self._block_s, tag)
        self._block_tick, self._block_length, self._block_s = self.tick, length, place

    def _fail(self, failure: MotionError) -> None:
        self.failure = failure
        self.state = State.FAILED
        self._emit("error", failure.line, code=failure.code, message=failure.message)

    # --- records ------------------------------------------------------------------------------------

    def _read(self, signal: str, read: Callable[[int], bool], index: int, line: int, ahead: bool) -> bool:
        try:
            value = read(index)
        except KeyError:
            raise ExecutionError("E411", f"the cell has no {signal}", line) from None
        self._emit("input_read", line, signal=signal, value=value, s_mm=self._s_mm(), ahead=ahead)
        return value

    def _emit(self, kind: str, line: int, *, tick: int | None = None, **data: EventValue) -> None:
        at = self.tick if tick is None else tick
        self._listener(Event(tick=at, t=at * self.cell.tick, line=line, kind=kind, data=data))

    def _standing(self, first: int, count: int) -> Window:
        lines = np.full(count, self.line, dtype=np.int64)
        return self.telemetry.standing(first, lines, self._status())

    def _status(self) -> Status:
        line = self._interpreter.line if self._interpreter is not None else 0
        return Status(line, self.clock.rate, self._buffer.fill, self.tool)

    def _s_mm(self) -> float:
        """Travelled TCP length where the path is now."""
        return float(self.planner.route.axes.everything(np.array([self.mover.s]))[0, -2]) / MM
