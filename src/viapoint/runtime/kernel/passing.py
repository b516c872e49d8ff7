"""What the path passes, and in which tick: ends of motions, actions, and the ends of pulses."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from operator import attrgetter
from typing import Final, NamedTuple

from viapoint.runtime.kernel.breaks import Breaks
from viapoint.runtime.kernel.buffer import Entry
from viapoint.runtime.kernel.execution import Execution
from viapoint.runtime.kernel.failure import ExecutionError
from viapoint.runtime.kernel.guard import TickGuard
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.onpath import Due
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.searching import Searching
from viapoint.runtime.records import Floats
from viapoint.vm.ports import Motion, PathAction

ARRIVED: Final = 1e-10
"""m of path within which two places are one: rounding of summed lengths."""


class Passed(NamedTuple):
    """Something on the path: in which row of a window, what happens, and whether a motion ends by it."""

    row: int
    happens: Callable[[], bool | None]
    """Answers True where the law has changed."""
    ends_motion: bool = False
    stops: bool = False
    """Whether the robot has to stop for it: what comes after is not known yet."""


_row = attrgetter("row")


def _nothing() -> None:
    """The world may have changed: it is looked at in every tick in which something is passed."""


class Passing:
    """Looks for the next thing to happen; `execute` makes an entry take effect."""

    def __init__(
        self,
        execution: Execution,
        planner: Planner,
        mover: Mover,
        breaks: Breaks,
        guard: TickGuard,
        searching: Searching,
        execute: Callable[[Entry], None],
    ) -> None:
        self._execution = execution
        self._planner = planner
        self._mover = mover
        self._breaks = breaks
        self._guard = guard
        self._searching = searching
        self._execute = execute

    def next(self, s: Floats, row: int, first: int, frontier: float) -> Passed | None:
        """What happens next in rows s (N,) from `row` on; the first row is tick `first`. None: nothing."""
        found = []
        if (ends := self._execution.pulses.next_end) is not None and ends < first + len(s):
            found.append(Passed(max(ends - first, row), self._execution.end_pulses))
        look = self._execution.interrupts.next_look
        if look is not None and look < first + len(s):
            found.append(Passed(max(look - first, row), _nothing))
        entry = self._execution.front
        if entry is not None and s[-1] >= frontier:
            try:
                upcoming = self._upcoming(entry)
            except ExecutionError as error:
                return Passed(row, partial(self._guard.refuse, error), stops=True)
            for due in upcoming:
                at = None if due.s is None else self._row_of(due.s, s, row)
                if due.tick is not None and due.tick < first + len(s):
                    at = max(due.tick - first, row)
                if at is not None:
                    found.append(Passed(at, partial(self._execution.act, due.action)))
            look = self._searching.next_look(entry)
            if look is not None and look < first + len(s):
                found.append(Passed(max(look - first, row), partial(self._look, entry)))
            passed = self._entry_row(entry, s, row)
            if passed is not None:
                ends_motion = isinstance(entry.call, Motion)
                found.append(Passed(passed, partial(self._execute, entry), ends_motion))
        return min(found, key=_row) if found else None

    def _upcoming(self, entry: Entry) -> list[Due]:
        if not isinstance(entry.call, Motion) or not entry.call.actions:
            return []
        return self._execution.on_path.upcoming(entry, self._execution.blocks.begin)

    def _entry_row(self, entry: Entry, s: Floats, row: int) -> int | None:
        """Row, not before `row`, in which the path passes an entry; None if it does not in s (N,)."""
        if not isinstance(entry.call, Motion):
            passable = self._execution.passable(entry) and not self._breaks.may_halt(entry)
            return row if passable else None
        place = self._planner.route.place(entry.number)
        return None if place is None else self._row_of(place, s, row)

    def _row_of(self, place: float, s: Floats, row: int) -> int | None:
        """Row, not before `row`, in which the path passes a place; None if it does not in s (N,)."""
        law = self._mover.law
        assert law is not None, "rows belong to a law"
        if abs(place - law.s_end) < ARRIVED:  # an exact stop is reached when the path is at rest
            return len(s) - 1 if s[-1] == law.s_end else None
        passed = max(row, int(s.searchsorted(place)))
        return passed if passed < len(s) else None

    def _look(self, entry: Entry) -> bool:
        """Look at a search; found, the robot comes to rest."""
        tick = self._execution.tick
        return self._searching.look(entry, tick) and self._mover.halt(tick)

    def standing_at(self, entry: Entry) -> PathAction | None:
        """An action of the motion of `entry` that stands where the robot does."""
        here = self._mover.s + ARRIVED
        return next((d.action for d in self._upcoming(entry) if d.s is not None and d.s <= here), None)
