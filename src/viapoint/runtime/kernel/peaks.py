"""Peak ratios to the limits, measured where it counts: finite differences of the set points as sent."""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.runtime import core
from viapoint.runtime.records import Floats

_REACH: Final = 3
"""Ticks that a jerk reaches back."""


class PeakMeter:
    """Peaks of the first three differences of m axes over a whole run, window by window.

    Speed and acceleration are differences per tick and tick²; so is jerk. A run starts at rest.
    """

    def __init__(self, start: Floats, tick: float) -> None:
        self._tail = np.tile(start, (_REACH, 1))
        self._tick = tick
        self.peaks = np.zeros((3, len(start)))
        """(3, m): largest speed, acceleration and jerk of each axis so far, absolute."""

    def feed(self, rows: Floats) -> None:
        """Take the next rows (N, m)."""
        module = core.chosen("kernel._ticks")
        (module.feed if module is not None else feed)(self._tail, rows, self._tick, self.peaks)

    def stand(self, count: int) -> None:
        """Take so many rows like the last one."""
        rows = np.empty((min(count, _REACH), self._tail.shape[1]))
        rows[:] = self._tail[-1]
        self.feed(rows)


def feed(tail: Floats, rows: Floats, tick: float, peaks: Floats) -> None:
    """Raise peaks (3, m) to the differences that end in rows (N, m); tail (3, m) is what came before them."""
    x = np.concatenate((tail, rows))
    tail[:] = x[-_REACH:]
    for order in range(3):
        x = np.diff(x, axis=0) / tick
        # rows whose differences reach back before the window's first row are new; the rest were counted
        fresh = np.abs(x[2 - order :])
        if len(fresh):
            np.maximum(peaks[order], fresh.max(axis=0), out=peaks[order])


def ratios(peaks: Floats, limits: Floats) -> list[float]:
    """Peak ÷ limit per axis; an unlimited axis has ratio 0."""
    return [float(p / limit) if np.isfinite(limit) else 0.0 for p, limit in zip(peaks, limits, strict=True)]
