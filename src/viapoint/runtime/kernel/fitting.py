"""Axis functions of spans of path as Chebyshev cells: sampled, checked, halved until good. Stateless.

A cell is good when the interpolation error is below `JOINT_TOLERANCE`, or where all that is left is what
rounding leaves of joints beside the end of reach.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from viapoint.runtime.core import chosen
from viapoint.runtime.kernel import chebyshev
from viapoint.runtime.kernel.failure import JointJump, PlanningError
from viapoint.runtime.kernel.sampling import Cell, NearSingular, out_of_reach, sample
from viapoint.runtime.kernel.spans import Span
from viapoint.runtime.kernel.stretch import Stretch
from viapoint.runtime.path import Space
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.robots import Robot

JOINT_TOLERANCE: Final = 2e-12
"""rad (m for a slide). At an arm's length of 3 m this is 1e-8 mm of TCP, and its third difference at
1 ms stays below 0.1 % of any drive's jerk limit."""

_LENGTH_TOLERANCE: Final = 1e-8
"""m (rad for the angle). Lengths meter speeds; they do not place the TCP."""

TURNS_ONLY: Final = 1e-3
"""rad or m. Joints followed so closely cannot be misread by a turn, nor any but those that jump be lost."""

_ROUNDING: Final = 1e-15
"""m or rad by which a pose and its way through the inverse kinematics are rounded."""

_MOST_ROUNDING: Final = 1e-9
"""rad. Beside the end of reach a joint is known to its rounding only; more than this would shake it."""

_ORDINARY_HALVINGS: Final = 4
"""Cells of an ordinary path converge with so many; one that does not is looked at for singular poses."""

_FEW: Final = 16
"""Cells of a round to which others are added without its costing much more."""

_HOPE: Final = 2.0**chebyshev.DEGREE
"""Halving a cell makes its error so many times smaller at best, far from all singular poses."""

_VANISHING_CELL: Final = 1e-9
"""m. A cell this small that has not converged: the joints do not follow the path there."""

_FREE: Final = 1e-6
"""Size of a free joint's vector (rad or m) beyond which it is not this joint that cannot follow."""

_FIRST_CELL: Final = 0.15
"""m (or rad) of path a cell spans at first; most converge, and the rest are halved."""

_LARGEST_STEP: Final = 0.6
"""rad between neighbouring nodes; more, and the turn count of a joint could be misread."""


_CORE: Final = "kernel._axes"


@dataclass(frozen=True, slots=True)
class Fitted:
    """Finished cells of consecutive spans, in order: values (C, D+1, m) at the nodes and coefficients."""

    spans: Sequence[Span]
    cells: Sequence[Cell]
    values: Floats
    coefficients: Floats

    @property
    def widths(self) -> Floats:
        """(C,)."""
        return np.array([cell.width for cell in self.cells])

    def place(self, cell: int, node: int) -> float:
        """w of a node, m from the start of the stretch."""
        at = self.cells[cell]
        u = np.array([at.start + at.width * chebyshev.NODES[node]])
        return float(self.spans[at.span].places(u)[0][0])


def fit(
    robot: Robot,
    stretches: Sequence[Stretch],
    spans: Sequence[Span],
    reference: Floats,
    *,
    patient: bool = False,
    tolerance: float = JOINT_TOLERANCE,
) -> Fitted:
    """Cells of each span, halved until all are good to the tolerance; one batch a round for all spans.

    `stretches` are the spans' own, `reference` (n,) the joints near which the turns are. Raises NearSingular
    where a path is not ordinary (unless `patient`), PlanningError where a pose is out of reach.
    """
    fitting = _Fitting(robot, stretches, spans, reference, patient, tolerance)
    todo = [cell for index, span in enumerate(spans) for cell in _first_cells(index, span)]
    while todo:
        todo = fitting.round(todo)
    return _in_order(spans, fitting.done)


