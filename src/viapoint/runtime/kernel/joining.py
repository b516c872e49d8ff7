"""Cells of consecutive stretches joined to the end of a path: turns counted on, gaps closed.

Joints that do not join, or leave their range, are a fault of the cell; those before it are good.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from viapoint.language.units import DEG
from viapoint.runtime.core import chosen
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.kernel.fitting import Fitted, joint_jump
from viapoint.runtime.kernel.stretch import Stretch
from viapoint.runtime.path import Space
from viapoint.runtime.records import Bools, Floats, Ints
from viapoint.runtime.robots import Robot

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

_TURN: Final = 2.0 * np.pi

_GAPS: Final = (_GAP_TO_CLOSE, _JOIN_GAP, _MOVING_GAP)
_CORE: Final = "kernel._axes"


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Joined:
    """Cells of S consecutive stretches as they continue a path, wherever on it that is.

    Of all stretches, or of those before the first that has a `fault`. The last four columns of the
    `coefficients` (C, D+1, m) are those of lengths from where each cell starts.
    """

    owner: Ints
    """(C,) number of each cell's stretch."""
    bounds: list[int]
    """S + 1 numbers: of the first cell of each stretch, and of the cells in all."""
    starts: Floats
    """(C,) from where its stretch starts."""
    widths: Floats
    lengths: Floats
    """(S,) of the stretches, in the path parameter."""
    coefficients: Floats
    rises: Floats
    """(C, 4) of the lengths along each cell."""
    ends: Floats
    """(S, n + k) joints and auxiliary axes in which the stretches end."""
    fault: Callable[[], PlanningError] | None


