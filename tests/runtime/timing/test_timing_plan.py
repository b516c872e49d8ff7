"""Time laws from rest to rest: limits at ticks, Ruckig's times, odd sections, refusals."""

from __future__ import annotations

import numpy as np
import pytest
import ruckig
from timing_curves import Waves, constant, limits, line, peaks, random_waves, steps

from viapoint.runtime.timing import PROGRAMMED_SPEED, AxisLimits, TimeLaw, TimingError, plan

ROUNDING = 1e-6


def check(law: TimeLaw, curve: Waves, lim: AxisLimits, s_end: float, tick: float) -> None:
    speed, acceleration, jerk = peaks(law, curve, lim, tick)
    assert speed <= 1.0 + ROUNDING
    assert acceleration <= 1.0 + ROUNDING
    assert jerk <= 1.05
    s, v, a = law.at(np.array([law.t_end, law.t_end + 1.0]))
    assert (s == s_end).all()
    assert (v == 0.0).all()
    assert (a == 0.0).all()


@pytest.mark.parametrize("seed", range(16))
def test_random_curves_stay_within_limits_at_every_tick(seed: int) -> None:
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    length, axes, tick = 10.0 ** rng.uniform(-2, 0.7), int(rng.integers(1, 9)), (1e-3, 4e-3, 2e-4)[seed % 3]
    curve = random_waves(seed, axes, length)
    acceleration = 10.0 ** rng.uniform(0.0, 1.5)
    lim = limits(axes, 10.0 ** rng.uniform(-1, 1), acceleration, acceleration * 10.0 ** rng.uniform(0.7, 3))
    bound = steps(list(curve.breaks), list(10.0 ** rng.uniform(-1, 0.3, 7)))
    law = plan(curve, lim, bound, s_start=0.0, s_end=length, tick=tick)
    check(law, curve, lim, length, tick)
    s, v, _ = law.at(np.arange(0.0, law.duration, tick))
    assert (np.diff(s) >= 0.0).all()
    assert (v <= bound(s) * (1.0 + ROUNDING)).all()
    assert (np.diff(s) <= tick * np.minimum(bound(s[1:]), bound(s[:-1])) * (1.0 + ROUNDING)).all()
    assert law.quality.stretch == 1.0


@pytest.mark.parametrize(
    ("length", "speed", "jerk"), [(1.0, 0.5, 50.0), (1e-6, 0.5, 50.0), (100.0, 1.0, 5.0), (0.01, 0.5, 5e4)]
)
def test_linear_axes_take_the_time_of_ruckig(length: float, speed: float, jerk: float) -> None:
    ask = ruckig.InputParameter(1)
    ask.target_position, ask.max_velocity, ask.max_acceleration, ask.max_jerk = (
        [length],
        [speed],
        [5.0],
        [jerk],
    )
    exact = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(ask, exact)
    curve, lim = line(1.0, 0.0, -0.25), limits(3, 10.0, 5.0, jerk)
    law = plan(curve, lim, constant(speed), s_start=0.0, s_end=length, tick=1e-3)
    assert law.quality.method == "exact"
    assert law.duration == pytest.approx(exact.duration, abs=1e-3)
    check(law, curve, lim, length, 1e-3)


def test_a_curve_that_is_nearly_a_line_takes_nearly_the_time_of_a_line() -> None:
    straight, lim = line(1.0, 0.5), limits(2, 1.0, 5.0, 50.0)
    bent = Waves(straight.rate, *(np.array([[0.0, x]]) for x in (1e-3, 6.0, 0.0)))
    times = [
        plan(c, lim, constant(0.8), s_start=0.0, s_end=1.0, tick=1e-3).duration for c in (straight, bent)
    ]
    assert times[1] == pytest.approx(times[0], rel=0.03)


