"""The limits as rows on the coefficients c of x(s) = ṡ²; tightened copies of them for a solve.

With q(s) an axis, q̇ = q′ṡ, q̈ = ½q′x′ + q″x and d³q/dt³ = (½q′x″ + (3/2)q″x′ + q‴x)√x (chain rule with
s̈ = ½x′). Speed bounds c; acceleration is linear in x at the knots; jerk reads L(c) ≤ j/√x, at both
ends of every piece. Rows are scaled so that a limit is 1. Not here: ticks, and the solver.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.limits import AxisLimits
from viapoint.runtime.timing.spline import Spline

SPEED_PART: Final = 0.9995
"""Part of the speed limits planned with; the rest is for the difference of ticks and knots."""

ACCELERATION_PART: Final = 0.9985
JERK_PART: Final = 1.03
"""Jerk counts over three ticks, which smooths its peaks; ticks are allowed 1.05."""

END_SHARE: Final = 0.5
"""Share of q‴ at the end of a piece in the jerk row there; the rest is its mean over the piece. Where q‴
swings within a piece (beside a singular pose), the mean alone forbids what no tick would show; the end
alone bounds a peak that the ticks smooth."""

_UNBOUNDED: Final = 1e3
"""Limit of a direction that has none, in units of the other direction's."""

Band = tuple[Floats, Floats, Floats]
"""Entries on the coefficient before, of and after each piece."""


@dataclass(frozen=True, slots=True)
class Rows:
    """m axes, n pieces, scaled by the limits. Immutable; `tightened` gives what the solver takes."""

    spline: Spline
    lo: Floats  # (m, n+1) acceleration at knots: entry on the coefficient before the knot
    hi: Floats  # (m, n+1) and behind it
    above: Floats  # (m+1, n+1) its upper limit: 1, but for separate decelerations; last row: of x
    below: Floats  # (m+1, n+1) its lower limit, positive
    left: Band  # (m, n) each: jerk/√x at the left end of the pieces
    right: Band  # (m, n) each: at the right end
    inverse_max: Floats  # (n,) 1/bound of c
    knot_max: Floats  # (n+1,) bound of x at the knots; inf: none
    axis_speed: Floats  # (m, n) ratio of the axes' speeds to their limits at ṡ = 1
    programmed: Floats  # (3, n) programmed speed at the left end, middle and right end of the pieces
    edges: Floats  # (n+1,) where the programmed speeds change: the knots, or breaks beside them


@dataclass(frozen=True, slots=True)
class Tightening:
    """Factors by which rows are multiplied: acceleration (n+1,), jerk (n,), speed (n,); 1: as planned."""

    acceleration: Floats
    jerk: Floats
    speed: Floats

    @staticmethod
    def none(n: int) -> Tightening:
        """No tightening of n pieces."""
        return Tightening(np.ones(n + 1), np.ones(n), np.ones(n))


@dataclass(frozen=True, slots=True)
class Problem:
    """What the solver takes: minimise Σ weight/√c subject to the rows; the first `fixed` c are given.

    Acceleration and, as the last row, x itself over its bound: −below ≤ lo cᵢ₋₁ + hi cᵢ ≤ above at knot i.
    Jerk: |jm cᵢ₋₁ + j0 cᵢ + jp cᵢ₊₁| ≤ 1/√cᵢ at both ends of piece i, left ends first.
    """

    weight: Floats  # (n,)
    fixed: int
    lo: Floats  # (m+1, n+1)
    hi: Floats
    above: Floats
    below: Floats
    jm: Floats  # (2m, n)
    j0: Floats
    jp: Floats
    inverse_max: Floats  # (n,)


@dataclass(frozen=True, slots=True)
class AxisRows:
    """What each axis says by itself; fields as of `Rows`, and |q′| over the speed limits at the knots
    (m, n+1) and in the middle of the pieces (m, n)."""

    lo: Floats
    hi: Floats
    left: Band
    right: Band
    ends: Floats
    middle: Floats


class RowNumerics(Protocol):
    """The functions that `build` is made of."""

    @property
    def axis_rows(self) -> Callable[..., AxisRows]: ...
    @property
    def sides(self) -> Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]: ...
    @property
    def bounds(self) -> Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]: ...


