"""The programmed speed on the pieces between knots, and where its jumps are met.

A tick that spans a jump moves at the mean of two speeds. So that no tick exceeds the slower one, the
slower speed holds one tick longer on the faster side: its knot stands that much off the break.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.curve import INSET
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.limits import SpeedBound
from viapoint.runtime.timing.spline import Spline

JUMP: Final = 1e-4
"""Relative difference of the speeds beside a break that is a jump. Less is the slope of a bound that
varies, or within what is planned below the limit; a knot that leaves its break costs far more than that."""

_FARTHEST: Final = 0.4
"""Part of the way to the next break by which a knot may stand off its break."""


def knots_of(breaks: Floats, bound: SpeedBound, tick: float) -> Floats:
    """Where knots stand for breaks (k,): at them, or one tick at the slower speed off on the faster side."""
    if len(breaks) == 0:
        return breaks
    gap = np.diff(breaks, prepend=-np.inf, append=np.inf)
    near = np.minimum(gap[:-1], gap[1:])
    inset = INSET * np.where(np.isfinite(near), near, 1.0)
    speeds = bound(np.concatenate((breaks - inset, breaks + inset)))
    before, after = speeds[: len(breaks)], speeds[len(breaks) :]
    slower = np.minimum(before, after)
    jumps = np.maximum(before, after) > slower * (1.0 + JUMP)
    away = np.where(jumps, np.minimum(slower * tick, _FARTHEST * near), 0.0)
    return breaks + np.where(before > after, -away, away)


def edges(knots: Floats, breaks: Floats, stands: Floats) -> Floats:
    """The knots (n+1,) with those that stand off a break moved to it: where speeds really change."""
    result = knots.copy()
    k = np.clip(np.searchsorted(knots, stands), 0, len(knots) - 1)
    found = knots[k] == stands
    result[k[found]] = breaks[found]
    return result


def on_pieces(spline: Spline, breaks: Floats, bound: SpeedBound) -> Floats:
    """Programmed speeds (3, n) on the pieces: just inside the left end, in the middle, inside the right end;
    nowhere above those beside breaks that lie inside.

    The given start of a section in motion is not bounded. Raises TimingError if a speed is not positive.
    """
    knots = spline.knots
    low, high, n = knots[:-1], knots[1:], len(knots) - 1
    inset = INSET * spline.width
    inside = breaks[(breaks > low[0] - spline.rest_start) & (breaks < high[-1] + spline.rest_end)]
    piece = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, n - 1)
    around = np.concatenate((inside - inset[piece], inside + inset[piece]))
    asked = np.concatenate((low + inset, 0.5 * (low + high), high - inset, around))
    bounds = bound(np.maximum(asked, knots[1]) if spline.fixed else asked)
    speeds: Floats = bounds[: 3 * n].reshape(3, n)
    owner = np.clip(np.searchsorted(knots, around, side="right") - 1, 0, n - 1)
    beside = np.full(n, np.inf)
    np.minimum.at(beside, owner, bounds[3 * n :])
    speeds = np.minimum(speeds, beside)
    if not np.all(speeds > 0.0):
        where = float(low[np.argmin(speeds.min(axis=0) > 0.0)])
        raise TimingError("the programmed speed is not a positive number", where)
    if spline.fixed:
        speeds[:, 0] = np.inf
    return speeds


def allowed(edges: Floats, speeds: Floats, s: Floats) -> Floats:
    """Programmed speeds (N-1,) of the ticks from s to s (N,): of the middle, or the slower side of a jump.

    Between the three `speeds` (3, n) of a piece it follows their parabola, never below all of them.
    """
    n = speeds.shape[1]
    piece = np.clip(np.searchsorted(edges, s, side="right") - 1, 0, n - 1)
    left, middle, right = speeds[:, piece]
    u = np.clip((s - edges[piece]) / (edges[piece + 1] - edges[piece]), 0.0, 1.0)
    with np.errstate(invalid="ignore"):
        curved = left + u * (4.0 * middle - 3.0 * left - right + u * 2.0 * (left + right - 2.0 * middle))
        jumps = np.abs(speeds[2, :-1] - speeds[0, 1:]) > JUMP * speeds[0, 1:]
    here = np.fmax(curved, np.minimum(np.minimum(left, middle), right))
    passed = np.concatenate(([0], np.cumsum(jumps)))[piece]
    both = np.stack((here[1:], here[:-1]))
    result: Floats = np.where(passed[1:] == passed[:-1], both.mean(axis=0), both.min(axis=0))
    return result
