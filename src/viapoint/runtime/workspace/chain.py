"""A robot's wire frame as a chain of turns and slides: found from its kinematics, whatever its family is.

With the joints at 0 every joint turns about a line, or slides along a direction, that is fixed in the base;
the joints are applied one after the other (a product of exponentials). Not every mechanism is such a chain:
what is found is checked against the robot's own kinematics.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.records import Bools, Floats, Ints
from viapoint.runtime.robots import Robot

_EXACT: Final = 1e-10
"""m (or rad) by which the chain may miss: joints kept as polynomials place a link no better."""


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Joints at 0: `cross` (n, 3, 3) with cross·x = axis × x for a turn; `point` (n, 3) on its axis, m.

    For a slide `cross` is 0 and `slide` (n, 3) its direction. Point k of the frame is at `home[k]` and goes
    with the first `carried[k]` joints; the flange is turned by `R_base_flange` (3, 3).
    """

    cross: Floats
    point: Floats
    slide: Floats
    home: Floats
    carried: Ints
    R_base_flange: Floats

    def place(self, q: Floats) -> tuple[Floats, Floats]:
        """Joints (N, n) → points (N, K, 3) in the base, R_base_flange (N, 3, 3)."""
        R, t = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3))
        points = np.empty((len(q), *self.home.shape))
        for joint in range(len(self.cross) + 1):
            mine = self.carried == joint
            points[:, mine] = np.einsum("nij,kj->nki", R, self.home[mine]) + t[:, None]
            if joint < len(self.cross):
                K, angle = self.cross[joint], q[:, joint, None, None]
                turn = np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)
                shift = q[:, joint, None] * self.slide[joint] - turn @ self.point[joint]
                t = t + np.einsum("nij,nj->ni", R, shift)
                R = R + R @ turn
        return points, R @ self.R_base_flange


def chain_of(robot: Robot, tip: Floats, moved: Bools, probes: Floats) -> Chain | None:
    """The chain of a robot with the wire frame's last point at `tip` (3,) in its flange, m.

    `moved` (n, K): which joint moves which point.
    None where it misses what the robot says at the joints `probes` (N, n): it is no such chain.
    """
    n = robot.joint_count
    q = np.concatenate((np.zeros((1, n)), np.eye(n)))
    X = robot.fk(q)
    R = X[1:, :3, :3] @ X[0, :3, :3].T
    shift = X[1:, :3, 3] - np.einsum("nij,j->ni", R, X[0, :3, 3])
    turns = ~robot.prismatic[:, None]
    spin = 0.5 * np.stack(
        (R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=-1
    )
    axis = np.where(turns, spin / np.sin(1.0), 0.0)
    point = np.where(turns, 0.5 * (shift + np.cross(axis, shift) / np.tan(0.5)), 0.0)
    frame = wire_frame(robot, tip, np.concatenate((q[:1], probes)))
    chain = Chain(
        cross=np.cross(np.eye(3), axis[:, None]),
        point=point,
        slide=np.where(turns, 0.0, shift),
        home=frame[0],
        carried=np.where(moved, np.arange(1, n + 1)[:, None], 0).max(axis=0),
        R_base_flange=X[0, :3, :3],
    )
    points, turned = chain.place(probes)
    missed = np.abs(points - frame[1:]).max(), np.abs(turned - robot.fk(probes)[:, :3, :3]).max()
    return chain if max(missed) < _EXACT else None


def wire_frame(robot: Robot, tip: Floats, q: Floats) -> Floats:
    """(..., n) → (..., K, 3) m: the robot's link points, and the tip (3,) in its flange."""
    X = robot.fk(q)
    end = X[..., :3, 3] + X[..., :3, :3] @ tip
    points: Floats = np.concatenate((robot.link_points(q), end[..., None, :]), axis=-2)
    return points
