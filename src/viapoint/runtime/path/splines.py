"""One cubic Bézier per spline motion, from its neighbours (F ch. 5, "Spline").

Inner control points lie on the end tangents, a third of the chord away; so |dp/dw| = 1 at both ends where w
runs over the chord's length, and neighbouring splines join with a continuous first derivative.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from viapoint.runtime.path.curves import Bezier, Profile, joining
from viapoint.runtime.path.keys import free_rate, passing_rate
from viapoint.runtime.path.moves import Floats, Move, MoveKind, require_finite
from viapoint.runtime.path.rates import shortest_turn
from viapoint.runtime.path.segments import PoseSegment, Segment
from viapoint.runtime.path.shapes import (
    IN_PLACE,
    even_auxiliary,
    is_zero,
    quaternion,
    shape_alone,
    turns_in_place,
)
from viapoint.runtime.path.turns import Key, Turn, slerp, turn_through

# A neighbour whose TCP moves slower than this (m per unit of w) gives no tangent.
LOWEST_TANGENT_SPEED = 1e-6


@dataclass(frozen=True, slots=True)
class Neighbour:
    """A motion beside a spline: with its segment, unless it is a spline itself."""

    move: Move
    segment: Segment | None


def spline(move: Move, before: Neighbour | None, after: Neighbour | None) -> PoseSegment:
    """The spline motion between its neighbours; None where nothing precedes or follows it."""
    p0, p3 = move.start.position, move.target.position
    chord = float(np.linalg.norm(p3 - p0))
    tangent0 = _tangent(_chord(before.move, move), before, at_end=True) if before else None
    tangent3 = _tangent(_chord(move, after.move), after, at_end=False) if after else None
    third = chord / 3.0
    p1 = None if tangent0 is None else p0 + third * tangent0
    p2 = None if tangent3 is None else p3 - third * tangent3
    # Where nothing gives a tangent it points to the neighbouring control point; with neither, to the end.
    inner1 = p0 + third * _unit((p3 if p2 is None else p2) - p0, p3 - p0) if p1 is None else p1
    inner2 = p3 - third * _unit(p3 - (p0 if p1 is None else p1), p3 - p0) if p2 is None else p2
    curve = Bezier(np.stack((p0, inner1, inner2, p3)), chord)
    turn = _spline_turn(move, before, after, chord)
    return PoseSegment(curve, turn, auxiliary=_spline_auxiliary(move, before, after, chord))


def programmed(move: Move) -> Segment | None:
    """A motion's geometry by itself, without neighbours or round edges; None if nothing moves in it.

    Raises GeometryError where the motion has no geometry, ValueError where a number is not finite.
    """
    require_finite(move)
    if is_zero(move):
        return None
    return shape_alone(move) or spline(move, None, None)


def is_spline(neighbour: Neighbour | None) -> bool:
    """A spline with a length of its own: it shares the tangent rule and the key orientations."""
    return (
        neighbour is not None
        and neighbour.move.kind is MoveKind.SPLINE
        and not turns_in_place(neighbour.move)
    )


def _chord(first: Move, second: Move) -> Floats:
    return second.target.position - first.start.position


def _tangent(chord: Floats, neighbour: Neighbour, *, at_end: bool) -> Floats | None:
    """Unit tangent where the neighbour meets the spline, or None where it gives none."""
    if is_spline(neighbour):
        length = float(np.linalg.norm(chord))
        return chord / length if length > IN_PLACE else None
    if neighbour.segment is None or neighbour.segment.turns_in_place:
        return None
    velocity = neighbour.segment.jet(neighbour.segment.length if at_end else 0.0).velocity
    speed = float(np.linalg.norm(velocity))
    return velocity / speed if speed > LOWEST_TANGENT_SPEED else None


def _unit(v: Floats, otherwise: Floats) -> Floats:
    length = float(np.linalg.norm(v))
    return v / length if length > IN_PLACE else otherwise / float(np.linalg.norm(otherwise))


def _mean_turn(move: Move) -> tuple[Floats, float]:
    """Mean rate (3,) along the chord, and the chord's length."""
    h = float(np.linalg.norm(move.target.position - move.start.position))
    return shortest_turn(quaternion(move.start), quaternion(move.target), move.z_axis) / h, h


def _mean_auxiliary(move: Move) -> tuple[Floats, float]:
    """Mean rate (k,) of the auxiliary axes along the chord, and the chord's length."""
    if move.e_start is None or move.e_target is None:
        raise ValueError("all motions of a path have auxiliary axes, or none")
    h = float(np.linalg.norm(move.target.position - move.start.position))
    return (move.e_target - move.e_start) / h, h


def _end_rates(
    mean_of: Callable[[Move], tuple[Floats, float]],
    move: Move,
    before: Neighbour | None,
    after: Neighbour | None,
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]] | None:
    """Rate and change of rate at both ends, from the splines beside it; None where there are none."""
    mean, chord = mean_of(move)
    rates: list[tuple[Floats, Floats] | None] = [None, None]
    if before is not None and is_spline(before):
        mean_before, h = mean_of(before.move)
        rates[0] = passing_rate(mean_before, mean, h, chord)
    if after is not None and is_spline(after):
        mean_after, h = mean_of(after.move)
        rates[1] = passing_rate(mean, mean_after, chord, h)
    still = np.zeros_like(mean)
    first, last = rates
    if first is None and last is None:
        return None
    first = first or (free_rate(mean, last[0] if last else mean), still)
    return first, last or (free_rate(mean, first[0]), still)


def _spline_turn(move: Move, before: Neighbour | None, after: Neighbour | None, chord: float) -> Turn:
    q0, q1 = quaternion(move.start), quaternion(move.target)
    onwards = _mean_turn(move)[0] * chord
    rates = _end_rates(_mean_turn, move, before, after)
    if rates is None:
        return slerp(q0, onwards, chord)
    return turn_through([Key(0.0, q0, *rates[0], onwards), Key(chord, q1, *rates[1])])


def _spline_auxiliary(
    move: Move, before: Neighbour | None, after: Neighbour | None, chord: float
) -> Profile | None:
    """Auxiliary axes pass the points of a spline as orientations do, with continuous second derivative."""
    if move.e_start is None or move.e_target is None:
        return None
    rates = _end_rates(_mean_auxiliary, move, before, after)
    if rates is None:
        return even_auxiliary(move, chord)
    return joining((move.e_start, *rates[0]), (move.e_target, *rates[1]), chord)
