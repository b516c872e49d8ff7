"""Set points at ticks and their check: differences of the axes against the limits, numpy twin of the core.

The check is the judge of a time law: differences over ticks of what will be sent, at rest before and
after. Not here: what is done about a tick that is over a limit (tighten).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.limits import AxisLimits


@dataclass(frozen=True, slots=True)
class Ratios:
    """Largest ratio over the axes to its limit: speed (N-1,), acceleration (N-2,), jerk (N-3,) of N ticks."""

    speed: Floats
    acceleration: Floats
    jerk: Floats

    @property
    def peaks(self) -> tuple[float, float, float]:
        """The largest of each."""
        speed, acceleration, jerk = (
            float(r.max(initial=0.0)) for r in (self.speed, self.acceleration, self.jerk)
        )
        return speed, acceleration, jerk


def ratios(q: Floats, limits: AxisLimits, tick: float) -> Ratios:
    """Ratios of first, second and third differences of the axes q (N, m) at consecutive ticks."""
    d1 = np.diff(q, axis=0)
    d2 = np.diff(d1, axis=0)
    d3 = np.diff(d2, axis=0)
    speed = np.abs(d1) * (1.0 / (limits.speed * tick))
    up = 1.0 / (limits.acceleration * tick**2)
    if limits.deceleration is None:
        acceleration = np.abs(d2) * up
    else:
        acceleration = _signed(d1, d2, up, 1.0 / (limits.deceleration * tick**2))
    jerk = np.abs(d3) * (1.0 / (limits.jerk * tick**3))
    return Ratios(*(r.max(axis=1, initial=0.0) for r in (speed, acceleration, jerk)))


def _signed(d1: Floats, d2: Floats, up: Floats, down: Floats) -> Floats:
    """With the motion counts as acceleration, against it as deceleration; the milder where it turns."""
    before, after = d1[:-1], d1[1:]
    speeding = np.where(np.abs(after) >= np.abs(before), up, down)
    turning = before * after < 0.0
    scale = np.where(turning, np.minimum(up, down), speeding)
    result: Floats = np.abs(d2) * scale
    return result
