"""What a robot is to the rest of the runtime: its kinematics, limits and joint solutions. Immutable.

One `Robot` serves every family; the formulas stand in the module of the family, behind `Kinematics`.
Metres and radians; poses are of the flange in the robot's base. Tools, frames and where the robot
stands in its cell are not known here.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

from viapoint.runtime.core import chosen

if TYPE_CHECKING:
    from viapoint.runtime.robots.dynamics import LinkMasses

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Complexes = npt.NDArray[np.complex128]

TURN = 2.0 * math.pi
# A joint standing on the end of its range, up to the rounding of degrees and of the IK, is inside it.
RANGE_TOLERANCE = 1e-9
# Solutions closer than this (rad or m) are one: what rounding leaves of a double root.
SAME_SOLUTION = 1e-7
_CORE = "robots._inside"


@dataclass(frozen=True, slots=True, eq=False)
class JointLimits:
    """Per joint, (n,) each: range in rad or m, and the magnitudes of its first three derivatives."""

    lower: Floats
    upper: Floats
    speed: Floats
    acceleration: Floats
    jerk: Floats

    def contain(self, q: Floats) -> Bools:
        """(..., n) → (..., n): which joints are inside their range."""
        inside: Bools = (q >= self.lower - RANGE_TOLERANCE) & (q <= self.upper + RANGE_TOLERANCE)
        return inside


@dataclass(frozen=True, slots=True, eq=False)
class IkSolutions:
    """Every branch of the inverse kinematics: q (..., b, n), valid (..., b). Invalid rows mean nothing."""

    q: Floats
    valid: Bools


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """One way to stand at a pose: joints (n,), the index of its configuration and its names."""

    joints: Floats
    configuration: int
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SingularityReport:
    """How far joints are from each singularity (0: at it; units are the family's), which they are at."""

    measures: Mapping[str, float]
    singular: tuple[str, ...]


class Kinematics(Protocol):
    """The formulas of one robot of a family. Shapes as in `Robot`, whose methods say what they mean."""

    @property
    def configurations(self) -> tuple[tuple[str, ...], ...]: ...
    def fk(self, q: Floats) -> Floats: ...
    def tcp(self, q: Floats, X_flange_tool: Floats) -> tuple[Floats, Floats]: ...
    def jacobian(self, q: Floats) -> Floats: ...
    def link_points(self, q: Floats) -> Floats: ...
    def ik(self, X: Floats, reference: Floats | None = None) -> IkSolutions: ...
    def ik_branch(
        self, X: Floats, configuration: int | Ints, reference: Floats, given: tuple[int, ...] = ()
    ) -> tuple[Floats, Bools]: ...
    def free_joint(self, X: Floats, q: Floats) -> Bools: ...
    def clearance(self, q: Floats) -> Floats:
        """(N, n) → (N,) m: about how far the arm has to move to a pose that leaves a joint free."""
        ...

    @property
    def free_joints(self) -> tuple[int, ...]:
        """The joints that singular poses leave free, each found before the next."""
        ...

    def free_vectors(self, X: Floats, q: Floats, configuration: int) -> Complexes:
        """(N, 4, 4), solutions (N, n) → (N, k): a plane vector x + i·y for each free joint.

        The joint is its argument (up to full turns) in that configuration; it vanishes where the joint is
        free. It depends on the pose and the free joints before it.
        """
        ...

    def beyond(self, configuration: int, joint: int) -> int:
        """The configuration in which joints that run on smoothly leave the singular pose of a free joint."""
        ...

    def configuration(self, q: Floats) -> Ints: ...
    def singularity(self, q: Floats) -> SingularityReport: ...


@dataclass(frozen=True, slots=True, eq=False)
class Robot:
    """A robot: name, family, kinematics, limits; `prismatic` (n,) marks the joints in metres.

    `coupling` (n, n) relates the motors to the joints (F 3-16, 4-34): joints = coupling · motors.
    """

    name: str
    family: str
    kinematics: Kinematics
    limits: JointLimits
    prismatic: Bools
    coupling: Floats
    body_radius: Floats | None = None  # (k,) m, of the capsule along each link of the wire frame
    masses: LinkMasses | None = None  # of the links, where they are known
    joint_count: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "joint_count", len(self.prismatic))

    def with_limits(self, limits: JointLimits) -> Robot:
        """The same robot under other limits."""
        return replace(self, limits=limits)

    def fk(self, q: npt.ArrayLike) -> Floats:
        """Forward kinematics: q (..., n) → X_base_flange (..., 4, 4)."""
        return self.kinematics.fk(np.asarray(q, dtype=np.float64))

    def tcp(self, q: Floats, X_flange_tool: Floats) -> tuple[Floats, Floats]:
        """Joints (N, n) and a tool (4, 4) → positions (N, 3) and quaternions (N, 4) of its TCP."""
        return self.kinematics.tcp(q, X_flange_tool)

    def jacobian(self, q: npt.ArrayLike) -> Floats:
        """(..., n) → (..., 6, n): the flange's twist in the base frame per joint speed, linear rows first."""
        return self.kinematics.jacobian(np.asarray(q, dtype=np.float64))

    def link_points(self, q: npt.ArrayLike) -> Floats:
        """(..., n) → (..., k, 3) m: the wire frame, from the base to the flange, in the base frame."""
        return self.kinematics.link_points(np.asarray(q, dtype=np.float64))

    def ik(self, X_base_flange: Floats) -> IkSolutions:
        """(..., 4, 4) → every branch, principal values −π … π, joint ranges ignored.

        Valid rows are distinct. Where a joint is free (a singular pose) a branch shows one of its
        infinitely many solutions.
        """
        return self.kinematics.ik(X_base_flange)

    def ik_branch(
        self,
        X_base_flange: Floats,
        configuration: int | Ints,
        reference: Floats,
        given: tuple[int, ...] = (),
    ) -> tuple[Floats, Bools]:
        """One branch: (N, 4, 4), index or (N,), reference (n,) or (N, n) → q (N, n), reachable (N,).

        Every revolute joint takes the turn nearest to the reference. At a singular pose the free joint
        keeps the reference's value and the others make up for it; free joints that are `given` do so at
        every pose. Unreachable rows mean nothing.
        """
        q, reachable = self.kinematics.ik_branch(X_base_flange, configuration, reference, given)
        if (core := chosen(_CORE)) is not None:
            core.nearest_turns(
                q, np.ascontiguousarray(np.atleast_2d(reference)), self.prismatic.view(np.uint8)
            )
        else:
            q += np.where(self.prismatic, 0.0, TURN * np.rint((reference - q) / TURN))
        return q, reachable

    def ik_path(self, X_base_flange: Floats, configuration: int, start: Floats) -> tuple[Floats, Bools, bool]:
        """One branch along the rows of a path: as `ik_branch`, each row's reference the row before it.

        `start` (n,) is the reference of the first row. Also whether a joint is free in any of them.
        """
        q, reachable = self.ik_branch(X_base_flange, configuration, start)
        q = self._without_turns(q, start)
        held = np.flatnonzero(self.kinematics.free_joint(X_base_flange, q))
        for row in held:  # rare: the path stands on a singularity
            before = q[row - 1] if row else start
            q[row], _ = (
                part[0] for part in self.ik_branch(X_base_flange[row : row + 1], configuration, before)
            )
        return (self._without_turns(q, start) if len(held) else q), reachable, len(held) > 0

    def _without_turns(self, q: Floats, start: Floats) -> Floats:
        """(N, n) with jumps of full turns between the rows, and before the first, taken out."""
        if (core := chosen(_CORE)) is not None:
            return np.asarray(core.without_turns(q, start, self.prismatic.view(np.uint8)))
        steps = q - np.concatenate((start[None], q[:-1]))
        turns = np.where(self.prismatic, 0.0, np.rint(steps / TURN))
        if not turns.any():
            return q
        result: Floats = q - TURN * np.cumsum(turns, axis=0)
        return result

    def solutions(self, X_base_flange: Floats, *, reference: Floats | None = None) -> list[Solution]:
        """Every solution inside the joint ranges for one pose (4, 4), full turns included.

        With a reference (n,) the nearest comes first, joint distances in units of each joint's speed limit,
        and the free joints of a singular pose keep the reference's values.
        """
        joints, indices = self.inside(X_base_flange, reference)
        return [
            Solution(q, index, self.configuration_names(index))
            for q, index in zip(joints, indices.tolist(), strict=True)
        ]

    def inside(self, X_base_flange: Floats, reference: Floats | None) -> tuple[Floats, Ints]:
        """Joints (K, n) of the `solutions` for one pose (4, 4), in their order; their configurations (K,)."""
        branches = self.kinematics.ik(X_base_flange, reference)
        lower, upper = self.limits.lower - RANGE_TOLERANCE, self.limits.upper + RANGE_TOLERANCE
        core = chosen(_CORE)
        if core is None:
            joints, indices = self._turned(branches.q, _distinct(branches), lower, upper)
        else:
            rows = core.distinct(branches.q, branches.valid.view(np.uint8))
            joints, indices = core.turned(branches.q, rows, lower, upper, self.prismatic.view(np.uint8))
        if reference is None:
            return joints, indices
        if core is None:
            steps = (joints - reference) / self.limits.speed
            order = np.argsort(np.sqrt((steps * steps).sum(axis=1)), kind="stable")
        else:
            order = core.nearest_first(joints, np.ascontiguousarray(reference), self.limits.speed)
        return joints[order], indices[order]

    def _turned(self, q: Floats, chosen: Ints, lower: Floats, upper: Floats) -> tuple[Floats, Ints]:
        """All joints (K, n) that differ from one of the chosen rows of q (N, n) by full turns and lie from
        lower to upper (n,); and of which row each is (K,).
        """
        lower, upper = lower - q[chosen], upper - q[chosen]
        first, last = np.ceil(lower / TURN), np.floor(upper / TURN)
        outside = (lower > 0.0) | (upper < 0.0)
        first, last = (np.where(self.prismatic, end, x) for end, x in ((0.0, first), (0.0 - outside, last)))
        turns = [
            (row, *each)
            for row, least, most in zip(chosen.tolist(), first.tolist(), last.tolist(), strict=True)
            for each in itertools.product(*map(_through, least, most))
        ]
        every = np.array(turns, dtype=np.float64).reshape(-1, 1 + self.joint_count)
        rows = every[:, 0].astype(np.int64)
        return q[rows] + TURN * every[:, 1:], rows

    def distance(self, a: Floats, b: Floats) -> float:
        """Length of the joint move from a to b (n,), every joint in units of its speed limit: s."""
        steps = (a - b) / self.limits.speed
        return math.sqrt(float((steps * steps).sum()))

    def configuration(self, q: npt.ArrayLike) -> Ints:
        """(..., n) → (...) index of the branch that `ik_branch` must be given to come back to q."""
        return self.kinematics.configuration(np.asarray(q, dtype=np.float64))

    def configuration_names(self, index: int) -> tuple[str, ...]:
        """The family's names of a configuration, such as FRONT, UP, POSITIVE."""
        return self.kinematics.configurations[index]

    def singularity(self, q: npt.ArrayLike) -> SingularityReport:
        """Which singularities the joints (n,) stand at, and how far they are from each."""
        return self.kinematics.singularity(np.asarray(q, dtype=np.float64))

    def manipulability(self, q: npt.ArrayLike) -> Floats:
        """(..., n) → (...) Yoshikawa's measure √det(J·Jᵀ); 0 where a direction is lost."""
        J = self.jacobian(q)
        measure: Floats = np.sqrt(np.maximum(np.linalg.det(J @ np.swapaxes(J, -1, -2)), 0.0))
        return measure

    def motors_to_joints(self, motors: npt.ArrayLike) -> Floats:
        """(..., n) motor angles seen at the joints → (..., n) joints (F 3-16, 3-17)."""
        joints: Floats = np.asarray(motors, dtype=np.float64) @ self.coupling.T
        return joints

    def joints_to_motors(self, q: npt.ArrayLike) -> Floats:
        """(..., n) joints → (..., n) motors (F 4-34, 4-35)."""
        joints = np.asarray(q, dtype=np.float64)[..., None]
        return np.asarray(np.linalg.solve(self.coupling, joints)[..., 0], dtype=np.float64)


def _distinct(branches: IkSolutions) -> Ints:
    """The valid branches that are none of those before them: at a singular pose branches meet."""
    valid = np.flatnonzero(branches.valid)
    q = branches.q[valid]
    same = np.abs(q[:, None] - q).max(axis=2) < SAME_SOLUTION
    result: Ints = valid[~np.tril(same, -1).any(axis=1)]
    return result


def _through(first: float, last: float) -> range:
    return range(int(first), int(last) + 1)
