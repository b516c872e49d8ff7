"""The path as the axes see it: joints, TCP length and TCP angle as smooth functions of the path parameter.

Geometry gives poses; closed-form inverse kinematics turns them into joints. Both are sampled once,
when a piece of path is finished, and kept as Chebyshev cells whose interpolation error is driven
below `JOINT_TOLERANCE`: the time law differentiates them, the generator evaluates them per tick, and
the set points that leave are the very functions that were verified. Not here: time, limits, actions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from viapoint.language.units import DEG
from viapoint.runtime.kernel import chebyshev
from viapoint.runtime.kernel.chebyshev import Cells
from viapoint.runtime.kernel.failure import JointJump, PlanningError
from viapoint.runtime.kernel.sampling import Cell as _Cell
from viapoint.runtime.kernel.sampling import Stretch, sample
from viapoint.runtime.path import Space
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot

JOINT_TOLERANCE: Final = 2e-12
"""rad (m for a slide). At an arm's length of 3 m this is 1e-8 mm of TCP, and its third difference at
1 ms stays below 0.1 % of any drive's jerk limit."""

_LENGTH_TOLERANCE: Final = 1e-8
"""m (rad for the angle). Lengths meter speeds; they do not place the TCP."""

_ROUGH_TOLERANCE: Final = 1e-8
"""rad, for the tiny cells beside a singular pose, where the free joint is only known to this."""

_SMALLEST_CELL: Final = 2e-4
"""m. A cell this small that has not converged sits beside a singularity."""

_VANISHING_CELL: Final = 1e-7
"""m. A cell this small that has not converged even roughly: the joints jump there."""

_FIRST_CELL: Final = 0.15
"""m (or rad) of path a cell spans at first; most converge, and the rest are halved."""

_LARGEST_STEP: Final = 0.6
"""rad between neighbouring nodes; more, and the turn count of a joint could be misread."""

_JOIN_GAP: Final = 1e-6
"""rad between the end of one cell and the start of the next; more is a jump of the joints."""

_RANGE_SLACK: Final = 1e-9
"""rad by which a joint may pass its range: rounding of a target that lies exactly on it."""

_Done = tuple[float, float, Floats, Floats]  # start, width, values, coefficients


