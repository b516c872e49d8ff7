"""Derivatives of a rotation against derivatives of its rotation vector, and the shorter way round.

For R(w) = exp(φ(w))·R_m, in base axes: ω = J(φ)·φ′ with J = 1 + a·[φ] + b·[φ]², a = (1 − cos θ)/θ²,
b = (θ − sin θ)/θ³, θ = |φ|. Rates are per unit of the path parameter; there is no time here.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from viapoint.runtime.path.moves import Floats

# Rotations within this of 180° (rad) count as half turns: the sense is then decided by the frame's +Z and
# not by rounding of the two orientations (12 digits of a pose read from a file leave 1e-9).
HALF_TURN_MARGIN = 1e-6
# An axis whose component along a tie-breaking direction is smaller than this is square to it.
SQUARE = 1e-6
# Below this θ² the closed forms of a, b and their derivatives lose digits; four terms of the series do not.
SERIES_BELOW = 1e-2
_CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])


def cross(a: Floats, b: Floats) -> Floats:
    """Vector product of (3,) or (N, 3), the same shape both; quicker than numpy's for small batches."""
    if a.ndim == 1:
        (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
        return np.array((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx))
    c = np.empty_like(a)
    c[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    c[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    c[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return c


def norm(v: Floats) -> float:
    """Length of one vector."""
    return math.sqrt(float(v @ v))


def product(a: Floats, b: Floats) -> Floats:
    """Hamilton product of two single quaternions (4,)."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a.tolist(), b.tolist()
    return np.array(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        )
    )


def exponential(phi: Floats) -> Floats:
    """Rotation vector (3,) → quaternion (4,)."""
    x, y, z = phi.tolist()
    half = 0.5 * math.sqrt(x * x + y * y + z * z)
    scale = 0.5 * (math.sin(half) / half if half > 0.0 else 1.0)
    return np.array((math.cos(half), scale * x, scale * y, scale * z))


def turned(phi: Floats, q: Floats) -> Floats:
    """exp(φ)·q for rotation vectors φ (N, 3) and one quaternion q (4,): (N, 4)."""
    half = 0.5 * np.sqrt(_dot(phi, phi)[:, 0])
    scale = 0.5 * np.where(half > 0.0, np.sin(half) / np.where(half > 0.0, half, 1.0), 1.0)
    (x, y, z), c = (scale * column for column in phi.T), np.cos(half)
    qw, qx, qy, qz = q.tolist()
    result = np.empty((len(phi), 4))
    result[:, 0] = c * qw - x * qx - y * qy - z * qz
    result[:, 1] = c * qx + x * qw + y * qz - z * qy
    result[:, 2] = c * qy - x * qz + y * qw + z * qx
    result[:, 3] = c * qz + x * qy - y * qx + z * qw
    return result


def rotation_from(start: Floats, end: Floats) -> Floats:
    """(4,), (4,) → (3,) rotation vector φ, |φ| ≤ π, in base axes: R(end) = exp(φ)·R(start)."""
    w, x, y, z = product(end, start * _CONJUGATE).tolist()
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 * math.atan2(sine, abs(w)) / sine if sine > 0.0 else 2.0
    scale = -scale if w < 0.0 else scale
    return np.array((scale * x, scale * y, scale * z))


def shortest_turn(start: Floats, end: Floats, z_axis: Floats) -> Floats:
    """The rotation vector of the shorter way from one orientation to another.

    Of two orientations 180° apart the axis is unique but for its sign, and both senses sweep the tool
    axis equally: the sense is the one that is positive about `z_axis`; for an axis square to it, about
    the base's +X, then +Y.
    """
    turn = rotation_from(start, end)
    angle = norm(turn)
    if angle < math.pi - HALF_TURN_MARGIN:
        return turn
    axis = turn / angle
    for sign in (float(axis @ z_axis), float(axis[0]), float(axis[1]), float(axis[2])):
        if abs(sign) > SQUARE:
            return turn if sign > 0.0 else -axis * (2.0 * math.pi - angle)
    return turn


def rates_of_vectors(phi: Floats, phi1: Floats, phi2: Floats) -> tuple[Floats, Floats]:
    """φ, φ′, φ″, all (3,) or all (N, 3) → ω and dω/dw in base axes."""
    x, x1 = _dot(phi, phi), 2.0 * _dot(phi, phi1)
    a, b, da, db = _coefficients(x) if isinstance(x, np.ndarray) else _coefficients_at(x)
    side1, side2 = cross(phi, phi1), cross(phi, phi2)
    out1, out2 = cross(phi, side1), cross(phi, side2)
    rate = phi1 + a * side1 + b * out1
    change = phi2 + a * side2 + b * out2 + x1 * (da * side1 + db * out1) + b * cross(phi1, side1)
    return rate, change


def vector_of_rates(phi: Floats, rate: Floats, rate_change: Floats) -> tuple[Floats, Floats]:
    """φ, ω, dω/dw (3,) → φ′ and φ″ (3,); |φ| < 2π. The inverse J⁻¹ = 1 − [φ]/2 + c·[φ]²."""
    x = float(phi @ phi)
    a, b, da, db = _coefficients_at(x)
    c = (1.0 - (1.0 - x * b) / (2.0 * a)) / x if x >= SERIES_BELOW else 1 / 12 + x / 720 + x**2 / 30240
    side = cross(phi, rate)
    phi1 = rate - 0.5 * side + c * cross(phi, side)
    side = cross(phi, phi1)
    bend = 2.0 * float(phi @ phi1) * (da * side + db * cross(phi, side)) + b * cross(phi1, side)
    rest = rate_change - bend
    side = cross(phi, rest)
    return phi1, rest - 0.5 * side + c * cross(phi, side)


def _dot(a: Floats, b: Floats) -> Any:
    if a.ndim == 1:
        return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
    return (a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])[:, None]


def _coefficients_at(x: float) -> tuple[Any, Any, Any, Any]:
    """a, b, da/dx, db/dx at one x = θ²."""
    if x < SERIES_BELOW:
        return _series(x)
    theta = math.sqrt(x)
    return _closed(x, theta, math.sin(theta), math.cos(theta))


def _coefficients(x: Floats) -> tuple[Any, Any, Any, Any]:
    """a, b, da/dx, db/dx at many x = θ²."""
    small = x < SERIES_BELOW
    y = np.where(small, 1.0, x)
    theta = np.sqrt(y)
    closed = _closed(y, theta, np.sin(theta), np.cos(theta))
    if not small.any():
        return closed
    a, b, da, db = (np.where(small, s, c) for s, c in zip(_series(x), closed, strict=True))
    return a, b, da, db


# The formulas serve floats and arrays alike, hence Any.


def _closed(x: Any, theta: Any, s: Any, c: Any) -> tuple[Any, Any, Any, Any]:
    return (
        (1.0 - c) / x,
        (theta - s) / (x * theta),
        (theta * s - 2.0 * (1.0 - c)) / (2.0 * x * x),
        (3.0 * s - 2.0 * theta - theta * c) / (2.0 * x * x * theta),
    )


def _series(x: Any) -> tuple[Any, Any, Any, Any]:
    return (
        1 / 2 - x * (1 / 24 - x * (1 / 720 - x / 40320)),
        1 / 6 - x * (1 / 120 - x * (1 / 5040 - x / 362880)),
        -1 / 24 + x * (1 / 360 - x * (1 / 13440 - x / 907200)),
        -1 / 120 + x * (1 / 2520 - x * (1 / 120960 - x / 9979200)),
    )
