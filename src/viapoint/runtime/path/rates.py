"""Derivatives of a rotation against derivatives of its rotation vector, and the shorter way round.

For R(w) = exp(φ(w))·R_m, in base axes: ω = J(φ)·φ′ with J = 1 + a·[φ] + b·[φ]², a = (1 − cos θ)/θ²,
b = (θ − sin θ)/θ³, θ = |φ|. Rates are per unit of the path parameter; there is no time here.
"""

from __future__ import annotations

import math

import numpy as np

from viapoint.runtime.path.moves import Floats
from viapoint.runtime.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)

# Rotations within this of 180° (rad) count as half turns: the sense is then decided by the frame's +Z and
# not by rounding of the two orientations (12 digits of a pose read from a file leave 1e-9).
HALF_TURN_MARGIN = 1e-6
# An axis whose component along a tie-breaking direction is smaller than this is square to it.
SQUARE = 1e-6
# Below this θ² the closed forms of a, b and their derivatives lose digits; four terms of the series do not.
_SERIES_BELOW = 1e-2


def cross(a: Floats, b: Floats) -> Floats:
    """(..., 3) × (..., 3); several times quicker than numpy's for small batches."""
    c = np.empty(np.broadcast_shapes(a.shape, b.shape))
    c[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    c[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    c[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return c


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("...i,...i->...", a, b)
    return product[..., None]


def rotation_from(start: Floats, end: Floats) -> Floats:
    """(4,), (4,) → (3,) rotation vector φ, |φ| ≤ π, in base axes: R(end) = exp(φ)·R(start)."""
    return quaternion_to_rotation_vector(quaternion_multiply(end, quaternion_conjugate(start)))


def shortest_turn(start: Floats, end: Floats, z_axis: Floats) -> Floats:
    """The rotation vector of the shorter way from one orientation to another.

    Of two orientations 180° apart the axis is unique but for its sign, and both senses sweep the tool
    axis equally: the sense is the one that is positive about `z_axis`; for an axis square to it, about
    the base's +X, then +Y.
    """
    turn = rotation_from(start, end)
    angle = math.sqrt(float(turn @ turn))
    if angle < math.pi - HALF_TURN_MARGIN:
        return turn
    axis = turn / angle
    for sign in (float(axis @ z_axis), float(axis[0]), float(axis[1]), float(axis[2])):
        if abs(sign) > SQUARE:
            return turn if sign > 0.0 else -axis * (2.0 * math.pi - angle)
    return turn


def _coefficients(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """a, b, da/dx, db/dx as functions of x = θ²."""
    series = x < _SERIES_BELOW
    y = np.where(series, 1.0, x)
    theta = np.sqrt(y)
    s, c = np.sin(theta), np.cos(theta)
    a = np.where(series, 0.5 - x / 24 + x**2 / 720 - x**3 / 40320, (1.0 - c) / y)
    b = np.where(series, 1 / 6 - x / 120 + x**2 / 5040 - x**3 / 362880, (theta - s) / (y * theta))
    da = np.where(
        series,
        -1 / 24 + x / 360 - x**2 / 13440 + x**3 / 907200,
        (theta * s - 2.0 * (1.0 - c)) / (2.0 * y * y),
    )
    db = np.where(
        series,
        -1 / 120 + x / 2520 - x**2 / 120960 + x**3 / 9979200,
        (3.0 * s - 2.0 * theta - theta * c) / (2.0 * y * y * theta),
    )
    return a, b, da, db


def _bend(phi: Floats, phi1: Floats) -> Floats:
    """The derivative of J(φ) times φ′."""
    _, b, da, db = _coefficients(_dot(phi, phi))
    x1 = 2.0 * _dot(phi, phi1)
    side = cross(phi, phi1)
    bend: Floats = x1 * (da * side + db * cross(phi, side)) + b * cross(phi1, side)
    return bend


def _jacobian_times(phi: Floats, v: Floats) -> Floats:
    a, b, _, _ = _coefficients(_dot(phi, phi))
    side = cross(phi, v)
    product: Floats = v + a * side + b * cross(phi, side)
    return product


def _inverse_times(phi: Floats, v: Floats) -> Floats:
    x = _dot(phi, phi)
    a, b, _, _ = _coefficients(x)
    # c = (1 − (1 − x·b)/(2a))/x, and its series, since numerator and denominator vanish together.
    small = x < _SERIES_BELOW
    closed = (1.0 - (1.0 - x * b) / (2.0 * a)) / np.where(small, 1.0, x)
    c = np.where(small, 1 / 12 + x / 720 + x**2 / 30240 + x**3 / 1209600, closed)
    side = cross(phi, v)
    product: Floats = v - 0.5 * side + c * cross(phi, side)
    return product


def rates_of_vector(phi: Floats, phi1: Floats, phi2: Floats) -> tuple[Floats, Floats]:
    """φ, φ′, φ″ (..., 3) → ω and dω/dw (..., 3) in base axes."""
    return _jacobian_times(phi, phi1), _jacobian_times(phi, phi2) + _bend(phi, phi1)


def vector_of_rates(phi: Floats, rate: Floats, rate_change: Floats) -> tuple[Floats, Floats]:
    """φ, ω, dω/dw (..., 3) → φ′ and φ″ (..., 3); |φ| < 2π."""
    phi1 = _inverse_times(phi, rate)
    return phi1, _inverse_times(phi, rate_change - _bend(phi, phi1))
