"""From finished pieces of path to values at nodes: poses, inverse kinematics, lengths. Stateless.

One batch of inverse kinematics serves the nodes of many cells, since numpy's cost per call would
otherwise outweigh the arithmetic. Singular poses are met here: the free joint of an exactly singular
node is extrapolated from its neighbourhood on the path, so that joints stay continuous through it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum, unique
from typing import Final, NamedTuple, Protocol, assert_never

import numpy as np

from viapoint.runtime.kernel.chebyshev import NODES, integrals
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.path import Piece, Poses, Space
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot
from viapoint.runtime.rotations import quaternion_to_matrix

_NUDGE: Final = 1e-5
"""m (or rad) beside a singular pose where its free joint is read: far enough for the joint to be well
determined, near enough for linear extrapolation from two such places to be exact to 1e-10 rad."""


@unique
class PathLimits(Enum):
    """Whether the limits of TCP speed, acceleration and jerk hold along a piece."""

    APPLY = "apply"
    FREE = "free"
    RAMP_IN = "ramp in"
    RAMP_OUT = "ramp out"


class Curve(Protocol):
    """A curve of TCP poses with its own parameter, 0 … length."""

    @property
    def length(self) -> float: ...
    def poses(self, w: Floats) -> Poses: ...


@dataclass(frozen=True)
class FlangePath:
    """A curve of TCP poses as the flange runs it: X_tool_flange (4, 4) is the inverse of the tool."""

    curve: Curve
    X_tool_flange: Floats

    @property
    def length(self) -> float:
        """Length in the curve's own parameter."""
        return self.curve.length

    def flange_poses(self, w: Floats) -> Floats:
        """X_base_flange (N, 4, 4) at w (N,)."""
        position, quaternion = self.curve.poses(w)
        X = np.zeros((len(w), 4, 4))
        X[:, :3, :3] = quaternion_to_matrix(quaternion)
        X[:, :3, 3] = position
        X[:, 3, 3] = 1.0
        return np.asarray(X @ self.X_tool_flange)


@dataclass(frozen=True)
class Stretch(FlangePath):
    """A finished piece of path with its source line, and how path limits apply to it.

    Joint moves are free of them; a round edge between a joint move and a path motion ramps them in or out
    on the half that belongs to the path motion.
    """

    curve: Piece
    line: int
    limits: PathLimits

    def split(self, w: float) -> tuple[Stretch, Stretch]:
        """The stretch up to w and from there on; not for one whose path limits are ramped."""
        piece = self.curve
        head = replace(piece, length=w, ends=False, stop=False)
        tail = replace(piece, begin=piece.begin + w, length=piece.length - w)
        return replace(self, curve=head), replace(self, curve=tail)

    def rates(self, w: Floats) -> Floats:
        """(N, 4): limited TCP length and angle, travelled TCP length and angle, per parameter at w (N,)."""
        travelled = np.stack(self.curve.rates(w), axis=1)
        match self.limits:
            case PathLimits.APPLY:
                limited = travelled
            case PathLimits.FREE:
                limited = np.zeros_like(travelled)
            case PathLimits.RAMP_IN:
                limited = travelled * _smooth_step(w / self.length)[:, None]
            case PathLimits.RAMP_OUT:
                limited = travelled * _smooth_step(1.0 - w / self.length)[:, None]
            case _:
                assert_never(self.limits)
        return np.concatenate((limited, travelled), axis=1)


def _smooth_step(u: Floats) -> Floats:
    """0 … 1 over u = 0 … 1, with first and second derivative zero at both ends."""
    result: Floats = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return result


class Cell(NamedTuple):
    """An interval of a stretch that one polynomial shall represent."""

    stretch: int
    start: float
    width: float

    def halves(self) -> list[Cell]:
        """Two cells in its place."""
        half = 0.5 * self.width
        return [Cell(self.stretch, self.start, half), Cell(self.stretch, self.start + half, half)]


