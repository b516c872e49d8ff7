"""Searches: a motion with UNTIL ends where its condition comes true.

The condition is looked at in every tick in which it may have changed, from that of the motion's begin on.
Where it is true the robot comes to rest within its limits; the rest of the motion is not travelled.
"""

from __future__ import annotations

from viapoint.runtime.kernel.buffer import Entry
from viapoint.runtime.kernel.dialogue import Dialogue
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.signals import SignalWorld
from viapoint.vm.ports import Motion, Search


class Searching:
    """The search of the motion that the robot is in."""

    def __init__(self, world: SignalWorld, dialogue: Dialogue, planner: Planner, mover: Mover) -> None:
        self._world = world
        self._dialogue = dialogue
        self._planner = planner
        self._mover = mover
        self._number = -1  # of the entry that was looked at last
        self._looked: int | None = None  # in which tick
        self._found = False

    def has_found(self, entry: Entry) -> bool:
        """Whether the motion of `entry` is over where the robot stands."""
        return self._found and entry.number == self._number

    def next_look(self, entry: Entry) -> int | None:
        """The tick from which on the search of `entry` is to be looked at; 0: now. None: not any more."""
        if _search_of(entry) is None or self.has_found(entry):
            return None
        if entry.number != self._number or self._looked is None:
            return 0
        return self._world.next_look(self._looked)

    def look(self, entry: Entry, tick: int) -> bool:
        """Look in a tick, with the path where it is then; True if it has just been found."""
        search = _search_of(entry)
        if search is None or self.has_found(entry):
            return False
        self._number, self._looked = entry.number, tick
        self._found = search.condition.holds(self._world.read)
        if self._found:
            self._dialogue.holds(search.condition, line=entry.call.line)  # leaves the reads in the trace
            if search.point is not None and isinstance(entry.call, Motion):
                self._planner.keep(search.point, entry.call, self._mover.s)
        return self._found

    def end(self, entry: Entry) -> None:
        """The motion of `entry` is over."""
        if _search_of(entry) is not None:
            self._dialogue.settle_search(entry.call.line, found=self.has_found(entry))
            self._found = False


def _search_of(entry: Entry) -> Search | None:
    return entry.call.search if isinstance(entry.call, Motion) else None
