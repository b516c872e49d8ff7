"""x(s) = ṡ² as a C¹ piecewise quadratic: one Bézier coefficient c per piece, constant jerk at rest ends.

Between knots κᵢ of distance hᵢ the value and slope at a knot are
    xᵢ  = (hᵢ cᵢ₋₁ + hᵢ₋₁ cᵢ)/(hᵢ₋₁ + hᵢ),   x′ᵢ = 2 (cᵢ − cᵢ₋₁)/(hᵢ₋₁ + hᵢ).
At rest x ~ s^(4/3) (constant jerk) is singular in s, so a cubic in time of length r stands before the
first knot and behind the last: x₀ = c₀/(1 + 2h₀/3r), x′₀ = (4/3) x₀/r. A section that starts in motion
begins with a virtual piece instead; it and the first real piece are given by speed and acceleration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.law import Knots

FIXED_IN_MOTION: Final = 2
"""Coefficients that the state at the start of a section in motion determines."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_INNER: Final = 0.5 * (_NODES + 1.0)
GAUSS: Final = (0.5 * _WEIGHTS, (1.0 - _INNER) ** 2, 2.0 * _INNER * (1.0 - _INNER), _INNER * _INNER)
"""Weights of four places in a piece, and those of its Bézier coefficients there, (4,) each."""

TINY: Final = 1e-300


@dataclass(frozen=True, slots=True)
class Spline:
    """Knots (n+1,), widths (n,), and the two entries per knot of value and slope (n+1,).

    `weight` (n,): the duration is about Σ weight/√c. `rest_start` is 0 for a section in motion.
    """

    knots: Floats
    width: Floats
    value_lo: Floats
    value_hi: Floats
    slope_lo: Floats
    slope_hi: Floats
    weight: Floats
    rest_start: float
    rest_end: float

    @property
    def fixed(self) -> int:
        """How many leading coefficients are given."""
        return 0 if self.rest_start > 0.0 else FIXED_IN_MOTION

    def at_knots(self, c: Floats) -> tuple[Floats, Floats]:
        """x and x′ at the knots, (n+1,) each."""
        low, high = np.concatenate(([0.0], c)), np.concatenate((c, [0.0]))
        return self.value_lo * low + self.value_hi * high, self.slope_lo * low + self.slope_hi * high

    def durations(self, c: Floats, x: Floats) -> Floats:
        """Times (n,) of the pieces, ∫ds/√x by four-point Gauss quadrature; x (n+1,) at the knots."""
        total = np.zeros_like(c)
        for w, left, middle, right in zip(*GAUSS, strict=True):
            inner = left * x[:-1] + middle * c + right * x[1:]
            total += w / np.sqrt(np.maximum(inner, TINY))
        result: Floats = total * self.width
        return result


def trace(spline: Spline, c: Floats, s_end: float) -> Knots:
    """The law of coefficients c (n,): its knots from rest, or from the state in motion, to rest at s_end."""
    x, slope = spline.at_knots(c)
    x = np.maximum(x, 0.0)
    duration = spline.durations(c, x)
    last = 3.0 * spline.rest_end / math.sqrt(x[-1])
    s, v, a = spline.knots, np.sqrt(x), 0.5 * slope
    if spline.fixed:
        s, v, a, duration = s[1:], v[1:], a[1:], duration[1:]
        before = np.zeros(0)
    else:
        first = 3.0 * spline.rest_start / math.sqrt(x[0])
        before = np.array([spline.knots[0] - spline.rest_start])
        duration = np.concatenate(([first], duration))
    t = np.concatenate(([0.0], np.cumsum(duration), [0.0]))
    t[-1] = t[-2] + last
    still = np.zeros(len(before))
    return (
        t,
        np.concatenate((before, s, [s_end])),
        np.concatenate((still, v, [0.0])),
        np.concatenate((still, a, [0.0])),
    )


def make(knots: Floats, rest_start: float, rest_end: float) -> Spline:
    """Spline over knots (n+1,), with constant-jerk pieces of these lengths outside (start 0: in motion)."""
    h = np.diff(knots)
    n = len(h)
    value_lo, value_hi, slope_lo, slope_hi = (np.zeros(n + 1) for _ in range(4))
    both = h[:-1] + h[1:]
    value_lo[1:n], value_hi[1:n] = h[1:] / both, h[:-1] / both
    slope_lo[1:n], slope_hi[1:n] = -2.0 / both, 2.0 / both
    weight = h.copy()
    if rest_start > 0.0:
        value_hi[0] = 1.0 / _growth(h[0], rest_start)
        slope_hi[0] = (4.0 / 3.0) / rest_start * value_hi[0]
        weight[0] += 3.0 * rest_start * np.sqrt(_growth(h[0], rest_start))
    else:
        weight[0] = 0.0
    value_lo[n] = 1.0 / _growth(h[-1], rest_end)
    slope_lo[n] = -(4.0 / 3.0) / rest_end * value_lo[n]
    weight[-1] += 3.0 * rest_end * np.sqrt(_growth(h[-1], rest_end))
    return Spline(knots, h, value_lo, value_hi, slope_lo, slope_hi, weight, rest_start, rest_end)


def _growth(h: float, rest: float) -> float:
    """c/x at a rest end's knot: C¹ with x ~ s^(4/3)."""
    return 1.0 + 2.0 * h / (3.0 * rest)