def sample(
    robot: Robot,
    stretches: Sequence[Stretch],
    cells: Sequence[Cell],
    configuration: int,
    reference: Floats,
) -> Floats:
    """Values (C, D+1, n+4) of joints and lengths at the nodes of cells, given in the order of stretches.

    Joints are continuous within each cell and lengths count from its start; cells are chained by the
    caller. Raises PlanningError where
    a pose is out of reach.
    """
    places = [_Places(stretches[k], group) for k, group in _grouped(cells)]
    posed = [p for p in places if p.stretch.curve.space is Space.POSE]
    joints = iter(_joints_on_path(robot, posed, configuration, reference) if posed else ())
    shape = (len(cells), len(NODES), -1)
    q = np.concatenate(
        [next(joints) if p.stretch.curve.space is Space.POSE else p.stretch.curve.joints(p.w) for p in places]
    ).reshape(shape)
    turning = np.flatnonzero(~robot.prismatic)
    q[:, :, turning] = np.unwrap(q[:, :, turning], axis=1)
    rates = np.concatenate([p.stretch.rates(p.w) for p in places]).reshape(shape)
    lengths = integrals(rates, np.array([cell.width for cell in cells]))
    return np.concatenate((q, lengths), axis=2)


def _grouped(cells: Sequence[Cell]) -> list[tuple[int, list[Cell]]]:
    groups: dict[int, list[Cell]] = {}
    for cell in cells:
        groups.setdefault(cell.stretch, []).append(cell)
    return list(groups.items())


class _Places:
    """The nodes w (N,) of some cells of one stretch."""

    def __init__(self, stretch: Stretch, cells: Sequence[Cell]) -> None:
        self.stretch = stretch
        starts = np.array([c.start for c in cells])
        widths = np.array([c.width for c in cells])
        self.w = np.clip((starts[:, None] + widths[:, None] * NODES).ravel(), 0.0, stretch.length)


def _joints_on_path(
    robot: Robot, places: Sequence[_Places], configuration: int, reference: Floats
) -> list[Floats]:
    """Joints (N, n) at the places of each stretch, from one batch of inverse kinematics."""
    X = np.concatenate([p.stretch.flange_poses(p.w) for p in places])
    q, reachable = robot.ik_branch(X, configuration, reference)
    singular = robot.kinematics.free_joint(X, q)
    found = []
    end = 0
    for p in places:
        rows = slice(end, end := end + len(p.w))
        if not reachable[rows].all():
            raise _out_of_reach(p.stretch, float(p.w[np.argmin(reachable[rows])]))
        if singular[rows].any():
            held = rows.start + np.flatnonzero(singular[rows])
            q[held] = _at_singular(robot, p.stretch, p.w[singular[rows]], configuration, reference)
        found.append(q[rows])
    return found


def _at_singular(robot: Robot, stretch: Stretch, w: Floats, configuration: int, reference: Floats) -> Floats:
    """Joints (K, n) at exactly singular places: the free joint extrapolated from inside the piece."""
    inward = np.where(w < 0.5 * stretch.curve.length, 1.0, -1.0) * min(_NUDGE, 0.25 * stretch.curve.length)
    near, _ = robot.ik_branch(stretch.flange_poses(w + inward), configuration, reference)
    far, _ = robot.ik_branch(stretch.flange_poses(w + 2.0 * inward), configuration, near)
    free, _ = robot.ik_branch(stretch.flange_poses(w), configuration, 2.0 * near - far)
    return free


def _out_of_reach(stretch: Stretch, w: float) -> PlanningError:
    position, _ = stretch.curve.poses(np.array([w]))
    x, y, z = position[0] * 1e3
    return PlanningError(
        "E302",
        f"the path leaves the robot's reach after {w * 1e3:.1f} mm, at X={x:.1f} Y={y:.1f} Z={z:.1f}",
        stretch.line,
        "bring the path closer to the base, or check the tool and the frame",
    )
