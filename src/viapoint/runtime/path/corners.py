"""What happens where one segment meets the next: a stop, a smooth passage as it is, or a round edge."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, unique

import numpy as np

from viapoint.runtime.memo import Memo
from viapoint.runtime.path.edges import round_edge
from viapoint.runtime.path.moves import Corner, Floats, Space
from viapoint.runtime.path.rates import norm
from viapoint.runtime.path.segments import Jet, JointSegment, PoseSegment, Segment
from viapoint.runtime.path.tolerance import LEVER, first_guess, widest_edge

# Tangents within this angle (rad; 0.1°) count as tangential: above what rounding of coordinates to a
# micrometre leaves over a millimetre (0.06°), below any corner one would want rounded on purpose.
TANGENTIAL = math.radians(0.1)
# Within this angle of 180° (rad) a path turns back on itself: |dp/dw| on a round edge would fall below a
# thousandth of the path's own.
REVERSAL = 2e-3
# Derivatives by w that differ by no more than this are equal: at 1 m/s and 1 ms per tick the step left is
# 1e-6 m/s² in acceleration and 1e-3 m/s³ in jerk.
SAME_FIRST, SAME_SECOND = 1e-9, 1e-6
# A round edge shorter than this on each side (m, or rad in joint space) is not made: its curvature would be
# rounding noise.
SHORTEST_EDGE = 1e-6
# A round edge may not reach over more than this rotation (rad) on either side, so that both ends stay within
# half a turn of the corner's orientation. Half of a line never turns by more.
MOST_ROTATION = math.pi / 2.0 + 1e-9
# Slower than this (m per rad of joint-space length) the TCP has no direction at the corner.
NO_DIRECTION = 1e-6


@unique
class Reason(Enum):
    """Why a corner is passed the way it is, in the user's words."""

    ROUNDED = "rounded by R"
    SMOOTH = "smooth as programmed"
    TOLERANCE = "tangential, passed within the path tolerance"
    ZERO_LENGTH = "motion of zero length, passed over"
    END = "the path ends here"
    TANGENT = "the tool turns to another tangential orientation"
    ASKED = "an exact stop is required here"
    R_ZERO = "R0"
    CORNER = "not tangential and no R"
    REVERSAL = "the path turns back on itself"
    IN_PLACE = "a rotation in place has no tangent"
    NO_DIRECTION = "the TCP does not move at the end of the joint move"
    AUXILIARY = "auxiliary axes move alone on one side"
    TOO_SHORT = "a motion beside the corner is too short to round"
    NO_TOLERANCE = "tangential, but its curvature jumps and the path tolerance does not allow an edge"

    @property
    def stops(self) -> bool:
        """The path stands still at such a corner."""
        return self not in (Reason.ROUNDED, Reason.SMOOTH, Reason.TOLERANCE, Reason.ZERO_LENGTH)


@dataclass(frozen=True, slots=True)
class Passage:
    """How a corner is passed. With an edge: where it leaves the left segment and joins the right one."""

    reason: Reason
    edge: Segment | None = None
    leave: float = 0.0
    join: float = 0.0
    radius: float = 0.0  # in effect, m of TCP path or rad of joint-space length, each side


class Ruler:
    """Distances before and after one corner, in the measure that both sides share.

    TCP arc length; joint-space length between two joint moves; angle between two turns in place.
    """

    def __init__(self, left: Segment, right: Segment) -> None:
        self.left, self.right = left, right
        self.by_parameter = (left.space is right.space is Space.JOINT) or (
            left.turns_in_place and right.turns_in_place
        )

    def reach(self) -> float:
        """The most that may be cut: half of the shorter side, within the rotation allowed."""
        if self.by_parameter:
            most = 0.5 * min(self.left.length, self.right.length)
        else:
            most = min(self._most(self.left, at_end=True), self._most(self.right, at_end=False))
        if self._turns_little(self.left) and self._turns_little(self.right):
            return most
        while most > SHORTEST_EDGE and self._rotation(most) > MOST_ROTATION:
            most *= 0.5 if self._rotation(most) > 2.0 * MOST_ROTATION else 0.9
        return most

    def _most(self, segment: Segment, *, at_end: bool) -> float:
        """Half of a side; of a joint move also half its parameter: another joint move may take the rest."""
        total = self._total(segment)
        if segment.space is Space.POSE:
            return 0.5 * total
        half = segment.arc.upto(0.5 * segment.length)
        return min(0.5 * total, total - half if at_end else half)

    def cut(self, distance: float) -> tuple[float, float]:
        """Parameters of the left and right segment so far from the corner."""
        if self.by_parameter:
            return self.left.length - distance, distance
        leave = self.left.arc.where(self._total(self.left) - distance)
        return leave, self.right.arc.where(distance)

    def _rotation(self, distance: float) -> float:
        if self.left.space is self.right.space is Space.JOINT:
            return 0.0  # edges in joint space have no orientation of their own
        leave, join = self.cut(distance)
        left = self.left.angle
        return max(left.upto(self.left.length) - left.upto(leave), self.right.angle.upto(join))

    def _turns_little(self, segment: Segment) -> bool:
        """Whether no part of a side can rotate by more than is allowed."""
        if self.left.space is self.right.space is Space.JOINT:
            return True
        if isinstance(segment, PoseSegment) and segment.turn.most(segment.length) <= MOST_ROTATION:
            return True
        return segment.angle.upto(segment.length) <= MOST_ROTATION

    @staticmethod
    def _total(segment: Segment) -> float:
        return segment.arc.upto(segment.length)


