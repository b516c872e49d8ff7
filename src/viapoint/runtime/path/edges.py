"""Round edges: the curve that leaves one segment before a corner and joins the next one after it.

Between two lines it is the quartic of F 5-29; in general the quintic that matches value, first and second
derivative of both sides. Whether and how far to round is decided elsewhere.
"""

from __future__ import annotations

import numpy as np

from viapoint.runtime.path.alignment import along_edge
from viapoint.runtime.path.curves import Profile, joining
from viapoint.runtime.path.moves import Floats, Space
from viapoint.runtime.path.rates import norm
from viapoint.runtime.path.segments import Jet, JointSegment, PoseSegment, Segment
from viapoint.runtime.path.turns import Key, turn_about


def round_edge(left: Segment, right: Segment, leave: float, join: float) -> Segment:
    """The edge from `left` at parameter `leave` to `right` at parameter `join`."""
    if isinstance(left, JointSegment) and isinstance(right, JointSegment):
        length = left.length - leave + join
        curve = joining(left.curve.derivatives(leave), right.curve.derivatives(join), length)
        return JointSegment(curve, left.weights, left.fk, _auxiliary(left, right, leave, join, length))
    a, b = left.jet(leave), right.jet(join)
    length = _range(left, right, leave, join, a, b)
    curve = joining(
        (a.position, a.velocity, a.acceleration), (b.position, b.velocity, b.acceleration), length
    )
    corner = corner_orientation(left)
    turn = turn_about(_key(0.0, a), _key(length, b), corner)
    in_place = left.turns_in_place and right.turns_in_place
    edge = PoseSegment(curve, turn, in_place, _auxiliary(left, right, leave, join, length))
    return along_edge(edge, left, right, leave, join)


def _auxiliary(left: Segment, right: Segment, leave: float, join: float, length: float) -> Profile | None:
    """Auxiliary axes pass from one side to the other as the position does."""
    before, after = left.auxiliary, right.auxiliary
    if before is None or after is None:
        return None
    return joining(before.derivatives(leave), after.derivatives(join), length)


def corner_orientation(left: Segment) -> Floats:
    """(4,) orientation where `left` ends."""
    if isinstance(left, PoseSegment):
        return left.jet(left.length).quaternion
    end: Floats = left.poses(np.array([left.length])).quaternion[0]
    return end


def _key(w: float, jet: Jet) -> Key:
    return Key(w, jet.quaternion, jet.rate, jet.rate_change)


def _range(left: Segment, right: Segment, leave: float, join: float, a: Jet, b: Jet) -> float:
    """Range of the edge's parameter.

    On the path it is what the two sides lose. A joint move has another scale: there the range is the one
    in which a speed rising evenly from one side's |dp/dw| to the other's covers the same distance.
    """
    if left.space is Space.POSE and right.space is Space.POSE:
        return left.length - leave + join
    cut = left.arc.upto(left.length) - left.arc.upto(leave) + right.arc.upto(join)
    return 2.0 * cut / (norm(a.velocity) + norm(b.velocity))
