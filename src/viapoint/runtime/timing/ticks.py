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


def positions(
    t: Floats, width: Floats, coeffs: Floats, s_end: float, first: int, last: int, tick: float
) -> Floats:
    """Parameters s of a law at the ticks first ... last, k·tick since its start; arrays as in `TimeLaw`."""
    tau = np.arange(first, last + 1) * tick
    inside = np.maximum(tau, t[0])
    k = np.minimum(np.searchsorted(t, inside, side="right") - 1, len(width) - 1)
    u = (inside - t[k]) / width[k]
    c = coeffs[k]
    s = c[:, 0] + u * (c[:, 1] + u * (c[:, 2] + u * (c[:, 3] + u * (c[:, 4] + u * c[:, 5]))))
    return np.where(tau >= t[-1], s_end, s)


def ratios(q: Floats, limits: AxisLimits, tick: float) -> tuple[Floats, Floats, Floats]:
    """Largest ratios over the axes of first, second, third differences of q (N, m) at consecutive ticks."""
    d1 = np.diff(q, axis=0)
    d2 = np.diff(d1, axis=0)
    d3 = np.diff(d2, axis=0)
    speed = np.abs(d1) * (1.0 / (limits.speed * tick))
    up, down = 1.0 / (limits.acceleration * (tick * tick)), 1.0 / (limits.braking * (tick * tick))
    jerk = np.abs(d3) * (1.0 / (limits.jerk * (tick * tick * tick)))
    acceleration = np.abs(d2) * _scale(d1, up, down)
    return (
        speed.max(axis=1, initial=0.0),
        acceleration.max(axis=1, initial=0.0),
        jerk.max(axis=1, initial=0.0),
    )


def _scale(d1: Floats, up: Floats, down: Floats) -> Floats:
    """With the motion counts as acceleration, against it as deceleration; the milder where it turns."""
    before, after = d1[:-1], d1[1:]
    speeding = np.where(np.abs(after) >= np.abs(before), up, down)
    result: Floats = np.where(before * after < 0.0, np.minimum(up, down), speeding)
    return result
