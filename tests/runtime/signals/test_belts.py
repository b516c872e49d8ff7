"""Belts: travel is the integral of the scenario's speed; the encoder's estimate; nothing hangs on windows."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from viapoint.runtime.cell import Conveyor
from viapoint.runtime.signals import Belt, BeltScript

TICK = 1e-3
TIMES = np.array([0.5, 1.0, 2.0, 2.5])
SPEEDS = np.array([0.1, 0.3, -0.2, 0.15])


def belt(noise: float = 0.0, seed: int = 1, *, constant: float | None = None) -> Belt:
    conveyor = Conveyor(
        index=1, name=None, X_base_belt=np.eye(4), counts_per_metre=1e5, max_lag=1e-3, parts=None
    )
    times, speeds = (TIMES, SPEEDS) if constant is None else (np.zeros(1), np.array([constant]))
    return Belt(conveyor, BeltScript(1, times, speeds, noise), seed, TICK)


@pytest.mark.parametrize("tick", [0, 300, 500, 801, 1000, 1700, 2499, 2500, 4000])
def test_travel_is_the_integral_of_the_speed(tick: int) -> None:
    found = float(belt().travel(np.array([tick]))[0])
    expected, _ = quad(lambda t: np.interp(t, TIMES, SPEEDS), 0.0, tick * TICK, points=TIMES, limit=200)
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_belt_without_a_script_stands() -> None:
    conveyor = belt().conveyor
    still = Belt(conveyor, None, 0, TICK)
    assert (still.travel(np.arange(5000)) == 0.0).all()
    assert (still.measured(0, 50)[1] == 0.0).all()
    assert still.rest_tick == 0
    assert belt().rest_tick == np.inf


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_the_estimate_of_a_constant_belt(noise: float) -> None:
    moving = belt(noise, constant=0.2)
    place, speed = moving.measured(100, 3000)
    truth = moving.travel(np.arange(100, 3100))
    assert np.abs(place - truth).max() < 1e-5 * (1.0 + 2.0 * noise)
    assert np.abs(speed - 0.2).max() < 1e-3


def test_the_order_in_which_it_is_asked_changes_no_bit() -> None:
    whole_place, whole_speed = belt(0.7).measured(0, 3000)
    other = belt(0.7)
    for first, count in ((2900, 100), (0, 1), (1, 7), (1020, 64), (8, 1012)):
        place, speed = other.measured(first, count)
        assert (place == whole_place[first : first + count]).all()
        assert (speed == whole_speed[first : first + count]).all()


def test_the_seed_decides_the_noise() -> None:
    first, same, another = (belt(0.7, seed).measured(500, 100)[0] for seed in (1, 1, 2))
    assert (first == same).all()
    assert (first != another).any()
