"""The robot as capsules: along the links of its wire frame, and along the tool. Not here: what they may hit.

Links are numbered as their radii are in the cell file: link 1 stands on the base.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.cell import Tool
from viapoint.runtime.records import Floats, Ints
from viapoint.runtime.robots import Robot
from viapoint.runtime.workspace.chain import Chain, chain_of, wire_frame

_PROBES: Final = 24
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

    In m per rad (per m of a slide): no point of capsule p moves farther than Σ `part_pace[p]`·|Δq|, and no
    point of one of pair c, seen from the other, farther than Σ `pair_pace[c]`·|Δq|. `pace` bounds them all.
    """

    robot: Robot
    tool_point: Floats
    """(3,) where the tool's capsule ends, in the flange."""
    names: tuple[str, ...]
    radius: Floats
    moving: Ints
    pairs: Ints
    part_pace: Floats
    pair_pace: Floats
    pace: Floats
    chain: Chain | None
    """The frame as a chain of turns and slides, if it is one."""

    @property
    def thinnest(self) -> float:
        """Radius of the thinnest capsule that moves, m; 0 for a wire frame."""
        return float(self.radius[self.moving].min(initial=np.inf))

    def points(self, joints: Floats) -> Floats:
        """(N, n) → ends (N, P + 1, 3) of the capsules, one after the other."""
        return wire_frame(self.robot, self.tool_point, joints)


def body_of(robot: Robot, held: Tool) -> Body:
    """A robot with a tool: its capsule, or else a line from the flange to the TCP."""
    tip, thickness = held.X_flange_tool[:3, 3], 0.0
    if held.capsule is not None:
        tip, thickness = held.capsule.to, held.capsule.radius
    probes = _probes(robot)
    probed = wire_frame(robot, tip, _steps(probes))
    length = np.asarray(np.linalg.norm(np.diff(probed[:, 0], axis=-2), axis=-1).max(axis=0))
    links = len(length) - 1
    radii = np.zeros(links) if robot.body_radius is None else robot.body_radius[:links]
    radius = np.append(np.pad(radii, (0, links - len(radii))), thickness)
    present = np.append(np.ones(links, dtype=np.bool_), float(length[-1]) > 0.0 or thickness > 0.0)
    seen = np.linalg.norm(probed[:, 1:] - probed[:, :1], axis=-1).max(axis=0) / _PROBE_STEP
    point_pace = _point_pace(robot, seen.T, length)
    part_pace = np.maximum(point_pace[:-1], point_pace[1:])
    pairs = _pairs(length, radius, present)
    if robot.body_radius is None:
        pairs = pairs[:0]
    return Body(
        robot=robot,
        tool_point=tip,
        names=(*(f"link {k + 1}" for k in range(links)), "the tool"),
        radius=radius,
        moving=np.flatnonzero((part_pace > _STILL).any(axis=1) & present),
        pairs=pairs,
        part_pace=part_pace,
        pair_pace=_pair_pace(probed, pairs, part_pace),
        pace=np.asarray(part_pace.max(axis=0)),
        chain=chain_of(robot, tip, seen > _STILL, probes),
    )


def _probes(robot: Robot) -> Floats:
    """Joints (S, n) all over the ranges: multiples of irrational numbers fill them evenly."""
    lower, upper = robot.limits.lower, robot.limits.upper
    spread = np.sqrt(np.arange(2.0, 2.0 + robot.joint_count))
    probes: Floats = lower + (upper - lower) * np.modf(np.arange(1.0, _PROBES + 1.0)[:, None] * spread)[0]
    return probes


def _steps(probes: Floats) -> Floats:
    """(S, 1 + n, n): the probes, and each joint of theirs moved by a step."""
    moved = probes[:, None] + _PROBE_STEP * np.eye(probes.shape[1])
    return np.concatenate((probes[:, None], moved), axis=1)


def _point_pace(robot: Robot, seen: Floats, length: Floats) -> Floats:
    """Bound (K, n) on the speeds of the points, seen at up to (K, n): the chain from the joint to the point,
    stretched out.

    The last point that a joint leaves in place lies on its axis, in every family; that no speed seen is
    above the bound is taken care of all the same.
    """
    pace = np.where(seen > _STILL, seen, 0.0)
    chain = np.concatenate(([0.0], np.cumsum(length)))
    for joint in np.flatnonzero(~robot.prismatic & pace.any(axis=0)).tolist():
        first = int(np.argmax(pace[:, joint] > 0.0))
        stretched = chain - chain[max(first - 1, 0)]
        pace[first:, joint] = np.maximum(pace[first:, joint], stretched[first:])
    return pace


def _pair_pace(probed: Floats, pairs: Ints, part_pace: Floats) -> Floats:
    """Bound (C, n) on the speed of the outer capsule of each pair, seen from the inner one.

    A joint that changes no distance between their ends does not change how the two lie to each other.
    """
    ends = np.stack((pairs, pairs + 1), axis=-1)  # (C, 2, 2): pair, inner or outer, its ends
    inner, outer = probed[:, :, ends[:, 0]], probed[:, :, ends[:, 1]]  # (S, 1 + n, C, 2, 3)
    between = np.linalg.norm(inner[..., :, None, :] - outer[..., None, :, :], axis=-1)
    change = np.abs(between[:, 1:] - between[:, :1]).max(axis=(0, 3, 4), initial=0.0).T / _PROBE_STEP
    return np.where(change > _STILL, part_pace[pairs[:, 1]], 0.0)


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
