"""Joins the workspace to the kernel: what it says of planned path and of ticks about to be sent, as errors.

Two doors. Planning looks at every finished stretch of path before it can be travelled. The ticks are
looked at once more as they are sent, since what is added to the path then is not known before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.kernel.failure import ExecutionError, PlanningError
from viapoint.runtime.kernel.joining import Joined
from viapoint.runtime.kernel.motion import Rows
from viapoint.runtime.kernel.stretch import Stretch
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.path import Space
from viapoint.runtime.records import Floats
from viapoint.runtime.workspace import (
    NOTHING,
    TOUCH,
    Course,
    Monitor,
    Rule,
    Sure,
    Ticks,
    Violation,
    Watch,
)

PLANNED: Final = {Rule.FORBIDDEN: "E330", Rule.SAFE: "E331", Rule.SELF: "E332", Rule.CONE: "E333"}
_RUNNING: Final = {Rule.FORBIDDEN: "E420", Rule.SAFE: "E421", Rule.SELF: "E422", Rule.CONE: "E423"}
_HINTS: Final = {
    Rule.FORBIDDEN: "lead the path around the zone, or correct the zone in the cell",
    Rule.SAFE: "keep the motion inside, or enlarge the safe zones of the cell",
    Rule.SELF: "lead the motion around the robot, or correct the radii of its body",
    Rule.CONE: "keep the tool upright on the way, or widen the orientation cone",
}

_TURNS_IN_PLACE: Final = 1e-6
"""m of path below which a motion only turns, and places on it are named by their share alone."""

_DEPTH_SAMPLES: Final = 513
"""Places looked at to say how deep a violation gets."""


@dataclass(frozen=True, slots=True)
class ZoneCrossing:
    """The path enters, or leaves, an exclusive zone, `place` (0 … 1) along a stretch of the motion `tag`.

    Entering, it is the last place looked at that is still outside. `length` is that of the stretch.
    """

    tag: int
    line: int
    place: float
    length: float
    zone: str
    enters: bool


class _Met(NamedTuple):
    """An exclusive zone entered, or left, at a `share` (0 … 1) of stretch number `stretch`."""

    stretch: int
    share: float
    zone: str
    enters: bool


class _Inspected(NamedTuple):
    """What is met along consecutive stretches with so much travel (m), and what is sure behind them.

    Of all, or of those before the first on which the robot breaks a rule: `fault` says which.
    """

    sound: int
    met: list[_Met]
    travel: float
    sure: Sure
    fault: PlanningError | None


_From = tuple[int, bytes]
"""The tool, and the exclusive zones from which consecutive stretches are entered."""


class PathGuard:
    """Looks at finished stretches of path, in order; those that come again need no look."""

    def __init__(
        self, monitor: Monitor, tool_of: Callable[[int], int], crossed: Callable[[ZoneCrossing, float], None]
    ) -> None:
        """`crossed` is told of crossings, with s where their stretches begin."""
        self._crossed = crossed
        self._monitor = monitor
        self._watch = Watch(monitor)
        self._tool_of = tool_of
        self._known: WeakKeyDictionary[Joined, dict[_From, _Inspected]] = WeakKeyDictionary()

    def begin_anew(self) -> None:
        """What comes next does not begin where the last stretch ended."""
        self._watch = Watch(self._monitor)

    def inspect(
        self, stretches: Sequence[Stretch], joined: Joined, begins: Floats, travelled: Floats
    ) -> tuple[int, PlanningError | None]:
        """An `axispath.Inspector`: stretches may be laid up to the first on which the robot breaks a rule."""
        tool = self._tool_of(stretches[0].curve.tag)  # of all of them: the path stops where it changes
        known, key = self._known.setdefault(joined, {}), (tool, self._watch.within)
        if key in known:
            inspected = known[key]
            self._watch.again(inspected.sure, inspected.travel)
        else:
            inspected = self._look(stretches, joined, travelled, tool)
            if inspected.fault is None:
                known[key] = inspected
        for met in inspected.met:
            self._crossed(self._crossing(stretches[met.stretch], joined, met), float(begins[met.stretch]))
        return inspected.sound, inspected.fault

    def _look(self, stretches: Sequence[Stretch], joined: Joined, travelled: Floats, tool: int) -> _Inspected:
        coeffs = joined.coefficients.copy()
        coeffs[:, 0, -travelled.shape[1] :] += travelled
        pace, travel = self._monitor.pace(tool), 0.0
        met: list[_Met] = []
        fault, sound = None, 0
        for first, last in pairwise(joined.bounds):
            course = Course(joined.widths[first:last], coeffs[first:last], pace)
            travel += course.length
            fault = self._look_along(stretches[sound], sound, course, tool, met)
            if fault is not None:
                break
            sound += 1
        return _Inspected(sound, met, travel, self._watch.sure, fault)

    def _look_along(
        self, stretch: Stretch, number: int, course: Course, tool: int, met: list[_Met]
    ) -> PlanningError | None:
        """Look along one stretch, and note what is met; why it may not be laid, if it may not."""
        if not math.isfinite(course.length):
            return PlanningError("E490", "the way of the tool is not a finite number", stretch.line)
        if self._watch.passes(course.length, tool):
            return None
        course.divide(self._monitor.body(tool).thinnest)
        seen = self._watch.look(course, tool)
        for crossing in seen.crossings:
            share = course.share(max(crossing.row - 1, 0) if crossing.enters else crossing.row)
            met.append(_Met(number, share, crossing.zone, crossing.enters))
        if seen.violation is not None:
            return self._error(stretch, course, seen.violation, tool)
        self._watch.advance(len(course.travel) - 1)
        return None

    @staticmethod
    def _crossing(stretch: Stretch, joined: Joined, met: _Met) -> ZoneCrossing:
        first, last = joined.bounds[met.stretch : met.stretch + 2]
        length = float(joined.widths[first:last].sum())
        return ZoneCrossing(stretch.curve.tag, stretch.line, met.share, length, met.zone, met.enters)

    def _error(self, stretch: Stretch, course: Course, violation: Violation, tool: int) -> PlanningError:
        row, last = violation.row, len(course.travel) - 1
        joints = course.joints(np.linspace(row, last, _DEPTH_SAMPLES).round().astype(np.int64))
        deepest = self._monitor.deepest(violation, joints, tool)
        done, length = course.lengths(row)
        share = f"{course.share(row):.0%}"
        turns = length < _TURNS_IN_PLACE
        way = share if turns else f"{done / MM:.1f} of {length / MM:.1f} mm ({share})"
        kind = "joint move" if stretch.curve.space is Space.JOINT else "path"
        what = "round edge" if stretch.curve.is_edge else kind
        message = f"{violation} after {way} of the {what}, {self._where(joints[0], tool)}"
        message += f"; by up to {deepest.extent}"
        return PlanningError(PLANNED[violation.rule], message, stretch.line, _HINTS[violation.rule])

    def _where(self, q: Floats, tool: int) -> str:
        return where(self._monitor.tcp(q, tool))


def where(position: Floats) -> str:
    """A TCP position (3,) m in words."""
    x, y, z = position / MM + 0.0
    return f"with the TCP at X={x:.1f} Y={y:.1f} Z={z:.1f}"


class TickGuard:
    """Looks at ticks before they are sent. `alarm` is the first thing found wrong; the robot then stops."""

    def __init__(self, monitor: Monitor, trace: Trace) -> None:
        self.alarm: ExecutionError | None = None
        self._refused = False  # by somebody else, in the rows being sent
        self._monitor = monitor if monitor.active else None
        self._watch = Watch(monitor)
        self._trace = trace
        self._seen = NOTHING
        self._error: ExecutionError | None = None

    def standing(self, q: Floats, tool: int, line: int) -> ExecutionError | None:
        """What is wrong with how the robot stands, at joints q (n,) with a tool."""
        if self._monitor is None:
            return None
        violation = self._monitor.check(q[None], tool)
        return None if violation is None else self._failure(violation, q, tool, line)

    def zones_at(self, q: Floats, tool: int) -> list[str]:
        """The exclusive zones that the robot is in, at joints q (n,) with a tool."""
        if self._monitor is None:
            return []
        inside = self._monitor.clearances(q[None], tool)[1][0] < -TOUCH
        return [name for name, within in zip(self._monitor.exclusive_zones, inside, strict=True) if within]

    def watch(self, rows: Rows, q: Floats, tool: int, line: int) -> Rows:
        """Rows about to be sent after joints q (n,): cut after the first in which something is met."""
        if self._monitor is None or self.alarm is not None:
            return rows
        joints = rows.columns[:, : len(q)]
        ticks = Ticks(joints, q, self._monitor.pace(tool))
        self._error, self._seen = None, self._watch.look(ticks, tool)
        if self._seen is NOTHING:
            return rows
        violation = self._seen.violation
        met = [crossing.row for crossing in self._seen.crossings]
        if violation is not None:
            self._error = self._failure(violation, joints[violation.row], tool, line)
            met.append(violation.row)
        if not met or min(met) + 1 == len(rows.s):
            return rows
        count = min(met) + 1
        return replace(rows, s=rows.s[:count], columns=rows.columns[:count], arrived=False)

    def refuse(self, error: ExecutionError) -> None:
        """Something else is wrong with the last row that will be sent: the robot stops behind it."""
        self._refused = self.alarm is None
        self.alarm = self.alarm or error

    def sent(self, count: int, line: int) -> bool:
        """So many of the rows were sent; True if the robot must be stopped."""
        if self._refused:
            self._refused = False
            return True
        if self._monitor is None or self.alarm is not None:
            return False
        self._watch.advance(count - 1)
        for crossing in self._seen.crossings:
            if crossing.row == count - 1:
                action = "entered" if crossing.enters else "left"
                self._trace.emit("zone", line, zone=crossing.zone, action=action)
        violation = self._seen.violation
        if violation is not None and violation.row == count - 1:
            self.alarm = self._error
        return self.alarm is not None

    def _failure(self, violation: Violation, q: Floats, tool: int, line: int) -> ExecutionError:
        assert self._monitor is not None, "only a monitor finds violations"
        message = f"{violation}, {where(self._monitor.tcp(q, tool))}"
        return ExecutionError(_RUNNING[violation.rule], message, line, _HINTS[violation.rule])