class AxisPath:
    """Axis functions of the path, growing piece by piece; the parameter s runs on from piece to piece.

    Columns: the robot's n joints; TCP length (m) and TCP angle (rad) as far as path limits apply to
    them (not along joint moves); both again as travelled.
    """

    def __init__(self, robot: Robot, q_start: Floats) -> None:
        self.robot = robot
        self.n = len(q_start)
        self.length = 0.0
        self._cells = Cells(self.n + 4)
        self._last = np.concatenate((q_start, np.zeros(4)))

    @property
    def q_end(self) -> Floats:
        """Joints (n,) at the end."""
        return self._last[: self.n].copy()

    @property
    def travelled(self) -> float:
        """TCP length at the end, m."""
        return float(self._last[self.n + 2])

    def extend(self, stretches: Sequence[Stretch], configuration: int) -> None:
        """Compile finished pieces onto the end, all in one configuration.

        Raises PlanningError naming the line: pose out of reach, joint out of range, or joints that cannot
        follow continuously. What comes before the bad piece is then on the path.
        """
        try:
            cells = self._converge(stretches, configuration)
        except PlanningError:
            if len(stretches) == 1:
                raise
            for stretch in stretches:
                self.extend((stretch,), configuration)
            return
        for stretch, done in zip(stretches, cells, strict=True):
            done.sort(key=lambda d: d[0])
            coeffs = self._chain(stretch, done)
            starts, widths = np.array([d[:2] for d in done]).T
            self._cells.append(self.length + starts, widths, coeffs)
            self.length += stretch.length

    def values(self, s: Floats) -> Floats:
        """Limited axes (N, n + 2) at s (N,)."""
        return self.everything(s)[:, : self.n + 2]

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """First, second and third derivatives of the limited axes, each (N, n + 2)."""
        first, second, third = (d[:, : self.n + 2] for d in self._cells.evaluate(s, (1, 2, 3)))
        return first, second, third

    def everything(self, s: Floats) -> Floats:
        """All columns (N, n + 4) at s (N,): what the generator sends and reports."""
        if self.length == 0.0:  # no path yet: the robot stands
            return np.tile(self._last, (len(s), 1))
        return self._cells.evaluate(s)[0]

    def rates(self, s: Floats) -> Floats:
        """TCP length and angle per path parameter, (N, 2)."""
        return self._cells.evaluate(s, (1,))[0][:, self.n + 2 :]

    def forget(self, s: float) -> None:
        """Drop what lies wholly before s: the robot will not come back there."""
        self._cells.forget(s)

    def _converge(self, stretches: Sequence[Stretch], configuration: int) -> list[list[_Done]]:
        """Cells of each stretch, halved until all are good; one batch a round for all stretches."""
        todo: list[_Cell] = []
        for index, stretch in enumerate(stretches):
            count = max(1, round(stretch.length / _FIRST_CELL))
            width = stretch.length / count
            todo += [_Cell(index, k * width, width) for k in range(count)]
        done: list[list[_Done]] = [[] for _ in stretches]
        while todo:
            values = sample(self.robot, stretches, todo, configuration, self._last[: self.n])
            coeffs = chebyshev.coefficients(values)
            good = self._converged(values, coeffs, np.array([c.width for c in todo]))
            rest: list[_Cell] = []
            for k, cell in enumerate(todo):
                if good[k]:
                    done[cell.stretch].append((cell.start, cell.width, values[k], coeffs[k]))
                elif cell.width < _VANISHING_CELL:
                    raise self._jump(stretches[cell.stretch], cell.start)
                else:
                    rest += cell.halves()
            todo = rest
        return done

    def _converged(self, values: Floats, coeffs: Floats, widths: Floats) -> npt.NDArray[np.bool_]:
        n = self.n
        error = chebyshev.residual(coeffs)
        step = np.abs(np.diff(values[:, :, :n], axis=1)).max(axis=(1, 2))
        small = widths < _SMALLEST_CELL
        joints = error[:, :n].max(axis=1) < np.where(small, _ROUGH_TOLERANCE, JOINT_TOLERANCE)
        lengths = (error[:, n:].max(axis=1) < _LENGTH_TOLERANCE) | small
        good: npt.NDArray[np.bool_] = joints & lengths & (step < _LARGEST_STEP)
        return good

    def _chain(self, stretch: Stretch, done: list[_Done]) -> Floats:
        """Coefficients (C, D+1, n+4) with turns and lengths counted on from the end of the path."""
        n = self.n
        turn = np.where(self.robot.prismatic, 0.0, 2.0 * np.pi)
        chained = []
        for start, width, values, coeffs in done:
            gap = self._last[:n] - values[0, :n]
            turns = turn * np.round(gap / (2.0 * np.pi))
            turned = stretch.curve.space is Space.JOINT and turns.any()  # its joints are meant as they are
            if turned or np.abs(gap - turns).max() > _JOIN_GAP:
                raise self._jump(stretch, start)
            shift = np.concatenate((turns, self._last[n:]))
            moved = coeffs.copy()
            moved[0] += shift
            chained.append(moved)
            self._check_range(stretch, values + shift, start, width)
            self._last = values[-1] + shift
        return np.stack(chained)

    def _check_range(self, stretch: Stretch, values: Floats, start: float, width: float) -> None:
        q = values[:, : self.n]
        limits = self.robot.limits
        over = np.maximum(q - limits.upper, limits.lower - q)
        if over.max() <= _RANGE_SLACK:
            return
        node, joint = np.unravel_index(int(np.argmax(over > _RANGE_SLACK)), over.shape)
        w = start + width * chebyshev.NODES[node]
        raise PlanningError(
            "E303",
            f"J{joint + 1} would leave its range {limits.lower[joint] / DEG:g}…"
            f"{limits.upper[joint] / DEG:g} deg after {w / stretch.length:.0%} of this stretch of path",
            stretch.line,
            "start the motion in another configuration, or go part of the way with MJ",
        )

    def _jump(self, stretch: Stretch, w: float) -> PlanningError:
        where = "at its start" if w <= 0.0 else f"after {w * 1e3:.1f} mm"
        if stretch.curve.space is Space.JOINT:
            return PlanningError(
                "E305",
                "the round edge does not lead into this joint move: within it the joint move passes a singular "
                "pose into another configuration",
                stretch.line,
                "make R of the motion before smaller, or leave it out",
            )
        return JointJump(
            "E304",
            f"the joints cannot follow the path continuously {where}: it passes a singular pose",
            stretch.line,
            "go through the singular pose with MJ, or move the path away from it",
            w,
        )
