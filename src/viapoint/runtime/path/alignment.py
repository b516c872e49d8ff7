"""Segments with a tangential tool, and the turns in place that align it where the path stands still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from viapoint.runtime.path.curves import Straight
from viapoint.runtime.path.moves import Floats, Move, Tangential
from viapoint.runtime.path.rates import norm, shortest_turn
from viapoint.runtime.path.segments import PoseSegment, Segment
from viapoint.runtime.path.shapes import ZERO_LENGTH, line
from viapoint.runtime.path.tangential import aligned_turn, edge_turn, heading_of, turned_by
from viapoint.runtime.path.turns import Key, slerp, turn_about


def aligned(segment: Segment, how: Tangential) -> PoseSegment:
    """A segment of a move without heading, with its tool along the tangent. Raises GeometryError E308."""
    assert isinstance(segment, PoseSegment), "joint moves are not tangential"
    turn = aligned_turn(segment.curve, segment.turn, how)
    return replace(segment, turn=turn, base=segment.turn, tangential=how)


def in_place(move: Move, how: Tangential, before: Floats) -> PoseSegment:
    """A turn in place, which has no tangent: the tool keeps the heading it has before it, (4,)."""
    segment = line(move)
    start = segment.turn.quaternions(np.zeros(1))[0]
    turn = turned_by(heading_of(before, start, how), segment.turn, how)
    return replace(segment, turn=turn, base=segment.turn, tangential=how)


def alignment(before: Floats, segment: Segment, move: Move) -> PoseSegment | None:
    """The turn from an orientation (4,) to the one in which a segment begins; None where it is there."""
    begin = segment.poses(np.zeros(1))
    turn = shortest_turn(before, begin.quaternion[0], move.z_axis)
    angle = norm(turn)
    if angle < ZERO_LENGTH:
        return None
    still = None if move.e_start is None else Straight(move.e_start, np.zeros_like(move.e_start), angle)
    curve = Straight(begin.position[0], np.zeros(3), angle)
    return PoseSegment(
        curve, slerp(before, turn, angle), turns_in_place=True, auxiliary=still, tangential=move.tangential
    )


def along_edge(edge: PoseSegment, left: Segment, right: Segment, leave: float, join: float) -> PoseSegment:
    """A round edge whose tool keeps to its tangent, where it does so on both sides."""
    if not isinstance(left, PoseSegment) or not isinstance(right, PoseSegment) or edge.turns_in_place:
        return edge
    how = left.tangential
    if how is None or left.base is None or right.base is None:
        return edge
    length = edge.length
    plain = Key(0.0, *left.base.derivatives(leave)), Key(length, *right.base.derivatives(join))
    base = turn_about(*plain, left.base.derivatives(left.length)[0])
    a, b = left.turn.derivatives(leave), right.turn.derivatives(join)
    turn = edge_turn(edge.curve, base, how, Key(0.0, *a), Key(length, *b))
    return replace(edge, turn=turn, base=base, tangential=how)


def same(a: Tangential | None, b: Tangential | None) -> bool:
    """Two moves have the tool in the same way to the path."""
    if a is None or b is None:
        return a is b
    return a.offset == b.offset and bool(np.array_equal(a.R_base_frame, b.R_base_frame))
