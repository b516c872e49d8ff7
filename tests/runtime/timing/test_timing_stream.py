"""Extending a law that is being executed: what was sent stays, limits hold across the join, the end comes."""

from __future__ import annotations

import numpy as np
import pytest
from timing_curves import Waves, constant, limits, line, peaks, random_waves, steps

from viapoint.runtime.timing import AxisLimits, SpeedBound, TimeLaw, extend, halt, plan

TICK = 1e-3


def stream(
    curve: Waves, lim: AxisLimits, bound: SpeedBound, ends: list[float], ahead: int
) -> tuple[TimeLaw, int]:
    """Laws for ends appended one by one as blocks are reached; `ahead` blocks are known. Counts refusals."""
    law = plan(curve, lim, bound, s_start=0.0, s_end=ends[ahead - 1], tick=TICK)
    refused = 0
    for k in range(ahead, len(ends)):
        reached = ends[k - ahead]
        commit = float(law.time_of(min(reached, law.s_end)))
        following = extend(law, curve, lim, bound, s_end=ends[k], tick=TICK, commit_time=commit)
        if following is None:
            refused += 1
            continue
        sent = np.arange(0.0, commit, TICK)
        assert np.array_equal(law.at(sent), following.at(sent))
        law = following
    return law, refused


@pytest.mark.parametrize("seed", range(6))
def test_streaming_keeps_limits_and_costs_next_to_nothing(seed: int) -> None:
    print(f"seed {seed}")
    curve = random_waves(seed + 50, 5, 2.0)
    lim = limits(5, 2.0, 6.0, (60.0, 300.0)[seed % 2])
    bound = steps(list(curve.breaks), [0.8, 0.5, 1.0, 0.3, 0.9, 0.6, 0.8])
    ends = [float(s) for s in np.linspace(0.25, 2.0, 8)]
    whole = plan(curve, lim, bound, s_start=0.0, s_end=2.0, tick=TICK)
    times = []
    for ahead in (3, 5):
        law, refused = stream(curve, lim, bound, ends, ahead)
        assert refused == 0
        assert law.s_end == 2.0
        speed, acceleration, jerk = peaks(law, curve, lim, TICK)
        assert speed <= 1.0 + 1e-6
        assert acceleration <= 1.0 + 1e-6
        assert jerk <= 1.05
        times.append(law.duration)
    assert times[1] <= times[0] * 1.005
    assert times[1] <= whole.duration * 1.01


def test_a_straight_line_is_extended_exactly() -> None:
    curve, lim = line(1.0, 0.2), limits(2, 2.0, 5.0, 50.0)
    law = plan(curve, lim, constant(0.5), s_start=0.0, s_end=1.0, tick=TICK)
    longer = extend(law, curve, lim, constant(0.5), s_end=2.0, tick=TICK, commit_time=1.0)
    assert longer is not None
    whole = plan(curve, lim, constant(0.5), s_start=0.0, s_end=2.0, tick=TICK)
    assert longer.duration == pytest.approx(whole.duration, abs=TICK)
    assert max(peaks(longer, curve, lim, TICK)) <= 1.0 + 1e-6


def test_a_straight_line_goes_on_into_a_curve() -> None:
    bent = Waves(np.array([1.0, 0.0]), *(np.array([[0.0, x]]) for x in (0.05, 9.0, 0.0)))
    straight, lim = line(1.0, 0.45), limits(2, 2.0, 5.0, 50.0)
    first = plan(straight, lim, constant(0.5), s_start=0.0, s_end=0.3, tick=TICK)
    curve = Joined(straight, bent, 0.3)
    law = extend(first, curve, lim, constant(0.5), s_end=1.5, tick=TICK, commit_time=0.2)
    assert law is not None
    speed, acceleration, jerk = peaks(law, curve, lim, TICK)
    assert max(speed, acceleration) <= 1.0 + 1e-6
    assert jerk <= 1.05
    assert law.s_end == 1.5


class Joined(Waves):
    """A line that turns into waves at a place where value, slope and curvature agree."""

    def __init__(self, before: Waves, after: Waves, place: float) -> None:
        super().__init__(before.rate, before.amplitude, before.frequency, before.phase, np.array([place]))
        self.before, self.after, self.place = before, after, place
        self.offset = before.values(np.array([place]))[0] - after.values(np.zeros(1))[0]

    def values(self, s: np.ndarray) -> np.ndarray:
        shifted = self.after.values(np.maximum(s - self.place, 0.0)) + self.offset
        return np.where((s < self.place)[:, None], self.before.values(s), shifted)

    def derivatives(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        early = (s < self.place)[:, None]
        both = zip(
            self.before.derivatives(s), self.after.derivatives(np.maximum(s - self.place, 0.0)), strict=True
        )
        first, second, third = (np.where(early, a, b) for a, b in both)
        return first, second, third


def test_forgetting_the_past_changes_nothing_ahead() -> None:
    curve, lim, bound = random_waves(61, 4, 2.0), limits(4, 2.0, 6.0, 60.0), constant(0.5)
    law = plan(curve, lim, bound, s_start=0.0, s_end=1.0, tick=TICK)
    short = law.without_past(0.799)
    laws = [extend(x, curve, lim, bound, s_end=2.0, tick=TICK, commit_time=0.8) for x in (law, short)]
    assert laws[0] is not None
    assert laws[1] is not None
    t = np.arange(0.8, laws[0].t_end, TICK)
    assert np.array_equal(laws[0].at(t), laws[1].at(t))
    assert len(laws[1].t) < len(laws[0].t)


@pytest.mark.parametrize("seed", range(4))
def test_halting_at_any_tick_keeps_limits(seed: int) -> None:
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    curve, lim = random_waves(seed + 70, 5, 4.0), limits(5, 2.0, 6.0, (60.0, 400.0)[seed % 2])
    law = plan(curve, lim, constant(0.8), s_start=0.0, s_end=4.0, tick=TICK)
    for k in rng.integers(50, int(0.8 * law.duration / TICK), 4):
        halted = halt(law, curve, lim, constant(0.8), tick=TICK, commit_time=float(k) * TICK)
        assert halted is not None, f"tick {k}"
        sent = np.arange(k + 1) * TICK
        assert np.array_equal(law.at(sent), halted.at(sent))
        assert halted.s_end < law.s_end
        speed, acceleration, jerk = peaks(halted, curve, lim, TICK)
        assert max(speed, acceleration) <= 1.0 + 1e-6
        assert jerk <= 1.05


def test_before_its_start_and_after_its_end() -> None:
    curve, lim, bound = random_waves(60, 3, 1.0), limits(3, 2.0, 6.0, 60.0), constant(0.5)
    law = plan(curve, lim, bound, s_start=0.0, s_end=0.5, tick=TICK, t0=2.0)
    whole = plan(curve, lim, bound, s_start=0.0, s_end=1.0, tick=TICK, t0=2.0)
    anew = extend(law, curve, lim, bound, s_end=1.0, tick=TICK, commit_time=2.0)
    assert anew is not None
    assert np.array_equal(anew.t, whole.t)
    assert extend(law, curve, lim, bound, s_end=1.0, tick=TICK, commit_time=law.t_end) is None
    late = extend(law, curve, lim, bound, s_end=1.0, tick=TICK, commit_time=law.t_end - 0.1)
    assert late is None or max(peaks(late, curve, lim, TICK)[:2]) <= 1.0 + 1e-6
