"""A quick upper estimate of the speed over the section: it places the knots and starts the solver.

Per sample the bounds of speed, of the centripetal term |q″|ṡ² ≤ a and of |q‴|ṡ³ ≤ j; between samples
tangential acceleration, by two min-plus scans over x = ṡ²; at rest ends a constant-jerk ramp. Only
tick checks prove limits; nothing here does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.core import chosen
from viapoint.runtime.timing.curve import INSET, AxisCurve
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.limits import AxisLimits, SpeedBound

_SAMPLES: Final = 64
"""Samples over a section without breaks; a dip of the speed limit (a singularity) narrower than 1/64
of the section is found by refinement if its flank is met."""

_SAMPLES_PER_PIECE: Final = 6
"""Samples between two breaks at least: the speed limit of a round edge has up to three minima."""

_RAMP: Final = 3.0 * 0.75 ** np.arange(30)
"""Samples beside the ends, in sample distances: near rest speed goes as s^(2/3)."""

_REFINE_ABOVE: Final = (0.2, 0.4, 1.0, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5)
"""Neighbouring speed limits that differ by more (natural logarithm) get a sample between them, round by
round: at first for accuracy, then only where a singular pose is passed closely."""

_SPLITS: Final = np.arange(1, 3) / 3.0
"""Where they are split: at thirds, which takes half as many rounds as in the middle."""

_FLANK: Final = 0.4
"""Fall before and rise behind two neighbours (natural logarithm) that hide the bottom of a dip between."""

_FINEST: Final = 0.004
"""s to pass from sample to sample at the slower one's speed: closer is finer than the knots will be."""

_TICKS_TO_FULL: Final = 0.25
"""An acceleration that changes the top speed (a jerk: the acceleration) within this part of a tick is
as good as infinite: differences over whole ticks cannot tell."""

_STRAIGHT: Final = 1e-7
"""Relative variation of a rate that is rounding (of interpolated axes: 1e-12 rad over 0.1 mm)."""

_HELD: Final = 1e-3
"""Relative change of the speed between samples that is none."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Samples (N,) of s, estimated speed v, time t, and whether the speed is just held there."""

    s: Floats
    v: Floats
    t: Floats
    calm: npt.NDArray[np.bool_]
    acceleration: float  # smallest possible path acceleration at the start and the end
    jerk_start: float
    jerk_end: float
    response: float  # s, shortest time in which an axis builds up its acceleration: min a/j
    straight: StraightLine | None  # set if every axis and the speed bound are constant along s


@dataclass(frozen=True, slots=True)
class StraightLine:
    """Every axis linear in s: rates (m,) per s, and the constant bound of ṡ."""

    rates: Floats
    bound: float


def estimate(
    curve: AxisCurve,
    limits: AxisLimits,
    bound: SpeedBound,
    s_start: float,
    s_end: float,
    tick: float,
    v_start: float = 0.0,
) -> Estimate:
    """Speed estimate from speed v_start at s_start to rest at s_end.

    Raises TimingError if the curve or the bound is not finite there, or if nothing limits the motion.
    """
    s, first, ceiling, straight = _ceiling(curve, limits, bound, s_start, s_end)
    room_of = chosen().room
    room, brake = room_of(first, limits.acceleration), room_of(first, limits.braking)
    jerk = room_of(first, limits.jerk)
    top = _top_speed(ceiling, room, jerk, s_end - s_start)
    instant = top / (_TICKS_TO_FULL * tick)
    ceiling, room, brake = (np.minimum(x, c) for x, c in ((ceiling, top), (room, instant), (brake, instant)))
    jerk = np.minimum(jerk, np.minimum(room, brake) / (_TICKS_TO_FULL * tick))
    x = _scan(ceiling**2, room, brake, s, v_start**2)
    v = np.sqrt(x)
    if v_start == 0.0:
        v = np.minimum(v, _ramp(s - s_start, jerk[0]))
    v = np.minimum(v, _ramp(s_end - s, jerk[-1]))
    mean = np.maximum(v[1:] + v[:-1], 1e-9 * top)
    t = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(s) / mean)))
    ends = np.minimum(room, brake)[[0, -1]].min()
    with np.errstate(divide="ignore", invalid="ignore"):
        response = np.nan_to_num(limits.gentlest / limits.jerk, nan=np.inf, posinf=np.inf).min()
    return Estimate(
        s, v, t, _calm(v, ceiling), float(ends), float(jerk[0]), float(jerk[-1]), float(response), straight
    )


