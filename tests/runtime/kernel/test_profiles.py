"""`controller.profile` of a cell: figures through a program, limits, commands, windows."""

from __future__ import annotations

import numpy as np
import pytest
from command_runs import CommandRun, command_cell
from programs_at_random import random_program

from session_runs import Run, cell, run

SHAPES = ("sinusoidal", "bezier")
FREE = """
[limits.joints]
speed_deg_s = [9e4, 9e4, 9e4, 9e4, 9e4, 9e4]
acceleration_deg_s2 = [9e6, 9e6, 9e6, 9e6, 9e6, 9e6]
jerk_deg_s3 = [9e9, 9e9, 9e9, 9e9, 9e9, 9e9]
"""
PATH = "acceleration_mm_s2 = 10000\njerk_mm_s3 = 100000"


def shaped(name: str, controller: str = "", limits: str = "", more: str = "") -> Run:
    """A line of 800 mm at 1 m/s."""
    where = cell(controller=f'profile = "{name}"\n{controller}', limits=limits, more=more)
    return run("MJ P1 F60\nML Y=500 F1000\n", where)


@pytest.mark.parametrize(("name", "seconds"), [("sinusoidal", 0.2507), ("bezier", 0.2449)])
def test_a_program_takes_the_time_of_the_book_to_reach_its_speed(name: str, seconds: float) -> None:
    """Also on a line of an arm with turning joints; half of the speed after half of the time."""
    done = shaped(name, limits=PATH, more=FREE)
    speed = done.column("speed")[done.end_of(1) :]
    half, full = (np.flatnonzero(speed > part)[0] * done.session.cell.tick for part in (0.5, 0.9994))
    assert half == pytest.approx(0.5 * seconds, abs=2e-3)
    assert 0.95 * seconds < full <= seconds + 2e-3
    assert not done.over_limits()


@pytest.mark.parametrize("name", SHAPES)
def test_a_joint_move_is_up_along_and_down(name: str) -> None:
    """J1 by 90 deg at 60 deg/s, a = 400, j = 4000: two changes of speed and 60 deg/s between them."""
    text = "MJ J1=90 F60\n"
    times = [run(text, cell(controller=f'profile = "{p}"')).session.kernel.tick for p in (name, "s-curve")]
    change = {
        "sinusoidal": max(2 * 60 / 400, np.sqrt(2 * np.pi * 60 / 4000)),
        "bezier": np.sqrt(6 * 60 / 4000),
    }
    assert times[0] == pytest.approx(1e3 * (90 / 60 + change[name]), abs=2)
    assert times[1] == pytest.approx(1e3 * (90 / 60 + 60 / 400 + 0.1), abs=2)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("seed", range(3))
def test_random_programs_keep_limits_and_are_not_faster(name: str, seed: int) -> None:
    text = random_program(seed).text
    plain, smooth = run(text, max_time=60.0), run(text, cell(controller=f'profile = "{name}"'), max_time=60.0)
    say = f"seed {seed}:\n{text}"
    assert not smooth.over_limits(), f"{smooth.over_limits()} {say}"
    assert smooth.code == plain.code, say
    assert smooth.session.kernel.tick >= 0.999 * plain.session.kernel.tick, say
    if plain.status == "finished":
        assert np.abs(smooth.joints[-1] - plain.joints[-1]).max() < 1e-9, say


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("seed", [0, 1, 5])
def test_random_commands(name: str, seed: int) -> None:
    """Override, halt, back and emergency stop in the middle of changes of speed."""
    command_run = CommandRun(seed, command_cell(name))
    wrong = command_run.check().wrong
    assert not wrong, f"seed {seed}: {wrong}\n{command_run.describe()}"


@pytest.mark.parametrize(("name", "window"), [("sinusoidal", 1), ("bezier", 23)])
def test_the_window_changes_nothing(name: str, window: int) -> None:
    text = "MJ J5=30 F90\nML X=1650 R20 F600\nSET DO1\nML Y=80 R20\nMS X=1640 Y=0 Z=2500\n"
    where = cell(controller=f'profile = "{name}"')
    long, short = run(text, where, window=1024), run(text, where, window=window)
    assert long.history == short.history
    assert np.abs(long.joints - short.joints).max() < 1e-9


@pytest.mark.parametrize("name", SHAPES)
def test_a_long_chain_is_extended_in_motion(name: str) -> None:
    """More corners than one horizon holds: the robot does not stand still among them."""
    corners = "".join(f"ML X={1500 + k % 2 * 8} Y={8 * k - 300} R3\n" for k in range(60))
    done = run(f"MJ P1 F60\n{corners}ML P2\n", cell(controller=f'profile = "{name}"'))
    assert not done.over_limits()
    moving = done.column("speed")[done.end_of(1) + 60 : -60]
    assert moving.min() > 0.01