def build(
    spline: Spline,
    first: Floats,
    second: Floats,
    third: tuple[Floats, Floats],
    limits: AxisLimits,
    programmed: Floats,
    edges: Floats,
    in_jerk: Floats,
    numerics: RowNumerics,
) -> Rows:
    """Rows from the curve's first and second derivatives (n+1, m) at the knots, and the third (n, m) just
    inside the left and the right ends of the pieces.

    `programmed` (3, n) bounds ṡ at the left end, middle and right end of the pieces, between `edges`
    (n+1,); `in_jerk` (m,) are the jerk limits planned with, `numerics` the functions of this module or their
    compiled twins.
    """
    scale = limits.gentlest * ACCELERATION_PART
    each = numerics.axis_rows(spline, first, second, third, scale, in_jerk * JERK_PART, limits.speed)
    lo, hi, left, right, ends, middle = each.lo, each.hi, each.left, each.right, each.ends, each.middle
    above, below = _above_and_below(first, limits, scale, numerics)
    axis_speed = np.maximum(np.maximum(ends[:, 1:], ends[:, :-1]), middle)
    inverse_max, knot_max = numerics.bounds(ends, middle, programmed)
    _bound_rest(spline, first, in_jerk * JERK_PART, inverse_max)
    if spline.fixed:
        inverse_max[: spline.fixed] = 0.0
        knot_max[: spline.fixed] = np.inf
        for rows in (lo, hi):
            rows[:, : spline.fixed] = 0.0
        for rows in (*left, *right):
            rows[:, 0] = 0.0
    return Rows(
        spline, lo, hi, above, below, left, right, inverse_max, knot_max, axis_speed, programmed, edges
    )


def axis_rows(
    spline: Spline,
    first: Floats,
    second: Floats,
    third: tuple[Floats, Floats],
    acceleration: Floats,
    jerk: Floats,
    speed: Floats,
) -> AxisRows:
    """Rows of the axes from their derivatives, as in `build`, and the limits (m,) they are scaled by."""
    q1, q2 = _by_axis(first / acceleration), _by_axis(second / acceleration)
    lo = 0.5 * q1 * spline.slope_lo + q2 * spline.value_lo
    hi = 0.5 * q1 * spline.slope_hi + q2 * spline.value_hi
    return AxisRows(
        lo, hi, *_jerk(spline, first, second, third, jerk), *_axis_speed(spline, first, second, speed)
    )


def _above_and_below(
    first: Floats, limits: AxisLimits, scale: Floats, numerics: RowNumerics
) -> tuple[Floats, Floats]:
    """Limits above and below: along the motion of an axis its acceleration, against it its deceleration."""
    knots, axes = first.shape
    if limits.deceleration is None:
        ones = np.ones((axes + 1, knots))
        return ones, ones
    with np.errstate(invalid="ignore"):
        speeding = np.fmin(limits.acceleration * ACCELERATION_PART / scale, _UNBOUNDED)
        braking = np.fmin(limits.deceleration * ACCELERATION_PART / scale, _UNBOUNDED)
    return numerics.sides(first, speeding, braking)


def sides(first: Floats, speeding: Floats, braking: Floats) -> tuple[Floats, Floats]:
    """Limits above and below (m+1, n+1) of axes with first derivatives (n+1, m), speeding up and braking
    (m,); the last row, of x, is 1.
    """
    forward = _by_axis(first) >= 0.0
    up, down = speeding[:, None], braking[:, None]
    one = np.ones((1, len(first)))
    above, below = np.where(forward, up, down), np.where(forward, down, up)
    return np.vstack((above, one)), np.vstack((below, one))


def _by_axis(x: Floats) -> Floats:
    return np.ascontiguousarray(x.T)


