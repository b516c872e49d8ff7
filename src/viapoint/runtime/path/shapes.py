"""Programmed motions to segments: lines, turns in place, circles, joint moves. Splines need neighbours
and have a module of their own.
"""

from __future__ import annotations

import math

import numpy as np

from viapoint.runtime.path.curves import Arc, Profile, Straight
from viapoint.runtime.path.errors import GeometryError
from viapoint.runtime.path.keys import keys_along, periodic_keys
from viapoint.runtime.path.moves import Floats, Move, MoveKind, Pose
from viapoint.runtime.path.rates import cross, norm, shortest_turn
from viapoint.runtime.path.segments import JointSegment, PoseSegment, Segment
from viapoint.runtime.path.turns import Turn, slerp, turn_through

# Motions shorter than this (m, and rad) are no motion: rounding of poses that went through forward and
# inverse kinematics. One nanometre in one tick of 1 ms is a jerk of 1 m/s³, far below any limit.
ZERO_LENGTH = 1e-9
# A translation shorter than this (m), and shorter than 1 m per rad of its rotation, is a turn in place.
IN_PLACE = 1e-6
# The three points of a circle are collinear or coincident where their triangle is lower than this (m):
# one unit in the last place of coordinates given in mm with three decimals.
LOWEST_TRIANGLE = 1e-6

TWO_PI = 2.0 * math.pi


def line(move: Move) -> PoseSegment:
    """Straight line with SLERP; where nothing but the orientation moves, a turn in place."""
    along = move.target.position - move.start.position
    distance = norm(along)
    turn = shortest_turn(quaternion(move.start), quaternion(move.target), move.z_axis)
    angle = norm(turn)
    in_place = distance < IN_PLACE and angle > distance
    length = angle if in_place else distance
    curve = Straight(move.start.position, along / length, length)
    turned = slerp(quaternion(move.start), turn, length)
    return PoseSegment(curve, turned, in_place, even_auxiliary(move, length))


def joint_move(move: Move) -> JointSegment:
    """Straight line in joint space; where no joint moves, its parameter is the auxiliary axes' length."""
    if move.q_start is None or move.q_target is None or move.fk is None:
        raise ValueError("a joint move needs q_start, q_target and fk")
    weights = np.ones_like(move.q_start) if move.joint_weights is None else move.joint_weights
    start, along = weights * move.q_start, weights * (move.q_target - move.q_start)
    length = norm(along)
    stands = auxiliary_alone(move)
    if stands:
        length = auxiliary_length(move)
    curve = Straight(start, along / length, length)
    return JointSegment(curve, weights, move.fk, even_auxiliary(move, length), stands)


def circle(move: Move) -> PoseSegment:
    """Arc through start, Q and target, or of angle H on that circle (F 5-18…24).

    Orientation goes through the key orientations. With H they repeat every turn (start, Q, target, start),
    backwards for a negative H; so a full turn ends in the orientation it started with.

    Raises GeometryError E306 where the three points define no circle.
    """
    arc, at_via, at_target = _arc(move)
    turn = _circle_turn(move, arc, at_via, at_target)
    return PoseSegment(arc, turn, auxiliary=even_auxiliary(move, arc.length))


def _arc(move: Move) -> tuple[Arc, float, float]:
    """The arc, and the angles from the start, in the sense of Q, of Q and the target."""
    if move.via is None:
        raise ValueError("a circle needs via")
    p0, p1, p2 = move.start.position, move.via.position, move.target.position
    to_via, to_target = p1 - p0, p2 - p0
    normal = cross(to_via, to_target)
    area = norm(normal)
    if area <= LOWEST_TRIANGLE * max(norm(v) for v in (to_via, to_target, p2 - p1)):
        raise GeometryError("E306", "start, Q and target of the circle lie on one line or coincide")
    normal = normal / area
    # The centre from the two chords; the same point as F 5-22 with fewer products of large coordinates.
    offset = cross((to_via @ to_via) * to_target - (to_target @ to_target) * to_via, normal) / (2.0 * area)
    center, radius = p0 + offset, norm(offset)
    u = -offset / radius
    v = cross(normal, u)
    angles = [math.atan2(float((p - center) @ v), float((p - center) @ u)) % TWO_PI for p in (p1, p2)]
    sweep = angles[1] if move.angle is None else move.angle
    return Arc(center, radius, u, math.copysign(1.0, sweep) * v, radius * abs(sweep)), angles[0], angles[1]


