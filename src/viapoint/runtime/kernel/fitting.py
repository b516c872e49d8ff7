"""Axis functions of spans of path as Chebyshev cells: sampled, checked, halved until good. Stateless.

A cell is good when the interpolation error is below `JOINT_TOLERANCE`, or where all that is left is what
rounding leaves of joints beside the end of reach.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
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
    todo = [cell for index, span in enumerate(spans) for cell in _first_cells(index, span)]
    done: list[tuple[Sequence[Cell], Floats, Floats]] = []
    while todo:
        values = sample(robot, stretches, spans, todo, reference)
        coeffs = chebyshev.coefficients(values)
        good = _converged(values, coeffs, robot.joint_count, tolerance)
        if patient:
            shaken = ~good & _converged(values, coeffs, robot.joint_count, _MOST_ROUNDING)
            for k in np.flatnonzero(shaken).tolist():
                good[k] = not spans[todo[k].span].bearings and _is_rounding(robot, values[k], coeffs[k])
        if good.all():
            done.append((todo, values, coeffs))
            break
        kept = np.flatnonzero(good)
        done.append(([todo[k] for k in kept.tolist()], values[kept], coeffs[kept]))
        failed = [todo[k] for k in np.flatnonzero(~good).tolist()]
        for cell in failed:
            if stretches[cell.span].curve.space is Space.POSE:
                _require_hope(robot, stretches[cell.span], spans[cell.span], cell, reference, patient)
        todo = [half for cell in failed for half in cell.halves()]
    return _in_order(spans, done)


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


def _converged(values: Floats, coeffs: Floats, joints: int, tolerance: float) -> Bools:
    """Which cells are good, (C,): the error left in joints and auxiliary axes is below the tolerance."""
    driven, lengths, step = _errors(values, coeffs, joints)
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


def _is_rounding(robot: Robot, values: Floats, coeffs: Floats) -> bool:
    """Whether a cell has converged to what rounding leaves of the joints."""
    joints = robot.joint_count
    rounding = min(_rounding(robot, values[:, :joints]), _MOST_ROUNDING)
    return bool(_converged(values[None], coeffs[None], joints, rounding)[0])


def _rounding(robot: Robot, q: Floats) -> float:
    """rad to which joints (N, n) are known from poses: rounding over the least gain of the arm."""
    gains = np.linalg.svd(robot.jacobian(q), compute_uv=False)[:, -1]
    return _ROUNDING / max(float(gains.min()), _ROUNDING)


def _require_hope(
    robot: Robot, stretch: Stretch, span: Span, cell: Cell, reference: Floats, patient: bool
) -> None:
    """Smaller cells may converge; raises what is to be said where they may not."""
    if not patient and cell.depth >= _ORDINARY_HALVINGS:
        raise NearSingular
    if cell.width >= _VANISHING_CELL:
        return
    w, x, _ = span.places(np.array([cell.start]))
    q, _, X = span.joints(robot, w, x, reference)
    vectors = robot.kinematics.free_vectors(X, q, span.configuration)
    if np.abs(vectors).min(initial=np.inf) > _FREE:
        raise out_of_reach(stretch, float(w[0]), "reaches the end of")
    raise joint_jump(stretch, float(w[0]))


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
