"""Changes of speed in a shape: the seed's figures, limits at ticks, smooth acceleration, extensions."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from timing_curves import Waves, constant, limits, line, peaks, random_waves, steps

from viapoint.runtime.timing import AxisLimits, TimeLaw, plan, profile

TICK = 1e-3
SHAPES = ("sinusoidal", "bezier")
NEVER_FASTER = 0.999
"""A shorter time than the S-curve's is beyond what the checks of two laws differ by."""


def assert_within(law: TimeLaw, curve: Waves, lim: AxisLimits, tick: float) -> None:
    speed, acceleration, jerk = peaks(law, curve, lim, tick)
    assert speed <= 1.0 + 1e-6
    assert acceleration <= 1.0 + 1e-6
    assert jerk <= 1.05


def reaches(law: TimeLaw, speed: float) -> float:
    """Time in which a law is first as fast."""
    return float(law.t[np.flatnonzero(law.v >= speed * (1.0 - 1e-5))[0]])


@pytest.mark.parametrize(
    ("name", "seconds", "peak"),
    [("s-curve", 0.2, 10.0), ("sinusoidal", 0.2507, 7.98), ("bezier", 0.2449, 6.12)],
)
def test_a_change_of_speed_takes_the_time_of_the_book(name: str, seconds: float, peak: float) -> None:
    law = profile(name).plan(
        line(1.0), limits(1, 9.0, 10.0, 100.0), constant(1.0), s_start=0.0, s_end=2.0, tick=TICK
    )
    assert reaches(law, 1.0) == pytest.approx(seconds, abs=2e-4)
    _, _, a = law.at(np.arange(0.0, law.duration, 1e-4))
    assert np.abs(a).max() == pytest.approx(peak, rel=2e-3)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("length", [1e-4, 0.01, 0.1, 0.25])
def test_a_short_line_is_up_and_down_again(name: str, length: float) -> None:
    """Nothing is held, and the speed reached is what the length allows."""
    curve, lim = line(1.0), limits(1, 9.0, 10.0, 100.0)
    law = profile(name).plan(curve, lim, constant(3.0), s_start=0.0, s_end=length, tick=TICK)
    top = float(law.v.max())
    assert law.duration == pytest.approx(2.0 * length / top, rel=1e-4)
    assert law.duration > plan(curve, lim, constant(3.0), s_start=0.0, s_end=length, tick=TICK).duration
    assert_within(law, curve, lim, TICK)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("seed", range(6))
def test_random_curves_stay_within_limits_and_are_not_faster(name: str, seed: int) -> None:
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    length, axes, tick = 10.0 ** rng.uniform(-2, 0.7), int(rng.integers(1, 9)), (1e-3, 4e-3, 2e-4)[seed % 3]
    curve = random_waves(seed, axes, length)
    acceleration = 10.0 ** rng.uniform(0.0, 1.5)
    lim = limits(axes, 10.0 ** rng.uniform(-1, 1), acceleration, acceleration * 10.0 ** rng.uniform(0.7, 3))
    bound = steps(list(curve.breaks), list(10.0 ** rng.uniform(-1, 0.3, 7)))
    law = profile(name).plan(curve, lim, bound, s_start=0.0, s_end=length, tick=tick)
    assert_within(law, curve, lim, tick)
    s, _, _ = law.at(np.arange(0.0, law.duration, tick))
    assert (np.diff(s) <= tick * np.minimum(bound(s[1:]), bound(s[:-1])) * (1.0 + 1e-6)).all()
    quickest = plan(curve, lim, bound, s_start=0.0, s_end=length, tick=tick)
    assert law.duration >= NEVER_FASTER * quickest.duration
    assert law.quality.stretch == 1.0


@pytest.mark.parametrize("name", SHAPES)
def test_speed_is_held_or_changes_in_the_shape(name: str) -> None:
    """Every stretch between two places without acceleration has the shape's form: its middle is half-way."""
    curve = random_waves(3, 4, 1.0)
    lim = limits(4, 2.0, 6.0, 60.0)
    law = profile(name).plan(curve, lim, constant(0.7), s_start=0.0, s_end=1.0, tick=TICK)
    still = np.flatnonzero(law.a == 0.0)
    assert len(still) > 4
    for a, b in pairwise(still):
        middle = np.array([0.5 * (law.t[a] + law.t[b])])
        _, v, _ = law.at(middle)
        assert v[0] == pytest.approx(0.5 * (law.v[a] + law.v[b]), rel=1e-6)


def test_the_jerk_of_a_sinusoidal_law_has_no_jumps() -> None:
    """Its rate is at most 4π²·Δv/T³ = j²·2π/Δv for the smallest change; an S-curve's is without bound."""
    curve, lim = line(1.0), limits(1, 9.0, 10.0, 100.0)
    fine = 1e-4
    rates = []
    for name in ("sinusoidal", "s-curve"):
        law = profile(name).plan(curve, lim, constant(1.0), s_start=0.0, s_end=2.0, tick=TICK)
        s, _, _ = law.at(np.arange(-10, 2400 * 10) * fine)
        rates.append(float(np.abs(np.diff(s, 4)).max()) / fine**4)
    assert rates[0] < 4.0 * np.pi**2 / 0.2507**3 * 1.05
    assert rates[1] > 100.0 * rates[0]


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("commit", [0.05, 0.4, 1.0])
def test_an_extension_keeps_what_was_sent_and_the_limits(name: str, commit: float) -> None:
    """Asked in the middle of a change of speed it goes on from the end of that change."""
    curve, lim = random_waves(11, 5, 2.0), limits(5, 2.0, 6.0, 60.0)
    shaped = profile(name)
    law = shaped.plan(curve, lim, constant(0.5), s_start=0.0, s_end=1.2, tick=TICK)
    longer = shaped.extend(law, curve, lim, constant(0.5), s_end=2.0, tick=TICK, commit_time=commit)
    assert longer is not None
    sent = np.arange(0.0, commit, TICK)
    assert np.array_equal(law.at(sent), longer.at(sent))
    assert_within(longer, curve, lim, TICK)
    assert longer.s_end == 2.0


@pytest.mark.parametrize("name", SHAPES)
def test_no_extension_once_the_last_braking_has_begun(name: str) -> None:
    curve, lim, bound = line(1.0), limits(1, 2.0, 6.0, 60.0), constant(0.5)
    shaped = profile(name)
    law = shaped.plan(curve, lim, bound, s_start=0.0, s_end=1.0, tick=TICK)
    late = law.duration - 0.05
    assert shaped.extend(law, curve, lim, bound, s_end=2.0, tick=TICK, commit_time=late) is None


@pytest.mark.parametrize("name", SHAPES)
def test_a_dip_so_narrow_that_only_crawling_passes_it(name: str) -> None:
    """Lower and lower speeds are tried until a change fits."""
    curve, lim = line(1.0), limits(1, 2.0, 1e-3, 1e-2)
    law = profile(name).plan(curve, lim, constant(0.5), s_start=0.0, s_end=1e-5, tick=TICK)
    assert_within(law, curve, lim, TICK)
