"""Motion along the route: which stretch the time law covers, when it is extended, and its ticks.

Between two exact stops the law covers a horizon of pieces and ends at rest at its end; before the
braking for that end begins, the horizon is moved on and what has been sent stays as it is.
"""

from __future__ import annotations

import bisect
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.clock import PathClock
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.records import Floats
from viapoint.runtime.timing import (
    PROGRAMMED_SPEED,
    UNLIMITED,
    AxisLimits,
    TimeLaw,
    TimingError,
    extend,
    plan,
)

_HORIZON_PIECES: Final = 20
"""Pieces a law covers at least: some seven blocks with round edges; 3–4 blocks are within 0.2 % of full
knowledge, and the cost of a solve grows with its length."""

_RENEW_PIECES: Final = 8
"""Pieces left in the law when it is extended."""

_STOPPING_SHARE: Final = 3.0
"""The horizon is at least this many stopping distances long, and renewed while half of it is left."""


_FIRST_HALT: Final = 1.0
"""First stopping distance tried, in units of that of constant path deceleration."""

_HALT_GROWTH: Final = 1.3
"""Factor between stopping distances tried: the halt is at most so much longer than the shortest."""

_REPORT_SAMPLES: Final = 33
"""Times at which a block is asked what limits it."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Ticks of a moving path: s (N,), its axis functions (N, n + 4), and whether the last one is at rest."""

    s: Floats
    columns: Floats
    arrived: bool


class Mover:
    """Where the robot is on the route, and the law by which it goes on."""

    def __init__(self, cell: Cell, route: Route, clock: PathClock) -> None:
        self.law: TimeLaw | None = None
        self.s = 0.0
        self._route = route
        self._clock = clock
        self._tick = cell.tick
        limits, path = cell.robot.limits, cell.path_limits
        self.limits = AxisLimits(
            speed=np.append(limits.speed, (path.speed, path.angular_speed)),
            acceleration=np.append(limits.acceleration, (path.acceleration, path.angular_acceleration)),
            jerk=np.append(limits.jerk, (path.jerk, path.angular_jerk)),
        )
        self._per_stopping_speed = 1.0 / path.acceleration
        self._stopping = 0.5 * path.speed**2 / path.acceleration + path.speed * path.acceleration / path.jerk

    @property
    def wanted(self) -> float:
        """s up to which the route should be known for the law to be as fast as the limits allow."""
        return self.s + _STOPPING_SHARE * self._stopping

    def start(self, tick: int, line: int) -> bool:
        """From rest at `tick`: plan a law along what is known of the route; False if nothing is.

        Raises PlanningError, naming `line`, where no law keeps the limits.
        """
        end = self._horizon(self.s)
        if end <= self.s:
            return False
        try:
            self.law = plan(
                _Curve(self._route, self.s, end),
                self.limits,
                self._route.speed_bound,
                s_start=self.s,
                s_end=end,
                tick=self._tick,
                t0=self._clock.time(tick),
            )
        except TimingError as error:
            raise PlanningError("E320", f"the motion cannot be timed: {error}", line) from None
        return True

    def extend(self, tick: int) -> bool:
        """At `tick`, moving: let the law reach further if it is time to; True if later ticks changed."""
        law = self.law
        assert law is not None, "only a moving path is extended"
        if law.s_end in self._route.stops or not self._due(law):
            return False
        end = self._horizon(self.s)
        return end > law.s_end and self._replan(law, tick, end)

    def halt(self, tick: int) -> bool:
        """At `tick`, moving: come to rest as soon as the limits allow; True if later ticks changed.

        The stopping distance follows from trying: the first of growing distances at which a law ends that
        keeps all limits. Where none does, the present law runs on to its own end.
        """
        law = self.law
        assert law is not None, "only a moving path is halted"
        s, v, _ = (float(x[0]) for x in law.at(np.array([self._clock.time(tick + 1)])))
        distance = max(v * self._tick, _FIRST_HALT * 0.5 * v * v * self._per_stopping_speed)
        while s + distance < law.s_end:
            if self._replan(law, tick, s + distance):
                return True
            distance *= _HALT_GROWTH
        return False

    def forget(self, tick: int) -> None:
        """Drop what the law says of the time before `tick`: otherwise a path without stops adds up."""
        if self.law is not None:
            self.law = self.law.without_past(self._clock.time(tick))

    def _replan(self, law: TimeLaw, tick: int, end: float) -> bool:
        try:
            longer = extend(
                law,
                _Curve(self._route, self.s, end),
                self.limits,
                self._route.speed_bound,
                s_end=end,
                tick=self._tick,
                commit_time=self._clock.time(tick + 1),
            )
        except TimingError:
            return False  # the present law ends at rest; starting from there will say what is wrong
        if longer is None:
            return False
        self.law = longer
        return True

    def rows(self, first_tick: int, count: int) -> Rows:
        """At most `count` ticks from first_tick on, ending early in the tick in which the law is at rest."""
        law = self.law
        assert law is not None, "rows are asked for while moving"
        times = self._clock.times(first_tick, count)
        left = int(np.searchsorted(times, law.t_end - 1e-9 * self._tick)) + 1
        times = times[:left]
        s, _, _ = law.at(times)
        arrived = left <= count
        if arrived:
            s[-1] = law.s_end
        return Rows(s, self._route.axes.everything(s), arrived)

    def limited_by(self, first_tick: int, last_tick: int) -> str:
        """What held the speed back for most of the time between two ticks of the present law."""
        law = self.law
        if law is None or last_tick <= first_tick:
            return ""
        times = np.linspace(self._clock.time(first_tick), self._clock.time(last_tick), _REPORT_SAMPLES)
        codes, counts = np.unique(law.limited_by(law.at(times)[0]), return_counts=True)
        return self._name(int(codes[np.argmax(counts)]))

    def _name(self, code: int) -> str:
        joints = len(self.limits.speed) - 2
        if code == PROGRAMMED_SPEED:
            return "programmed speed"
        if code == UNLIMITED:
            return ""
        return f"J{code + 1}" if code < joints else ("path" if code == joints else "orientation")

    def _due(self, law: TimeLaw) -> bool:
        ends = self._route.ends
        pieces = bisect.bisect_right(ends, law.s_end) - bisect.bisect_right(ends, self.s)
        left = law.s_end - self.s
        return pieces <= _RENEW_PIECES or left < 0.5 * _STOPPING_SHARE * self._stopping

    def _horizon(self, s: float) -> float:
        """s at which a law from s may end at rest: the next exact stop, or the end of enough pieces."""
        route = self._route
        stop = route.next_stop(s)
        last = route.end if stop is None else stop
        k = bisect.bisect_right(route.ends, s) + _HORIZON_PIECES
        j = bisect.bisect_left(route.ends, s + _STOPPING_SHARE * self._stopping)
        k = max(k, j)
        return min(last, route.ends[k]) if k < len(route.ends) else last


@dataclass(frozen=True, slots=True)
class _Curve:
    """The limited axes of the route over one horizon, as the time law wants them."""

    route: Route
    s_from: float
    s_to: float

    def values(self, s: Floats) -> Floats:
        return self.route.axes.values(s)

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        return self.route.axes.derivatives(s)

    @property
    def breaks(self) -> Floats:
        return self.route.breaks(self.s_from, self.s_to)
