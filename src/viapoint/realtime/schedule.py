"""When each tick is due, and how late it was. Knows a clock and how to sleep; no processes, no set points.

Deadlines are absolute: a tick that is a little late does not make those behind it late. One that is late by
more than a part of a tick moves all that follow: two ticks close together would be a jump of the axes.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

TOLERANCE: Final = 0.5
"""Part of a tick by which a tick may be late and the ones behind it are not moved."""

_RESOLUTION: Final = 1e-6
"""s: lateness is counted to this."""

_BINS: Final = 20_000


@dataclass(frozen=True, slots=True)
class Punctuality:
    """How a run kept its time. `late_us` are percentiles of how late ticks were sent, in µs."""

    ticks: int
    missed: int
    """Ticks later than half a tick: all behind them were moved."""
    starved: int
    """Ticks among them that had not been computed in time."""
    slip_s: float
    """By how much the last tick came later than planned at the start."""
    late_us: dict[str, float]
    priority: str


@dataclass(slots=True)
class Lateness:
    """Counts how late ticks were, in bounded memory."""

    ticks: int = 0
    worst: float = 0.0
    _counts: array[int] = field(default_factory=lambda: array("q", bytes(8 * _BINS)))

    def add(self, late: float) -> None:
        """One more tick, `late` s after its deadline."""
        self.ticks += 1
        self.worst = max(self.worst, late)
        self._counts[min(int(late / _RESOLUTION), _BINS - 1)] += 1

    def percentile(self, percent: float) -> float:
        """s that so many percent of the ticks were not later than."""
        wanted, counted = percent / 100.0 * self.ticks, 0
        for k, count in enumerate(self._counts):
            counted += count
            if counted >= wanted and counted:
                return min((k + 1) * _RESOLUTION, self.worst) if k < _BINS - 1 else self.worst
        return 0.0


class Schedule:
    """Waits for tick after tick; the first one is due when it is asked for."""

    def __init__(self, tick_s: float, clock: Callable[[], float], sleep: Callable[[float], None]) -> None:
        self.lateness = Lateness()
        self.missed = 0
        self.starved = 0
        self.slip = 0.0
        self._tick = tick_s
        self._clock = clock
        self._sleep = sleep
        self._due: float | None = None

    def keep(self, *, starved: bool = False) -> None:
        """Come back when the next tick is due, or at once where it is late already.

        `starved` says that it has just been computed.
        """
        now = self._clock()
        due = now if self._due is None else self._due
        while now < due:
            self._sleep(due - now)
            now = self._clock()
        late = now - due
        self.lateness.add(late)
        if late > TOLERANCE * self._tick:
            self.missed += 1
            self.starved += starved
            self.slip += late
            due = now
        self._due = due + self._tick

    def report(self, priority: str) -> Punctuality:
        """How it went."""
        late = {name: self.lateness.percentile(percent) for name, percent in _PERCENTILES}
        late["max"] = self.lateness.worst
        return Punctuality(
            ticks=self.lateness.ticks,
            missed=self.missed,
            starved=self.starved,
            slip_s=round(self.slip, 6),
            late_us={name: round(seconds * 1e6, 1) for name, seconds in late.items()},
            priority=priority,
        )


_PERCENTILES: Final = (("p50", 50.0), ("p99", 99.0), ("p99_9", 99.9))
