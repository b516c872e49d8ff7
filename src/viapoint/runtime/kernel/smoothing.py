"""The joint filter: a Gaussian window over the last ticks (F 7-55 … 7-57). No limits, no path.

The window has N + 1 taps and is symmetric, so that whatever goes through it is N/2 ticks late and at rest N
ticks after its source is.
"""

from __future__ import annotations

import numpy as np

from viapoint.runtime.records import Floats


def gaussian(ticks: int, sigma: float) -> Floats:
    """Weights (N + 1,) that add up to 1: exp(−½·((n − N/2)/(σ·N/2))²), F 7-55, normalised by F 7-57."""
    half = 0.5 * ticks
    weights = np.exp(-0.5 * ((np.arange(ticks + 1) - half) / (sigma * half)) ** 2) if ticks else np.ones(1)
    return np.asarray(weights / weights.sum())


class Smoother:
    """Convolves columns with a window, from rest at `start` (m,) on (F 7-56).

    `smooth` may be asked for more rows than are sent; `commit` says how many were.
    """

    def __init__(self, weights: Floats, start: Floats) -> None:
        self._weights = weights
        self._past: Floats = np.tile(start, (len(weights) - 1, 1))
        self._rows: Floats = self._past

    @property
    def oldest(self) -> float:
        """The last column of the oldest row that the window still sees."""
        return float(self._past[0, -1])

    def smooth(self, rows: Floats) -> Floats:
        """Rows (N, m) after those committed → as filtered. Equal taps give exactly their value."""
        taps = len(self._weights)
        self._rows = np.concatenate((self._past, rows))
        deviation = np.zeros_like(rows)
        for k, weight in enumerate(self._weights):  # in one order, whatever the number of rows: same bits
            deviation += weight * (self._rows[k : k + len(rows)] - rows)
        return rows + deviation if taps > 1 else rows

    def set_last(self, value: float) -> None:
        """At rest: the last column is another one from now on, and has always been that value."""
        self._past = np.concatenate((self._past[:, :-1], np.full((len(self._past), 1), value)), axis=1)

    def commit(self, count: int) -> None:
        """The first so many of the rows smoothed last were sent."""
        self._past = self._rows[count : count + len(self._weights) - 1]
