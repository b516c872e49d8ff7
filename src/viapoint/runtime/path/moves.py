"""What geometry is made from: one record per motion, both ends known. No curves yet, and no time.

SI units, radians, base frame, quaternions w x y z.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum, unique
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def _base_z() -> Floats:
    return np.array([0.0, 0.0, 1.0])


@unique
class MoveKind(Enum):
    """The shapes a motion can have."""

    LINE = "line"
    CIRCLE = "circle"
    SPLINE = "spline"
    JOINT = "joint move"


@unique
class Space(Enum):
    """Where a curve is defined: as poses of the TCP, or as joint values."""

    POSE = "pose"
    JOINT = "joint"


class Poses(NamedTuple):
    """N poses of the TCP in the base frame."""

    position: Floats  # (N, 3) m
    quaternion: Floats  # (N, 4) w x y z


@dataclass(frozen=True, slots=True)
class Pose:
    """One pose of the TCP in the base frame."""

    position: Floats  # (3,) m
    quaternion: Floats | None  # (4,) w x y z; None only where an orientation is optional


@dataclass(frozen=True, slots=True)
class Corner:
    """How a motion passes into the next one.

    `stop` forces an exact stop; `radius` is R: the distance before and after the corner at which the
    round edge begins and ends, in m of TCP path (between two joint moves `joint_radius` in its place),
    0 for an exact stop, None where none was programmed.
    """

    stop: bool = False
    radius: float | None = None
    joint_radius: float | None = None  # R in rad, where both motions are joint moves; None: as `radius`

    @property
    def halts(self) -> bool:
        """An exact stop whatever the geometry is."""
        return self.stop or self.radius == 0.0

    def radius_between(self, left: Space, right: Space) -> float | None:
        """R in the measure that motions in these spaces share."""
        if left is right is Space.JOINT and self.joint_radius is not None:
            return self.joint_radius
        return self.radius


@dataclass(frozen=True, slots=True)
class Tangential:
    """How the tool of a motion keeps to its tangent: `offset` rad from the heading in the frame's X-Y plane.

    The orientations of such a motion are given without their heading (`path.tangential`); `before` is the
    one that the robot really has where its path begins at rest.
    """

    R_base_frame: Floats  # (3, 3)
    offset: float
    before: Floats  # (4,)


Kinematics = Callable[[Floats], Poses]  # joints (N, n) rad or m → pose of the TCP


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """One motion as the planner hands it over."""

    kind: MoveKind
    tag: int  # the caller's number of the motion; every piece of path keeps it
    start: Pose
    target: Pose
    via: Pose | None = None  # CIRCLE: Q, its orientation optional
    angle: float | None = None  # CIRCLE: H in rad, signed
    q_start: Floats | None = None  # JOINT: (n,)
    q_target: Floats | None = None  # JOINT: (n,)
    joint_weights: Floats | None = None  # JOINT: (n,) rad of joint-space length per rad or m; None: ones
    fk: Kinematics | None = None  # JOINT: with the tool of this motion
    e_start: Floats | None = None  # (k,) m or rad, of the auxiliary axes; None: there are none
    e_target: Floats | None = None  # (k,)
    z_axis: Floats = field(default_factory=_base_z)  # (3,) +Z of the frame, decides half turns
    corner: Corner = Corner()
    tangential: Tangential | None = None


def require_finite(move: Move) -> None:
    """Raises ValueError where a move has a number that is not finite: it has no geometry."""
    numbers: list[Floats | None] = [move.q_start, move.q_target, move.e_start, move.e_target]
    for pose in (move.start, move.target, move.via):
        if pose is not None:
            numbers += [pose.position, pose.quaternion]
    given = [array for array in numbers if array is not None]
    if not np.isfinite(np.concatenate(given)).all() or not math.isfinite(move.angle or 0.0):
        raise ValueError(f"the {move.kind.value} {move.tag} has a number that is not finite")
