"""Which joints a motion ends in: the choice among solutions of an MJ, the continuous end of a path move.

Both look at the geometry as programmed, without round edges, so that stepping and automatic running
end in the same joints.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.kernel.sampling import Curve, FlangePath
from viapoint.runtime.path import Poses
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot
from viapoint.runtime.rotations import matrix_to_quaternion

_FIRST_SAMPLES: Final = 17
_MOST_SAMPLES: Final = 4097
_LARGEST_STEP: Final = 0.5
"""rad between samples; more, and the path is sampled more densely: a turn could be misread."""

_TIE: Final = 1e-9
"""Distances to the references closer than this are a tie, which the start decides."""


_BISECTIONS: Final = 52
"""Halvings that find a place on a path to the last digit."""

_HALF_JUMP: Final = 0.5 * np.pi
"""rad: joints further from those before a singular pose than this are behind it."""

_NUDGE: Final = 1e-5
"""m (or rad) from a singular pose at which the direction of its free joints is read."""


def motion_target(
    robot: Robot, X_base_flange: Floats, q_start: Floats, references: Floats, line: int
) -> Floats:
    """Joints (n,) of an MJ to a pose: nearest to the references (NaN: none), then to the start."""
    solutions = robot.solutions(X_base_flange, reference=q_start)
    if not solutions:
        raise _no_solution(robot, X_base_flange, line)
    named = ~np.isnan(references)
    weights = np.where(named, 1.0 / robot.limits.speed, 0.0)
    distances = [
        float(np.linalg.norm((s.joints - np.where(named, references, 0.0)) * weights)) for s in solutions
    ]
    best = min(distances)
    # solutions come sorted by distance to the start, so the first of the tied ones is the nearest
    return next(s.joints for s, d in zip(solutions, distances, strict=True) if d <= best + _TIE)


def end_joints(robot: Robot, path: FlangePath, q_start: Floats, line: int) -> tuple[Floats, Floats, int]:
    """Joints (n,) and flange pose (4, 4) in which a path move from q_start ends, followed continuously.

    Third, the configuration in which it leaves.
    """
    configuration, q_leaving = leaving_singular(robot, path, q_start)
    count = _FIRST_SAMPLES
    while True:
        X = path.flange_poses(np.linspace(0.0, path.length, count))
        q, reachable = robot.ik_path(X, configuration, q_leaving)
        if not reachable.all():
            raise _leaves_reach(path, (float(np.argmin(reachable)) - 1.0) / (count - 1), line)
        steps = np.abs(np.diff(q, axis=0)).max(axis=1)
        if steps.max() < _LARGEST_STEP:
            return q[-1], X[-1], configuration
        if count >= _MOST_SAMPLES:
            break
        count = 4 * (count - 1) + 1
    k = int(np.argmax(steps))
    w = singular_place(robot, path, configuration, q[k], np.array([k, k + 1.0]) * (path.length / (count - 1)))
    if w is None or not 0.0 < w < path.length:
        return q[-1], X[-1], configuration
    rest = FlangePath(_Rest(path.curve, w), path.X_tool_flange)
    return *end_joints(robot, rest, q[k], line)[:2], configuration


def tcp_kinematics(robot: Robot, X_flange_tool: Floats) -> Callable[[Floats], Poses]:
    """Forward kinematics (N, n) → TCP poses with a tool."""

    def fk(q: Floats) -> Poses:
        X = robot.fk(q) @ X_flange_tool
        return Poses(X[:, :3, 3], matrix_to_quaternion(X[:, :3, :3]))

    return fk


def leaving_singular(
    robot: Robot, path: FlangePath, q_start: Floats, preferred: int | None = None
) -> tuple[int, Floats]:
    """Configuration in which a path is followed from q_start (n,), and the joints (n,) it starts in.

    Away from singularities that is q_start itself. In a singular pose the path prescribes where its free
    joints must point: of all branches that leave along it, the one nearest in joint motion is taken, or
    that of the `preferred` configuration if it is among them.
    """
    start = np.zeros(1)
    X = path.flange_poses(start)
    if not robot.kinematics.free_joint(X, q_start[None])[0]:
        return int(robot.configuration(q_start)), q_start
    nudge = min(_NUDGE, 0.25 * path.length)
    best: tuple[float, int, Floats] | None = None
    for index in range(len(robot.kinematics.configurations)):
        near, reachable = robot.ik_branch(path.flange_poses(start + nudge), index, q_start)
        far, also = robot.ik_branch(path.flange_poses(start + 2.0 * nudge), index, near)
        q, _ = robot.ik_branch(X, index, 2.0 * near - far)
        distance = -1.0 if index == preferred else robot.distance(q[0], q_start)
        if reachable[0] and also[0] and (best is None or distance < best[0]):
            best = (distance, index, q[0])
    return (best[1], best[2]) if best is not None else (int(robot.configuration(q_start)), q_start)


def singular_place(
    robot: Robot, path: FlangePath, configuration: int, reference: Floats, between: Floats
) -> float | None:
    """Where, `between` two places (2,), a path passes exactly through a singular pose; None if nowhere.

    Beside such a pose a joint of the configuration jumps by half a turn; another branch goes on smoothly.
    Free joints there are as in `reference` (n,).
    """

    def joints(w: float, reference: Floats) -> tuple[Floats, bool]:
        X = path.flange_poses(np.array([w]))
        q, _ = robot.ik_branch(X, configuration, reference)
        return q[0], bool(robot.kinematics.free_joint(X, q)[0])

    low, high = (float(w) for w in np.clip(between, 0.0, path.length))
    q_before, _ = joints(low, reference)
    for _ in range(_BISECTIONS):
        for w in (low, high):
            if joints(w, q_before)[1]:
                return w
        middle = 0.5 * (low + high)
        if np.abs(joints(middle, q_before)[0] - q_before).max() < _HALF_JUMP:
            low = middle
        else:
            high = middle
    return None


@dataclass(frozen=True)
class _Rest:
    """A curve from `begin` on."""

    curve: Curve
    begin: float

    @property
    def length(self) -> float:
        return self.curve.length - self.begin

    def poses(self, w: Floats) -> Poses:
        return self.curve.poses(self.begin + w)


def _no_solution(robot: Robot, X_base_flange: Floats, line: int) -> PlanningError:
    x, y, z = X_base_flange[:3, 3] * 1e3
    where = f"flange at X={x:.1f} Y={y:.1f} Z={z:.1f}"
    if robot.ik(X_base_flange).valid.any():
        return PlanningError(
            "E303",
            f"the target can only be reached with a joint outside its range ({where})",
            line,
            "turn the tool, or move the target towards the middle of the workspace",
        )
    return PlanningError(
        "E301", f"the target is out of reach ({where})", line, "check the point, the frame Z and the tool T"
    )


def _leaves_reach(path: FlangePath, fraction: float, line: int) -> PlanningError:
    length = path.length * 1e3
    return PlanningError(
        "E302",
        f"the path leaves the robot's reach after about {max(fraction, 0.0) * length:.0f} of {length:.0f} mm",
        line,
        "check the target, the frame Z and the tool T, or start from another configuration",
    )
