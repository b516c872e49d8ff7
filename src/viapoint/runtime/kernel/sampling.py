"""From spans of path to values at nodes: poses, inverse kinematics, lengths. Stateless.

One batch of inverse kinematics serves the nodes of many cells, since numpy's cost per call would
otherwise outweigh the arithmetic.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from viapoint.runtime.kernel.chebyshev import NODES, integrals
from viapoint.runtime.kernel.failure import OutOfReach
from viapoint.runtime.kernel.spans import Span
from viapoint.runtime.kernel.stretch import Stretch
from viapoint.runtime.path import Space
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.robots import Robot


class NearSingular(Exception):
    """A path that was taken for ordinary meets or nearly meets a singular pose: it has to be divided."""


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

    `stretches` says which stretch each span belongs to. Joints are continuous within each cell and lengths
    count from its start; cells are chained by the caller. Raises OutOfReach where a pose is,
    NearSingular where a joint is free that no bearing of the span decides.
    """
    groups = [_Nodes(stretches[k], spans[k], group) for k, group in _grouped(cells)]
    shape = (len(cells), len(NODES), -1)
    q = np.concatenate(_joints(robot, groups, reference)).reshape(shape)
    turning = np.flatnonzero(~robot.prismatic)
    q[:, :, turning] = np.unwrap(q[:, :, turning], axis=1)
    rates = np.concatenate([g.stretch.rates(g.w) * g.rate[:, None] for g in groups]).reshape(shape)
    lengths = integrals(rates, np.array([cell.width for cell in cells]))
    if stretches[0].curve.segment.auxiliary is None:
        return np.concatenate((q, lengths), axis=2)
    auxiliary = np.concatenate([g.stretch.curve.auxiliary(g.w) for g in groups]).reshape(shape)
    return np.concatenate((q, auxiliary, lengths), axis=2)


def _grouped(cells: Sequence[Cell]) -> list[tuple[int, list[Cell]]]:
    groups: dict[int, list[Cell]] = {}
    for cell in cells:
        groups.setdefault(cell.span, []).append(cell)
    return list(groups.items())


class _Nodes:
    """The nodes of some cells of one span: places w, x and dw/du there, (N,) each."""

    def __init__(self, stretch: Stretch, span: Span, cells: Sequence[Cell]) -> None:
        self.stretch = stretch
        self.span = span
        starts = np.array([c.start for c in cells])
        widths = np.array([c.width for c in cells])
        self.w, self.x, self.rate = span.places((starts[:, None] + widths[:, None] * NODES).ravel())


def _joints(robot: Robot, groups: Sequence[_Nodes], reference: Floats) -> list[Floats]:
    """Joints (N, n) at the nodes of each group; those of ordinary spans from one batch."""
    found: list[Floats | None] = [None] * len(groups)
    ordinary = []
    for k, group in enumerate(groups):
        if group.stretch.curve.space is Space.JOINT:
            found[k] = group.stretch.curve.joints(group.w)
        elif group.span.bearings:
            q, reachable, _ = group.span.joints(robot, group.w, group.x, reference)
            _require_reach(group, reachable)
            found[k] = q
        else:
            ordinary.append(k)
    if ordinary:
        together = _ordinary_joints(robot, [groups[k] for k in ordinary], reference)
        for k, q in zip(ordinary, together, strict=True):
            found[k] = q
    return [q for q in found if q is not None]


def _ordinary_joints(robot: Robot, groups: Sequence[_Nodes], reference: Floats) -> list[Floats]:
    X = np.concatenate([g.stretch.flange_poses(g.w) for g in groups])
    counts = [len(g.w) for g in groups]
    configurations = [g.span.configuration for g in groups]
    one = len(set(configurations)) == 1
    q, reachable = robot.ik_branch(
        X, configurations[0] if one else np.repeat(configurations, counts), reference
    )
    ends = np.cumsum(counts)[:-1]
    for group, inside in zip(groups, np.split(reachable, ends), strict=True):
        _require_reach(group, inside)
    if robot.kinematics.free_joint(X, q).any():
        raise NearSingular
    return np.split(q, ends)


def _require_reach(group: _Nodes, reachable: Bools) -> None:
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
