"""Which joints a motion ends in: the choice among solutions of an MJ, the continuous end of a path move.

Both look at the geometry as programmed, without round edges, so that stepping and automatic running
end in the same joints.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from viapoint.runtime.kernel.axispath import AxisPath
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.kernel.spans import divide
from viapoint.runtime.kernel.stretch import FlangePath, Stretch
from viapoint.runtime.path import Poses
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot
from viapoint.runtime.rotations import matrix_to_quaternion

_SAMPLES: Final = 17
"""On a path move whose joints turn little; others are followed as finely as it takes."""

_LARGEST_STEP: Final = 0.5
"""rad between samples; more, and a turn could be misread."""

_TIE: Final = 1e-9
"""Distances closer than this are a tie: among solutions of an MJ the start decides, among the branches that
leave a singular pose the order of the configurations."""

_SAME_ARM: Final = 1e-6
"""rad. Branches that meet in a singular pose have the same joints there but for rounding."""


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


class PathEnd(NamedTuple):
    """Where a path move ends: joints (n,), flange pose (4, 4); the configuration in which it leaves.

    `sure` if joints turn so little on the way that rounding the path cannot change them at its end.
    """

    q: Floats
    X_base_flange: Floats
    configuration: int
    sure: bool


def end_joints(robot: Robot, stretch: Stretch, q_start: Floats) -> PathEnd:
    """The end of a path move from q_start, followed continuously. Raises PlanningError where that fails."""
    configuration, q_leaving = leaving_singular(robot, stretch, q_start)
    X = stretch.flange_poses(np.linspace(0.0, stretch.length, _SAMPLES))
    q, reachable = robot.ik_path(X, configuration, q_leaving)
    smooth = reachable.all() and np.abs(np.diff(q, axis=0)).max() < _LARGEST_STEP
    if smooth and not robot.kinematics.free_joint(X, q).any():
        return PathEnd(q[-1], X[-1], configuration, sure=True)
    axes = AxisPath(robot, q_leaving)
    axes.follow(stretch, configuration, (True, True))
    return PathEnd(axes.q_end, X[-1], configuration, sure=False)


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
    joints must point: of the branches that leave along it, the one nearest in joint motion is taken, or that
    of the `preferred` configuration if it is among them.
    """
    w = np.zeros(1)
    X = path.flange_poses(w)
    if not robot.kinematics.free_joint(X, q_start[None])[0]:
        return int(robot.configuration(q_start)), q_start
    best: tuple[float, int, Floats] | None = None
    for index in range(len(robot.kinematics.configurations)):
        held, reachable = robot.ik_branch(X, index, q_start)
        if not reachable[0] or np.abs(held[0] - q_start).max() > _SAME_ARM:
            continue  # another arm altogether, which cannot be turned into with the TCP held
        first = divide(robot, path, index, q_start, (True, True), choose=False).spans[0]
        q, _, _ = first.joints(robot, w, w - first.centre, q_start)
        distance = -1.0 if index == preferred else robot.distance(q[0], q_start)
        if best is None or distance < best[0] - _TIE:
            best = (distance, index, q[0])
    return (best[1], best[2]) if best is not None else (int(robot.configuration(q_start)), q_start)


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
