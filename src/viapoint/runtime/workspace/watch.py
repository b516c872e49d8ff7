"""Watching a motion with as few looks as its clearances allow. Knows travel, not time.

The travel of a motion is Σ pace·|Δq| along it: no clearance changes by more. A look at one place therefore
vouches for all within its clearance, and what is left of it at the end vouches for the next motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from viapoint.runtime import core
from viapoint.runtime.records import Floats, Ints
from viapoint.runtime.workspace.monitor import TOUCH, Monitor, Violation

Bools = npt.NDArray[np.bool_]

_FEWEST: Final = 4
"""Looks of a round at least; fewer cost as much, since numpy's calls outweigh the arithmetic."""

_MOST: Final = 256
"""Looks of the first round at most."""

_GROWTH: Final = 4
"""Factor between the rounds: where looks are decided early few are made, where not the rounds stay few."""

_UNKNOWN: Final = -1.0
"""m: the clearance where nobody has looked yet."""

_LEAST_CLEARANCE: Final = 0.01
"""m: a motion is looked at first as if there were at least this much room around it."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """The robot enters, or leaves, an exclusive zone in row `row`."""

    row: int
    zone: str
    enters: bool


@dataclass(frozen=True, slots=True)
class Sighting:
    """What a stretch of motion meets: the first violation, and crossings of exclusive zones up to it."""

    violation: Violation | None
    crossings: tuple[Crossing, ...]


NOTHING: Final = Sighting(None, ())
"""Of a stretch on which nothing is met, or so near to what was looked at that it needs no look."""


class Sure(NamedTuple):
    """What is sure where the robot is, with a tool: m of clearance, the exclusive zones (E,) it is in."""

    tool: int
    room: float
    inside: Bools


class Motion(Protocol):
    """A stretch of motion: rows with `travel` (N,) from its start on, ascending."""

    @property
    def travel(self) -> Floats: ...

    def joints(self, rows: Ints) -> Floats:
        """Joints (K, n) of rows (K,)."""
        ...

    def march(self, rules: Any, room: float) -> Any:
        """From look to look by the compiled rules, as `Rules._march`; `room` vouches for the first rows."""
        ...


class Ticks:
    """Joints (N, n), row by row, after joints `before` (n,) at that pace."""

    def __init__(self, rows: Floats, before: Floats, pace: Floats) -> None:
        module = core.chosen("workspace._core")
        self.travel: Floats = (module.ways if module is not None else ways)(rows, before, pace)
        self._rows = rows

    def joints(self, rows: Ints) -> Floats:
        return self._rows[rows]

    def march(self, rules: Any, room: float) -> Any:
        return rules.along_rows(self.travel, room, self._rows)


def ways(joints: Floats, before: Floats, pace: Floats) -> Floats:
    """Travel (N,) of rows of joints (N, n) from joints (n,) on."""
    steps = np.abs(np.diff(joints, axis=0, prepend=before[None]))
    travel: Floats = (steps @ pace).cumsum()
    return travel


class Watch:
    """Follows the motion of a robot: `look` ahead along a stretch, `advance` as far as it is really taken."""

    def __init__(self, monitor: Monitor) -> None:
        self._monitor = monitor
        self._room = _UNKNOWN  # clearance left where the robot is
        self._width = _LEAST_CLEARANCE  # clearance lately seen
        self._tool = -1
        self._inside = np.zeros(len(monitor.exclusive_zones), dtype=np.bool_)
        self._travel = np.zeros(1)
        self._search: _Search | None = None

    def passes(self, travel: float, tool: int) -> bool:
        """Whether a stretch with so much travel needs no look; then it is taken."""
        if tool != self._tool or travel > self._room:
            return False
        self._room -= travel
        return True

    @property
    def within(self) -> bytes:
        """The exclusive zones that the robot is in: equal where they are."""
        return self._inside.tobytes()

    @property
    def sure(self) -> Sure:
        """What is sure of where the robot is by now."""
        return Sure(self._tool, self._room, self._inside)

    def again(self, end: Sure, travel: float) -> None:
        """Take, with that tool, a stretch again that broke no rule: so much travel to where `end` is sure.

        It was taken from the same exclusive zones.
        """
        left = self._room - travel if self._tool == end.tool else _UNKNOWN
        self._tool, self._room, self._inside = end.tool, max(left, end.room), end.inside

    def look(self, motion: Motion, tool: int) -> Sighting:
        """What a stretch meets. The result is as if every row were looked at."""
        if tool != self._tool:
            self._tool, self._room = tool, _UNKNOWN
        self._travel, self._search = motion.travel, None
        if self._travel[-1] <= self._room:
            return NOTHING
        self._search = _Search(self._monitor, motion, tool, self._room)
        rules = self._monitor.rules(tool)
        if rules is None:
            self._search.run(self._width)
            self._width = max(self._search.usual(), _LEAST_CLEARANCE)
        else:
            self._search.march(rules, self._room)
        violation, crossings = self._search.violation, self._search.crossings(self._inside)
        return NOTHING if violation is None and not crossings else Sighting(violation, crossings)

    def advance(self, row: int) -> None:
        """The robot has come to row `row` of the stretch looked at; not beyond the first violation."""
        search, left = self._search, self._room - float(self._travel[row])
        if search is None:
            self._room = left
        else:
            self._room = max(left, search.room(row), 0.0)
            if len(self._inside) and row >= search.start:
                self._inside = search.states(np.array([row]))[0]


class _Search:
    """Looks at rows until every row is vouched for, or the first violation is."""

    def __init__(self, monitor: Monitor, motion: Motion, tool: int, room: float) -> None:
        self._monitor = monitor
        self._motion = motion
        self._travel = motion.travel
        self._tool = tool
        self._rows: Ints  # looked at
        self._radius: Floats  # m of travel around each for which it vouches
        self._within: Bools  # (L, E) which exclusive zones the robot is in there
        self._end = len(self._travel)  # rows from here on need no look: the first violation is before
        self.start = int(self._travel.searchsorted(room, side="right"))  # rows before are vouched for
        self.violation: Violation | None = None

    def run(self, width: float) -> None:
        """Rounds of looks at what is undecided, spread evenly."""
        self._rows, self._radius = np.empty(0, dtype=np.int64), np.empty(0)
        self._within = np.empty((0, len(self._monitor.exclusive_zones)), dtype=np.bool_)
        pending = np.arange(self.start, self._end)
        count = int(np.clip((self._travel[-1] - self._travel[self.start]) / width, _FEWEST, _MOST))
        while len(pending):
            chosen = pending[:: max(1, len(pending) // count)]
            self._look(chosen if chosen[-1] == pending[-1] else np.append(chosen, pending[-1]))
            pending = pending[~self._vouched(pending)]
            pending = pending[pending < self._end]
            count *= _GROWTH

    def march(self, rules: Any, room: float) -> None:
        """The same by looks one after the other, each as far on as the one before vouches."""
        self._rows, self._radius, self._within, broken = self._motion.march(rules, room)
        if broken:
            self._end = int(self._rows[-1])
            joints = self._motion.joints(self._rows[-1:])
            found = self._monitor.violation(rules.clearances(joints)[0], 0, self._tool)
            self.violation = replace(found, row=self._end)

    def _look(self, rows: Ints) -> None:
        clearances, exclusive = self._monitor.clearances(self._motion.joints(rows), self._tool)
        least = clearances.min(axis=1)
        broken = np.flatnonzero(least < -TOUCH)
        if len(broken):
            first = int(broken[0])
            self._end = int(rows[first])
            found = self._monitor.violation(clearances, first, self._tool)
            self.violation = replace(found, row=self._end)
        radius = self._monitor.room(clearances, self._tool)
        radius = np.minimum(radius, np.abs(exclusive).min(axis=1, initial=np.inf))
        rows = np.concatenate((self._rows, rows))
        order = np.argsort(rows, kind="stable")
        self._rows = rows[order]
        self._radius = np.concatenate((self._radius, np.maximum(radius, 0.0)))[order]
        self._within = np.concatenate((self._within, exclusive < -TOUCH))[order]

    def _nearest(self, rows: Ints) -> tuple[Ints, Ints]:
        """Rows looked at (positions among them) before, or at, and after the rows (N,)."""
        after = np.searchsorted(self._rows, rows, side="right")
        return np.maximum(after - 1, 0), np.minimum(after, len(self._rows) - 1)

    def _vouched(self, rows: Ints) -> Bools:
        """Which of the rows (N,) are decided by a look next to them, or were looked at."""
        decided = np.isin(rows, self._rows, assume_unique=True)
        for near in self._nearest(rows):
            decided |= np.abs(self._travel[rows] - self._travel[self._rows[near]]) <= self._radius[near]
        return decided

    def states(self, rows: Ints) -> Bools:
        """Which exclusive zones the robot is in, (N, E), in rows (N,) that are decided."""
        before, after = self._nearest(rows)
        near = self._travel[rows] - self._travel[self._rows[before]] <= self._radius[before]
        near |= self._rows[before] == rows
        return self._within[np.where(near, before, after)]

    def crossings(self, inside: Bools) -> tuple[Crossing, ...]:
        """Crossings of exclusive zones, by a robot that comes from where it was `inside` (E,)."""
        if not len(inside) or self.start >= self._end:
            return ()
        rows = np.arange(self.start, self._end)
        states = self.states(rows)
        changes = states != np.concatenate((inside[None], states[:-1]))
        zones = self._monitor.exclusive_zones
        return tuple(
            Crossing(int(rows[row]), zones[zone], bool(states[row, zone]))
            for row, zone in np.argwhere(changes).tolist()
        )

    def room(self, row: int) -> float:
        """Clearance that is sure in a row."""
        module = core.chosen("workspace._core")
        return float(
            (module.sure if module is not None else sure)(self._travel, row, self._rows, self._radius)
        )

    def usual(self) -> float:
        """The mean of the clearances seen."""
        return float(self._radius.mean())


def sure(travel: Floats, row: int, rows: Ints, radius: Floats) -> float:
    """What is sure in a row of `travel` (N,), m, where looks at rows (L,) vouch for that much around them."""
    left = radius - np.abs(travel[row] - travel[rows])
    return float(left.max(initial=0.0))
