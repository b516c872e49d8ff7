"""The time law s(t): quintic pieces between knots of position, speed and acceleration.

Immutable. Times of the knots count from the law's own start, so that a law may be moved on the clock
without touching a bit of it. Not here: how the knots are found (planner), ticks and their check.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from viapoint.runtime.records import Floats

if TYPE_CHECKING:
    from viapoint.runtime.timing.section import Plan

PROGRAMMED_SPEED: Final = -1
"""Code of `limited_by`: the programmed speed. Axes are 0, 1, ..."""

UNLIMITED: Final = -2
"""Code of `limited_by`: no constraint is near its limit there."""

_KEPT: Final = 0.05
"""s of the past that a trimmed law keeps: an extension is checked from four ticks before its start on."""

_INVERSE_STEPS: Final = 60
"""Halvings that bring any bracket below the resolution of a float; Newton needs 4 to 6 of them."""

_SETTLED: Final = 1e-12
_NEARLY: Final = 1e-9
"""Steps, as parts of a piece, at which an inverse is found: the larger one if it moves s by no more than
`_RESOLUTION` of s. From there on Newton's method only follows rounding, for ever if it may.
"""

_RESOLUTION: Final = 2e-15


Knots = tuple[Floats, Floats, Floats, Floats]
"""t (from the first knot), s, ṡ and s̈ at the knots of a stretch of law."""


@dataclass(frozen=True, slots=True)
class Quality:
    """How a law came to be: the method, solver iterations, tick checks, uniform stretch (1: none), peaks.

    `peaks` are the largest tick ratios of speed, acceleration and jerk to their limits.
    """

    method: str
    iterations: int = 0
    passes: int = 0
    stretch: float = 1.0
    peaks: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class TimeLaw:
    """s(t) from t0 on; at rest at its end, and for ever after.

    Knots (K,): `t` (s, since t0), `s`, `v` = ṡ, `a` = s̈. Piece k is the polynomial
    s(u) = Σ coeffs[k, i] uⁱ, u = (t − t[k]) / width[k]; a piece that was cut short by an extension
    keeps its polynomial, so what was already sent is reproduced bit by bit.
    """

    t0: float
    t: Floats
    s: Floats
    v: Floats
    a: Floats
    width: Floats  # (K-1,) s
    coeffs: Floats  # (K-1, 6)
    limiter: npt.NDArray[np.int16]  # (K-1,) codes of `limited_by`
    quality: Quality
    plan: Plan | None = None

    @property
    def duration(self) -> float:
        """s."""
        return float(self.t[-1])

    @property
    def t_end(self) -> float:
        """Time at which the law comes to rest, on the clock of t0."""
        return self.t0 + float(self.t[-1])

    @property
    def s_start(self) -> float:
        """Parameter of the first knot."""
        return float(self.s[0])

    @property
    def s_end(self) -> float:
        """Parameter at which the law comes to rest."""
        return float(self.s[-1])

    def at(self, t: npt.ArrayLike) -> tuple[Floats, Floats, Floats]:
        """s, ṡ, s̈ (N,) at times t (N,) of the clock; at rest before t0 and after t_end."""
        return self.since_start(np.asarray(t, dtype=np.float64) - self.t0)

    def since_start(self, tau: Floats) -> tuple[Floats, Floats, Floats]:
        """s, ṡ, s̈ (N,) at times tau (N,) since t0. Every element is computed by itself."""
        inside = np.minimum(np.maximum(tau, self.t[0]), self.t[-1])
        k = np.minimum(np.searchsorted(self.t, inside, side="right") - 1, len(self.width) - 1)
        width = self.width[k]
        u = (inside - self.t[k]) / width
        s, ds, dds = _horner(self.coeffs[k], u)
        v, a = ds / width, dds / (width * width)
        over = tau >= self.t[-1]
        if over.any():
            s, v, a = (np.where(over, end, x) for end, x in ((self.s[-1], s), (0.0, v), (0.0, a)))
        return s, v, a

    def time_of(self, s: npt.ArrayLike) -> Floats:
        """Times on the clock at which the parameters s are reached (the inverse of `at`); clamped."""
        asked = np.asarray(s, dtype=np.float64)
        inside = np.clip(asked, self.s[0], self.s[-1])
        k = np.clip(np.searchsorted(self.s, inside, side="right") - 1, 0, len(self.width) - 1)
        low = np.zeros_like(inside)
        high = (self.t[k + 1] - self.t[k]) / self.width[k]
        result: Floats = self.t0 + (self.t[k] + self.width[k] * _solve(self.coeffs[k], inside, low, high))
        return result

    def limited_by(self, s: npt.ArrayLike) -> npt.NDArray[np.int16]:
        """What holds the speed back at s: an axis index, PROGRAMMED_SPEED or UNLIMITED."""
        k = np.searchsorted(self.s, np.asarray(s, dtype=np.float64), side="right") - 1
        return self.limiter[np.clip(k, 0, len(self.limiter) - 1)]

    def moved(self, t0: float, s_start: float, s_end: float) -> TimeLaw:
        """The same law, of a curve whose parameter is counted from elsewhere: from s_start at t0 to s_end."""
        by = s_start - self.s_start
        s, coeffs = self.s + by, self.coeffs.copy()
        s[0], s[-1] = s_start, s_end
        coeffs[:, 0] += by
        plan = None if self.plan is None else self.plan.moved(by)
        return replace(self, t0=t0, s=s, coeffs=coeffs, plan=plan)

    def without_past(self, t: float) -> TimeLaw:
        """The same law without the pieces that end well before time t: they cannot be asked again.

        What an extension at t needs of the time before it is kept.
        """
        k = int(np.searchsorted(self.t, t - _KEPT - self.t0, side="right")) - 1
        k = min(max(k, 0), len(self.width) - 1)
        if k == 0:
            return self
        knots = {n: getattr(self, n)[k:] for n in ("t", "s", "v", "a", "width", "coeffs", "limiter")}
        plan = None if self.plan is None else replace(self.plan, first_knot=self.plan.first_knot - k)
        return replace(self, **knots, plan=plan)


def hermite(t: Floats, s: Floats, v: Floats, a: Floats) -> tuple[Floats, Floats]:
    """Widths (K-1,) and coefficients (K-1, 6) of the quintics through the knots.

    A cubic (constant jerk) is reproduced exactly.
    """
    width = np.diff(t)
    rise = np.diff(s)
    v0, v1 = v[:-1] * width, v[1:] * width
    square = width * width
    a0, a1 = a[:-1] * square, a[1:] * square
    c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * rise - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1
    return width, np.stack((s[:-1], v0, 0.5 * a0, c3, c4, c5), axis=1)


def _horner(c: Floats, u: Floats) -> tuple[Floats, Floats, Floats]:
    """Value, first and second derivative with respect to u of the quintics c (N, 6) at u (N,)."""
    c0, c1, c2, c3, c4, c5 = (c[..., i] for i in range(6))
    value = c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5))))
    first = c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * (5.0 * c5))))
    second = 2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * (20.0 * c5)))
    return value, first, second


def _solve(c: Floats, s: Floats, low: Floats, high: Floats) -> Floats:
    """u in [low, high] with s(u) = s: Newton's method, halving the bracket where it would leave it."""
    u = 0.5 * (low + high)
    for _ in range(_INVERSE_STEPS):
        value, slope, _ = _horner(c, u)
        above, rises = value > s, slope > 0.0
        low, high = np.where(above, low, u), np.where(above, u, high)
        newton = u - (value - s) / np.where(rises, slope, np.inf)
        nearest = np.clip(newton, low, high)  # at an end, but for rounding
        inside = rises & (np.abs(newton - nearest) <= _NEARLY)
        following = np.where(inside, nearest, 0.5 * (low + high))
        step = np.abs(following - u)
        settled = (step <= _SETTLED) | ((step <= _NEARLY) & (step * slope <= _RESOLUTION * (1.0 + np.abs(s))))
        u = following
        if settled.all():
            break
    return u
