"""The path as the axes see it: joints, TCP length and TCP angle as smooth functions of the path parameter.

Geometry gives poses; closed-form inverse kinematics turns them into joints. Both are sampled once,
when a piece of path is finished, and kept as Chebyshev cells whose interpolation error is driven
below `JOINT_TOLERANCE`: the time law differentiates them, the generator evaluates them per tick, and
the set points that leave are the very functions that were verified. Not here: time, limits, actions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.language.units import DEG
from viapoint.runtime.kernel import chebyshev
from viapoint.runtime.kernel.auxiliary import NO_AXES, AuxiliaryAxes
from viapoint.runtime.kernel.chebyshev import Cells
from viapoint.runtime.kernel.failure import JointJump, PlanningError
from viapoint.runtime.kernel.sampling import Cell as _Cell
from viapoint.runtime.kernel.sampling import NearSingular, out_of_reach, sample
from viapoint.runtime.kernel.spans import Division, Span, divide, whole
from viapoint.runtime.kernel.stretch import Stretch
from viapoint.runtime.path import Space
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.robots import Robot

JOINT_TOLERANCE: Final = 2e-12
"""rad (m for a slide). At an arm's length of 3 m this is 1e-8 mm of TCP, and its third difference at
1 ms stays below 0.1 % of any drive's jerk limit."""

_LENGTH_TOLERANCE: Final = 1e-8
"""m (rad for the angle). Lengths meter speeds; they do not place the TCP."""

_ROUNDING: Final = 1e-15
"""m or rad by which a pose and its way through the inverse kinematics are rounded."""

_MOST_ROUNDING: Final = 1e-9
"""rad. Beside the end of reach a joint is known to its rounding only; more than this would shake it."""

_ORDINARY_HALVINGS: Final = 4
"""Cells of an ordinary path converge with so many; one that does not is looked at for singular poses."""

_VANISHING_CELL: Final = 1e-9
"""m. A cell this small that has not converged: the joints do not follow the path there."""

_FREE: Final = 1e-6
"""Size of a free joint's vector (rad or m) beyond which it is not this joint that cannot follow."""

_FIRST_CELL: Final = 0.15
"""m (or rad) of path a cell spans at first; most converge, and the rest are halved."""

_LARGEST_STEP: Final = 0.6
"""rad between neighbouring nodes; more, and the turn count of a joint could be misread."""

_JOIN_GAP: Final = 1e-6
"""rad between the end of one cell and the start of the next; more is a jump of the joints. Less is what
rounding leaves beside a singular pose, where J4 and J6 may differ by it and the pose does not."""

_FREE_GAP: Final = 1e-2
_SAME_POSE: Final = 1e-10
"""rad; m and rad. Near a singular pose a gap may be rounding if the pose is the same but for it."""

_MOVING_GAP: Final = 1e-9
"""rad. A larger gap would be felt where the path is passed without a stop."""

_GAP_TO_CLOSE: Final = 1e-13
"""rad. A smaller gap between pieces of path is not seen in the ticks' differences."""

_RANGE_SLACK: Final = 1e-9
"""rad by which a joint may pass its range: rounding of a target that lies exactly on it."""


@dataclass(frozen=True, slots=True)
class _Fitted:
    """A finished cell: its span with the place in it, values at the nodes and coefficients."""

    span: Span
    start: float
    width: float
    values: Floats
    coefficients: Floats

    def place(self, node: int) -> float:
        """w of a node, m from the start of the stretch."""
        return float(self.span.places(np.array([self.start + self.width * chebyshev.NODES[node]]))[0][0])


Compiled = list[_Fitted]
"""The cells of one stretch, in order."""


