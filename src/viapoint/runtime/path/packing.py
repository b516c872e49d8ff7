"""Segments as rows of numbers, for the compiled module `_curves`. Nothing is computed here.

A row is the kind and figures of the curve, then those of the turn: a straight's origin and velocity; an
arc's radius, centre and axes; degree, length and control points of a Bézier; start and rate of a uniform
turn; number of intervals, knots, middles and control points of a keyed one.
"""

from __future__ import annotations

from typing import Final, assert_never

import numpy as np

from viapoint.runtime.path.curves import Arc, Bezier, Curve, Straight
from viapoint.runtime.path.moves import Floats
from viapoint.runtime.path.turns import KeyedTurn, Turn, UniformTurn

STRAIGHT: Final = 0
ARC: Final = 1
BEZIER: Final = 2
UNIFORM: Final = 0
KEYED: Final = 1


def pack(curve: Curve, turn: Turn) -> Floats:
    """A curve of the TCP and the turn beside it as one row."""
    return np.concatenate((*_curve(curve), *_turn(turn)))


def _curve(curve: Curve) -> tuple[Floats | tuple[float, ...], ...]:
    match curve:
        case Straight(origin=origin, velocity=velocity):
            return (STRAIGHT,), origin, velocity
        case Arc(radius=radius, center=center, u=u, v=v):
            return (ARC, radius), center, u, v
        case Bezier(controls=controls, length=length):
            return (BEZIER, len(controls) - 1, length), controls.ravel()
        case _:
            assert_never(curve)


def _turn(turn: Turn) -> tuple[Floats | tuple[float, ...], ...]:
    match turn:
        case UniformTurn(start=start, rate=rate):
            return (UNIFORM,), start, rate
        case KeyedTurn(knots=knots, middles=middles, controls=controls):
            return (KEYED, len(middles)), knots, middles.ravel(), controls.ravel()
        case _:
            assert_never(turn)
