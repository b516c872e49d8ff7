"""Joins the workspace to the kernel: what it says of planned path and of ticks about to be sent, as errors.

Two doors. Planning looks at every finished stretch of path before it can be travelled. The ticks are
looked at once more as they are sent, since what is added to the path then is not known before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.chebyshev import DEGREE
from viapoint.runtime.kernel.failure import ExecutionError, PlanningError
from viapoint.runtime.kernel.motion import Rows
from viapoint.runtime.kernel.stretch import Stretch
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.path import Space
from viapoint.runtime.records import Floats, Ints
from viapoint.runtime.workspace import NOTHING, Crossing, Monitor, Rule, Violation, Watch, grid

_PLANNED: Final = {Rule.FORBIDDEN: "E330", Rule.SAFE: "E331", Rule.SELF: "E332", Rule.CONE: "E333"}
_RUNNING: Final = {Rule.FORBIDDEN: "E420", Rule.SAFE: "E421", Rule.SELF: "E422", Rule.CONE: "E423"}
_HINTS: Final = {
    Rule.FORBIDDEN: "lead the path around the zone, or correct the zone in the cell",
    Rule.SAFE: "keep the motion inside, or enlarge the safe zones of the cell",
    Rule.SELF: "lead the motion around the robot, or correct the radii of its body",
    Rule.CONE: "keep the tool upright on the way, or widen the orientation cone",
}

_STEEPEST: Final = np.arange(DEGREE + 1, dtype=np.float64) ** 2
"""Bounds |Tₖ'| on −1 … 1."""

_DEPTH_SAMPLES: Final = 513
"""Places looked at to say how deep a violation gets."""


@dataclass(frozen=True, slots=True)
class ZoneCrossing:
    """The path enters, or leaves, an exclusive zone, `place` (0 … 1) along a stretch of the motion `tag`."""

    tag: int
    line: int
    place: float
    zone: str
    enters: bool


class PathGuard:
    """Looks at finished stretches of path, in order."""

    def __init__(
        self, monitor: Monitor, tool_of: Callable[[int], int], crossed: Callable[[ZoneCrossing], None]
    ) -> None:
        self._crossed = crossed
        self._monitor = monitor
        self._watch = Watch(monitor)
        self._tool_of = tool_of

    def inspect(self, stretch: Stretch, widths: Floats, coeffs: Floats) -> None:
        """A stretch as its cells: widths (C,), Chebyshev coefficients (C, D+1, m), joints first.

        Raises PlanningError if the robot breaks a rule somewhere on it.
        """
        tool = self._tool_of(stretch.curve.tag)
        course = _Course(widths, coeffs, self._monitor.pace(tool))
        if not np.isfinite(course.travel):
            raise PlanningError("E490", "the way of the tool is not a finite number", stretch.line)
        if self._watch.passes(course.travel, tool):
            return
        places = grid(course.travel, self._monitor.body(tool).thinnest)
        seen = self._watch.look(places, lambda rows: course.joints(places[rows]), tool)
        for crossing in seen.crossings:
            self._crossed(self._crossing(stretch, course, places, crossing))
        if seen.violation is not None:
            raise self._error(stretch, course, places, seen.violation, tool)
        self._watch.advance(len(places) - 1)

    @staticmethod
    def _crossing(stretch: Stretch, course: _Course, places: Floats, crossing: Crossing) -> ZoneCrossing:
        share = course.share(float(places[crossing.row]))
        return ZoneCrossing(stretch.curve.tag, stretch.line, share, crossing.zone, crossing.enters)

    def _error(
        self, stretch: Stretch, course: _Course, places: Floats, violation: Violation, tool: int
    ) -> PlanningError:
        rows = np.linspace(violation.row, len(places) - 1, _DEPTH_SAMPLES).round().astype(np.int64)
        joints = course.joints(places[rows])
        deepest = self._monitor.deepest(violation, joints, tool)
        place = float(places[violation.row])
        done, length = course.lengths(place)
        way = f"{done / MM:.1f} of {length / MM:.1f} mm ({course.share(place):.0%})"
        kind = "joint move" if stretch.curve.space is Space.JOINT else "path"
        what = "round edge" if stretch.curve.is_edge else kind
        message = f"{violation} after {way} of the {what}, {self._where(joints[0], tool)}"
        message += f"; by up to {deepest.extent}"
        return PlanningError(_PLANNED[violation.rule], message, stretch.line, _HINTS[violation.rule])

    def _where(self, q: Floats, tool: int) -> str:
        return where(self._monitor.tcp(q, tool))


