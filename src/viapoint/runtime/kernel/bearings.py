"""Joints that a singular pose leaves free, as smooth functions along a path that meets or nearly meets one.

Such a joint is the bearing of a plane vector that vanishes at the singularity: J4 that of the hand's axis
seen along the forearm, J1 that of the wrist point seen along axis 1. Written as a complex number V the
vector is smooth along the path however near the path comes, while its argument is known only to
10⁻¹⁶/|V|, jumps where V passes through zero, and turns by half a turn within the distance of a miss. So V
is made a polynomial of x, the place from the centre of a span; its zeros say where the singular poses are.
A real zero is divided out: what is left has the argument that goes on smoothly (the configuration changes
there). A zero at x + i·d is a miss by d. Not here: spans of path and inverse kinematics.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from viapoint.runtime.kernel import chebyshev
from viapoint.runtime.records import Bools, Floats

Complexes = npt.NDArray[np.complex128]

SINGULAR: Final = 1e-10
"""|V| (rad; m for the wrist point) that counts as zero. The inverse kinematics takes the joint as free
below it. A path that comes nearer is taken through the pose: its orientation is missed by at most as much,
1e-7 mm at a metre from the wrist. One that does not is followed as it is, half a turn included."""

_SMOOTH: Final = 1e-13
"""Trailing coefficients of V below this: the polynomial is V up to rounding."""

_SHORTEST: Final = 1e-5
"""m. V that is not smooth over this much of path is not taken for smooth at all."""

Vector = Callable[[Floats], Complexes]
"""V at places w (N,) of a path."""

_POWERS: Final = np.stack(
    [
        np.pad(np.polynomial.chebyshev.cheb2poly(row[: k + 1]), (0, chebyshev.DEGREE - k))
        for k, row in enumerate(np.eye(chebyshev.DEGREE + 1))
    ],
    axis=1,
)
"""Chebyshev coefficients to those of powers, ascending."""


@dataclass(frozen=True, slots=True)
class Bearing:
    """One free joint along a span: the argument of a polynomial that has no real zero near the span.

    `coefficients` ascend in x/scale, where x counts from `centre`. V itself vanishes `within` the span so
    many times, and at its begin if it `begins_singular`; the other zeros near it, x + i·d, are `misses`.
    """

    joint: int
    centre: float
    scale: float
    coefficients: Complexes
    within: int = 0
    begins_singular: bool = False
    misses: tuple[complex, ...] = ()

    def angle(self, x: Floats) -> Floats:
        """The joint (N,), −π … π, at x (N,) from the centre."""
        return np.asarray(np.angle(_horner(self.coefficients, x / self.scale)))

    def moved(self, centre: float) -> Bearing:
        """The same, with x counted from another centre, so that it is exact near there."""
        by = (centre - self.centre) / self.scale
        return replace(self, centre=centre, coefficients=_moved(self.coefficients, by))


def zeros(vector: Vector, edges: Floats, near: float) -> list[complex] | None:
    """Zeros of V within `near` (m) of the intervals between edges (K + 1,), as places w + i·d.

    None where V vanishes all along. One look at V serves all intervals; those over which it is not smooth
    are halved for the next one.
    """
    found: list[complex] = []
    begins, ends = edges[:-1], edges[1:]
    vanishes = True
    while len(begins):
        halves = 0.5 * (ends - begins)
        values, series, smooth = _looked_at(vector, begins, halves)
        vanishes = vanishes and bool((np.abs(values) < SINGULAR).all())
        if vanishes:
            return None
        for k in np.flatnonzero(smooth & _may_vanish(series, near / halves)).tolist():
            begin, end, half = begins[k], ends[k], halves[k]
            places = begin + half * (1.0 + _roots(_trimmed(_POWERS @ series[k])))
            outside = np.maximum(np.maximum(begin - places.real, places.real - end), 0.0)
            found += [complex(w) for w in places[np.hypot(outside, places.imag) <= near]]
        left = np.flatnonzero(~smooth & (halves >= _SHORTEST))
        middles = begins[left] + halves[left]
        begins, ends = np.concatenate((begins[left], middles)), np.concatenate((middles, ends[left]))
    return found


def smooth(vector: Vector, begins: Floats, ends: Floats) -> Bools:
    """Whether V is smooth on each of the intervals (K,)."""
    return _looked_at(vector, begins, 0.5 * (ends - begins))[2]


def fit(vector: Vector, joint: int, centre: float, begin: float, end: float, near: float) -> Bearing | None:
    """The bearing of V on begin … end, as the path comes in from its begin; zeros within `near` m count.

    None where V is not smooth there.
    """
    scale = max(end - centre, centre - begin)
    coefficients = _polynomial(vector, begin, end, centre)
    if not len(coefficients) or end - begin < _SHORTEST:
        return None
    unit = 0.5 * (end - begin) / scale  # _polynomial's variable is in half lengths
    coefficients = np.asarray(coefficients * unit ** -np.arange(len(coefficients), dtype=np.float64))
    crossings, misses = [], []
    for root in _roots(coefficients):
        outside = max(root.real * scale - (end - centre), (begin - centre) - root.real * scale, 0.0)
        if abs(root.imag) * scale > near or outside > near:
            continue
        if abs(_horner(coefficients, np.array([root.real]))[0]) < SINGULAR:
            crossings.append(float(root.real))
        else:
            misses.append(complex(root * scale))
    ends = (begin - centre) / scale, (end - centre) / scale
    ahead = [y for y in crossings if y > ends[0] and not _is_singular(coefficients, y, ends[0])]
    within = [y for y in ahead if y < ends[1] and not _is_singular(coefficients, y, ends[1])]
    begins = any(_is_singular(coefficients, y, ends[0]) for y in crossings)
    for y in crossings:
        coefficients = _divided(coefficients, y)
    # before a zero that is still to come, V points against what is left when it is divided out
    coefficients = coefficients * (-1.0) ** len(ahead)
    return Bearing(joint, centre, scale, coefficients, len(within), begins, tuple(misses))


def held(joint: int, angle: float) -> Bearing:
    """The bearing of a joint that stays free all along a path: it keeps its angle."""
    return Bearing(joint, 0.0, 1.0, np.array([np.exp(1j * angle)]))


def _is_singular(coefficients: Complexes, zero: float, end: float) -> bool:
    """Whether an end of the span is one with a zero: all between the two is singular."""
    return bool(abs(_horner(coefficients, np.array([0.5 * (zero + end)]))[0]) < SINGULAR)


def _polynomial(vector: Vector, begin: float, end: float, centre: float) -> Complexes:
    """Coefficients of V, ascending, in (w − centre)/half length; none where V is not smooth."""
    half = 0.5 * (end - begin)
    _, series, smooth = _looked_at(vector, np.array([begin]), np.array([half]))
    if not smooth[0]:
        return np.zeros(0, dtype=np.complex128)
    return _moved(_trimmed(_POWERS @ series[0]), (centre - begin) / half - 1.0)


def _looked_at(vector: Vector, begins: Floats, halves: Floats) -> tuple[Complexes, Complexes, Bools]:
    """V on intervals of half lengths (K,): at their nodes (K·(D+1),), as Chebyshev coefficients (K, D+1),
    and where it is smooth (K,).
    """
    values = vector((begins[:, None] + 2.0 * halves[:, None] * chebyshev.NODES).ravel())
    parts = np.stack((values.real, values.imag), axis=1).reshape(len(begins), -1, 2)
    parts = chebyshev.unrounded_coefficients(parts)
    series = parts[:, :, 0] + 1j * parts[:, :, 1]
    tail = chebyshev.residual(parts).max(axis=1)
    return values, series, tail <= _SMOOTH * np.maximum(1.0, np.abs(series).max(axis=1))


def _may_vanish(series: Complexes, near: Floats) -> Bools:
    """Whether V (K, D+1) may be 0 within `near` (K,) half lengths of its interval: V at the middle is not
    larger than all that the other terms can come to there.
    """
    powers = np.abs(series @ _POWERS.T)
    reach = (1.0 + near)[:, None] ** np.arange(1, powers.shape[1])
    may: Bools = powers[:, 0] <= (powers[:, 1:] * reach).sum(axis=1)
    return may


def _trimmed(coefficients: Complexes) -> Complexes:
    """Without leading coefficients that are exactly 0."""
    last = np.flatnonzero(coefficients)
    return coefficients[: int(last[-1]) + 1 if len(last) else 1]


def _moved(coefficients: Complexes, by: float) -> Complexes:
    """The polynomial p(y + by), by repeated synthetic division."""
    moved = coefficients.copy()
    for k in range(len(moved)):
        for j in range(len(moved) - 2, k - 1, -1):
            moved[j] += by * moved[j + 1]
    return moved


def _roots(coefficients: Complexes) -> Complexes:
    if len(coefficients) < 2:
        return np.zeros(0, dtype=np.complex128)
    return np.asarray(np.roots(coefficients[::-1]))


def _divided(coefficients: Complexes, root: float) -> Complexes:
    """The quotient by (y − root), ascending; the remainder is below `SINGULAR`."""
    quotient = coefficients[1:].copy()
    for k in range(len(quotient) - 2, -1, -1):
        quotient[k] += root * quotient[k + 1]
    return quotient


def _horner(coefficients: Complexes, y: Floats) -> Complexes:
    value = np.full(y.shape, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = value * y + coefficient
    return value
