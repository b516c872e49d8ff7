"""A quick upper estimate of the speed over the section: it places the knots and starts the solver.

Per sample the bounds of speed, of the centripetal term |q″|ṡ² ≤ a and of |q‴|ṡ³ ≤ j; between samples
tangential acceleration, by two min-plus scans over x = ṡ²; at rest ends a constant-jerk ramp. Only
tick checks prove limits; nothing here does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.core import chosen
from viapoint.runtime.timing.curve import INSET, AxisCurve
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.limits import AxisLimits, SpeedBound

_REFINE_ABOVE: Final = (0.2, 0.4, 1.0, 1.5, 1.5, 1.5, 1.5, 1.5, 1.5)
"""Neighbouring speed limits that differ by more (natural logarithm) get a sample between them, round by
round: at first for accuracy, then only where a singular pose is passed closely."""


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
    breaks: Floats  # (k,) the curve's, between start and end


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
    marks = inner_breaks(curve, s_start, s_end)
    s, first, ceiling, straight = _ceiling(curve, limits, bound, marks)
    numerics = chosen()
    rooms = numerics.rooms(first, limits.acceleration, limits.braking, limits.jerk)
    top = _top_speed(ceiling, rooms[0], rooms[2], s_end - s_start)
    v, ceiling, cubes, (acceleration, jerk_start, jerk_end) = numerics.scanned(
        s, ceiling, rooms, top, tick, v_start**2
    )
    jerk = jerk_start, jerk_end
    v, t, calm = numerics.timed(s, v, ceiling, np.cbrt(cubes), jerk, top, v_start == 0.0)
    response, breaks = _response(limits), marks[1:-1]
    return Estimate(s, v, t, calm, acceleration, jerk_start, jerk_end, response, straight, breaks)


def _ceiling(
    curve: AxisCurve, limits: AxisLimits, bound: SpeedBound, marks: Floats
) -> tuple[Floats, Floats, Floats, StraightLine | None]:
    """Samples, first derivatives and speed limits without tangential acceleration, refined at dips."""
    numerics = chosen()
    s = numerics.first_samples(marks)
    first, ceiling, programmed = _limits_at(curve, limits, bound, s)
    rates = numerics.even(first, programmed)
    straight = None if rates is None else StraightLine(rates, float(programmed.min()))
    for above in _REFINE_ABOVE:
        between, before = numerics.dips(s, np.log(ceiling), ceiling, above)
        if len(between) == 0:
            break
        more, more_ceiling, _ = _limits_at(curve, limits, bound, between)
        s, first, ceiling = (
            numerics.merged(rows, new, before)
            for rows, new in ((s, between), (first, more), (ceiling, more_ceiling))
        )
    return s, first, ceiling, straight


def inner_breaks(curve: AxisCurve, s_start: float, s_end: float) -> Floats:
    """Ascending marks from s_start to s_end: the two, and the curve's breaks between them."""
    margin = INSET * (s_end - s_start)
    breaks = np.asarray(curve.breaks, dtype=np.float64)
    breaks = breaks[(breaks > s_start + margin) & (breaks < s_end - margin)]
    return np.concatenate(([s_start], breaks, [s_end]))


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


def _top_speed(ceiling: Floats, room: Floats, jerk: Floats, length: float) -> float:
    """A finite speed that the section cannot exceed or need not."""
    for highest in (ceiling, np.sqrt(2.0 * room * length), np.cbrt(jerk * length**2)):
        finite = highest[np.isfinite(highest)]
        if finite.size:
            return float(finite.max())
    raise TimingError("neither a speed nor an acceleration nor a jerk limits the motion")


def _response(limits: AxisLimits) -> float:
    """The shortest time in which an axis builds up its acceleration, s."""
    both = zip(limits.gentlest.tolist(), limits.jerk.tolist(), strict=True)
    return min((a / j for a, j in both if not (math.isinf(a) and math.isinf(j))), default=math.inf)