@dataclass(slots=True)
class _Fitting:
    """What is to be fitted, as `fit` has it, and the cells that are good so far, by rounds."""

    robot: Robot
    stretches: Sequence[Stretch]
    spans: Sequence[Span]
    reference: Floats
    patient: bool
    tolerance: float
    doubtful: set[Cell] = field(default_factory=set)
    done: list[tuple[Sequence[Cell], Floats, Floats]] = field(default_factory=list)

    def round(self, todo: list[Cell]) -> list[Cell]:
        """Look at ascending cells; what is to be looked at next instead of those that are bad, ascending.

        Halves of doubtful cells are looked at with them: some more nodes cost less than another round.
        """
        cells = todo
        if len(todo) <= _FEW and (doubtful := self.doubtful.intersection(todo)):
            cells = sorted((*todo, *(half for cell in doubtful for half in cell.halves())))
        values = sample(self.robot, self.stretches, self.spans, cells, self.reference)
        coeffs = chebyshev.coefficients(values)
        errors = _errors(values, coeffs, self.robot.joint_count)
        good = _within(errors, self.tolerance)
        if self.patient:
            self._forgive(cells, values, errors, good)
        if cells is todo and good.all():
            self.done.append((cells, values, coeffs))
            return []
        kept, following = self._sorted_out(todo, cells, good, errors)
        self.done.append(([cells[k] for k in kept], values[kept], coeffs[kept]))
        return following

    def _forgive(self, cells: Sequence[Cell], values: Floats, errors: Floats, good: Bools) -> None:
        """Make those good of which nothing is left but rounding."""
        for k in np.flatnonzero(~good & _within(errors, _MOST_ROUNDING)).tolist():
            if not self.spans[cells[k].span].bearings:
                rounding = _rounding(self.robot, values[k][:, : self.robot.joint_count])
                good[k] = _within(errors[:, k], min(rounding, _MOST_ROUNDING))

    def _sorted_out(
        self, todo: Sequence[Cell], cells: Sequence[Cell], good: Bools, errors: Floats
    ) -> tuple[list[int], list[Cell]]:
        """Which of the cells looked at are kept, and what is to be looked at next, both ascending."""
        places = {cell: k for k, cell in enumerate(cells)}
        hopeful = _within(errors, _HOPE * self.tolerance)
        kept: list[int] = []
        following: list[Cell] = []
        asked = list(todo)
        for cell in asked:
            k = places.get(cell)
            if k is None:
                following.append(cell)
            elif good[k]:
                kept.append(k)
            else:
                self._require_hope(cell, float(errors[0, k]))
                asked += cell.halves()
                if not hopeful[k]:
                    self.doubtful.update(cell.halves())
        return sorted(kept), sorted(following)

    def _require_hope(self, cell: Cell, error: float) -> None:
        """Smaller cells than this one may converge, of this error; raises what is to be said where not."""
        stretch, span = self.stretches[cell.span], self.spans[cell.span]
        if stretch.curve.space is not Space.POSE:
            return
        halvings = _ORDINARY_HALVINGS - cell.depth
        if not self.patient and (halvings <= 0 or error > self.tolerance * _HOPE**halvings):
            raise NearSingular(before=cell.span)
        if cell.width >= _VANISHING_CELL:
            return
        w, x, _ = span.places(np.array([cell.start]))
        q, _, X = span.joints(self.robot, w, x, self.reference)
        vectors = self.robot.kinematics.free_vectors(X, q, span.configuration)
        if np.abs(vectors).min(initial=np.inf) > _FREE:
            raise out_of_reach(stretch, float(w[0]), "reaches the end of")
        raise joint_jump(stretch, float(w[0]))


def _in_order(spans: Sequence[Span], done: Sequence[tuple[Sequence[Cell], Floats, Floats]]) -> Fitted:
    if len(done) == 1:
        return Fitted(spans, *done[0])
    cells = [cell for round_cells, _, _ in done for cell in round_cells]
    order = sorted(range(len(cells)), key=lambda k: cells[k])
    values, coeffs = (np.concatenate([part[k] for part in done])[order] for k in (1, 2))
    return Fitted(spans, [cells[k] for k in order], values, coeffs)


def _first_cells(index: int, span: Span) -> Iterator[Cell]:
    length = span.length
    count = max(1, round(length / (_FIRST_CELL if span.warp is None else span.warp.scale)))
    width = length / count
    return (Cell(index, k * width, width) for k in range(count))


def _within(errors: Floats, tolerance: float) -> Bools:
    """Which cells are good, (C,), of their errors (3, C)."""
    driven, lengths, step = errors
    good: Bools = (
        (driven < tolerance) & (lengths < max(_LENGTH_TOLERANCE, tolerance)) & (step < _LARGEST_STEP)
    )
    return good


def _errors(values: Floats, coeffs: Floats, joints: int) -> Floats:
    """(3, C): the errors left of joints and auxiliary axes, and of lengths; the largest step of a joint."""
    if (core := chosen(_CORE)) is not None:
        return np.asarray(core.errors(values, coeffs, joints))
    error, q = chebyshev.residual(coeffs), values[:, :, :joints]
    step = np.abs(q[:, 1:] - q[:, :-1]).max(axis=(1, 2))
    return np.stack((error[:, :-4].max(axis=1), error[:, -4:].max(axis=1), step))


def _rounding(robot: Robot, q: Floats) -> float:
    """rad to which joints (N, n) are known from poses: rounding over the least gain of the arm."""
    gains = np.linalg.svd(robot.jacobian(q), compute_uv=False)[:, -1]
    return _ROUNDING / max(float(gains.min()), _ROUNDING)


def joint_jump(stretch: Stretch, w: float, joints: Floats | None = None) -> PlanningError:
    """The failure of joints that cannot follow a stretch from w on; `joints` (n,) are those it begins in."""
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
        joints,
    )
