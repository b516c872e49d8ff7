"""Paths that start in, pass through and end in singular poses: the TCP keeps to them, joints are smooth."""

from __future__ import annotations

import numpy as np
import pytest
from programs_at_random import Arm, Floats

from session_runs import Run, run

ON_PATH = 1e-9
ACROSS = "MJ X=1755 Y=-100 Z=2660 A=0 B=0 C=0 F90\n"
"""With this orientation J5 = 0 wherever Y = 0, on the way to HOME's pose and beyond it."""


def positions(done: Run, line: int) -> Floats:
    """TCP (N, 3) within a line, by independent kinematics, tool 0."""
    arm = Arm()
    rows = np.flatnonzero(done.column("line") == line)
    return np.array([arm.flange(done.joints[k])[:3, 3] for k in rows])


def assert_good(done: Run) -> None:
    assert done.status == "finished", done.session.failure
    assert not done.over_limits()


def test_a_line_goes_through_a_singular_pose_as_if_it_were_none() -> None:
    done = run(f"{ACROSS}ML Y=100 F200\n")
    assert_good(done)
    p = positions(done, 2)
    assert np.abs(p[:, [0, 2]] - [1.755, 2.660]).max() < ON_PATH
    middle = int(np.argmin(np.abs(p[:, 1])))
    speed = np.abs(np.diff(p[:, 1]))[middle - 20 : middle + 20] / 0.001
    assert speed.min() > 0.199
    # the hand goes over to the other side: J5 changes its sign, J4 and J6 hardly move
    rows = np.flatnonzero(done.column("line") == 2)
    q = done.joints[rows]
    assert q[0, 4] * q[-1, 4] < 0.0
    assert np.ptp(q[:, [3, 5]], axis=0).max() < 0.1


def test_two_lines_meet_in_a_singular_pose() -> None:
    done = run(f"{ACROSS}ML Y=0 F200\nML Y=100\n")
    assert_good(done)
    assert done.reasons[2] == "SMOOTH"
    assert done.column("speed")[done.end_of(2)] > 0.19


def test_a_stop_in_a_singular_pose() -> None:
    done = run(f"{ACROSS}ML Y=0 F200\nWAIT 0.01\nML Y=100\nML Y=0 R0\nML Y=-100\n")
    assert_good(done)
    assert np.abs(positions(done, 4)[:, [0, 2]] - [1.755, 2.660]).max() < ON_PATH


@pytest.mark.parametrize("turns", ["H360", "H-400", "H450"])
def test_a_circle_passes_the_singular_pose_it_began_in(turns: str) -> None:
    done = run(f"HOME\nMC X=1555 Y=100 Z=2560 QX=1655 QY=150 QZ=2560 F700 {turns}\n")
    assert_good(done)


def test_free_joints_turn_first_while_the_tcp_is_held() -> None:
    """Out of HOME along Y the hand must bend sideways: J4 turns by a quarter, and J6 back."""
    done = run("HOME\nML Y=150 F200\n")
    assert_good(done)
    p, q = positions(done, 2), done.joints[done.column("line") == 2]
    turning = np.linalg.norm(p - [1.755, 0.0, 2.660], axis=1) < ON_PATH
    assert np.abs(q[turning][-1, 3]) == pytest.approx(np.pi / 2, abs=0.05)
    assert turning.sum() > 100
    assert np.abs(p[:, [0, 2]] - [1.755, 2.660]).max() < ON_PATH


def test_no_joint_turns_where_the_path_leaves_along_the_joints_as_they_are() -> None:
    done = run("HOME\nML X=1600 F200\n")
    assert_good(done)
    assert np.abs(done.joints[:, [0, 3, 5]]).max() < 1e-9


def test_a_joint_move_with_straight_hand_is_not_rounded_into_a_line() -> None:
    done = run("MJ J1=30 J2=10 F60 R10\nML X=1600 Y=500 Z=2300 F200\n")
    assert_good(done)
    assert np.linalg.norm(np.diff(done.joints[[done.end_of(1) - 1, done.end_of(1)]], axis=0)) < 1e-6
    assert np.abs(done.column("position")[-1] - [1.6, 0.5, 2.3]).max() < 1e-9
