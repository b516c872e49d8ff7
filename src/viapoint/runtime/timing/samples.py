"""Samples of the speed estimate and what is computed at them: numpy twin of the core.

Not here: the curve and its limits, which `estimate` asks.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.runtime.records import Bools, Floats, Ints
from viapoint.runtime.timing.rooms import room

SAMPLES: Final = 64
"""Samples over a section without breaks; a dip of the speed limit (a singularity) narrower than 1/64
of the section is found by refinement if its flank is met."""

SAMPLES_PER_PIECE: Final = 6
"""Samples between two breaks at least: the speed limit of a round edge has up to three minima."""

RAMP: Final = 3.0 * 0.75 ** np.arange(30)
"""Samples beside the ends, in sample distances: near rest speed goes as s^(2/3)."""

SPLITS: Final = np.arange(1, 3) / 3.0
"""Where neighbours are split: at thirds, which takes half as many rounds as in the middle."""

FLANK: Final = 0.4
"""Fall before and rise behind two neighbours (natural logarithm) that hide the bottom of a dip between."""

FINEST: Final = 0.004
"""s to pass from sample to sample at the slower one's speed: closer is finer than the knots will be."""

TICKS_TO_FULL: Final = 0.25
"""An acceleration that changes the top speed (a jerk: the acceleration) within this part of a tick is
as good as infinite: differences over whole ticks cannot tell."""

STRAIGHT: Final = 1e-7
"""Relative variation of a rate that is rounding (of interpolated axes: 1e-12 rad over 0.1 mm)."""

HELD: Final = 1e-3
"""Relative change of the speed between samples that is none."""

SLOWEST: Final = 1e-9
"""Part of the top speed that a mean over two samples has at least: the time to pass them is finite."""

Rooms = tuple[Floats, Floats, Floats]
"""Bounds (N,) of the path's acceleration, deceleration and jerk by the axes' rates."""


def first_samples(marks: Floats) -> Floats:
    """Ascending places (N,) on the pieces between marks (k,): evenly on each, and closer beside both ends."""
    length = np.diff(marks)
    count = np.maximum(np.ceil(length / (marks[-1] - marks[0]) * SAMPLES), SAMPLES_PER_PIECE).astype(int)
    piece = np.repeat(np.arange(len(count)), count)
    step = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    inner = marks[piece] + length[piece] * step / count[piece]
    near = (marks[-1] - marks[0]) / SAMPLES * RAMP
    return np.unique(np.concatenate((inner, marks[0] + near, marks[-1] - near, marks[-1:])))


def dips(s: Floats, logs: Floats, ceiling: Floats, above: float) -> tuple[Floats, Ints]:
    """Places (2k,) between neighbouring samples whose speed limits differ by more than `above`, or hide the
    bottom of a dip, ascending; and for each the number of the sample before it. `logs` are the limits'.
    """
    change = np.diff(logs)
    steep = np.abs(change) > above
    steep[1:-1] |= (change[:-2] < -FLANK) & (change[2:] > FLANK)
    steep &= np.diff(s) > FINEST * np.minimum(ceiling[1:], ceiling[:-1])
    before = np.repeat(np.flatnonzero(steep), len(SPLITS))
    split = np.tile(SPLITS, len(before) // len(SPLITS))
    return s[before] + (s[before + 1] - s[before]) * split, before


def merged(rows: Floats, more: Floats, before: Ints) -> Floats:
    """Rows (N, m) or (N,) of samples with those of further ones, each behind the sample `before` it."""
    return np.insert(rows, before + 1, more, axis=0)


def even(first: Floats, programmed: Floats) -> Floats | None:
    """Rates (m,) of axes with first derivatives (N, m) that, like the programmed speeds (N,), vary by no more
    than rounding; else None.
    """
    rates = first[0]
    spread = np.abs(first - rates).max(axis=0)
    if (spread > STRAIGHT * np.abs(rates) + STRAIGHT * np.abs(rates).max(initial=0.0)).any():
        return None
    slowest = float(programmed.min())
    if not (np.isinf(slowest) or float(programmed.max()) <= slowest * (1.0 + STRAIGHT)):
        return None
    result: Floats = np.abs(first).max(axis=0)
    return result


def rooms(first: Floats, acceleration: Floats, braking: Floats, jerk: Floats) -> Rooms:
    """What limits (m,) leave the path where its axes have first derivatives (N, m)."""
    return room(first, acceleration), room(first, braking), room(first, jerk)


def scanned(
    s: Floats, ceiling: Floats, room: Rooms, top: float, tick: float, x_start: float
) -> tuple[Floats, Floats, Floats, tuple[float, float, float]]:
    """Speeds (N,) from √x_start at the first sample to rest at the last one, without bounded jerk, and their
    ceiling (N,), none above `top`; 6·distance/jerk (2, N) from the begin and to the end; and the least
    acceleration at the ends, the jerk at the begin and at the end.
    """
    instant = top / (TICKS_TO_FULL * tick)
    ceiling = np.minimum(ceiling, top)
    gain, brake = np.minimum(room[0], instant), np.minimum(room[1], instant)
    jerk = np.minimum(room[2], np.minimum(gain, brake) / (TICKS_TO_FULL * tick))[[0, -1]]
    v = np.sqrt(_lowered(ceiling * ceiling, gain, brake, s, x_start))
    away = np.stack((s - s[0], s[-1] - s))
    ends = float(np.minimum(gain, brake)[[0, -1]].min())
    cubes = 6.0 * np.maximum(away, 0.0) / jerk[:, None]
    return v, ceiling, cubes, (ends, float(jerk[0]), float(jerk[1]))


def _lowered(x: Floats, gain: Floats, brake: Floats, s: Floats, x_start: float) -> Floats:
    """x = ṡ² lowered until neighbours differ by no more than 2∫a ds allows, from x_start to rest."""
    ds = np.diff(s)
    gained = np.concatenate(([0.0], np.cumsum((gain[1:] + gain[:-1]) * ds)))
    lost = np.concatenate(([0.0], np.cumsum((brake[1:] + brake[:-1]) * ds)))
    x = x.copy()
    x[0], x[-1] = x_start, 0.0
    x = np.minimum.accumulate(x - gained) + gained
    x = np.minimum.accumulate((x + lost)[::-1])[::-1] - lost
    return np.maximum(x, 0.0)


def timed(
    s: Floats, v: Floats, ceiling: Floats, roots: Floats, jerk: tuple[float, float], top: float, rests: bool
) -> tuple[Floats, Floats, Bools]:
    """Speeds, times from the begin and whether the speed is just held (N,), with constant jerk at the ends at
    rest: at the last one and, if it `rests` there, at the first. `roots` (2, N) are those of the cubes.
    """
    for root, each in zip(roots if rests else roots[1:], jerk if rests else jerk[1:], strict=True):
        v = np.minimum(v, 0.5 * each * (root * root))
    mean = np.maximum(v[1:] + v[:-1], SLOWEST * top)
    t = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(s) / mean)))
    held = v >= (1.0 - HELD) * ceiling
    steady = np.abs(np.diff(v)) <= HELD * v[1:]
    calm: Bools = held & np.append(steady, False) & np.append(False, steady)
    return v, t, calm
