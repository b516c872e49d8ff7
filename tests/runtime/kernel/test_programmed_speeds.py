"""F, FC and FA hold on every kind of motion: reached where the way is long enough, and never passed."""

from __future__ import annotations

import numpy as np
import pytest
from programs_at_random import Arm, Floats

from session_runs import Run, run

START = "MJ X=1500 Y=-150 Z=1500 A=0 B=90 C=0 F60\n"
TICK = 1e-3
OVER = 1.0 + 1e-4
"""A chord is shorter than the path; what rounding and the ticks' differences add is less."""

REACHED = 0.995
DEG = np.pi / 180.0

CASES = {
    "line, F in mm/s": ("ML Y=150 F200", "linear", 0.2),
    "line that turns much, F in deg/s": ("ML Y=-140 A=40 F20", "angular", 20 * DEG),
    "line, FC": ("ML Y=150 A=40 FC100", "linear", 0.1),
    "line, FA": ("ML Y=150 A=40 FA15", "angular", 15 * DEG),
    "line without a turn, FA read as mm/s": ("ML Y=150 FA100", "linear", 0.1),
    "turn in place, F": ("ML A=40 F20", "angular", 20 * DEG),
    "turn in place, FC read as deg/s": ("ML A=40 FC20", "angular", 20 * DEG),
    "circle, F": ("MC Y=150 QX=1580 QY=0 QZ=1500 F150", "linear", 0.15),
    "circle, FC": ("MC Y=150 A=30 QX=1580 QY=0 QZ=1500 FC150", "linear", 0.15),
    "circle, FA": ("MC Y=150 A=30 QX=1580 QY=0 QZ=1500 FA12", "angular", 12 * DEG),
    "two turns backwards": ("MC Y=150 QX=1580 QY=0 QZ=1500 H-720 F300", "linear", 0.3),
    "splines, FC": ("MS X=1600 Y=0 FC120\nMS X=1500 Y=150", "linear", 0.12),
    "splines, FA": ("MS X=1600 Y=0 A=20 FA10\nMS X=1500 Y=150 A=40", "angular", 10 * DEG),
    "joint move, F along its joint-space length": ("MJ Y=150 F25", "joint", 25 * DEG),
    "joint move, FC": ("MJ Y=150 FC80", "linear", 0.08),
    "joint move, FA": ("MJ Y=150 A=40 FA15", "angular", 15 * DEG),
}


def speeds(done: Run, measure: str) -> Floats:
    """By one measure in every tick from line 2 on: m/s or rad/s, by independent kinematics."""
    q = done.joints[np.flatnonzero(done.column("line") >= 2)]
    if measure == "joint":
        return np.asarray(np.linalg.norm(np.diff(q, axis=0), axis=1) / TICK)
    arm = Arm()
    X = np.array([arm.flange(row) for row in q])
    if measure == "linear":
        return np.asarray(np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=1) / TICK)
    change = X[1:, :3, :3] @ np.swapaxes(X[:-1, :3, :3], 1, 2)
    twice = np.stack([change[:, i, j] - change[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1)
    return np.asarray(np.arcsin(0.5 * np.linalg.norm(twice, axis=1)) / TICK)


@pytest.mark.parametrize("name", CASES)
def test_the_programmed_speed_is_reached_and_not_passed(name: str) -> None:
    lines, measure, speed = CASES[name]
    done = run(START + lines + "\n")
    assert done.status == "finished", done.session.failure
    assert not done.over_limits()
    measured = speeds(done, measure)
    assert measured.max() <= speed * OVER
    assert measured.max() >= speed * REACHED