def _ceiling(
    curve: AxisCurve, limits: AxisLimits, bound: SpeedBound, s_start: float, s_end: float
) -> tuple[Floats, Floats, Floats, StraightLine | None]:
    """Samples, first derivatives and speed limits without tangential acceleration, refined at dips."""
    marks = inner_breaks(curve, s_start, s_end)
    s = _first_samples(marks)
    first, ceiling, programmed = _limits_at(curve, limits, bound, s)
    straight = _straight(first, programmed)
    for above in _REFINE_ABOVE:
        with np.errstate(invalid="ignore"):
            change = np.diff(np.log(ceiling))
        steep = np.abs(change) > above
        steep[1:-1] |= (change[:-2] < -_FLANK) & (change[2:] > _FLANK)
        steep &= np.diff(s) > _FINEST * np.minimum(ceiling[1:], ceiling[:-1])
        if not steep.any():
            break
        between = (s[:-1] + np.diff(s) * _SPLITS[:, None])[:, steep].ravel()
        more, more_ceiling, _ = _limits_at(curve, limits, bound, between)
        order = np.argsort(np.concatenate((s, between)), kind="stable")
        s = np.concatenate((s, between))[order]
        first = np.concatenate((first, more))[order]
        ceiling = np.concatenate((ceiling, more_ceiling))[order]
    return s, first, ceiling, straight


def inner_breaks(curve: AxisCurve, s_start: float, s_end: float) -> Floats:
    """Ascending marks from s_start to s_end: the two, and the curve's breaks between them."""
    margin = INSET * (s_end - s_start)
    breaks = np.asarray(curve.breaks, dtype=np.float64)
    breaks = breaks[(breaks > s_start + margin) & (breaks < s_end - margin)]
    return np.concatenate(([s_start], breaks, [s_end]))


def _first_samples(marks: Floats) -> Floats:
    length = np.diff(marks)
    count = np.maximum(np.ceil(length / (marks[-1] - marks[0]) * _SAMPLES), _SAMPLES_PER_PIECE).astype(int)
    piece = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    inner = marks[piece] + length[piece] * step / count[piece]
    near = (marks[-1] - marks[0]) / _SAMPLES * _RAMP
    return np.unique(np.concatenate((inner, marks[0] + near, marks[-1] - near, marks[-1:])))


def _limits_at(
    curve: AxisCurve, limits: AxisLimits, bound: SpeedBound, s: Floats
) -> tuple[Floats, Floats, Floats]:
    """First derivatives (N, m), speed limits and programmed speeds (N,) at s; checked to be finite."""
    first, second, third = curve.derivatives(s)
    programmed = bound(s)
    ceiling, cubed, bad = chosen().ceilings(
        first, second, third, programmed, limits.speed, limits.gentlest, limits.jerk
    )
    if bad >= 0:
        where = float(s[bad])
        raise TimingError(
            f"the curve or its programmed speed is not a finite number at s = {where:.9g}", where
        )
    return first, np.minimum(ceiling, np.cbrt(cubed)), programmed


def _straight(first: Floats, programmed: Floats) -> StraightLine | None:
    """The straight line, if rates and bound vary by no more than rounding."""
    rates = first[0]
    spread = np.abs(first - rates).max(axis=0)
    if (spread > _STRAIGHT * np.abs(rates) + _STRAIGHT * np.abs(rates).max(initial=0.0)).any():
        return None
    slowest = float(programmed.min())
    if not (np.isinf(slowest) or float(programmed.max()) <= slowest * (1.0 + _STRAIGHT)):
        return None
    return StraightLine(np.abs(first).max(axis=0), slowest)


def _top_speed(ceiling: Floats, room: Floats, jerk: Floats, length: float) -> float:
    """A finite speed that the section cannot exceed or need not."""
    for highest in (ceiling, np.sqrt(2.0 * room * length), np.cbrt(jerk * length**2)):
        finite = highest[np.isfinite(highest)]
        if finite.size:
            return float(finite.max())
    raise TimingError("neither a speed nor an acceleration nor a jerk limits the motion")


def _scan(x: Floats, room: Floats, brake: Floats, s: Floats, x_start: float) -> Floats:
    """x = ṡ² lowered until neighbours differ by no more than 2∫a ds allows, from x_start to rest."""
    ds = np.diff(s)
    gained = np.concatenate(([0.0], np.cumsum((room[1:] + room[:-1]) * ds)))
    lost = np.concatenate(([0.0], np.cumsum((brake[1:] + brake[:-1]) * ds)))
    x = x.copy()
    x[0], x[-1] = x_start, 0.0
    x = np.minimum.accumulate(x - gained) + gained
    x = np.minimum.accumulate((x + lost)[::-1])[::-1] - lost
    return np.maximum(x, 0.0)


def _calm(v: Floats, ceiling: Floats) -> npt.NDArray[np.bool_]:
    """Where the estimate follows a limit that stays the same from sample to sample."""
    held = v >= (1.0 - _HELD) * ceiling
    steady = np.abs(np.diff(v)) <= _HELD * v[1:]
    calm: npt.NDArray[np.bool_] = held & np.append(steady, False) & np.append(False, steady)
    return calm


def _ramp(distance: Floats, jerk: float) -> Floats:
    """Speed after `distance` from rest at constant jerk."""
    result: Floats = 0.5 * jerk * np.cbrt(6.0 * np.maximum(distance, 0.0) / jerk) ** 2
    return result
