"""From a motion as programmed (indices, mm, deg) to a move of the path (poses, joints, SI).

Fills in what a statement leaves out, chooses among joint solutions, and knows the joints at the end of
every motion. Errors name the line. Not here: what points, frames and tools are (`places`).
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.doubt import edge_in_doubt, rounding_margin
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.kernel.joints import end_joints, motion_target, tcp_kinematics
from viapoint.runtime.kernel.places import Places
from viapoint.runtime.kernel.speeds import UNBOUND, SpeedRule, speed_rule
from viapoint.runtime.kernel.stretch import PathLimits, Stretch
from viapoint.runtime.memo import Memo
from viapoint.runtime.path import (
    Corner,
    GeometryError,
    Move,
    MoveKind,
    Piece,
    Pose,
    Segment,
    Tangential,
    auxiliary_alone,
    end_pose,
    programmed,
    tangential_move,
)
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot
from viapoint.runtime.rotations import (
    abc_to_matrix,
    invert_pose,
    matrix_to_abc,
    matrix_to_quaternion,
    quaternion_to_matrix,
)
from viapoint.vm.ports import Motion, MotionKind, Target

_KINDS: Final = {
    MotionKind.LINE: MoveKind.LINE,
    MotionKind.CIRCLE: MoveKind.CIRCLE,
    MotionKind.SPLINE: MoveKind.SPLINE,
    MotionKind.JOINT: MoveKind.JOINT,
    MotionKind.HOME: MoveKind.JOINT,
}
_POSITION: Final = ("X", "Y", "Z")
_ROTATION: Final = ("A", "B", "C")
_SAME: Final = 9
"""Decimals by which two orientations are told apart."""


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a motion leaves the robot: joints (n,), flange X_base_flange (4, 4), auxiliary axes (k,)."""

    q: Floats
    X_base_flange: Floats
    e: Floats
    R_programmed: Floats | None = None
    """(3, 3) of the flange as programmed, where a tangential tool has another; None: as it is."""


@dataclass(frozen=True, slots=True)
class Tangency:
    """What a tangential tool leaves to the motions after it: its offset (rad), the orientation programmed."""

    offset: float | None = None
    R_programmed: Floats | None = None  # (3, 3)

    @property
    def key(self) -> tuple[float, ...]:
        """Equal for two that are one but for rounding; inf: none."""
        R = np.zeros(0) if self.R_programmed is None else np.round(self.R_programmed, _SAME).ravel() + 0.0
        return (np.inf if self.offset is None else self.offset, *R.tolist())


NO_TANGENCY: Final = Tangency()


@dataclass(frozen=True, slots=True)
class Resolved:
    """A motion ready for the path."""

    move: Move
    rule: SpeedRule
    X_flange_tool: Floats
    X_tool_flange: Floats
    end: Stand
    configuration: int | None = None
    """In which a path move leaves; the path as it will be rounded must not choose another."""
    segment: Segment | None = None
    """The move's geometry, where it has been made and needs no neighbours."""