def _jerk(
    spline: Spline, first: Floats, second: Floats, third: tuple[Floats, Floats], limit: Floats
) -> tuple[Band, Band]:
    """½q′x″ + (3/2)q″x′ + q‴x at both ends of the pieces; q‴ between that of the end and the piece's mean."""
    h = spline.width
    q1, q2 = _by_axis(0.5 * first / limit), _by_axis(1.5 * second / limit)
    mean = np.diff(second, axis=0) / h[:, None]
    begin, end = (_by_axis((END_SHARE * q3 + (1.0 - END_SHARE) * mean) / limit) for q3 in third)
    bend_m = -spline.slope_lo[:-1] / h
    bend_0 = (spline.slope_lo[1:] - spline.slope_hi[:-1]) / h
    bend_p = spline.slope_hi[1:] / h
    a, b = q1[:, :-1], q2[:, :-1]
    left = (
        a * bend_m + b * spline.slope_lo[:-1] + begin * spline.value_lo[:-1],
        a * bend_0 + b * spline.slope_hi[:-1] + begin * spline.value_hi[:-1],
        a * bend_p,
    )
    a, b = q1[:, 1:], q2[:, 1:]
    right = (
        a * bend_m,
        a * bend_0 + b * spline.slope_lo[1:] + end * spline.value_lo[1:],
        a * bend_p + b * spline.slope_hi[1:] + end * spline.value_hi[1:],
    )
    return left, right


def _axis_speed(spline: Spline, first: Floats, second: Floats, speed: Floats) -> tuple[Floats, Floats]:
    """|q′| over the limit: at the knots (m, n+1) and in the middle of the pieces (m, n)."""
    middle = 0.5 * (first[1:] + first[:-1]) - 0.125 * spline.width[:, None] * np.diff(second, axis=0)
    return _by_axis(np.abs(first) / speed), _by_axis(np.abs(middle) / speed)


def bounds(ends: Floats, middle: Floats, programmed: Floats) -> tuple[Floats, Floats]:
    """1/bound (n,) of c and bound (n+1,) of x at the knots, from the axes' speeds over their limits at ṡ = 1.

    Where the bound of x varies over a piece, x follows it if its knots are on it and c where the parabola
    through both ends and the middle has its control point; never below the smallest of the three.
    """
    fastest = ends.max(axis=0, initial=0.0)
    rates = np.stack((fastest[:-1], middle.max(axis=0, initial=0.0), fastest[1:]))
    with np.errstate(divide="ignore", invalid="ignore"):
        three = np.minimum(1.0 / rates, programmed) ** 2
        left, x, right = three
        c = np.minimum(2.0 * x - 0.5 * (left + right), three.max(axis=0))
    c = np.fmax(c, three.min(axis=0))
    knots = np.minimum(np.append(left, right[-1:]), np.append(left[:1], right))
    part = SPEED_PART * SPEED_PART
    return 1.0 / (c * part), knots * part


def _bound_rest(spline: Spline, first: Floats, jerk: Floats, inverse_max: Floats) -> None:
    """The constant jerk at a rest end is (2/9) x^(3/2)/r²; bound c there so that no axis exceeds its own."""
    ends = ((0, spline.rest_start, spline.value_hi[0]), (-1, spline.rest_end, spline.value_lo[-1]))
    for k, rest, value in ends:
        if rest > 0.0:
            share = (np.abs(first[k]) / jerk).max(initial=0.0) * (2.0 / 9.0) / rest**2
            inverse_max[k] = max(inverse_max[k], value * share ** (2.0 / 3.0))


def tightened(rows: Rows, by: Tightening, c: Floats) -> Problem:
    """The problem around the iterate c: jerk's √x at the ends of a piece as a multiple of its √c."""
    spline = rows.spline
    x, _ = spline.at_knots(c)
    ratio_left = np.sqrt(np.maximum(x[:-1], 0.0) / c) * by.jerk
    ratio_right = np.sqrt(np.maximum(x[1:], 0.0) / c) * by.jerk
    jm, j0, jp = (
        np.vstack((a * ratio_left, b * ratio_right)) for a, b in zip(rows.left, rows.right, strict=True)
    )
    speed = by.speed**2
    inverse_max = rows.inverse_max * speed
    for k, fixed in ((0, spline.fixed > 0), (-1, False)):
        if not fixed:
            inverse_max[k] *= max(1.0, by.jerk[k]) ** (2.0 / 3.0)
    knot_max = rows.knot_max / np.maximum(np.append(speed[:1], speed), np.append(speed, speed[-1:]))
    return Problem(
        weight=spline.weight,
        fixed=spline.fixed,
        lo=np.vstack((rows.lo * by.acceleration, spline.value_lo / knot_max)),
        hi=np.vstack((rows.hi * by.acceleration, spline.value_hi / knot_max)),
        above=rows.above,
        below=rows.below,
        jm=jm,
        j0=j0,
        jp=jp,
        inverse_max=inverse_max,
    )
