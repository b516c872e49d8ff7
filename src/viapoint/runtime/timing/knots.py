"""Knots of the spline x(s) = ṡ²: about equally spaced in estimated time, one at every break.

Not here: what the spline has to satisfy (rows) and how it is found (solver).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.timing.curve import INSET

if TYPE_CHECKING:
    from viapoint.runtime.timing.estimate import Estimate

SPACING: Final = 0.010
"""s of estimated time between knots: 1.01-1.06 of the optimum; 5 ms costs twice the work for 1 %."""

_SPACING_MAX: Final = 0.050
"""s. Slow limits (long build-up of acceleration) are resolved by fewer knots."""

CALM_SPACING: Final = 0.080
"""s. Where a constant speed is held for long, only the curve's own bends need knots."""

GROWTH: Final = 0.25
"""Growth of the spacing with the time to the nearest change of speed: neighbours differ by a quarter."""

FROM_REST: Final = 0.75
"""Spacing beside a rest end, in times from rest: the acceleration there builds up within that time."""

BUSY: Final = 1.5
"""Mean spacing, in units of the narrow one, below which a stretch between breaks gets all its pieces."""

_PIECES: Final = 24
"""Pieces of a section at least (ticks permitting), so that short moves are resolved too."""

FEWEST: Final = 8

MOST: Final = 500_000
"""Knots of a section whose speed changes for hours: more would take more memory than there is."""

PIECES_PER_EDGE: Final = 6
"""Pieces between two breaks: a round edge's acceleration turns once, its jerk three times."""

SHORTEST: Final = 0.0015
"""s. Shorter pieces only cost: differences over ticks do not see them."""

_REST_SHARE: Final = 0.4
"""Part of the possible acceleration reached at the end of the constant-jerk piece at rest."""

_REST_TIMES: Final = (0.004, 0.040)
"""s, shortest and longest constant-jerk piece at rest."""

_REST_LENGTH: Final = 0.02
"""Part of the section that a constant-jerk piece at rest takes at most."""


def spacing(est: Estimate, tick: float) -> float:
    """Time between knots, s."""
    usual = min(max(SPACING, 0.1 * est.response), _SPACING_MAX)
    return max(min(usual, float(est.t[-1]) / _PIECES), 0.25 * tick)


def rest_length(est: Estimate, jerk: float, length: float) -> float:
    """Length of the constant-jerk piece at a rest end."""
    shortest, longest = _REST_TIMES
    tau = min(max(_REST_SHARE * est.acceleration / jerk, shortest), longest)
    return min(min(jerk * tau, _REST_SHARE * est.acceleration) * tau**2 / 6.0, _REST_LENGTH * length)


def place(s: Floats, t: Floats, calm: Bools, marks: Floats, dt: float, tick: float) -> Floats:
    """Knots (n+1,) from marks[0] to marks[-1], one at every mark that is not too near its neighbour.

    Counted in spacings of dt seconds where the speed changes, of more where it is just held; s, t and calm
    (N,) as of `Estimate`.
    """
    shortest = max(SHORTEST, 0.5 * tick)
    marks = marks[_apart(np.interp(marks, s, t), shortest)]
    counter = _counter(t, calm, dt, *np.interp(marks[[0, -1]], s, t))
    duration = np.diff(np.interp(marks, s, t))
    places = np.interp(marks, s, counter)
    count = np.maximum(np.round(np.diff(places)), 1.0)
    most = np.maximum(np.floor(duration / shortest), 1.0)
    busy = duration < BUSY * dt * np.diff(places)
    count = np.maximum(count, np.where(busy, np.minimum(PIECES_PER_EDGE, most), 1.0)).astype(int)
    if len(count) == 1:
        count = np.maximum(count, FEWEST)
    count[[0, -1]] = np.maximum(count[[0, -1]], 2)
    knots = _fill(places, count, counter, s)
    return _smooth(knots, marks, np.concatenate(([0], np.cumsum(count))))


def guess(s: Floats, v: Floats, knots: Floats, share: float) -> Floats:
    """Coefficients (n,) that the solver starts from: `share` of the squared estimated speeds v (N,) at s."""
    middle = 0.5 * (knots[1:] + knots[:-1])
    speed = np.interp(middle, s, v)
    x = share * (speed * speed)
    return np.maximum(x, 1e-9 * float(x.max()))


def insides(knots: Floats, given: bool) -> Floats:
    """Places (2n+1,) just inside both ends of the pieces, and the last knot; none before the second knot if
    the first piece is `given`.
    """
    knots = np.maximum(knots, knots[1]) if given else knots
    inset = INSET * np.diff(knots)
    inside = np.stack((knots[:-1] + inset, knots[1:] - inset), axis=1).ravel()
    return np.concatenate((inside, knots[-1:]))


def _counter(t: Floats, calm: Bools, dt: float, first: float, last: float) -> Floats:
    """Knots passed since the start, (N,): spacing grows with the time to the nearest change of speed.

    First and last knot stand at these times; the time from there to rest, if any, limits growth too.
    """
    change = t[~calm]
    k = np.clip(np.searchsorted(change, t), 1, len(change) - 1)
    away = np.minimum(np.abs(t - change[k - 1]), np.abs(change[k] - t))
    each = np.minimum(dt + GROWTH * away, max(dt, CALM_SPACING))
    if first > 0.0:
        each = np.minimum(each, FROM_REST * np.maximum(t, first))
    each = np.minimum(each, FROM_REST * np.maximum(t[-1] - t, t[-1] - last))
    steps = np.diff(t) * 0.5 * (1.0 / each[1:] + 1.0 / each[:-1])
    return np.concatenate(([0.0], np.cumsum(steps)))


def _apart(times: Floats, least: float) -> npt.NDArray[np.intp]:
    """Indices of marks at least `least` apart in time; the two ends are always kept."""
    kept = [0]
    for k in range(1, len(times) - 1):
        if times[k] - times[kept[-1]] >= least and times[-1] - times[k] >= least:
            kept.append(k)
    return np.array([*kept, len(times) - 1], dtype=np.intp)


def _fill(places: Floats, count: npt.NDArray[np.int_], counter: Floats, s: Floats) -> Floats:
    piece = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    inner = places[piece] + np.diff(places)[piece] * step / count[piece]
    return np.interp(np.concatenate((inner, places[-1:])), counter, s)


def _smooth(knots: Floats, marks: Floats, fixed: npt.NDArray[np.int_]) -> Floats:
    """Even out the widths (the estimate has corners); marks stay where they are."""
    knots[fixed] = marks
    for _ in range(3):
        inner = 0.5 * knots[1:-1] + 0.25 * (knots[:-2] + knots[2:])
        knots = np.concatenate((knots[:1], inner, knots[-1:]))
        knots[fixed] = marks
    return knots