class AxisPath:
    """Axis functions of the path, growing piece by piece; the parameter s runs on from piece to piece.

    Columns: the robot's n joints; k auxiliary axes; TCP length (m) and TCP angle (rad) as far as path
    limits apply to them (not along joint moves); both again as travelled.
    """

    def __init__(self, robot: Robot, q_start: Floats, auxiliary: AuxiliaryAxes = NO_AXES) -> None:
        self.robot = robot
        self.n = len(q_start)
        self.driven = self.n + len(auxiliary)
        self.length = 0.0
        self.inspect: Callable[[Stretch, Floats, Floats], None] | None = None
        """Told of every stretch before it is path, with its cells' widths and coefficients; may refuse it."""
        self._auxiliary = auxiliary
        self._lower = np.concatenate((robot.limits.lower, auxiliary.limits.lower))
        self._upper = np.concatenate((robot.limits.upper, auxiliary.limits.upper))
        self._cells = Cells(self.driven + 4)
        self._last = np.concatenate((q_start, auxiliary.start, np.zeros(4)))

    @property
    def q_end(self) -> Floats:
        """Joints (n,) at the end."""
        return self._last[: self.n].copy()

    @property
    def e_end(self) -> Floats:
        """Auxiliary axes (k,) at the end."""
        return self._last[self.n : self.driven].copy()

    @property
    def travelled(self) -> float:
        """TCP length at the end, m."""
        return float(self._last[-2])

    def compile(self, stretches: Sequence[Stretch], configuration: int) -> list[Compiled]:
        """Cells of finished pieces that follow each other in one configuration, in one batch.

        Raises NearSingular where that is too much to ask, PlanningError where a pose is out of reach.
        """
        return self._converge(stretches, [whole(stretch, configuration) for stretch in stretches])

    def follow(self, stretch: Stretch, configuration: int, rest: tuple[bool, bool]) -> Division:
        """Compile one piece onto the end, through and past singular poses; entered in a configuration.

        `rest` says whether the path stands still at its begin and its end. Raises PlanningError naming the
        line: pose out of reach, joint out of range, or joints that cannot follow continuously.
        """
        plain = whole(stretch, configuration)
        division = Division([plain], configuration, False, False)
        try:
            compiled = self._converge([stretch], [plain])
        except NearSingular:
            division = divide(self.robot, stretch, configuration, self.q_end, rest)
            compiled = self._patiently(stretch, division.spans)
        self.append(stretch, [cell for cells in compiled for cell in cells], at_rest=rest[0])
        return division

    def _patiently(self, stretch: Stretch, spans: Sequence[Span]) -> list[Compiled]:
        try:
            return self._converge([stretch] * len(spans), spans, patient=True)
        except NearSingular:
            raise self._jump(stretch, 0.0) from None

    def append(self, stretch: Stretch, compiled: Compiled, *, at_rest: bool) -> None:
        """Put a compiled piece onto the end of the path, which is passed `at_rest` or without a stop.

        Raises PlanningError naming the line: joint out of range, JointJump where the joints do not join.
        """
        coeffs, last = self._chain(stretch, compiled, at_rest=at_rest)
        widths = np.array([cell.width for cell in compiled])
        ends = np.cumsum(widths)
        if self.inspect is not None:
            self.inspect(stretch, widths, coeffs)
        self._cells.append(self.length + ends - widths, widths, coeffs)
        self.length += float(ends[-1])
        self._last = last

    def values(self, s: Floats) -> Floats:
        """Limited axes (N, n + k + 2) at s (N,)."""
        return self.everything(s)[:, :-2]

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """First, second and third derivatives of the limited axes, each (N, n + k + 2)."""
        first, second, third = (d[:, :-2] for d in self._cells.evaluate(s, (1, 2, 3)))
        return first, second, third

    def everything(self, s: Floats) -> Floats:
        """All columns (N, n + k + 4) at s (N,): what the generator sends and reports."""
        if self.length == 0.0:  # no path yet: the robot stands
            return np.tile(self._last, (len(s), 1))
        return self._cells.evaluate(s)[0]

    def rates(self, s: Floats) -> Floats:
        """TCP length and angle per path parameter, (N, 2)."""
        return self._cells.evaluate(s, (1,))[0][:, -2:]

    def forget(self, s: float) -> None:
        """Drop what lies wholly before s: the robot will not come back there."""
        self._cells.forget(s)

    def _converge(
        self, stretches: Sequence[Stretch], spans: Sequence[Span], *, patient: bool = False
    ) -> list[Compiled]:
        """Cells of each span, halved until all are good; one batch a round for all spans."""
        todo = [cell for index, span in enumerate(spans) for cell in _first_cells(index, span)]
        done: list[Compiled] = [[] for _ in spans]
        while todo:
            values = sample(self.robot, stretches, spans, todo, self._last[: self.n])
            coeffs = chebyshev.coefficients(values)
            good = self._converged(values, coeffs)
            rest: list[_Cell] = []
            for k, cell in enumerate(todo):
                span = spans[cell.span]
                rounded = patient and not span.bearings
                if good[k] or (rounded and self._is_rounding(values[k], coeffs[k])):
                    done[cell.span].append(_Fitted(span, cell.start, cell.width, values[k], coeffs[k]))
                    continue
                if stretches[cell.span].curve.space is Space.POSE:
                    self._require_hope(stretches[cell.span], span, cell, patient=patient)
                rest += cell.halves()
            todo = rest
        for cells in done:
            cells.sort(key=lambda cell: cell.start)
        return done

    def _converged(self, values: Floats, coeffs: Floats, tolerance: float = JOINT_TOLERANCE) -> Bools:
        n = self.driven
        error = chebyshev.residual(coeffs)
        step = np.abs(np.diff(values[:, :, : self.n], axis=1)).max(axis=(1, 2))
        joints = error[:, :n].max(axis=1) < tolerance
        good: Bools = joints & (error[:, n:].max(axis=1) < _LENGTH_TOLERANCE) & (step < _LARGEST_STEP)
        return good

    def _is_rounding(self, values: Floats, coeffs: Floats) -> bool:
        """Whether a cell has converged to what rounding leaves of the joints."""
        rounding = min(self._rounding(values), _MOST_ROUNDING)
        return bool(self._converged(values[None], coeffs[None], rounding)[0])

    def _rounding(self, values: Floats) -> float:
        """rad to which joints (N, n) are known from poses: rounding over the least gain of the arm."""
        gains = np.linalg.svd(self.robot.jacobian(values[:, : self.n]), compute_uv=False)[:, -1]
        return _ROUNDING / max(float(gains.min()), _ROUNDING)

    def _require_hope(self, stretch: Stretch, span: Span, cell: _Cell, *, patient: bool) -> None:
        """Smaller cells may converge; raises what is to be said where they may not."""
        if not patient and cell.depth >= _ORDINARY_HALVINGS:
            raise NearSingular
        if cell.width >= _VANISHING_CELL:
            return
        w, x, _ = span.places(np.array([cell.start]))
        q, _, X = span.joints(self.robot, w, x, self.q_end)
        vectors = self.robot.kinematics.free_vectors(X, q, span.configuration)
        if np.abs(vectors).min(initial=np.inf) > _FREE:
            raise out_of_reach(stretch, float(w[0]), "reaches the end of")
        raise self._jump(stretch, float(w[0]))

    def _chain(self, stretch: Stretch, compiled: Compiled, *, at_rest: bool) -> tuple[Floats, Floats]:
        """Coefficients (C, D+1, n+4), turns and lengths counted on from the end of the path; the new end."""
        n = self.n
        turn = np.where(self.robot.prismatic, 0.0, 2.0 * np.pi)
        chained = []
        last = self._last
        for number, cell in enumerate(compiled):
            gap = last[:n] - cell.values[0, :n]
            turns = turn * np.round(gap / (2.0 * np.pi))
            gap = gap - turns
            turned = stretch.curve.space is Space.JOINT and turns.any()  # its joints are meant as they are
            steady = at_rest or number > 0 or stretch.curve.space is Space.JOINT
            if turned or not self._joins(last[:n], gap, at_rest=steady):
                raise self._jump(stretch, 0.0 if number == 0 else cell.place(0))
            shift = np.concatenate((turns, np.zeros(self.driven - n), last[self.driven :]))
            moved = cell.coefficients.copy()
            moved[0] += shift
            if number == 0 and np.abs(gap).max() > _GAP_TO_CLOSE:  # closed along the cell
                moved[0, :n] += 0.5 * gap
                moved[1, :n] -= 0.5 * gap
            chained.append(moved)
            self._check_range(stretch, cell, cell.values + shift)
            last = cell.values[-1] + shift
        return np.stack(chained), last

    def _joins(self, q: Floats, gap: Floats, *, at_rest: bool) -> bool:
        """Whether joints q (n,) and q − gap are the same but for rounding."""
        largest = float(np.abs(gap).max())
        if not at_rest or largest <= _JOIN_GAP:
            return at_rest or largest <= _MOVING_GAP
        before, after = self.robot.fk(np.stack((q, q - gap)))
        return largest <= _FREE_GAP and float(np.abs(before - after).max()) <= _SAME_POSE

    def _check_range(self, stretch: Stretch, cell: _Fitted, values: Floats) -> None:
        driven = values[:, : self.driven]
        over = np.maximum(driven - self._upper, self._lower - driven)
        if over.max() <= _RANGE_SLACK:
            return
        node, joint = np.unravel_index(int(np.argmax(over > _RANGE_SLACK)), over.shape)
        if joint >= self.n:
            raise self._auxiliary.out_of_range(int(joint) - self.n, float(driven[node, joint]), stretch.line)
        raise PlanningError(
            "E303",
            f"J{joint + 1} would leave its range {self._lower[joint] / DEG:g}…"
            f"{self._upper[joint] / DEG:g} deg after {cell.place(int(node)) / stretch.length:.0%} of this "
            "stretch of path",
            stretch.line,
            "start the motion in another configuration, or go part of the way with MJ",
        )

    def _jump(self, stretch: Stretch, w: float) -> PlanningError:
        where = "at its start" if w <= 0.0 else f"after {w * 1e3:.1f} mm"
        if stretch.curve.space is Space.JOINT:
            return PlanningError(
                "E305",
                "the path before this joint move does not lead into it: beside a singular pose it goes "
                "another way round than the programmed one",
                stretch.line,
                "let the robot stop before it, with WAIT 0",
            )
        return JointJump(
            "E304",
            f"the joints cannot follow the path continuously {where}: it passes a singular pose",
            stretch.line,
            "go through the singular pose with MJ, or move the path away from it",
            w,
        )


def _first_cells(index: int, span: Span) -> list[_Cell]:
    length = span.length
    count = max(1, round(length / (_FIRST_CELL if span.warp is None else span.warp.scale)))
    width = length / count
    return [_Cell(index, k * width, width) for k in range(count)]