def _circle_turn(move: Move, arc: Arc, at_via: float, at_target: float) -> Turn:
    assert move.via is not None
    q0, q2 = quaternion(move.start), quaternion(move.target)
    passed = [(0.0, q0), (arc.radius * at_target, q2)]
    if move.via.quaternion is not None:
        passed.insert(1, (arc.radius * at_via, quaternion(move.via)))
    stops, orientations = [w for w, _ in passed], [q for _, q in passed]
    if move.angle is not None:
        around = TWO_PI * arc.radius
        backwards = move.angle < 0.0
        return turn_through(periodic_keys(stops, orientations, around, arc.length, backwards, move.z_axis))
    if len(stops) == 2:
        return slerp(q0, shortest_turn(q0, q2, move.z_axis), arc.length)
    return turn_through(keys_along(stops, orientations, move.z_axis))


def even_auxiliary(move: Move, length: float) -> Profile | None:
    """The auxiliary axes of a motion as they move with it: evenly over its parameter 0 … length."""
    if move.e_start is None or move.e_target is None:
        return None
    return Straight(move.e_start, (move.e_target - move.e_start) / length, length)


def auxiliary_length(move: Move) -> float:
    """How far the auxiliary axes travel, rad counted as m."""
    if move.e_start is None or move.e_target is None:
        return 0.0
    return norm(move.e_target - move.e_start)


def is_zero(move: Move) -> bool:
    """Nothing moves in it."""
    return _robot_length(move) < ZERO_LENGTH and auxiliary_length(move) < ZERO_LENGTH


def auxiliary_alone(move: Move) -> bool:
    """Nothing worth a path parameter of its own moves in it but auxiliary axes."""
    travel = auxiliary_length(move)
    return travel >= ZERO_LENGTH and _robot_length(move) < min(IN_PLACE, travel)


def _robot_length(move: Move) -> float:
    """The larger of translation (m) and rotation (rad), or joint-space length (rad); inf for a circle."""
    if move.kind is MoveKind.JOINT and move.q_start is not None and move.q_target is not None:
        weights = 1.0 if move.joint_weights is None else move.joint_weights
        return norm(weights * (move.q_target - move.q_start))
    if move.kind is MoveKind.CIRCLE:
        return 0.0 if move.angle is not None and abs(move.angle) < ZERO_LENGTH else math.inf
    distance = norm(move.target.position - move.start.position)
    turn = shortest_turn(quaternion(move.start), quaternion(move.target), move.z_axis)
    return max(distance, norm(turn))


def turns_in_place(move: Move) -> bool:
    """A path motion that only turns: it has no tangent."""
    distance = norm(move.target.position - move.start.position)
    if distance >= IN_PLACE:
        return False
    turn = shortest_turn(quaternion(move.start), quaternion(move.target), move.z_axis)
    return norm(turn) > distance


def shape_alone(move: Move) -> Segment | None:
    """The segment of a motion that needs no neighbours; None for a spline with a length."""
    match move.kind:
        case MoveKind.LINE:
            return line(move)
        case MoveKind.CIRCLE:
            return circle(move)
        case MoveKind.JOINT:
            return joint_move(move)
        case MoveKind.SPLINE:
            return line(move) if turns_in_place(move) else None


def end_pose(move: Move) -> Pose:
    """Where the motion really ends: its target, but for a circle with H.

    Raises GeometryError E306 where a circle's three points define none.
    """
    if move.kind is not MoveKind.CIRCLE or move.angle is None:
        return move.target
    if is_zero(move):
        return move.start
    segment = circle(move)
    end = segment.poses(np.array([segment.length]))
    return Pose(end.position[0], end.quaternion[0])


def quaternion(pose: Pose) -> Floats:
    """The orientation of a pose, normalised."""
    if pose.quaternion is None:
        raise ValueError("this pose needs an orientation")
    unit: Floats = pose.quaternion / math.sqrt(float(pose.quaternion @ pose.quaternion))
    return unit
