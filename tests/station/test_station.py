"""Several robots in one cell: one tick, signals, meeting points, exclusive zones, bodies, deadlocks."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from station_runs import FACING, StationRun, cells, run

from viapoint.runtime.records import Floats
from viapoint.session import Session, Status, compile_text

MOVE = "MJ J1=30 F60\n"
ASK = "L: IF NOT DO1\nGOTO L\nENDIF\n"
MEET = "[[when]]\nm = 5\nrobots = [1, 2]\nafter_s = 0.5\nreset_m = 5\n"
WINDOWS = [1024, 64, 7]


@pytest.mark.parametrize("window", WINDOWS)
def test_an_output_of_one_is_seen_by_another_in_the_next_tick(window: int) -> None:
    done = run(MOVE + "SET DO1\n", f"{ASK}SET DO2\n", window=window)
    (written,) = done.ticks_of("output", 1, signal="DO1")
    (answered,) = done.ticks_of("output", 2, signal="DO2")
    assert answered == written + 1


def test_order_of_robots_within_a_tick_does_not_matter() -> None:
    one = run(MOVE + "SET DO1\n", f"{ASK}SET DO2\n")
    other = run(f"{ASK}SET DO2\n", MOVE + "SET DO1\n")
    assert one.ticks_of("output", 2) == other.ticks_of("output", 1)


@pytest.mark.parametrize("window", WINDOWS)
def test_a_meeting_point_lets_both_go_on_together(window: int) -> None:
    """Each raises its own M 5; the scenario resets both half a second after the later one."""
    done = run(f"{MOVE}M 5\n{MOVE}", f"MJ J1=-20 F20\nM 5\n{MOVE}", scenario=MEET, window=window)
    raised = [done.ticks_of("m", robot, action="raised") for robot in (1, 2)]
    reset = [done.ticks_of("m", robot, action="reset") for robot in (1, 2)]
    assert reset[0] == reset[1] == [max(raised[0][0], raised[1][0]) + 500]


def test_robots_that_share_nothing_run_as_if_alone() -> None:
    left, right = "MJ J1=30 F60\nML Z=2000 F200\n", "MJ J2=20 F30\nSET DO2\nMJ J1=-40\n"
    together = run(left, right)
    for k, (text, cell) in enumerate(zip((left, right), cells(), strict=True)):
        alone = Session(cell, compile_text(text, cell=cell))
        joints = np.concatenate([window.joints for window in alone.run()])
        assert np.abs(together.joints[k][: len(joints)] - joints).max() < 1e-12
        assert np.array_equal(together.joints[k][-1], joints[-1]), "then it stands"


def test_a_deadlock_names_both_lines() -> None:
    done = run("MJ J1=30\nWAIT DI 1\nSET DO1\n", "\nM 5\nMJ J1=9\n")
    assert done.station.status is Status.ERROR
    for failure, line in ((done.failures[1], 2), (done.failures[2], 2)):
        assert failure.startswith(f"E450 {line} ")
        assert "robot 1 (left) in line 2: WAIT DI 1" in failure
        assert "robot 2 (right) in line 2: M 5" in failure


def test_who_waits_alone_is_told_as_a_single_robot_is() -> None:
    done = run("WAIT DI 1\n", MOVE)
    assert list(done.failures) == [1]
    assert done.failures[1].startswith("E410 1 ")
    assert done.station.tick == done.ticks_of("block", 2)[0] + len(_moving(done.joints[1])), "not before"


def _moving(joints: Floats) -> Floats:
    return np.flatnonzero(np.abs(np.diff(joints, axis=0)).max(axis=1) > 0.0)


def test_a_wait_that_the_other_robot_may_end_is_no_deadlock() -> None:
    done = run(
        "WAIT DI 1\nSET DO2\n",
        MOVE + "SET DO1\n",
        scenario='[[when]]\nsignal = "DO1"\nafter_s = 0.2\nset = { DI1 = true }\n',
    )
    assert done.station.status is Status.FINISHED
    assert done.ticks_of("output", 1)[0] == done.ticks_of("output", 2)[0] + 200


def test_a_robot_that_fails_stops_the_others_on_their_paths() -> None:
    done = run("MJ J1=30 F60\nML X=9000\n", "MJ J1=-150 F30\n")
    assert done.station.status is Status.ERROR
    assert list(done.failures) == [1]
    assert done.station.sessions[1].status is Status.STOPPED
    speed = np.abs(np.diff(done.joints[1][:, 0])) / 1e-3
    assert speed.max() <= np.radians(30.0) * (1.0 + 1e-9)
    assert speed[-1] < 1e-3, "it has come to rest, not been cut off"


def test_max_time_ends_all() -> None:
    done = run("L: MJ J1=30 F60\nMJ J1=40\nGOTO L\n", "MJ J1=20 F60\n", max_time=2.5)
    assert done.station.status is Status.STOPPED
    assert [len(joints) for joints in done.joints] == [2501, 2501]


# --- exclusive zones ----------------------------------------------------------------------------------

MIDDLE = """
[[zones]]
name = "middle"
kind = "exclusive"
corner_1 = [1400, -500, 0]
corner_2 = [2800, 500, 2400]
"""
LEFT = "MJ X=1500 Y=900 Z=1500 A=0 B=90 C=0 F60\nML Y=-900 F500\nML X=1550 F500\nML Y=900 F500\nMJ J1=60\n"
RIGHT = (
    "MJ X=2700 Y=-900 Z=1500 A=0 B=90 C=180 F60\nML Y=900 F500\nML X=2650 F500\nML Y=-900 F500\nMJ J1=60\n"
)


@pytest.mark.parametrize("window", [64, 11])
def test_the_window_changes_nothing_when_robots_wait_for_zones(window: int) -> None:
    reference, done = (run(LEFT, RIGHT, cell=MIDDLE + FACING, window=w) for w in (1024, window))
    assert done.history == reference.history
    for a, b in zip(done.joints, reference.joints, strict=True):
        assert np.abs(a - b).max() < 1e-9


def test_only_one_robot_is_in_an_exclusive_zone() -> None:
    done = run(LEFT, RIGHT, cell=MIDDLE + FACING)
    assert done.station.status is Status.FINISHED
    stays = []
    for robot in (1, 2):
        entered, left = (done.ticks_of("zone", robot, action=a) for a in ("entered", "left"))
        assert len(entered) == len(left) == 2
        stays += [(a, b, robot) for a, b in zip(entered, left, strict=True)]
    stays.sort()
    assert [robot for _, _, robot in stays] == [1, 2, 1, 2]
    for (_, end, _), (begin, _, _) in itertools.pairwise(stays):
        assert end < begin < end + 60, "taken over at once, and not before it was left"


def test_a_free_zone_costs_no_time() -> None:
    """It is asked for before braking begins; the path is the same, its time law is made anew there."""
    alone, without = run(LEFT, MOVE, cell=MIDDLE + FACING), run(LEFT, MOVE)
    assert alone.station.tick == pytest.approx(without.station.tick, abs=5)
    assert np.abs(alone.joints[0][-1] - without.joints[0][-1]).max() < 1e-12


def test_priority_decides_between_those_who_ask_in_one_tick() -> None:
    """Mirror images of each other, they come to the zone together."""
    first = run(LEFT, RIGHT, cell=MIDDLE + FACING)
    ranked = FACING.replace('name = "right"', 'name = "right"\npriority = 1')
    other = run(LEFT, RIGHT, cell=MIDDLE + ranked)
    begin = [[done.ticks_of("zone", robot)[0] for robot in (1, 2)] for done in (first, other)]
    assert begin[0][0] < begin[0][1], "the lower number"
    assert begin[1][1] < begin[1][0], "the higher priority"


def test_zones_taken_crosswise_are_a_deadlock_with_both_lines() -> None:
    two = MIDDLE.replace("[2800, 500", "[2800, 0") + MIDDLE.replace('"middle"', '"far"').replace(
        "[1400, -500", "[1400, 5"
    )
    done = run(LEFT, RIGHT, cell=two + FACING)
    assert done.station.status is Status.ERROR
    for failure in done.failures.values():
        assert failure.startswith("E450 2 ")
        assert "robot 1 (left) in line 2: it waits for the zone middle, which robot 2 has" in failure
        assert "robot 2 (right) in line 2: it waits for the zone far, which robot 1 has" in failure


def test_two_robots_cannot_start_in_one_zone() -> None:
    everywhere = MIDDLE.replace("[1400, -500", "[-9000, -9000").replace(
        "[2800, 500, 2400]", "[9000, 9000, 9000]"
    )
    done = run(LEFT, RIGHT, cell=everywhere + FACING)
    assert done.failures[2].startswith("E452 0 ")
    assert all(len(joints) < 10 for joints in done.joints), "nothing moved"


# --- bodies -------------------------------------------------------------------------------------------

RADII = [0.2, 0.15, 0.15, 0.08, 0.08, 0.06]
CLOSE = FACING.replace("4200", "3000").replace("[40,", "[80,")
BODIES = CLOSE.replace("[[robots]]", f"[[robots]]\nbody = {{ radius_mm = {[1e3 * r for r in RADII]} }}")
WIRES = CLOSE.replace("[[robots]]", "[[robots]]\nbody = { radius_mm = [0, 0, 0, 0, 0, 0] }")
IN = "MJ J1=0 F30\nWAIT 3\nMJ J1=80\n"
INTO_IT = "WAIT 1\nMJ J1=0 F20\nMJ J1=80\n"


def gap(done: StationRun, rows: slice) -> float:
    """Least distance of the two bodies by points sampled along their links, m; a little more than it is."""
    ends = []
    for session, joints in zip(done.station.sessions, done.joints, strict=True):
        X = session.cell.X_world_base
        ends.append(session.cell.robot.link_points(joints[rows]) @ X[:3, :3].T + X[:3, 3])
    share = np.linspace(0.0, 1.0, 40)[:, None]
    least = np.inf
    for i, r in enumerate(RADII):
        for j, q in enumerate(RADII):
            a, b = (
                e[:, k, None] + share * (e[:, k + 1] - e[:, k])[:, None]
                for e, k in zip(ends, (i, j), strict=True)
            )
            distance = np.linalg.norm(a[:, :, None] - b[:, None], axis=-1).min()
            least = min(least, float(distance) - r - q)
    return least


def test_bodies_about_to_touch_are_stopped_before() -> None:
    without, done = run(IN, INTO_IT, cell=WIRES), run(IN, INTO_IT, cell=BODIES)
    assert gap(without, slice(0, None, 20)) < -0.1, "they would have met"
    assert done.station.status is Status.ERROR
    assert 0.0 < gap(done, slice(-40, None)) < 0.2, "late, but not too late"
    for failure, line in ((done.failures[1], 3), (done.failures[2], 2)):
        assert failure.startswith(f"E451 {line} ")
        assert "of robot 1 (left), in line 3, and" in failure
        assert "of robot 2 (right), in line 2, would touch" in failure
    for cell, joints in zip(cells(BODIES), done.joints, strict=True):
        limits = cell.robot.limits
        assert np.all(np.abs(np.diff(joints, axis=0)) <= limits.speed * 1e-3 * (1 + 1e-9))
        assert np.all(np.abs(np.diff(joints, n=2, axis=0)) <= limits.acceleration * 1e-6 * (1 + 1e-6))


@pytest.mark.parametrize("window", [64, 1])
def test_they_are_stopped_in_the_same_tick_whatever_the_window(window: int) -> None:
    reference, done = (run(IN, INTO_IT, cell=BODIES, window=w) for w in (1024, window))
    assert done.station.tick == reference.station.tick
    assert done.failures == reference.failures


def test_bodies_that_only_come_near_are_left_alone() -> None:
    done = run(IN, INTO_IT.replace("WAIT 1", "WAIT 6"), cell=BODIES)
    assert done.station.status is Status.FINISHED
    assert gap(done, slice(0, None, 50)) > 0.0


def test_bodies_that_touch_from_the_start_do_not_move() -> None:
    done = run(IN, INTO_IT, cell=BODIES.replace("home = [80,", "home = [0,"))
    assert all(failure.startswith("E451 ") for failure in done.failures.values())
    assert len(done.failures) == 2
    assert np.abs(np.diff(done.joints[0], axis=0)).max() < 1e-4
