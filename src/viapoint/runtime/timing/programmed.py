"""The programmed speed on the pieces between knots, and where its jumps are met.

A tick that spans a jump moves at the mean of two speeds. So that no tick exceeds the slower one, the
slower speed holds one tick longer on the faster side: its knot stands that much off the break.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.runtime.records import Floats, Ints
from viapoint.runtime.timing.curve import INSET
from viapoint.runtime.timing.limits import SpeedBound

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
    """The knots (n+1,) with those that stand off a break (k,) moved to it: where speeds really change."""
    result = knots.copy()
    k = np.clip(np.searchsorted(knots, stands), 0, len(knots) - 1)
    found = knots[k] == stands
    result[k[found]] = breaks[found]
    return result


def asked(
    knots: Floats, width: Floats, rest_start: float, rest_end: float, breaks: Floats
) -> tuple[Floats, Ints]:
    """Places at which the speed bound of pieces is asked: just inside the left end of each of n, in the
    middle, inside the right end, then on both sides of every break inside; and the pieces that those are on.

    None is before the second knot of a section in motion (`rest_start` 0).
    """
    low, high, n = knots[:-1], knots[1:], len(width)
    inset = INSET * width
    inside = breaks[(breaks > low[0] - rest_start) & (breaks < high[-1] + rest_end)]
    near = inset[np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, n - 1)]
    around = np.stack((inside - near, inside + near), axis=1).ravel()
    places = np.concatenate((low + inset, 0.5 * (low + high), high - inset, around))
    owner = np.clip(np.searchsorted(knots, around, side="right") - 1, 0, n - 1)
    return places if rest_start > 0.0 else np.maximum(places, knots[1]), owner


def on_pieces(bounds: Floats, owner: Ints, n: int, given: bool) -> tuple[Floats, int]:
    """Programmed speeds (3, n) on the pieces from their bounds at the places `asked`, nowhere above those
    beside breaks that lie inside; and the first piece whose speed is not positive, or -1.

    The start of a section in motion, if it is `given`, is not bounded.
    """
    beside = np.full(n, np.inf)
    np.minimum.at(beside, owner, bounds[3 * n :])
    speeds: Floats = np.minimum(bounds[: 3 * n].reshape(3, n), beside)
    good = (speeds > 0.0).all(axis=0)
    bad = -1 if good.all() else int(np.argmin(good))
    if given:
        speeds[:, 0] = np.inf
    return speeds, bad


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
