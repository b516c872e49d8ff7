"""Rates at which a turn passes its key orientations, chosen from the neighbouring keys alone.

A parabola through three keys gives rate and change of rate; both are bounded by the slower neighbour, so that
a quick turn beside a slow one is never overshot. Constant rates are reproduced exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from viapoint.runtime.path.moves import Floats
from viapoint.runtime.path.rates import shortest_turn
from viapoint.runtime.path.turns import Key

# A key's rate may exceed that of the slower neighbouring interval by this factor; up to it, a quintic with
# matching ends does not swing beyond its keys.
RATE_BOUND = 2.0


def passing_rate(before: Floats, after: Floats, h_before: float, h_after: float) -> tuple[Floats, Floats]:
    """Mean rates (3,) of the intervals before and after a key, and their lengths → ω and dω/dw at it."""
    total = h_before + h_after
    rate = (h_after * before + h_before * after) / total
    change = 2.0 * (after - before) / total
    slower = min(float(np.linalg.norm(before)), float(np.linalg.norm(after)))
    bound = RATE_BOUND * slower
    return _bounded(rate, bound), _bounded(change, bound / max(h_before, h_after))


def free_rate(mean: Floats, other_end: Floats) -> Floats:
    """Rate at an end where nothing follows, for a change of rate of zero there."""
    rate: Floats = 1.5 * mean - 0.5 * other_end
    return rate


def keys_along(stops: Sequence[float], orientations: Sequence[Floats], z_axis: Floats) -> list[Key]:
    """Keys with rates for a turn with free ends; at least three."""
    steps = np.diff(stops)
    turns = [shortest_turn(a, b, z_axis) for a, b in pairwise(orientations)]
    means = [turn / h for turn, h in zip(turns, steps, strict=True)]
    passing = [
        passing_rate(means[i], means[i + 1], float(steps[i]), float(steps[i + 1]))
        for i in range(len(means) - 1)
    ]
    still = np.zeros(3)
    first, last = free_rate(means[0], passing[0][0]), free_rate(means[-1], passing[-1][0])
    rates = [(first, still), *passing, (last, still)]
    onwards = [*turns, None]
    return [Key(w, q, *r, turn) for w, q, r, turn in zip(stops, orientations, rates, onwards, strict=True)]


def periodic_keys(
    stops: Sequence[float],
    orientations: Sequence[Floats],
    period: float,
    length: float,
    backwards: bool,
    z_axis: Floats,
) -> list[Key]:
    """Keys that repeat with `period`, enough of them to cover 0 … `length`.

    `stops` rise from 0 and stay below `period`; the last key is followed by the first. `backwards`: the
    turn is travelled against the order of the keys.
    """
    stops, orientations = list(stops), list(orientations)
    if backwards:
        stops = [0.0, *(period - w for w in reversed(stops[1:]))]
        orientations = [orientations[0], *reversed(orientations[1:])]
    count = len(stops)
    steps = np.diff([*stops, period])
    turns = [_sense(orientations[i], orientations[(i + 1) % count], z_axis, backwards) for i in range(count)]
    means = [turn / h for turn, h in zip(turns, steps, strict=True)]
    rates = [passing_rate(means[i - 1], means[i], float(steps[i - 1]), float(steps[i])) for i in range(count)]
    keys: list[Key] = []
    while not keys or keys[-1].w < length:
        revolutions, i = divmod(len(keys), count)
        keys.append(Key(revolutions * period + stops[i], orientations[i], *rates[i], turns[i]))
    return keys


def _sense(start: Floats, end: Floats, z_axis: Floats, backwards: bool) -> Floats:
    """The turn between two keys: backwards, it is the forward one undone, half turns included."""
    return -shortest_turn(end, start, z_axis) if backwards else shortest_turn(start, end, z_axis)


def _bounded(v: Floats, bound: float) -> Floats:
    norm = float(np.linalg.norm(v))
    return v if norm <= bound else v * (bound / norm)
