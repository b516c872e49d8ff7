"""Which joints a motion ends in: the choice among solutions of an MJ, the continuous end of a path move.

Both look at the geometry as programmed, without round edges, so that stepping and automatic running
end in the same joints.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from viapoint.runtime.kernel.axispath import AxisPath
from viapoint.runtime.kernel.failure import JointJump, PlanningError
from viapoint.runtime.kernel.fitting import TURNS_ONLY
from viapoint.runtime.kernel.spans import divide
from viapoint.runtime.kernel.stretch import FlangePath, Stretch
from viapoint.runtime.path import Poses
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot
from viapoint.runtime.rotations import matrix_to_quaternion

_SHARES: Final = np.linspace(0.0, 1.0, 17)
"""Samples on a path move whose joints turn little; others are followed as finely as it takes."""

_LARGEST_STEP: Final = 0.5
"""rad between samples; more, and a turn could be misread."""

_TIE: Final = 1e-9
"""Distances closer than this are a tie: among solutions of an MJ the start decides, among the branches that
leave a singular pose the order of the configurations."""

HELD_TURN: Final = 1e-9
"""rad. Free joints that must turn by more than this before the TCP can leave a singular pose do so first."""

_HELD_POSE: Final = 1e-9
"""m and rad by which the pose may differ in which joints turn: as far as a path may be off."""

_SAME_ARM: Final = 1e-6
"""rad. Branches that meet in a singular pose have the same joints there but for rounding."""


def motion_target(
    robot: Robot, X_base_flange: Floats, q_start: Floats, references: Floats, line: int
) -> Floats:
    """Joints (n,) of an MJ to a pose: nearest to the references (NaN: none), then to the start."""
    solutions, _ = robot.inside(X_base_flange, q_start)
    if len(solutions) == 0:
        raise _no_solution(robot, X_base_flange, line)
    named = ~np.isnan(references)
    if not named.any():
        return np.array(solutions[0])  # they come sorted by distance to the start
    weights = np.where(named, 1.0 / robot.limits.speed, 0.0)
    distances = np.linalg.norm((solutions - np.where(named, references, 0.0)) * weights, axis=1)
    # the first of the tied ones is the nearest to the start
    return np.array(solutions[np.argmax(distances <= distances.min() + _TIE)])


class PathEnd(NamedTuple):
    """Where a path move ends: joints (n,), flange pose (4, 4); the configuration in which it leaves.

    `sure` if the way stays so far from singular poses that rounding the path cannot change the joints at its
    end by a turn.
    """

    q: Floats
    X_base_flange: Floats
    configuration: int
    sure: bool


def end_joints(robot: Robot, stretch: Stretch, q_start: Floats, margin: float) -> PathEnd:
    """The end of a path move from q_start, followed continuously. Raises PlanningError where that fails.

    `margin`, m, is how far the path as rounded may be from this one.
    """
    X = stretch.flange_poses(stretch.length * _SHARES)
    configuration, q_leaving = leaving_singular(robot, stretch, q_start, X_start=X[:1])
    q, reachable, free = robot.ik_path(X, configuration, q_leaving)
    if reachable.all() and not free and np.abs(q[1:] - q[:-1]).max() < _LARGEST_STEP:
        sure = float(robot.kinematics.clearance(q).min()) > margin
        return PathEnd(q[-1], X[-1], configuration, sure)
    try:
        q_end = _followed(robot, stretch, configuration, q_leaving)
    except JointJump as jump:
        turned = held_turn(robot, q_leaving, jump)
        if turned is None:
            raise
        q_end = _followed(robot, stretch, configuration, turned)
    return PathEnd(q_end, X[-1], configuration, sure=False)


def _followed(robot: Robot, stretch: Stretch, configuration: int, q_start: Floats) -> Floats:
    """Joints (n,) at the end, followed just closely enough to count turns; a failure is looked at closely."""
    axes = AxisPath(robot, q_start)
    try:
        axes.follow(stretch, configuration, (True, True), TURNS_ONLY)
    except PlanningError:
        axes = AxisPath(robot, q_start)
        axes.follow(stretch, configuration, (True, True))
    return axes.q_end


def held_turn(robot: Robot, q: Floats, jump: JointJump) -> Floats | None:
    """Joints (n,) to which the robot turns from q with the TCP held to go on; None: there are none.

    A pose may be so near to a singular one that the path stops in it by its real joints and leaves it as if
    it was singular.
    """
    if jump.place > 0.0 or jump.joints is None or np.abs(jump.joints - q).max() <= HELD_TURN:
        return None
    before, after = robot.fk(np.stack((q, jump.joints)))
    return jump.joints if np.abs(before - after).max() <= _HELD_POSE else None


def tcp_kinematics(robot: Robot, X_flange_tool: Floats) -> Callable[[Floats], Poses]:
    """Forward kinematics (N, n) → TCP poses with a tool."""

    def fk(q: Floats) -> Poses:
        X = robot.fk(q) @ X_flange_tool
        return Poses(X[:, :3, 3], matrix_to_quaternion(X[:, :3, :3]))

    return fk


def leaving_singular(
    robot: Robot,
    path: FlangePath,
    q_start: Floats,
    preferred: int | None = None,
    X_start: Floats | None = None,
) -> tuple[int, Floats]:
    """Configuration in which a path is followed from q_start (n,), and the joints (n,) it starts in.

    Away from singularities that is q_start itself. In a singular pose the path prescribes where its free
    joints must point: of the branches that leave along it, the one nearest in joint motion is taken, or that
    of the `preferred` configuration if it is among them. `X_start` (1, 4, 4) spares finding the flange there.
    """
    w = np.zeros(1)
    X = path.flange_poses(w) if X_start is None else X_start
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
