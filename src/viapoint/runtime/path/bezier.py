"""Bernstein form of polynomials: evaluation, derivatives, Hermite data to control points.

All terms of the Bernstein form are positive on 0 … 1, so it is as stable as De Casteljau's algorithm
(F 5-26…28) and one matrix product for a whole batch.
"""

from __future__ import annotations

from math import comb

import numpy as np

from viapoint.runtime.path.moves import Floats

_BINOMIALS = [np.array([comb(n, k) for k in range(n + 1)], dtype=np.float64) for n in range(6)]


def bernstein(degree: int, t: Floats) -> Floats:
    """(N,) → (N, degree + 1): the Bernstein polynomials at t."""
    rest = 1.0 - t
    basis = np.empty((degree + 1, len(t)))
    power = np.ones_like(t)
    for k in range(degree + 1):
        basis[k] = power
        power = power * t
    power = rest
    for k in range(degree - 1, -1, -1):
        basis[k] *= power
        power = power * rest
    basis *= _BINOMIALS[degree][:, None]
    return basis.T


def bezier(controls: Floats, t: Floats) -> Floats:
    """Control points (degree + 1, d), t (N,) → (N, d); F 5-25, 5-29 for degree 3 and 4."""
    return bernstein(len(controls) - 1, t) @ controls


def bezier_derivatives(controls: Floats, t: float) -> tuple[Floats, Floats, Floats]:
    """Value, first and second derivative by t at one t, by De Casteljau's algorithm (F 5-26…28).

    The last levels but one and two hold the derivatives. Degree 2 or more.
    """
    degree = len(controls) - 1
    points, levels = controls, []
    for _ in range(degree):
        levels.append(points)
        points = points[:-1] + t * (points[1:] - points[:-1])
    (b0, b1), (c0, c1, c2) = levels[-1], levels[-2]
    return points[0], degree * (b1 - b0), degree * (degree - 1) * (c2 - 2.0 * c1 + c0)


def differences(controls: Floats) -> Floats:
    """Control points of the derivative with respect to t (F 5-34)."""
    return (len(controls) - 1) * (controls[1:] - controls[:-1])


def hermite_controls(
    left: tuple[Floats, Floats, Floats], right: tuple[Floats, Floats, Floats], length: float
) -> Floats:
    """Quintic through value, first and second derivative (by w = t·length) at both ends: (6, d).

    Where both second derivatives vanish and the end tangents meet at equal distance, it is the quartic
    of F 5-29, raised by one degree.
    """
    (p0, v0, a0), (p1, v1, a1) = left, right
    step, bend = length / 5.0, length * length / 20.0
    return np.stack(
        (
            p0,
            p0 + step * v0,
            p0 + 2.0 * step * v0 + bend * a0,
            p1 - 2.0 * step * v1 + bend * a1,
            p1 - step * v1,
            p1,
        )
    )
