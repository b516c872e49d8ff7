"""From spans of path to values at nodes: poses, inverse kinematics, lengths. Stateless.

One batch serves the nodes of many cells, since a call would otherwise outweigh the arithmetic.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final, NamedTuple

import numpy as np

from viapoint.runtime.core import chosen
from viapoint.runtime.kernel.chebyshev import NODES, integrals
from viapoint.runtime.kernel.failure import OutOfReach
from viapoint.runtime.kernel.spans import Span
from viapoint.runtime.kernel.stretch import PathLimits, Stretch, flange_poses
from viapoint.runtime.path import PoseSegment, Space, cross, sample_segments
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.robots import Robot
from viapoint.runtime.rotations import invert_pose

_CORE: Final = "kernel._axes"


class NearSingular(Exception):
    """A path that was taken for ordinary meets or nearly meets a singular pose: it has to be divided.

    Of several that were asked for together, nothing like that was seen of the first `before`.
    """

    def __init__(self, before: int = 0) -> None:
        self.before = before


class Cell(NamedTuple):
    """An interval of a span, in its own parameter, that one polynomial shall represent."""

    span: int
    start: float
    width: float
    depth: int = 0  # halvings that led to it

    def halves(self) -> list[Cell]:
        """Two cells in its place."""
        half = 0.5 * self.width
        deeper = self.depth + 1
        return [Cell(self.span, self.start, half, deeper), Cell(self.span, self.start + half, half, deeper)]


def sample(
    robot: Robot,
    stretches: Sequence[Stretch],
    spans: Sequence[Span],
    cells: Sequence[Cell],
    reference: Floats,
) -> Floats:
    """Values (C, D+1, n+k+4) of joints, auxiliary axes and lengths at the nodes of cells, in order of spans.

    `stretches` says which stretch each span belongs to; they share a tool. Joints are continuous within each
    cell and lengths count from its start; cells are chained by the caller. Raises OutOfReach where a pose is,
    NearSingular where a joint is free that no bearing of the span decides.
    """
    widths = np.array([cell.width for cell in cells])
    groups = list(_groups(stretches, spans, cells, widths))
    shape = (len(cells), len(NODES), -1)
    q = np.empty((len(cells) * len(NODES), robot.joint_count))
    rates = np.empty((len(q), 2))
    for sampled in (_given, _guided, _ordinary):
        sampled(robot, groups, reference, q, rates)
    rates *= np.concatenate([group.rate for group in groups])[:, None]
    lengths = integrals(np.concatenate((_limited(groups, rates), rates), axis=1).reshape(shape), widths)
    if groups[0].stretch.curve.segment.auxiliary is None:
        return np.concatenate((_unwrapped(robot, q.reshape(shape)), lengths), axis=2)
    auxiliary = np.concatenate([g.stretch.curve.auxiliary(g.w) for g in groups]).reshape(shape)
    return np.concatenate((_unwrapped(robot, q.reshape(shape)), auxiliary, lengths), axis=2)


@dataclass(frozen=True, slots=True)
class _Group:
    """The nodes of the cells of one span: their rows among all, places w, x and dw/du there, (N,) each."""

    stretch: Stretch
    span: Span
    rows: slice
    w: Floats
    x: Floats
    rate: Floats

    @property
    def given(self) -> bool:
        """Whether the joints are."""
        return self.stretch.curve.space is Space.JOINT


def _groups(
    stretches: Sequence[Stretch], spans: Sequence[Span], cells: Sequence[Cell], widths: Floats
) -> Iterator[_Group]:
    starts = np.array([cell.start for cell in cells])
    u = (starts[:, None] + widths[:, None] * NODES).ravel()
    first = 0
    for number, group in groupby(cells, key=lambda cell: cell.span):
        last = first + len(NODES) * len(list(group))
        yield _Group(
            stretches[number], spans[number], slice(first, last), *spans[number].places(u[first:last])
        )
        first = last


def _given(robot: Robot, groups: Sequence[_Group], reference: Floats, q: Floats, rates: Floats) -> None:
    """Joints and TCP rates where the joints are given: the rates are those of the Jacobian."""
    given = [group for group in groups if group.given]
    if not given:
        return
    joints = np.concatenate([group.stretch.curve.joints(group.w) for group in given])
    speeds = np.concatenate([group.stretch.curve.joint_rates(group.w) for group in given])
    lever = invert_pose(given[0].stretch.X_tool_flange)[:3, 3]
    sizes = _tcp_rates(robot.jacobian(joints), speeds, robot.fk(joints), lever)
    first = 0
    for group in given:
        last = first + len(group.w)
        q[group.rows], rates[group.rows] = joints[first:last], sizes[first:last]
        first = last


def _tcp_rates(jacobian: Floats, speeds: Floats, X_base_flange: Floats, lever: Floats) -> Floats:
    """Speed and angular speed (N, 2) of a point `lever` (3,) off the flange, from Jacobians (N, 6, n), joint
    speeds (N, n) and poses (N, 4, 4).

    Summed in the order of the compiled module's, and not by matrix products: those round otherwise.
    """
    if (core := chosen(_CORE)) is not None:
        rows = np.ascontiguousarray(jacobian), speeds, np.ascontiguousarray(X_base_flange)
        return np.asarray(core.tcp_rates(*rows, np.ascontiguousarray(lever)))
    twist = jacobian[:, :, 0] * speeds[:, 0, None]
    for k in range(1, speeds.shape[1]):
        twist += jacobian[:, :, k] * speeds[:, k, None]
    R = X_base_flange[:, :3, :3]
    arm = R[:, :, 0] * lever[0] + R[:, :, 1] * lever[1] + R[:, :, 2] * lever[2]
    twist[:, :3] += cross(twist[:, 3:], arm)
    sizes: Floats = np.sqrt((twist * twist).reshape(-1, 2, 3).sum(axis=2))
    return sizes


def _guided(robot: Robot, groups: Sequence[_Group], reference: Floats, q: Floats, rates: Floats) -> None:
    """Joints and rates where bearings decide about free joints."""
    for group in groups:
        if group.span.bearings:
            q[group.rows], reachable, _ = group.span.joints(robot, group.w, group.x, reference)
            _require_reach(group, reachable)
            rates[group.rows] = np.stack(group.stretch.curve.rates(group.w), axis=1)


def _ordinary(robot: Robot, groups: Sequence[_Group], reference: Floats, q: Floats, rates: Floats) -> None:
    """Joints and rates of all other paths, in one batch."""
    chosen = [group for group in groups if not (group.given or group.span.bearings)]
    if not chosen:
        return
    pieces = [group.stretch.curve for group in chosen]
    segments = [piece.segment for piece in pieces if isinstance(piece.segment, PoseSegment)]
    counts = [len(group.w) for group in chosen]
    w = np.concatenate([piece.begin + group.w for piece, group in zip(pieces, chosen, strict=True)])
    poses, speeds = sample_segments(segments, counts, w)
    X = flange_poses(poses, chosen[0].stretch.X_tool_flange)
    configurations = [group.span.configuration for group in chosen]
    one = len(set(configurations)) == 1
    configuration = configurations[0] if one else np.repeat(configurations, counts)
    found, reachable = robot.ik_branch(X, configuration, reference)
    first = 0
    for group in chosen:
        last = first + len(group.w)
        _require_reach(group, reachable[first:last])
        q[group.rows], rates[group.rows] = found[first:last], speeds[first:last]
        first = last
    if robot.kinematics.free_joint(X, found).any():
        raise NearSingular


def _limited(groups: Sequence[_Group], rates: Floats) -> Floats:
    """The rates (N, 2) as far as path limits apply to them."""
    limited = rates.copy()
    for group in groups:
        if group.stretch.limits is not PathLimits.APPLY:
            limited[group.rows] *= group.stretch.limited_share(group.w)[:, None]
    return limited


def _unwrapped(robot: Robot, q: Floats) -> Floats:
    """Joints (C, D+1, n) without jumps of full turns inside the cells."""
    if np.abs(q[:, 1:] - q[:, :-1]).max() > np.pi:
        turning = np.flatnonzero(~robot.prismatic)
        q[:, :, turning] = np.unwrap(q[:, :, turning], axis=1)
    return q


def _require_reach(group: _Group, reachable: Bools) -> None:
    if not reachable.all():
        raise out_of_reach(group.stretch, float(group.w[np.argmin(reachable)]))


def out_of_reach(stretch: Stretch, w: float, verb: str = "leaves") -> OutOfReach:
    """The failure of a path that `verb` the robot's reach at w."""
    position, _ = stretch.curve.poses(np.array([w]))
    x, y, z = position[0] * 1e3
    return OutOfReach(
        "E302",
        f"the path {verb} the robot's reach after {w * 1e3:.1f} mm, at X={x:.1f} Y={y:.1f} Z={z:.1f}",
        stretch.line,
        "bring the path closer to the base, or check the tool and the frame",
    )
