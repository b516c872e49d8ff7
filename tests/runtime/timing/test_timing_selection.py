"""Rows left out of a solve: which they are, that none is missed, and that laws are as fast as with all."""

from __future__ import annotations

import numpy as np
import pytest
from timing_curves import Waves, constant, limits, peaks, random_waves

from viapoint.runtime.timing import plan, selection
from viapoint.runtime.timing.selection import Selection, missed, select

NEAR = (np.array([[0.2, 1.0, 4.0], [0.1, 0.4, 1.0], [0.6, 0.3, 1.9]]), np.array([[0.0], [2.0], [0.9]]))


def test_axes_far_below_the_largest_rows_are_left_out() -> None:
    chosen = select(NEAR)
    assert chosen.acceleration.tolist() == [True, False, True]  # 1.0 beside 4.0 is little
    assert chosen.jerk.tolist() == [False, True, False]


def test_rows_that_were_missed_are_taken_in_with_those_close_to_it() -> None:
    given = Selection(np.array([True, False, False]), np.array([False, True, False]))
    more = missed((np.array([[0.9], [0.95], [1.01]]), np.array([[0.1], [1.0], [0.5]])), given)
    assert more is not None
    assert more.acceleration.tolist() == [True, True, True]
    assert more.jerk.tolist() == [False, True, False]
    assert missed((np.array([[1.2], [0.99], [1.0]]), np.array([[0.1], [1.3], [0.5]])), given) is None


@pytest.mark.parametrize("seed", range(5))
def test_a_law_is_as_fast_and_as_safe_as_with_all_rows(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    print(f"seed {seed}")
    waves, lim = random_waves(seed + 30, 6, 1.0), limits(6, 2.0, 8.0, 200.0)
    share = np.array([1.0, 0.05, 0.4, 0.02, 0.6, 0.3])
    curve = Waves(waves.rate * share, waves.amplitude * share, waves.frequency, waves.phase, waves.breaks)
    law = plan(curve, lim, constant(0.6), s_start=0.0, s_end=1.0, tick=1e-3)
    monkeypatch.setattr(selection, "_NEAR", 0.0)
    every = plan(curve, lim, constant(0.6), s_start=0.0, s_end=1.0, tick=1e-3)
    assert law.duration == pytest.approx(every.duration, rel=2e-3)
    speed, acceleration, jerk = peaks(law, curve, lim, 1e-3)
    assert max(speed, acceleration) <= 1.0 + 1e-6
    assert jerk <= 1.05