@pytest.mark.parametrize("tick", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("jerk", [0.5, 100.0, 1e5, np.inf])
def test_any_tick_and_any_jerk(tick: float, jerk: float) -> None:
    curve, lim = random_waves(7, 6, 0.3), limits(6, 2.0, 8.0, jerk)
    check(plan(curve, lim, constant(0.4), s_start=0.0, s_end=0.3, tick=tick), curve, lim, 0.3, tick)


@pytest.mark.parametrize("pieces", [0, 200])
@pytest.mark.parametrize("length", [1e-6, 1e-3, 30.0])
def test_any_length_and_any_number_of_pieces(length: float, pieces: int) -> None:
    curve, lim = random_waves(8, 4, max(length, 1.0)), limits(4, 2.0, 8.0, 200.0)
    curve.breaks = np.linspace(0.0, length, pieces + 2)[1:-1]
    check(plan(curve, lim, constant(0.7), s_start=0.0, s_end=length, tick=1e-3), curve, lim, length, 1e-3)


def test_limits_of_any_scale_and_missing_ones() -> None:
    curve = random_waves(9, 4, 1.0)
    scale = np.array([1.0, 1e3, 1e-3, 1.0])
    curve = Waves(curve.rate * scale, curve.amplitude * scale, curve.frequency, curve.phase)
    lim = AxisLimits(
        np.array([np.inf, 1e3, 1e-3, 2.0]),
        np.array([5.0, 5e3, np.inf, 5.0]),
        np.array([np.inf, 1e5, 0.1, 80.0]),
    )
    check(plan(curve, lim, constant(np.inf), s_start=0.0, s_end=1.0, tick=1e-3), curve, lim, 1.0, 1e-3)


class Singular:
    """A wrist passing its singular pose at distance `off`: π of turn within a few times that."""

    breaks = np.zeros(0)

    def __init__(self, off: float) -> None:
        self.off = off

    def values(self, s: np.ndarray) -> np.ndarray:
        return np.column_stack((s, np.arctan2(s - 0.5, self.off)))

    def derivatives(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        y, e = s - 0.5, self.off
        r, one, zero = y * y + e * e, np.ones_like(s), np.zeros_like(s)
        third = e * (6.0 * y * y - 2.0 * e * e) / r**3
        return (
            np.column_stack((one, e / r)),
            np.column_stack((zero, -2.0 * e * y / r**2)),
            np.column_stack((zero, third)),
        )


@pytest.mark.parametrize("off", [1e-2, 1e-3, 1e-5])
def test_slow_only_beside_a_singular_pose(off: float) -> None:
    curve = Singular(off)
    lim = AxisLimits(np.array([np.inf, 3.0]), np.array([5.0, 15.0]), np.array([50.0, 300.0]))
    law = plan(curve, lim, constant(0.5), s_start=0.0, s_end=1.0, tick=1e-3)
    speed, acceleration, jerk = peaks(law, curve, lim, 1e-3)  # type: ignore[arg-type]
    assert max(speed, acceleration) <= 1.0 + ROUNDING
    assert jerk <= 1.05
    _, v, _ = law.at(law.time_of(np.array([0.25, 0.5, 0.75])))
    assert v[1] < 0.1
    assert min(v[0], v[2]) > 0.45


def test_deceleration_of_its_own() -> None:
    curve, tick = random_waves(10, 2, 1.0), 1e-3
    lim = AxisLimits(
        np.array([9.0, 9.0]), np.array([2.0, 99.0]), np.array([60.0, 999.0]), np.array([6.0, 99.0])
    )
    law = plan(curve, lim, constant(1.0), s_start=0.0, s_end=1.0, tick=tick)
    q = curve.values(law.at(np.arange(-4, law.duration / tick + 6) * tick)[0])[:, 0]
    a = np.diff(q, 2) / tick**2
    assert 1.9 < a.max() <= 2.0 + ROUNDING
    assert 4.0 < -a.min() <= 6.0 + ROUNDING


def test_a_law_is_the_same_for_any_batch_and_its_inverse_fits() -> None:
    curve = random_waves(11, 3, 1.0)
    law = plan(curve, limits(3, 2.0, 8.0, 200.0), constant(0.5), s_start=0.0, s_end=1.0, tick=1e-3, t0=0.25)
    t = np.arange(0.2, law.t_end + 0.1, 1e-3)
    single = np.array([[x[0] for x in law.at(np.array([k]))] for k in t]).T
    assert np.array_equal(single, np.array(law.at(t)))
    s = np.linspace(0.0, 1.0, 101)
    assert law.at(law.time_of(s))[0] == pytest.approx(s, abs=1e-12)
    assert law.t0 == 0.25
    moved = law.moved(1.25, 3.0, 4.0)
    assert moved.at(t + 1.0)[0] == pytest.approx(law.at(t)[0] + 3.0, abs=1e-12)
    assert (moved.s_start, moved.s_end) == (3.0, 4.0)
    later = law.without_past(0.6)
    assert np.array_equal(later.at(t[t > 0.6]), law.at(t[t > 0.6]))
    assert len(later.t) < len(law.t)


def test_what_limits_a_law_is_told() -> None:
    curve = Waves(np.array([1.0, 0.0]), *(np.array([[0.0, x]]) for x in (0.2, 9.0, 0.0)))
    lim = AxisLimits(np.array([9.0, 9.0]), np.array([3.0, 6.0]), np.array([100.0, 500.0]))
    law = plan(curve, lim, steps([1.0], [5.0, 0.1]), s_start=0.0, s_end=2.0, tick=1e-3)
    assert law.limited_by(1.5) == PROGRAMMED_SPEED
    assert law.limited_by(1e-3) == 0
    assert law.limited_by(np.pi / 18.0 * 3.0) == 1
    straight = plan(line(1.0, 2.0), lim, constant(0.3), s_start=0.0, s_end=1.0, tick=1e-3)
    assert list(straight.limited_by([1e-4, 0.5])) == [0, PROGRAMMED_SPEED]


class Jumping(Waves):
    """Not a curve: an axis jumps."""

    def values(self, s: np.ndarray) -> np.ndarray:
        return super().values(s) + (s[:, None] > 0.51)


def test_what_cannot_be_timed_is_refused() -> None:
    good, lim = random_waves(12, 2, 1.0), limits(2, 1.0, 5.0, 50.0)
    with pytest.raises(TimingError, match="nor a jerk limits"):
        plan(
            line(1.0), limits(1, np.inf, np.inf, np.inf), constant(np.inf), s_start=0.0, s_end=1.0, tick=1e-3
        )
    with pytest.raises(TimingError, match="not a finite number"):
        plan(good, lim, constant(np.nan), s_start=0.0, s_end=1.0, tick=1e-3)
    with pytest.raises(TimingError, match="not a finite number"):
        plan(line(np.nan, 1.0), lim, constant(1.0), s_start=0.0, s_end=1.0, tick=1e-3)
    with pytest.raises(TimingError, match="s_start < s_end"):
        plan(good, lim, constant(1.0), s_start=1.0, s_end=1.0, tick=1e-3)
    with pytest.raises(TimingError, match="tick"):
        plan(good, lim, constant(1.0), s_start=0.0, s_end=1.0, tick=0.0)
    with pytest.raises(TimingError, match="must be positive"):
        limits(2, 1.0, -5.0, 50.0)
    jumping = Jumping(good.rate, good.amplitude, good.frequency, good.phase)
    with pytest.raises(TimingError, match="jump"):
        plan(jumping, lim, constant(1.0), s_start=0.0, s_end=1.0, tick=1e-3)


def test_the_inverse_of_a_law_takes_few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also at knots, where it lies at the end of a bracket, and no further than rounding goes."""
    curve = random_waves(12, 3, 1.0)
    law = plan(curve, limits(3, 2.0, 8.0, 200.0), constant(0.5), s_start=0.0, s_end=1.0, tick=1e-3)
    s = np.concatenate((np.linspace(0.02, 0.98, 997), law.s[(law.s > 0.02) & (law.s < 0.98)]))
    times = law.time_of(s)
    monkeypatch.setattr("viapoint.runtime.timing.law._INVERSE_STEPS", 20)
    assert np.array_equal(law.time_of(s), times)
    assert np.abs(law.at(times)[0] - s).max() < 1e-15


def test_a_motion_for_hours_is_refused_before_it_takes_all_memory() -> None:
    with pytest.raises(TimingError, match="hours"):
        plan(
            random_waves(13, 3, 1.0),
            limits(3, 2.0, 8.0, 1e-12),
            constant(0.5),
            s_start=0.0,
            s_end=1.0,
            tick=1e-3,
        )
