"""The dialogue with the interpreter: its calls go into the motion buffer, its questions to the world.

Knows when the interpreter must wait, when it may go on, and when it waits in vain. Implements the ports
of the virtual machine; every read and every wait leaves a trace.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import NamedTuple, Protocol, assert_never

from viapoint.runtime.cell import Cell, Signal, SignalKind
from viapoint.runtime.kernel.buffer import MotionBuffer
from viapoint.runtime.kernel.failure import ExecutionError
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.records import EventValue
from viapoint.runtime.signals import Change, MFlag, SignalWorld
from viapoint.vm.conditions import Condition, Reading
from viapoint.vm.ports import (
    AtBarrier,
    AwaitCondition,
    AwaitInput,
    AwaitReset,
    Barrier,
    BufferFull,
    Call,
    Ended,
    Failed,
    Handler,
    Modal,
    MotionPort,
    RaiseM,
    Suspension,
    WorldPort,
)


class Interpreter(Protocol):
    """The virtual machine as the kernel sees it."""

    @property
    def line(self) -> int: ...
    @property
    def state(self) -> Hashable: ...
    @property
    def modal(self) -> Modal: ...
    def run(self) -> Suspension: ...
    def handling(
        self, handler: Handler, motion: MotionPort, world: WorldPort, modal: Modal, error: int = 0
    ) -> Interpreter: ...


class _Answered(NamedTuple):
    """When a barrier was answered last: tick, entries executed by then, state of the interpreter."""

    tick: int
    executed: int
    state: Hashable


class Dialogue:
    """MotionPort and WorldPort of one interpreter, and what it waits for.

    `travelled` tells the TCP length travelled so far, m. Where `patient`, somebody outside may still
    answer a wait that the scenario never satisfies.
    """

    def __init__(
        self,
        cell: Cell,
        world: SignalWorld,
        buffer: MotionBuffer,
        trace: Trace,
        travelled_mm: Callable[[], float],
        *,
        patient: bool,
    ) -> None:
        self._cell = cell
        self._world = world
        self._buffer = buffer
        self._trace = trace
        self._travelled_mm = travelled_mm
        self._patient = patient
        self._interpreter: Interpreter | None = None
        self._suspension: Suspension | None = None
        self._arrived = False  # the barrier it waits at has been reached
        self._raised = False  # the synchronous M it waits for has been raised
        self._found = False
        self._since = 0  # tick in which its present wait began
        self._answered: dict[int, _Answered] = {}  # barriers by line

    def open(self, interpreter: Interpreter) -> None:
        """Begin with `interpreter`, which asks for the first time whatever it asks."""
        self._interpreter = interpreter
        self._suspension = None
        self._answered.clear()

    def handling(self, handler: Handler, ports: Dialogue, modal: Modal, error: int = 0) -> Interpreter:
        """An interpreter of the same program that runs a handler on other ports, where that is in force."""
        assert self._interpreter is not None, "an interrupt is a program's"
        return self._interpreter.handling(handler, ports, ports, modal, error)

    @property
    def failure(self) -> ExecutionError | None:
        """What keeps the interpreter from ever going on."""
        match self._suspension:
            case Failed(line=line, code=code, message=message):
                return ExecutionError(code, message, line)
            case _:
                return None

    @property
    def line(self) -> int:
        """Source line the interpreter has reached; 0 before it runs."""
        return self._interpreter.line if self._interpreter is not None else 0

    @property
    def lacks_room(self) -> bool:
        """Whether the interpreter waits for a free slot and for nothing else."""
        return isinstance(self._suspension, BufferFull)

    @property
    def awaited(self) -> str:
        """What it waits for from outside, in words; empty where it does not."""
        match self._suspension:
            case AwaitInput(index=index):
                return f"DI{index}"
            case AwaitReset(index=index) if self._raised:
                return f"the reset of M{index}"
            case AwaitCondition(condition=condition):
                return condition.text.removeprefix("WAIT ")
            case _:
                return ""

    # --- ports ---------------------------------------------------------------------------------------

    def submit(self, call: Call) -> bool:
        """MotionPort: take a call into the motion buffer."""
        return self._buffer.put(call)

    def read(self, reading: Reading, *, line: int, ahead: bool) -> float:
        """WorldPort: a signal, flag or variable, traced."""
        try:
            value = self._world.read(reading)
        except KeyError:
            raise ExecutionError("E411", f"the cell has no {reading}", line) from None
        except TypeError as error:
            raise ExecutionError("E411", str(error), line) from None
        s_mm = self._travelled_mm()
        self._trace.emit("input_read", line, signal=str(reading), value=value, s_mm=s_mm, ahead=ahead)
        return value

    def holds(self, condition: Condition, *, line: int) -> bool:
        """WorldPort: a condition, all its reads traced."""
        return condition.holds(lambda reading: self.read(reading, line=line, ahead=False))

    def live_place(
        self, points: tuple[int | None, ...], frame: int, *, line: int, arrived: bool
    ) -> str | None:
        """WorldPort: by the cell."""
        live = self._cell.live_place(points, frame)
        if live is not None and arrived:
            self._trace.emit("place_read", line, place=live, s_mm=self._travelled_mm())
        return live

    def found(self) -> bool:
        """WorldPort: what the last search has come to."""
        return self._found

    def settle_search(self, line: int, *, found: bool) -> None:
        """A search has ended where the path is now."""
        self._found = found
        self._trace.emit("search", line, found=found, s_mm=self._travelled_mm())

    def m_is_synchronous(self, index: int) -> bool:
        """WorldPort: as the cell declares it; synchronous unless it says otherwise."""
        return self._cell.m_functions.get(index, True)

    # --- turns ---------------------------------------------------------------------------------------

    def run(self) -> Failed | bool | None:
        """Let the interpreter run if it may: False if it must wait, else True, or how it failed."""
        if self._interpreter is None or not self._may_resume():
            return False
        self._arrived = self._raised = False
        try:
            self._suspension = self._interpreter.run()
        except ExecutionError as error:  # a read that this cell cannot answer
            self._suspension = Failed(error.line, error.code, error.message)
        return self._suspension if isinstance(self._suspension, Failed) else True

    def reach_barrier(self, barrier: Barrier, executed: int) -> None:
        """The path has arrived at `barrier`, after so many entries."""
        self._arrived = True
        self._since = self._trace.tick
        state = self._interpreter.state if self._interpreter is not None else None
        self._answered[barrier.line] = _Answered(self._trace.tick, executed, state)

    def raise_m(self, call: RaiseM) -> None:
        """The path has raised an M flag."""
        self._raised = call.synchronous
        self._since = self._trace.tick

    def polls(self, barrier: Barrier) -> bool:
        """Whether `barrier` was already answered in this tick: then its next answer comes in the next one."""
        answered = self._answered.get(barrier.line)
        return answered is not None and answered.tick == self._trace.tick

    def vain_poll(self, barrier: Barrier, executed: int) -> ExecutionError | None:
        """What is wrong with asking `barrier` again, if its answer can never change."""
        return None if self._patient else self.asks_in_vain(barrier, executed)

    def vain_wait(self) -> ExecutionError | None:
        """What is wrong with waiting on, if what is awaited can never come."""
        return None if self._patient else self.in_vain()

    def asks_in_vain(self, barrier: Barrier, executed: int) -> ExecutionError | None:
        """As `vain_poll`, if nobody outside can answer."""
        before, now = self._answered[barrier.line], self._interpreter.state if self._interpreter else None
        if self._world.pending() or before.executed != executed or before.state != now:
            return None
        what = f"{barrier.reason} asks again and again what nothing in the scenario ever changes"
        return ExecutionError("E410", what, barrier.line)

    def in_vain(self) -> ExecutionError | None:
        """As `vain_wait`, if nobody outside can answer."""
        match self._suspension:
            case AwaitInput(line=line, index=index):
                awaited = Change(Signal(SignalKind.DIGITAL_INPUT, index), True)
                what = f"WAIT DI {index} waits for an input that nothing in the scenario sets any more"
            case AwaitCondition(seconds=float()):
                return None
            case AwaitCondition(line=line, condition=condition):
                what = f"{condition.text} waits for signals that nothing in the scenario changes any more"
                coming = self._world.coming(condition.readings)
                return None if coming else ExecutionError("E410", what, line)
            case AwaitReset(line=line, index=index):
                awaited = Change(MFlag(index, self._cell.number), False)
                what = f"M {index} waits for a reset that nothing in the scenario gives any more"
            case _:
                raise AssertionError(f"standing still, but not waiting: {self._suspension}")
        return None if self._world.pending(awaited) else ExecutionError("E410", what, line)

    def _may_resume(self) -> bool:
        match self._suspension:
            case None:
                return True
            case BufferFull():
                return not self._buffer.full
            case AtBarrier():
                return self._arrived
            case AwaitInput(line=line, index=index):
                return self._world.read_input(index) and self._waited(line, f"DI{index}")
            case AwaitCondition(line=line, condition=condition):
                if condition.holds(self._world.read):
                    return self._waited(line, condition.text)
                over = self.deadline is not None and self._trace.tick >= self.deadline
                return over and self._waited(line, condition.text, timed_out=True)
            case AwaitReset(line=line, index=index):
                if not self._raised or self._world.read_m(index):
                    return False
                self._trace.emit("m", line, index=index, action="reset")
                return self._waited(line, f"M{index}")
            case Ended() | Failed():
                return False
            case _:
                assert_never(self._suspension)

    @property
    def deadline(self) -> int | None:
        """Tick in which the interpreter goes on in any case; None: only when it gets what it waits for."""
        match self._suspension:
            case AwaitCondition(seconds=float() as seconds):
                return self._since + self._world.ticks(seconds)
            case _:
                return None

    def _waited(self, line: int, reason: str, **more: EventValue) -> bool:
        self._trace.emit("wait", line, tick=self._since, t_end=self._trace.time, reason=reason, **more)
        return True
