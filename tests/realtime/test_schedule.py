"""When ticks are sent: on a clock that the tests move."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from viapoint.realtime.schedule import TOLERANCE, Lateness, Schedule

TICK = 1e-3
UNHURRIED = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
"""For machines that are busy with other things."""


class Clock:
    """A clock that sleeping moves, by more than was asked where `oversleep` says so."""

    def __init__(self, oversleep: list[float] | None = None) -> None:
        self.now = 100.0
        self._oversleep = list(oversleep or [])

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.now += seconds + (self._oversleep.pop(0) if self._oversleep else 0.0)


def sent(clock: Clock, schedule: Schedule, work: list[float]) -> list[float]:
    """Times at which ticks were sent, with so much work behind each."""
    times = []
    for busy in work:
        schedule.keep()
        times.append(clock.now - 100.0)
        clock.now += busy
    return times


def test_work_between_ticks_does_not_add_up() -> None:
    clock = Clock()
    times = sent(clock, Schedule(TICK, clock, clock.sleep), [0.3e-3, 0.9e-3, 0.1e-3] * 10)
    assert times == pytest.approx([k * TICK for k in range(30)], abs=1e-9)


def test_a_tick_a_little_late_does_not_make_the_next_ones_late() -> None:
    clock = Clock(oversleep=[0.0, 0.4e-3])
    schedule = Schedule(TICK, clock, clock.sleep)
    times = sent(clock, schedule, [0.0] * 5)
    assert times == pytest.approx([0.0, 1e-3, 2.4e-3, 3e-3, 4e-3], abs=1e-9)
    assert (schedule.missed, schedule.slip) == (0, 0.0)


def test_a_tick_that_is_late_moves_those_behind_it() -> None:
    clock = Clock(oversleep=[0.0, 7.2e-3])
    schedule = Schedule(TICK, clock, clock.sleep)
    times = sent(clock, schedule, [0.0] * 5)
    assert times == pytest.approx([0.0, 1e-3, 9.2e-3, 10.2e-3, 11.2e-3], abs=1e-9)
    report = schedule.report("normal")
    assert (report.ticks, report.missed, report.starved) == (5, 1, 0)
    assert report.slip_s == pytest.approx(7.2e-3)
    assert report.late_us["max"] == pytest.approx(7200.0)


def test_what_was_not_computed_in_time_is_told_apart() -> None:
    clock = Clock()
    schedule = Schedule(TICK, clock, clock.sleep)
    schedule.keep()
    clock.now += 5 * TICK
    schedule.keep(starved=True)
    schedule.keep(starved=True)
    report = schedule.report("normal")
    assert (report.missed, report.starved) == (1, 1)


@UNHURRIED
@given(st.lists(st.tuples(st.floats(0.0, 5e-3), st.floats(0.0, 5e-3)), max_size=20))
def test_no_two_ticks_come_close_together(delays: list[tuple[float, float]]) -> None:
    """However late they are: less than half a tick apart would be a jump."""
    clock = Clock(oversleep=[over for over, _ in delays])
    schedule = Schedule(TICK, clock, clock.sleep)
    times = sent(clock, schedule, [busy for _, busy in delays])
    gaps = [b - a for a, b in pairwise(times)]
    assert all(gap >= (1.0 - TOLERANCE) * TICK - 1e-9 for gap in gaps)
    assert schedule.lateness.ticks == len(delays)


@UNHURRIED
@given(st.lists(st.floats(0.0, 0.03), min_size=1, max_size=50), st.sampled_from([50.0, 99.0, 100.0]))
def test_percentiles_are_those_of_the_values(values: list[float], percent: float) -> None:
    lateness = Lateness()
    for value in values:
        lateness.add(value)
    rank = max(-(-len(values) * percent // 100), 1)
    exact = sorted(values)[int(rank) - 1]
    found = lateness.percentile(percent)
    assert found == max(values) if exact >= 0.0199 else exact - 1e-9 <= found <= exact + 1.001e-6
