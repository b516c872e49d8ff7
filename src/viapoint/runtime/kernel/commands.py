"""What may be asked of a kernel at any tick: halt, stop, override and the like, and one step on or back.

Each says what is wanted; how the path comes to rest, or on, is the mover's matter.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.breaks import HERE, Breaks
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.outlet import Outlet
from viapoint.runtime.kernel.states import REFUSALS, Command, Hold, Mode, State
from viapoint.runtime.kernel.trace import Trace


class Commands(ABC):
    """The commands of a kernel, and what keeps it from going on because of them."""

    cell: Cell
    state: State
    trace: Trace
    mover: Mover
    breaks: Breaks
    outlet: Outlet
    _hold = Hold.NONE
    _paused = False
    _backward = False
    goes_on = False
    """Whether it takes another program after the end of one."""
    _frontier = 0.0  # s up to which the program has been executed

    @property
    def over(self) -> bool:
        """The run has ended, well or not."""
        return self.state.over

    @property
    def held(self) -> bool:
        """Whether it is halted, or about to be."""
        return self._hold is Hold.HALT

    @property
    def override(self) -> float:
        """As it was set: 0 stands still, below 0 goes back."""
        return 0.0 if self._paused else -self.mover.override if self._backward else self.mover.override

    @property
    @abstractmethod
    def line(self) -> int:
        """Source line the path is in."""

    @property
    def astray(self) -> bool:
        """Whether the robot went back from the place up to which the program has been executed."""
        return self.mover.s < self._frontier - HERE

    @abstractmethod
    def _settle(self) -> None:
        """At rest: everything that takes no time, until something must be waited for."""

    def refusal(self, command: Command) -> str | None:
        """Why a command would not be taken now; None if it would be."""
        return REFUSALS[self.mode].get(command)

    @property
    def mode(self) -> Mode:
        """What decides which commands are taken."""
        return Mode.of(self.state, self._hold, goes_on=self.goes_on)

    def halt(self) -> str | None:
        """Stop on the path within the limits; the interpreter keeps running ahead. `resume` goes on.

        This and the other commands answer why they are refused, where they are; then nothing happens.
        """
        refused = self.refusal(Command.HALT)
        if refused is None:
            self._hold_back(Hold.HALT)
        return refused

    def stop(self) -> str | None:
        """Stop on the path within the limits, and end the run there."""
        refused = self.refusal(Command.STOP)
        if refused is None:
            self._hold_back(Hold.STOP)
        return refused

    def emergency_stop(self) -> str | None:
        """Stop on the path with the emergency deceleration; `reset`, then `resume`, goes on."""
        refused = self.refusal(Command.EMERGENCY_STOP)
        if refused is None:
            self._hold_back(Hold.EMERGENCY, self.cell.emergency_deceleration_factor)
        return refused

    def reset(self) -> str | None:
        """Acknowledge an emergency stop once the robot stands: the run is then halted."""
        refused = self.refusal(Command.RESET)
        if refused is None:
            self._hold, self.state = Hold.HALT, State.HALTED
        return refused

    def resume(self) -> str | None:
        """Go on along the path after a halt; not while an emergency stop is not reset."""
        refused = self.refusal(Command.RESUME)
        if refused is None:
            self._hold = Hold.NONE
            self.breaks.run_on()
            if self.state is State.HALTED:
                self._settle()
        return refused

    def step(self, statements: int = 1) -> str | None:
        """Go on from a halt and halt again, on the path, when so many statements have been executed.

        After steps back it is one motion forward along the path.
        """
        refused = self.refusal(Command.STEP)
        if refused is None:
            if self.astray:
                self.breaks.step_again(self.mover.s, self._frontier)
            else:
                self.breaks.step(statements)
            self._release()
        return refused

    def step_back(self) -> str | None:
        """At rest, halted or at the program's end: back to where the motion before began, and halt there."""
        refused = self.refusal(Command.STEP_BACK)
        if refused is None:
            self.breaks.step_back(self.mover.s)
            self._backward, self.state = True, State.HALTED
            self._release()
        return refused

    def _release(self) -> None:
        self._hold = Hold.NONE
        if self.state is State.HALTED:
            self._settle()

    def set_override(self, override: float) -> str | None:
        """Scale all speeds from the next tick on; 0 stands still, below 0 the path is travelled back.

        Back it goes as far as the route is kept; nothing is read or written again until the path is, going
        forward, where the program was. Raises ValueError outside −1 … 1.
        """
        if not -1.0 <= override <= 1.0:
            raise ValueError(f"an override of {override!r} is not in -1 … 1")
        refused = self.refusal(Command.OVERRIDE)
        if refused is None:
            self._scale(override)
        return refused

    def _scale(self, override: float) -> None:
        self.trace.emit("override", self.line, value=override)
        self._paused = override == 0.0
        self._backward = override < 0.0
        turns_round = self._backward != (self.mover.direction < 0.0)
        settling = self.outlet.feed.settling
        if not self._paused and not (turns_round and self.state is State.MOVING) and not settling:
            self.mover.set_override(self.trace.tick, abs(override))
        elif self.state is State.MOVING:
            self._halt_path()
            self.mover.override = abs(override) or self.mover.override
        if self.state is State.HALTED and self._hold is Hold.NONE:
            self._settle()

    def keep_override(self, before: Commands) -> None:
        """Stand still, or go back, by its override where the kernel `before` this one would have."""
        self._paused, self._backward = before._paused, before._backward

    def _hold_back(self, hold: Hold, deceleration_factor: float = 1.0) -> None:
        if self.state.over or hold.value <= self._hold.value:
            return
        self._hold = hold
        if self.state is State.MOVING:
            self._halt_path(deceleration_factor)
        elif hold is not Hold.HALT and self.state is not State.READY:  # else it begins with that
            self._settle()

    def _halt_path(self, deceleration_factor: float = 1.0) -> None:
        if not self.outlet.feed.settling:  # else it has come to rest already
            self.mover.halt(self.trace.tick, deceleration_factor=deceleration_factor)
