"""Interrupts: which subroutines run when which conditions turn true, and which of them are due.

They are switched on and off where the path has come to `ON` and `OFF`. A condition is looked at in every
tick in which it may have changed; what counts is that it turns true. It is never lost meanwhile that it
has, and never kept twice. Not here: how the robot stops, and runs the subroutine.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from viapoint.runtime.signals import SignalWorld
from viapoint.vm.ports import HandleErrors, SwitchOff, SwitchOn


@dataclass(slots=True)
class _Watched:
    """An interrupt that is on."""

    call: SwitchOn
    held: bool
    """Whether its condition was true when it was looked at last."""
    due: bool = False
    """It has turned true, and the subroutine has not begun since."""
    stopping: bool = False
    """The robot stops for it: OFF does not keep it from running any more."""


class Interrupts:
    """The interrupts of a robot, in the order in which they were switched on."""

    def __init__(self, world: SignalWorld) -> None:
        self._world = world
        self._watched: dict[int, _Watched] = {}  # by the address of the subroutine
        self._left: list[_Watched] = []  # switched off while the robot stopped for them
        self._looked = -1  # tick
        self.handles_errors: HandleErrors | None = None
        """Whose subroutine runs when an error would end the run."""

    def __iter__(self) -> Iterator[_Watched]:
        return iter((*self._left, *self._watched.values()))

    def clear(self) -> None:
        """A program is over: none is on."""
        self._watched.clear()
        self._left.clear()
        self.handles_errors = None

    def switch_on(self, call: SwitchOn, tick: int) -> None:
        """The path has come to ON: the condition has to turn true after this tick.

        Where that very interrupt is on already nothing changes; one of the same subroutine is replaced.
        """
        known = self._watched.get(call.handler.address)
        if known is None or known.call.condition != call.condition:
            self._watched.pop(call.handler.address, None)
            held = call.condition.holds(self._world.read)
            self._watched[call.handler.address] = _Watched(call, held)
            if len(self._watched) == 1:
                self._looked = tick

    def switch_off(self, call: SwitchOff) -> None:
        """The path has come to OFF. What the robot is stopping for runs all the same."""
        if self.handles_errors is not None and self.handles_errors.handler == call.handler:
            self.handles_errors = None
        known = self._watched.pop(call.handler.address, None)
        if known is not None and known.stopping:
            self._left.append(known)

    @property
    def next_look(self) -> int | None:
        """The next tick in which a condition may have changed by itself; None: none will."""
        return self._world.next_look(self._looked) if self._watched else None

    def look(self, tick: int) -> list[SwitchOn]:
        """Look in a tick; those that have just turned true, in order."""
        turned = []
        self._looked = tick
        for each in self._watched.values():
            held = each.call.condition.holds(self._world.read)
            if held and not each.held and not each.due:
                each.due = True
                turned.append(each.call)
            each.held = held
        return turned

    @property
    def any(self) -> bool:
        """Whether one is on."""
        return bool(self._watched)

    @property
    def due(self) -> bool:
        """Whether one is to run."""
        return bool(self._left or self._watched) and any(each.due for each in self)

    @property
    def stopping(self) -> bool:
        """Whether the robot stops for one."""
        return bool(self._left or self._watched) and any(each.stopping for each in self)

    def stop_for_them(self) -> None:
        """The robot stops for those that are due."""
        for each in self:
            each.stopping = each.due

    def take(self) -> SwitchOn | None:
        """The first that is due, which begins now; None: none is."""
        for each in self:
            if each.due:
                each.due = each.stopping = False
                self._left = [other for other in self._left if other.due]
                return each.call
        return None

    @property
    def may_come(self) -> bool:
        """Whether one may still become due without the robot doing anything."""
        return any(each.due or self._world.coming(each.call.condition.readings) for each in self)