class Joiner:
    """Joins the cells of one robot with its auxiliary axes."""

    def __init__(self, robot: Robot, auxiliary: AuxiliaryAxes) -> None:
        self._robot = robot
        self._auxiliary = auxiliary
        self._n = robot.joint_count
        self._driven = self._n + len(auxiliary)
        self._turn = np.where(robot.prismatic, 0.0, _TURN)
        self._lower = np.concatenate((robot.limits.lower, auxiliary.limits.lower))
        self._upper = np.concatenate((robot.limits.upper, auxiliary.limits.upper))

    def join(
        self, q: Floats, stretches: Sequence[Stretch], fitted: Fitted, owner: Ints, *, at_rest: bool
    ) -> Joined:
        """`q` (n,) are the joints in which the path ends, which is passed `at_rest` or without a stop;
        `owner` (C,) numbers the stretch of each cell.
        """
        given = np.array([stretch.curve.space is Space.JOINT for stretch in stretches])
        if (core := chosen(_CORE)) is not None:
            cells = fitted.values, fitted.coefficients
            bounds = self._turn, self._lower, self._upper, _GAPS, _RANGE_SLACK
            good = core.joined(*cells, q, owner, given.view(np.uint8), at_rest, *bounds)
            if good is not None:
                coeffs, ends = good
                return self._of_whole(len(stretches), owner, len(owner), fitted, coeffs, ends, None)
        return self._joined(q, stretches, fitted, owner, given[owner], at_rest)

    def _joined(
        self,
        q: Floats,
        stretches: Sequence[Stretch],
        fitted: Fitted,
        owner: Ints,
        given: Bools,
        at_rest: bool,
    ) -> Joined:
        """As `join`, with the fault if there is one; `given` (C,) where the joints of a cell are."""
        n = self._n
        first, end = fitted.values[:, 0, : self._driven], fitted.values[:, -1, : self._driven]
        gaps = np.concatenate((q[None], end[:-1, :n])) - first[:, :n]
        turns = self._turn * np.rint(gaps / _TURN)
        gaps -= turns
        shifts = np.zeros_like(end)
        np.cumsum(turns, axis=0, out=shifts[:, :n])
        heads = np.concatenate(([True], owner[1:] > owner[:-1]))
        coeffs = fitted.coefficients.copy()
        coeffs[:, 0, : self._driven] += shifts
        closed = heads & (np.abs(gaps).max(axis=1) > _GAP_TO_CLOSE)
        coeffs[closed, 0, :n] += 0.5 * gaps[closed]  # along the cell
        coeffs[closed, 1, :n] -= 0.5 * gaps[closed]
        steady = given | ~heads
        steady[0] |= at_rest
        ends = end + shifts
        turned = given & shifts[:, :n].any(axis=1)  # its joints are meant as they are
        jump = self._jump(ends[:, :n], gaps, turned, steady)
        good, fault = len(owner), None
        if jump is not None:
            place, joints = (
                (0.0, first[jump, :n] + shifts[jump, :n]) if heads[jump] else (fitted.place(jump, 0), None)
            )
            good, fault = jump, partial(joint_jump, stretches[owner[jump]], place, joints)
        outside = self._outside(fitted.values[:good], shifts[:good])
        if outside is not None:
            good, stretch = outside[0], stretches[owner[outside[0]]]
            fault = partial(self._range_fault, stretch, fitted, shifts, outside)
        return self._of_whole(len(stretches), owner, good, fitted, coeffs, ends, fault)

    def _of_whole(
        self,
        stretches: int,
        owner: Ints,
        good: int,
        fitted: Fitted,
        coeffs: Floats,
        ends: Floats,
        fault: Callable[[], PlanningError] | None,
    ) -> Joined:
        """The stretches all of whose cells are among the first `good`."""
        bounds: list[int] = np.searchsorted(owner, np.arange(stretches + 1)).tolist()
        while bounds[-1] > good:
            del bounds[-1]
        count, widths = bounds[-1], fitted.widths
        upto = np.concatenate([np.cumsum(widths[a:b]) for a, b in pairwise(bounds)]) if count else np.zeros(0)
        lasts = np.array(bounds[1:], dtype=np.int64) - 1
        starts = np.zeros(count)
        starts[1:] = upto[:-1]
        starts[bounds[:-1]] = 0.0
        return Joined(
            owner=owner[:count],
            bounds=bounds,
            starts=starts,
            widths=widths[:count],
            lengths=upto[lasts],
            coefficients=coeffs[:count],
            rises=fitted.values[:count, -1, self._driven :].copy(),
            ends=ends[lasts],
            fault=fault,
        )

    def _jump(self, ends: Floats, gaps: Floats, turned: Bools, steady: Bools) -> int | None:
        """The first cell (if any) whose joints do not join, or that is `turned` where it must not be."""
        doubtful = turned | (np.abs(gaps).max(axis=1) > np.where(steady, _JOIN_GAP, _MOVING_GAP))
        for cell in np.flatnonzero(doubtful).tolist():
            if turned[cell] or not steady[cell]:
                return int(cell)
            if not self._is_one_pose(ends[cell - 1] if cell else ends[0], gaps[cell]):
                return int(cell)
        return None

    def _is_one_pose(self, q: Floats, gap: Floats) -> bool:
        """Whether joints q (n,) and q − gap are the same but for rounding."""
        before, after = self._robot.fk(np.stack((q, q - gap)))
        return float(np.abs(gap).max()) <= _FREE_GAP and float(np.abs(before - after).max()) <= _SAME_POSE

    def _outside(self, values: Floats, shifts: Floats) -> tuple[int, int, int] | None:
        """Cell, node and axis that first are out of range."""
        driven = values[:, :, : self._driven] + shifts[:, None]
        over = np.maximum(driven - self._upper, self._lower - driven)
        if over.max(initial=0.0) <= _RANGE_SLACK:
            return None
        cell, node, axis = np.unravel_index(int(np.argmax(over > _RANGE_SLACK)), over.shape)
        return int(cell), int(node), int(axis)

    def _range_fault(
        self, stretch: Stretch, fitted: Fitted, shifts: Floats, outside: tuple[int, int, int]
    ) -> PlanningError:
        cell, node, axis = outside
        if axis >= self._n:
            value = float(fitted.values[outside] + shifts[cell, axis])
            return self._auxiliary.out_of_range(axis - self._n, value, stretch.line)
        return PlanningError(
            "E303",
            f"J{axis + 1} would leave its range {self._lower[axis] / DEG:g}…"
            f"{self._upper[axis] / DEG:g} deg after {fitted.place(cell, node) / stretch.length:.0%} of this "
            "stretch of path",
            stretch.line,
            "start the motion in another configuration, or go part of the way with MJ",
        )
