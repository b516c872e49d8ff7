"""The robot as capsules: along the links of its wire frame, and along the tool. Not here: what they may hit.

Links are numbered as their radii are in the cell file: link 1 stands on the base.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.records import Floats, Ints
from viapoint.runtime.robots import Robot

_PROBES: Final = 64
"""Joint vectors, spread evenly over the ranges, at which it is seen which joint moves which point."""

_PROBE_STEP: Final = 1e-5
"""rad (m) by which a joint is moved there."""

_NEIGHBOURS: Final = 1e-3
"""m. Capsules that come as close as this at their joint are neighbours too: figures in mm made them touch."""

_STILL: Final = 1e-7
"""m per rad. Points slower than this do not move with a joint: rounding over the step gives 1e-10."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Capsules of the robot with one tool: names, radii (P,) m; `moving` of them a joint can move.

    `reach` (n,), m per rad: no point of the wire frame moves farther than Σ reach·|Δq|, nor, seen from any
    link, any point of another. `pairs` (C, 2) are the capsules that may not meet each other.
    """

    robot: Robot
    tool_point: Floats
    """(3,) where the tool's capsule ends, in the flange."""
    names: tuple[str, ...]
    radius: Floats
    moving: Ints
    pairs: Ints
    reach: Floats

    @property
    def thinnest(self) -> float:
        """Radius of the thinnest capsule that moves, m; 0 for a wire frame."""
        return float(self.radius[self.moving].min(initial=np.inf))

    def points(self, joints: Floats) -> tuple[Floats, Floats]:
        """(N, n) → ends (N, P + 1, 3) of the capsules, one after the other; flange poses (N, 4, 4)."""
        X = self.robot.fk(joints)
        tip = X[:, :3, 3] + X[:, :3, :3] @ self.tool_point
        return np.concatenate((self.robot.link_points(joints), tip[:, None]), axis=1), X


def body_of(cell: Cell, tool: int) -> Body:
    """The robot of a cell with a tool: its capsule, or else a line from the flange to the TCP."""
    robot, held = cell.robot, cell.tools[tool]
    tip, thickness = held.X_flange_tool[:3, 3], 0.0
    if held.capsule is not None:
        tip, thickness = held.capsule.to, held.capsule.radius
    moved, length = _motion(robot, tip)
    links = len(length) - 1
    has_body = robot.body_radius is not None
    radii = np.zeros(links) if robot.body_radius is None else robot.body_radius[:links]
    radius = np.append(np.pad(radii, (0, links - len(radii))), thickness)
    moves = np.asarray((moved > _STILL).any(axis=1))
    present = np.append(np.ones(links, dtype=np.bool_), float(length[-1]) > 0.0 or thickness > 0.0)
    return Body(
        robot=robot,
        tool_point=tip,
        names=(*(f"link {k + 1}" for k in range(links)), "the tool"),
        radius=radius,
        moving=np.flatnonzero((moves[:-1] | moves[1:]) & present),
        pairs=_pairs(length, radius, present) if has_body else np.empty((0, 2), dtype=np.int64),
        reach=_reach(robot, moved, length),
    )


def _motion(robot: Robot, tip: Floats) -> tuple[Floats, Floats]:
    """Largest speeds (K, n) of the frame's points per joint speed, and lengths (K − 1,) of its links."""
    lower, upper = robot.limits.lower, robot.limits.upper
    n = robot.joint_count
    spread = np.sqrt(np.arange(2.0, 2.0 + n))  # multiples of irrational numbers fill the ranges evenly
    q = lower + (upper - lower) * np.modf(np.arange(1.0, _PROBES + 1.0)[:, None] * spread)[0]
    near = np.concatenate((q[:, None], q[:, None] + _PROBE_STEP * np.eye(n)), axis=1)
    X = robot.fk(near)
    end = X[..., :3, 3] + X[..., :3, :3] @ tip
    points = np.concatenate((robot.link_points(near), end[..., None, :]), axis=-2)
    speeds = np.linalg.norm(points[:, 1:] - points[:, :1], axis=-1) / _PROBE_STEP
    lengths = np.linalg.norm(np.diff(points[:, 0], axis=-2), axis=-1)
    return speeds.max(axis=0).T, lengths.max(axis=0)


def _reach(robot: Robot, moved: Floats, length: Floats) -> Floats:
    """Bound (n,) on the speed of any point: the length of the chain a joint moves, stretched out.

    The last point that a joint leaves in place lies on its axis, in every family; that the speeds seen are
    never above the chain's is taken care of all the same.
    """
    reach = np.asarray(moved.max(axis=0))
    for joint in np.flatnonzero(~robot.prismatic).tolist():
        first = int(np.argmax(moved[:, joint] > _STILL))
        if moved[first, joint] > _STILL:
            reach[joint] = max(reach[joint], float(length[max(first - 1, 0) :].sum()))
    return reach


def _pairs(length: Floats, radius: Floats, present: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> Ints:
    """(C, 2) capsules that may not meet: all but neighbours.

    Neighbours are joined by nothing, or by links no longer than the two are thick: these touch at the joint
    however they stand.
    """
    parts = np.flatnonzero(present).tolist()
    found = [
        (i, j)
        for i in parts
        for j in parts
        if j > i + 1 and radius[i] + radius[j] > 0.0
        if length[i + 1 : j].sum() > radius[i] + radius[j] + _NEIGHBOURS
    ]
    return np.array(found, dtype=np.int64).reshape(-1, 2)