class Resolver:
    """Resolves motions one after the other; `stand` is where the last one ends."""

    def __init__(self, cell: Cell, q_start: Floats) -> None:
        self.cell = cell
        self.robot: Robot = cell.robot
        self._auxiliary = AuxiliaryAxes.of(cell)
        self.stand = Stand(q_start, self.robot.fk(q_start), self._auxiliary.start)
        self.places = Places(cell)
        self.offset: float | None = None
        """rad between tool and heading while the tool is tangential; None: it is not."""
        self._joint_before = False
        self._known: Memo[tuple[Resolved, bool, bool]] = Memo()
        self._stops: Memo[bool] = Memo()
        self._targets: Memo[Floats] = Memo()
        self._inverse = (np.eye(4), np.eye(4))  # the last tool and X_tool_flange
        self._edge_before = 0.0  # R of the last motion, mm
        self._doubtful_end = False  # of a joint move, if a path motion follows
        self._sure = True  # that the joints are those in which the path as rounded will end

    def resolve(self, motion: Motion, tag: int) -> Resolved:
        """The move of `motion`, which starts where the last one ended. Raises PlanningError.

        It is tagged as when a motion like it was resolved for the first time.
        """
        found = self._known.get(self._key(motion), lambda: self._resolved(motion, tag))
        resolved, self._doubtful_end, self._sure = found
        self.stand = resolved.end
        self._edge_before = motion.round_edge or 0.0
        self._joint_before = resolved.move.kind is MoveKind.JOINT
        return resolved

    def _key(self, motion: Motion) -> Hashable:
        """All that resolving a motion depends on, besides the cell."""
        stand, R = self.stand, self.stand.R_programmed
        return (
            (motion.line, motion.kind, motion.target, motion.via, motion.speed, motion.angle),
            (motion.round_edge, *self.places.numbers(motion)),
            (stand.q.tobytes(), stand.X_base_flange.tobytes(), stand.e.tobytes()),
            None if R is None else R.tobytes(),
            (self.offset, self._joint_before, self._edge_before, self._doubtful_end, self._sure),
        )

    def _resolved(self, motion: Motion, tag: int) -> tuple[Resolved, bool, bool]:
        """The move, whether its end is doubtful, and whether the joints there are sure."""
        X_flange_tool = self.places.tool(motion.tool, motion.line)
        resolve = self._joint_move if _KINDS[motion.kind] is MoveKind.JOINT else self._path_move
        try:
            return resolve(motion, tag, X_flange_tool), self._doubtful_end, self._sure
        except GeometryError as error:
            raise PlanningError(error.code, error.message, motion.line) from None

    def begin_anew(self, q: Floats, e: Floats) -> None:
        """The robot stands in joints q (n,), auxiliary axes e (k,), wherever the last motion leads."""
        self.stand = Stand(q, self.robot.fk(q), e, self.stand.R_programmed)
        self._joint_before, self._sure = True, True

    @property
    def tangency(self) -> Tangency:
        """What a tangential tool has left."""
        return Tangency(self.offset, self.stand.R_programmed)

    def take_over(self, tangency: Tangency) -> None:
        """Go on where a tangential tool has left this."""
        self.offset = tangency.offset
        self.stand = replace(self.stand, R_programmed=tangency.R_programmed)

    @property
    def rides(self) -> bool:
        """Whether an auxiliary axis carries the robot."""
        return self._auxiliary.carrier is not None

    def rebase(self, q: Floats, shift: Floats) -> None:
        """The next motion starts in joints q (n,), in frames that are displaced by `shift` (3,) m."""
        self.begin_anew(q, self.stand.e)
        self.places.shift = shift

    def arrive(self, q: Floats) -> None:
        """The path as rounded stops here in joints q (n,).

        Beside a singular pose it may have gone another way round than the programmed one.
        """
        tangential = self.stand.R_programmed is not None
        X_base_flange = self.robot.fk(q) if tangential else self.stand.X_base_flange
        self.stand = replace(self.stand, q=q, X_base_flange=X_base_flange)
        self._sure = True

    def must_stop_before(self, motion: Motion) -> bool:
        """Whether the robot must stand still before a motion.

        Where a joint move has ended in a singular pose the free joints must turn first: no round edge can
        lead out of a joint move along which a joint stays free. A joint move behind a path beside a singular
        pose, or with a round edge beside one, starts from joints that are not sure until it is rounded. A
        tangential tool is aligned at rest behind a joint move, and its joints are known at rest only.
        """
        if _KINDS[motion.kind] is MoveKind.JOINT:
            return not self._sure or (not self._joint_before and self._begins_in_doubt(motion))
        if not self._joint_before:
            return False
        if self.offset is not None:
            return True
        stand = self.stand
        return bool(self.robot.kinematics.free_joint(stand.X_base_flange[None], stand.q[None])[0])

    def _begins_in_doubt(self, motion: Motion) -> bool:
        """Whether the round edge into a joint move may pass a singular pose on either side."""
        if self._edge_before == 0.0:
            return False
        return self._stops.get(self._key(motion), lambda: self._edge_in_doubt(motion))

    def _edge_in_doubt(self, motion: Motion) -> bool:
        e = self._auxiliary_target(motion)
        q_target = self._joint_target(motion, self.places.tool(motion.tool, motion.line), e)
        return edge_in_doubt(self.robot, self.stand.q, q_target, self._edge_before, 0)

    def _from_tool(self, X_flange_tool: Floats) -> Floats:
        """X_tool_flange (4, 4)."""
        if self._inverse[0] is not X_flange_tool:
            self._inverse = X_flange_tool, invert_pose(X_flange_tool)
        return self._inverse[1]

    def _joint_move(self, motion: Motion, tag: int, X_flange_tool: Floats) -> Resolved:
        e = self._auxiliary_target(motion)
        q_target = self._joint_target(motion, X_flange_tool, e)
        end = Stand(q_target, self.robot.fk(q_target), e)
        move = self._joint_line(motion, tag, X_flange_tool, end)
        self._doubtful_end = edge_in_doubt(self.robot, self.stand.q, q_target, motion.round_edge or 0.0, -1)
        rule = UNBOUND if auxiliary_alone(move) else speed_rule(motion, self.cell)
        tool = X_flange_tool, self._from_tool(X_flange_tool)
        return Resolved(move, rule, *tool, end, segment=programmed(move))

    def _joint_line(self, motion: Motion, tag: int, X_flange_tool: Floats, end: Stand) -> Move:
        move = Move(
            kind=MoveKind.JOINT,
            tag=tag,
            start=_pose(self.stand.X_base_flange @ X_flange_tool),
            target=_pose(end.X_base_flange @ X_flange_tool),
            q_start=self.stand.q,
            q_target=end.q,
            joint_weights=np.where(self.robot.prismatic, DEG / MM / self.cell.mm_per_deg, 1.0),
            fk=tcp_kinematics(self.robot, X_flange_tool),
            z_axis=self.places.frame(motion, end.e)[:3, 2],
            corner=_corner(motion),
        )
        return self._with_auxiliary(move, end.e)

    def _joint_target(self, motion: Motion, X_flange_tool: Floats, e: Floats) -> Floats:
        target = motion.target
        taught = None if self.places.shift.any() else self.places.taught_joints(target, motion)
        if motion.kind is MotionKind.HOME:
            q = np.asarray(self.cell.home, dtype=np.float64)
        elif taught is not None:
            q = taught
        elif target.point is None and not target.coordinates:
            q = self.places.with_joints(self.stand.q, motion)
        else:
            X = self._target_pose(target, motion, X_flange_tool, e) @ self._from_tool(X_flange_tool)
            start, references = self.stand.q, self.places.references(motion)
            return self._targets.get(
                (X.tobytes(), start.tobytes(), references.tobytes()),
                lambda: motion_target(self.robot, X, start, references, motion.line),
            )
        self.places.check_range(q, motion)
        return q

    def _path_move(self, motion: Motion, tag: int, X_flange_tool: Floats) -> Resolved:
        self._sure &= not (self._joint_before and self._doubtful_end)
        e = self._auxiliary_target(motion)
        start = self.stand.X_base_flange @ X_flange_tool
        target = self._target_pose(motion.target, motion, X_flange_tool, e)
        via = None
        if motion.via is not None:
            X_via = self._target_pose(motion.via, motion, X_flange_tool, e)
            oriented = motion.via.point is not None or any(k in _ROTATION for k, _ in motion.via.coordinates)
            via = Pose(X_via[:3, 3], _pose(X_via).quaternion if oriented else None)
        move = Move(
            kind=_KINDS[motion.kind],
            tag=tag,
            start=_pose(start),
            target=_pose(target),
            via=via,
            angle=None if motion.angle is None else motion.angle * DEG,
            z_axis=self.places.frame(motion, e)[:3, 2],
            corner=_corner(motion),
        )
        if self.offset is not None:
            return self._tangential(motion, move, e, X_flange_tool)
        end, configuration = replace(self.stand, e=e), None
        if (segment := programmed(move)) is not None:
            piece = Piece(segment, 0.0, segment.length, tag, ends=True, stop=True)
            path = Stretch(piece, self._from_tool(X_flange_tool), motion.line, PathLimits.APPLY)
            edge = max(motion.round_edge or 0.0, self._edge_before)
            margin = rounding_margin(move, edge, self.cell.path_tolerance)
            reached = end_joints(self.robot, path, self.stand.q, margin)
            self._sure &= reached.sure
            end, configuration = Stand(reached.q, reached.X_base_flange, e), reached.configuration
        move, tool = self._with_auxiliary(move, e), (X_flange_tool, self._from_tool(X_flange_tool))
        if auxiliary_alone(move):
            return Resolved(self._joint_line(motion, tag, X_flange_tool, end), UNBOUND, *tool, end)
        known = segment if move.e_start is None and move.kind is not MoveKind.SPLINE else None
        return Resolved(move, speed_rule(motion, self.cell), *tool, end, configuration, known)

    def _tangential(self, motion: Motion, programmed: Move, e: Floats, X_flange_tool: Floats) -> Resolved:
        """A path motion whose tool keeps to the tangent: in which joints it ends is known when it is laid."""
        assert self.offset is not None, "asked for a tangential tool only"
        how = Tangential(self.places.frame(motion, e)[:3, :3], self.offset, _orientation(programmed.start))
        start = _pose(self._now(X_flange_tool))
        move = self._with_auxiliary(tangential_move(programmed, _orientation(start), how), e)
        tool = X_flange_tool, self._from_tool(X_flange_tool)
        if auxiliary_alone(move):
            end = replace(self.stand, e=e)
            return Resolved(self._joint_line(motion, move.tag, X_flange_tool, end), UNBOUND, *tool, end)
        last = end_pose(replace(programmed, start=start))
        X_end = np.eye(4)
        X_end[:3, :3], X_end[:3, 3] = quaternion_to_matrix(_orientation(last)[None])[0], last.position
        X_base_flange = X_end @ tool[1]
        self._sure = False
        end = Stand(self.stand.q, X_base_flange, e, X_base_flange[:3, :3])
        return Resolved(move, speed_rule(motion, self.cell), *tool, end)

    def _now(self, X_flange_tool: Floats) -> Floats:
        """X_base_tcp (4, 4) where the last motion ends, in the orientation that was programmed for it."""
        X = np.array(self.stand.X_base_flange @ X_flange_tool)
        if self.stand.R_programmed is not None:
            X[:3, :3] = self.stand.R_programmed @ X_flange_tool[:3, :3]
        return X

    def _auxiliary_target(self, motion: Motion) -> Floats:
        """Where the auxiliary axes (k,) end: as the statement says, as its point does, or where they are."""
        point = None if motion.target.point is None else self.places.point(motion.target.point)
        return self._auxiliary.target(self.stand.e, motion.target, point, motion.line)

    def _with_auxiliary(self, move: Move, e: Floats) -> Move:
        return replace(move, e_start=self.stand.e, e_target=e) if self._auxiliary.axes else move

    def _target_pose(self, target: Target, motion: Motion, X_flange_tool: Floats, e: Floats) -> Floats:
        """X_base_tcp (4, 4) of a target in the motion's frame, with the base where e (k,) has taken it."""
        X_base_frame = self.places.frame(motion, e)
        if target.point is not None:
            joints = self.places.taught_joints(target, motion)
            if joints is not None:
                X = self.robot.fk(joints) @ X_flange_tool
                X[:3, 3] += self.places.shift
                return np.asarray(X)
            point = self.places.point(target.point)
            pose = None if point is None else point.pose
            assert pose is not None, "a point is taught as a pose or as joints"
            return np.asarray(X_base_frame @ pose)
        X_frame_now = invert_pose(self.places.frame(motion, self.stand.e)) @ self._now(X_flange_tool)
        return np.asarray(X_base_frame @ _with_coordinates(X_frame_now, dict(target.coordinates)))


def _pose(X: Floats) -> Pose:
    return Pose(X[:3, 3], matrix_to_quaternion(X[:3, :3]))


def _orientation(pose: Pose) -> Floats:
    assert pose.quaternion is not None, "a commanded pose has an orientation"
    return pose.quaternion


def _corner(motion: Motion) -> Corner:
    """R is mm along the path, and degrees of joint-space length between two joint moves."""
    if motion.round_edge is None:
        return Corner()
    return Corner(radius=motion.round_edge * MM, joint_radius=motion.round_edge * DEG)


def _with_coordinates(X: Floats, programmed: dict[str, float]) -> Floats:
    """The pose X (4, 4) with the programmed coordinates (mm, deg) in place of its own."""
    result = X.copy()
    for axis, name in enumerate(_POSITION):
        if name in programmed:
            result[axis, 3] = programmed[name] * MM
    if any(name in programmed for name in _ROTATION):
        abc = matrix_to_abc(X[:3, :3])
        for axis, name in enumerate(_ROTATION):
            if name in programmed:
                abc[axis] = programmed[name] * DEG
        result[:3, :3] = abc_to_matrix(abc)
    return result
