"""Bernstein form of polynomials: evaluation, derivatives, Hermite data to control points."""

from __future__ import annotations

import numpy as np

from viapoint.runtime.core import chosen
from viapoint.runtime.path.moves import Floats

_CORE = "path._curves"


def bezier(controls: Floats, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Control points (degree + 1, d), t (N,) → value, first and second derivative by t, (N, d) each.

    By De Casteljau's algorithm (F 5-26…28), whose last levels but one and two hold the derivatives. Degree 2
    or more.
    """
    if (core := chosen(_CORE)) is not None:
        value, first, second = core.bezier(np.ascontiguousarray(controls), np.ascontiguousarray(t))
        return value, first, second
    degree = len(controls) - 1
    points, share = controls[:, None], t[:, None]
    first = second = points
    for level in range(degree, 0, -1):
        steps = points[1:] - points[:-1]
        if level == 2:
            second = degree * (degree - 1) * (points[2] - 2.0 * points[1] + points[0])
        if level == 1:
            first = degree * steps[0]
        points = points[:-1] + share * steps
    return points[0], first, np.broadcast_to(second, first.shape)


def hermite_controls(
    left: tuple[Floats, Floats, Floats], right: tuple[Floats, Floats, Floats], length: float
) -> Floats:
    """Quintic through value, first and second derivative (by w = t·length) at both ends: (6, d).

    Where both second derivatives vanish and the end tangents meet at equal distance, it is the quartic
    of F 5-29, raised by one degree.
    """
    (p0, v0, a0), (p1, v1, a1) = left, right
    step, bend = length / 5.0, length * length / 20.0
    leaving, arriving = step * v0, step * v1
    controls = np.empty((6, len(p0)))
    controls[0], controls[5] = p0, p1
    controls[1], controls[4] = p0 + leaving, p1 - arriving
    controls[2] = p0 + 2.0 * leaving + bend * a0
    controls[3] = p1 - 2.0 * arriving + bend * a1
    return controls
