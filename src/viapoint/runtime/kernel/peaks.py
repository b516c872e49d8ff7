"""Peak ratios to the limits, measured where it counts: finite differences of the set points as sent."""

from __future__ import annotations

import numpy as np

from viapoint.runtime.records import Floats


class PeakMeter:
    """Peaks of the first three differences of m axes over a whole run, window by window.

    Speed and acceleration are differences per tick and tick²; so is jerk. A run starts at rest.
    """

    def __init__(self, start: Floats, tick: float) -> None:
        self._tail = np.tile(start, (3, 1))
        self._tick = tick
        self.peaks = np.zeros((3, len(start)))
        """(3, m): largest speed, acceleration and jerk of each axis so far, absolute."""

    def feed(self, rows: Floats) -> None:
        """Take the next rows (N, m)."""
        x = np.concatenate((self._tail, rows))
        self._tail = x[-3:].copy()
        for order in range(3):
            x = np.diff(x, axis=0) / self._tick
            # rows whose differences reach back before the window's first row are new; the rest were counted
            fresh = np.abs(x[2 - order :])
            if len(fresh):
                np.maximum(self.peaks[order], fresh.max(axis=0), out=self.peaks[order])


def ratios(peaks: Floats, limits: Floats) -> list[float]:
    """Peak ÷ limit per axis; an unlimited axis has ratio 0."""
    return [float(p / limit) if np.isfinite(limit) else 0.0 for p, limit in zip(peaks, limits, strict=True)]
