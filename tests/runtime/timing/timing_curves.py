"""Curves for the tests of the time law: waves, lines, corners, and the judge of limits at ticks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from viapoint.runtime.timing import AxisLimits, TimeLaw

Floats = npt.NDArray[np.float64]


@dataclass
class Waves:
    """Axes rate·s + Σ amplitude·sin(frequency·s + phase): smooth, of any scale."""

    rate: Floats  # (m,)
    amplitude: Floats  # (k, m)
    frequency: Floats  # (k, m)
    phase: Floats  # (k, m)
    breaks: Floats = field(default_factory=lambda: np.zeros(0))

    def _terms(self, s: Floats, order: int) -> Floats:
        angle = self.frequency * s[:, None, None] + self.phase + order * np.pi / 2
        result: Floats = (self.amplitude * self.frequency**order * np.sin(angle)).sum(axis=1)
        return result

    def values(self, s: Floats) -> Floats:
        result: Floats = self.rate * s[:, None] + self._terms(s, 0)
        return result

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        return self.rate + self._terms(s, 1), self._terms(s, 2), self._terms(s, 3)


def line(*rates: float) -> Waves:
    """Axes linear in s."""
    none = np.zeros((0, len(rates)))
    return Waves(np.array(rates), none, none, none)


def random_waves(seed: int, axes: int, length: float) -> Waves:
    """A random curve; wave lengths down to a quarter of the length. One axis is the path itself."""
    rng = np.random.default_rng(seed)
    frequency = rng.uniform(0.5, 8.0 * np.pi, (4, axes)) / length
    amplitude = rng.normal(0.0, 0.3, (4, axes)) / (1.0 + (frequency * length / 4.0) ** 2)
    amplitude[:, 0] = 0.0
    rate = rng.normal(0.0, 1.0, axes)
    rate[0] = 1.0
    breaks = np.sort(rng.uniform(0.05, 0.95, 6)) * length
    return Waves(rate, amplitude, frequency, rng.uniform(0.0, 6.0, (4, axes)), breaks)


def limits(axes: int, speed: float, acceleration: float, jerk: float) -> AxisLimits:
    """The same limits for every axis."""
    return AxisLimits(*(np.full(axes, x) for x in (speed, acceleration, jerk)))


def constant(speed: float) -> Callable[[Floats], Floats]:
    """A programmed speed without jumps."""
    return lambda s: np.full(len(s), speed)


def steps(places: list[float], speeds: list[float]) -> Callable[[Floats], Floats]:
    """A programmed speed that jumps at places."""
    return lambda s: np.asarray(speeds)[np.searchsorted(places, s, side="right")]


def peaks(law: TimeLaw, curve: Waves, lim: AxisLimits, tick: float) -> tuple[float, float, float]:
    """Largest ratios of differences at ticks to the limits, an oracle apart from the planner's own check."""
    first = round(law.t0 / tick)
    k = np.arange(first - 4, first + int(law.duration / tick) + 6)
    s, _, _ = law.at(k * tick)
    q = curve.values(s)
    d = [np.abs(np.diff(q, n, axis=0)) / tick**n for n in (1, 2, 3)]
    result = [
        float((x / limit).max()) for x, limit in zip(d, (lim.speed, lim.acceleration, lim.jerk), strict=True)
    ]
    return result[0], result[1], result[2]
