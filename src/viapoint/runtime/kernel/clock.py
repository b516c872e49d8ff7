"""The path clock: how much path time passes per tick of the controller. Override scales it."""

from __future__ import annotations

import numpy as np

from viapoint.runtime.records import Floats


class PathClock:
    """Path time τ at controller ticks; `rate` is dτ/dt, 1.0 at 100 % override.

    τ is computed from an anchor, never summed tick by tick, so that it does not depend on how many ticks
    are asked for at once.
    """

    def __init__(self, tick: float, rate: float) -> None:
        self._tick = tick
        self._anchor_tick = 0
        self._anchor_time = 0.0
        self.rate = rate

    def times(self, first_tick: int, count: int) -> Floats:
        """τ (count,) at ticks first_tick, first_tick + 1, …"""
        ticks = np.arange(count, dtype=np.float64) + (first_tick - self._anchor_tick)
        times: Floats = self._anchor_time + ticks * (self._tick * self.rate)
        return times

    def time(self, tick: int) -> float:
        """τ at one tick."""
        return float(self.times(tick, 1)[0])

    def set_rate(self, tick: int, rate: float) -> None:
        """From `tick` on the clock runs at `rate`; only where the path is at rest."""
        self._anchor_time = self.time(tick)
        self._anchor_tick = tick
        self.rate = rate