def where(position: Floats) -> str:
    """A TCP position (3,) m in words."""
    x, y, z = position / MM + 0.0
    return f"with the TCP at X={x:.1f} Y={y:.1f} Z={z:.1f}"


class _Course:
    """A stretch by its travel: a bound on how far the robot moves, of which the joints are functions."""

    def __init__(self, widths: Floats, coeffs: Floats, pace: Floats) -> None:
        self._n = len(pace)
        self._coeffs = coeffs
        self._ends = np.cumsum(widths)
        self._starts = self._ends - widths
        steepest = np.einsum("k,ckn->cn", _STEEPEST, np.abs(coeffs[:, :, : self._n]))
        with np.errstate(over="ignore", invalid="ignore"):  # a tool of astronomic length is refused
            self._rates = steepest @ pace
        self._travel = np.concatenate(([0.0], np.cumsum(2.0 * self._rates)))
        self.travel = float(self._travel[-1])

    def joints(self, travel: Floats) -> Floats:
        """Joints (N, n) at places (N,)."""
        return self._values(travel)[:, : self._n]

    def lengths(self, travel: float) -> tuple[float, float]:
        """TCP length from the start of the stretch to a place, and of the whole stretch; m."""
        values = self._values(np.array([0.0, travel, self.travel]))[:, -2]
        return float(values[1] - values[0]), float(values[2] - values[0])

    def share(self, travel: float) -> float:
        """Where a place is in the path parameter of the stretch, 0 … 1."""
        cell, x = self._cells(np.array([travel]))
        at = self._starts[cell] + 0.5 * (x + 1.0) * (self._ends[cell] - self._starts[cell])
        return float(at[0] / self._ends[-1])

    def _cells(self, travel: Floats) -> tuple[Ints, Floats]:
        cell = np.clip(np.searchsorted(self._travel, travel, side="right") - 1, 0, len(self._rates) - 1)
        rates = self._rates[cell]
        x = (travel - self._travel[cell]) / np.where(rates > 0.0, rates, 1.0) - 1.0
        return cell, np.clip(x, -1.0, 1.0)

    def _values(self, travel: Floats) -> Floats:
        cell, x = self._cells(travel)
        basis = np.polynomial.chebyshev.chebvander(x, DEGREE)
        values: Floats = np.einsum("rk,rkm->rm", basis, self._coeffs[cell])
        return values


class TickGuard:
    """Looks at ticks before they are sent. `alarm` is the first thing found wrong; the robot then stops."""

    def __init__(self, cell: Cell, trace: Trace) -> None:
        self.alarm: ExecutionError | None = None
        monitor = Monitor(cell)
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

    def watch(self, rows: Rows, q: Floats, tool: int, line: int) -> Rows:
        """Rows about to be sent after joints q (n,): cut after the first in which something is met."""
        if self._monitor is None or self.alarm is not None:
            return rows
        joints = rows.columns[:, : len(q)]
        steps = np.empty(joints.shape)
        np.subtract(joints[1:], joints[:-1], out=steps[1:])
        np.subtract(joints[0], q, out=steps[0])
        travel = (np.abs(steps, out=steps) @ self._monitor.pace(tool)).cumsum()
        self._error, self._seen = None, self._watch.look(travel, joints.__getitem__, tool)
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

    def sent(self, count: int, line: int) -> bool:
        """So many of the rows were sent; True if the robot must be stopped."""
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
