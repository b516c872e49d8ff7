"""Programmed speeds that a filter behind the path does not lead over: each holds longer than programmed.

A filtered set point moves at the mean of the speeds in its window, and is where the path was half a window
before. So where two speeds meet, the slower one has to hold for half a window on the faster side too.
"""

from __future__ import annotations

from typing import Final, Protocol

import numpy as np

from viapoint.runtime.records import Floats

_BESIDE: Final = 1e-9
"""m (or rad) from a break at which the speed beside it is asked for."""

_JUMP: Final = 1e-4
"""Relative difference of the speeds beside a break that is a jump, as for the time law."""

_LOOKS: Final = 8
"""Places looked at on each side where a bound changes gradually."""


class Bounded(Protocol):
    """A curve with programmed speeds."""

    @property
    def breaks(self) -> Floats: ...
    def values(self, r: Floats) -> Floats: ...
    def derivatives(self, r: Floats) -> tuple[Floats, Floats, Floats]: ...
    def speed_bound(self, r: Floats) -> Floats: ...


class Lingering:
    """The same curve; speeds programmed on it hold for `time` s before and behind where they are.

    `behind` (B,) are breaks before its beginning, and the curve can be asked for its bounds there.
    """

    def __init__(self, curve: Bounded, low: float, high: float, time: float, behind: Floats) -> None:
        self._curve = curve
        self._time = time
        self._low = min(low, float(behind.min(initial=low)))
        self._high = high
        own = np.asarray(curve.breaks, dtype=np.float64)
        breaks = np.concatenate((behind, own))
        around = np.clip(np.concatenate((breaks - _BESIDE, breaks + _BESIDE)), self._low, high)
        speeds = curve.speed_bound(around) if len(around) else np.zeros(0)
        before, after = speeds[: len(breaks)], speeds[len(breaks) :]
        slower = np.minimum(before, after)
        jumps = np.isfinite(slower) & (np.maximum(before, after) > slower * (1.0 + _JUMP))
        reach = np.where(before > after, -slower, slower)[jumps] * time
        ends = np.stack((breaks[jumps], breaks[jumps] + reach))
        self._from, self._to, self._slow = ends.min(axis=0), ends.max(axis=0), slower[jumps]
        inside = ends[1][(ends[1] > low) & (ends[1] < high)]
        self.breaks: Floats = np.unique(np.concatenate((own, inside)))

    def values(self, r: Floats) -> Floats:
        """As those of the curve."""
        return self._curve.values(r)

    def derivatives(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """As those of the curve."""
        return self._curve.derivatives(r)

    def speed_bound(self, r: Floats) -> Floats:
        """Programmed bound (N,) on the rate of r: the least that holds there or still, or already."""
        bound = self._curve.speed_bound(r)
        held = (r[:, None] >= self._from) & (r[:, None] <= self._to)
        bound = np.minimum(bound, np.where(held, self._slow, np.inf).min(axis=1, initial=np.inf))
        reach = np.where(np.isfinite(bound), bound, 0.0) * self._time
        shares = np.linspace(-1.0, 1.0, 2 * _LOOKS + 1)
        places = np.clip(r[:, None] + shares * reach[:, None], self._low, self._high)
        there = self._curve.speed_bound(places.ravel()).reshape(places.shape)
        near = np.abs(places - r[:, None]) <= there * self._time
        least: Floats = np.minimum(bound, np.where(near, there, np.inf).min(axis=1))
        return least