class Corners:
    """Decides on corners between segments, and remembers those between the same two; tolerance in m."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self._known: Memo[tuple[Segment, Segment, Passage]] = Memo()  # with the segments: no id comes again

    def passage(self, left: Segment, right: Segment, corner: Corner) -> Passage:
        """How a corner is passed."""

        def decided() -> tuple[Segment, Segment, Passage]:
            return left, right, pass_corner(left, right, corner, self.tolerance)

        return self._known.get((id(left), id(right), corner), decided)[2]


def pass_corner(left: Segment, right: Segment, corner: Corner, tolerance: float) -> Passage:
    """Decide on the corner between two segments; tolerance in m."""
    if corner.halts:
        return Passage(Reason.ASKED if corner.stop else Reason.R_ZERO)
    before, after = _Side.of(left, left.length, right), _Side.of(right, 0.0, left)
    obstacle = _obstacle(before, after)
    if obstacle is not None:
        return Passage(obstacle)
    radius = corner.radius_between(left.space, right.space)
    if radius is not None and not (left.turns_in_place and right.turns_in_place):
        return _rounded(left, right, radius)
    if _angle(before.direction, after.direction) > TANGENTIAL:
        return Passage(Reason.CORNER)
    if before.continues_in(after):
        return Passage(Reason.SMOOTH)
    return _within_tolerance(before, after, tolerance)


def _rounded(left: Segment, right: Segment, radius: float) -> Passage:
    ruler = Ruler(left, right)
    distance = min(radius, ruler.reach())
    if distance < SHORTEST_EDGE:
        return Passage(Reason.TOO_SHORT)
    leave, join = ruler.cut(distance)
    return Passage(Reason.ROUNDED, round_edge(left, right, leave, join), leave, join, distance)


def _within_tolerance(before: _Side, after: _Side, tolerance: float) -> Passage:
    left, right = before.segment, after.segment
    ruler = Ruler(left, right)
    reach = ruler.reach()
    if tolerance <= 0.0 or reach < SHORTEST_EDGE:
        return Passage(Reason.NO_TOLERANCE if tolerance <= 0.0 else Reason.TOO_SHORT)
    kink, bend = (_size(x) for x in (after.first - before.first, after.second - before.second))
    guess = first_guess(kink, bend, tolerance)
    distance = widest_edge(left, right, ruler.cut, reach, tolerance, guess)
    if distance < SHORTEST_EDGE:
        return Passage(Reason.NO_TOLERANCE)
    leave, join = ruler.cut(distance)
    return Passage(Reason.TOLERANCE, round_edge(left, right, leave, join), leave, join, distance)


@dataclass(frozen=True, slots=True)
class _Side:
    """One side of a corner: its direction and the derivatives that must not jump."""

    segment: Segment
    direction: Floats
    first: Floats
    second: Floats

    @classmethod
    def of(cls, segment: Segment, w: float, other: Segment) -> _Side:
        auxiliary = () if segment.auxiliary is None else segment.auxiliary.derivatives(w)[1:]
        if isinstance(segment, JointSegment) and isinstance(other, JointSegment):
            _, v, a = segment.curve.derivatives(w)
            return cls(segment, v, *_with_auxiliary((v,), (a,), auxiliary))
        jet: Jet = segment.jet(w)
        direction = jet.rate if segment.turns_in_place else jet.velocity
        first, second = (jet.velocity, jet.rate), (jet.acceleration, jet.rate_change)
        return cls(segment, direction, *_with_auxiliary(first, second, auxiliary))

    def continues_in(self, after: _Side) -> bool:
        return bool(
            np.abs(self.first - after.first).max() <= SAME_FIRST
            and np.abs(self.second - after.second).max() <= SAME_SECOND
        )


def _with_auxiliary(
    first: tuple[Floats, ...], second: tuple[Floats, ...], auxiliary: tuple[Floats, ...]
) -> tuple[Floats, Floats]:
    """First and second derivatives, those of the auxiliary axes last."""
    return np.concatenate((*first, *auxiliary[:1])), np.concatenate((*second, *auxiliary[1:]))


def _size(jump: Floats) -> float:
    """A jump of derivatives, pose (6,) and auxiliary axes (k,), as a length; of joints, a rough one."""
    pose = norm(jump[:3]) + LEVER * norm(jump[3:6])
    return pose + norm(jump[6:]) if len(jump) > 6 else pose


def _stands(segment: Segment) -> bool:
    return isinstance(segment, JointSegment) and segment.stands


def _obstacle(before: _Side, after: _Side) -> Reason | None:
    if _stands(before.segment) or _stands(after.segment):
        return Reason.AUXILIARY
    if before.segment.turns_in_place is not after.segment.turns_in_place:
        return Reason.IN_PLACE
    if min(norm(before.direction), norm(after.direction)) < NO_DIRECTION:
        return Reason.NO_DIRECTION
    if _angle(before.direction, after.direction) > math.pi - REVERSAL:
        return Reason.REVERSAL
    return None


def _angle(a: Floats, b: Floats) -> float:
    """0 … π between two vectors of any dimension, without loss near 0 and π."""
    a, b = a / norm(a), b / norm(b)
    return 2.0 * math.atan2(norm(a - b), norm(a + b))
