"""What single statements do to the path: targets, frames, tools, speeds, joints, corners, flow."""

from __future__ import annotations

import numpy as np
import pytest
from programs_at_random import DEG, FRAMES, TOOLS, Arm, Floats, pose, rotation

from session_runs import Run, cell, run

START = "MJ P1 F90\n"


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm()


def flange_at_end(done: Run, arm: Arm) -> Floats:
    assert done.status == "finished", done.session.failure
    return arm.flange(done.joints[-1])


def rates(done: Run, line: int) -> dict[str, float]:
    """Peaks within a line: TCP in mm/s, orientation and joint-space length in deg/s."""
    rows = np.flatnonzero(done.column("line") == line)
    rows = np.concatenate(([rows[0] - 1], rows))
    q, p, R = done.joints[rows], done.column("position")[rows], done.column("quaternion")[rows]
    turned = 2.0 * np.arccos(np.clip(np.abs((R[1:] * R[:-1]).sum(axis=1)), 0.0, 1.0))
    tick = done.session.cell.tick
    return {
        "mm": float(np.linalg.norm(np.diff(p, axis=0), axis=1).max() / tick * 1e3),
        "deg": float(turned.max() / tick / DEG),
        "joint": float(np.linalg.norm(np.diff(q, axis=0), axis=1).max() / tick / DEG),
    }


# --- targets -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["ML", "MJ", "MS"])
def test_a_target_in_a_frame_with_a_tool(command: str, arm: Arm) -> None:
    done = run(f"{START}{command} X=100 Y=350 Z=900 A=10 B=80 C=-20 Z1 T2\n")
    X = FRAMES[1] @ pose((100, 350, 900), rotation(10, 80, -20)) @ np.linalg.inv(TOOLS[2])
    assert np.abs(flange_at_end(done, arm) - X).max() < 1e-8


def test_a_point_is_valid_in_the_frame_of_the_command(arm: Arm) -> None:
    where = cell(points="P20 = { x = 100, y = 350, z = 900, a = 0, b = 80, c = 0 }")
    done = run(f"{START}ML P20 Z1\n", where)
    X = FRAMES[1] @ pose((100, 350, 900), rotation(0, 80, 0))
    assert np.abs(flange_at_end(done, arm) - X).max() < 1e-8


def test_a_coordinate_left_out_keeps_its_value_in_this_frame_with_this_tool(arm: Arm) -> None:
    """Only X is programmed: Y, Z and the rotation stay as they are in frame 1 with tool 2."""
    done = run(f"{START}ML X=150 Z1 T2\n")
    before = np.linalg.inv(FRAMES[1]) @ pose((1500, -300, 1500), rotation(0, 90, 0)) @ TOOLS[2]
    before[0, 3] = 0.150
    X = FRAMES[1] @ before @ np.linalg.inv(TOOLS[2])
    assert np.abs(flange_at_end(done, arm) - X).max() < 1e-8


def test_one_angle_programmed_keeps_the_other_two(arm: Arm) -> None:
    done = run("MJ X=1500 Y=0 Z=1500 A=10 B=60 C=20 F90\nML B=75\n")
    assert np.abs(flange_at_end(done, arm) - pose((1500, 0, 1500), rotation(10, 75, 20))).max() < 1e-8


def test_what_is_left_out_refers_to_the_commanded_end_of_an_arc() -> None:
    """With H an arc ends elsewhere than at its target; the next coordinate left out is that of the end."""
    done = run(f"{START}MC X=1500 Y=-100 QX=1600 QY=-200 QZ=1500 H90\nML Z=1600\n")
    assert np.abs(done.column("position")[-1] - [1.6, -0.2, 1.6]).max() < 1e-8


def test_a_change_of_tool_is_an_exact_stop_and_changes_the_tcp(arm: Arm) -> None:
    done = run(f"{START}ML Y=-200 R50\nT 1\nML Y=-100 R50\nML Y=0 T2\nEND\n")
    stop = done.end_of(2)
    assert done.column("speed")[stop] < 1e-3
    assert done.reasons[2] == "END"
    assert done.reasons[4] == "END"
    # tool 1 stands 380 mm further along the flange's X, which points down
    assert done.column("position")[stop + 5][2] == pytest.approx(1.5 - 0.38, abs=1e-6)
    assert [e.data["index"] for e in done.events("tool")] == [1]


def test_a_tool_in_a_motion_holds_for_that_motion_alone(arm: Arm) -> None:
    done = run(f"{START}ML X=1500 Y=-300 Z=1400 T1\nML X=1500 Y=-300 Z=1500\n")
    assert np.abs(flange_at_end(done, arm) - pose((1500, -300, 1500), rotation(0, 90, 0))).max() < 1e-8


def test_a_change_of_frame_is_no_stop() -> None:
    far = np.linalg.inv(FRAMES[1]) @ np.array([1.5, 0.2, 1.5, 1.0]) * 1e3
    words = f"X={far[0]:.9g} Y={far[1]:.9g} Z={far[2]:.9g}"
    done = run(f"{START}ML Y=0 F200\nML {words} Z1\n")
    assert done.reasons[2] in ("SMOOTH", "TOLERANCE")
    assert done.column("speed")[done.end_of(2)] == pytest.approx(0.2, rel=2e-3)


# --- joint moves -------------------------------------------------------------------------------------


def nearest(X: Floats, to: dict[int, float], start: Floats) -> Floats:
    """By brute force: of all solutions, the one nearest to given joints (deg), ties by the start."""
    robot = cell().robot
    speed = robot.limits.speed
    found = [s.joints for s in robot.solutions(X)]
    named = np.array([j in to for j in range(1, 7)])
    goal = np.array([to.get(j, 0.0) * DEG for j in range(1, 7)])

    def rank(q: Floats) -> tuple[float, float]:
        asked = float(np.linalg.norm(((q - goal) / speed)[named]))
        return round(asked, 9), float(np.linalg.norm((q - start) / speed))

    return min(found, key=rank)


@pytest.mark.parametrize(
    "references",
    [
        {},
        {2: 100},
        {1: 170, 4: 0},
        {4: -200, 6: 200},
        {4: -140},
        {4: 330},
        {4: -100, 6: -300},
        {5: -20},
        {6: -200},
    ],
)
def test_a_joint_move_takes_the_nearest_solution(references: dict[int, float]) -> None:
    words = " ".join(f"J{j}={v}" for j, v in references.items())
    done = run(f"MJ P7 F90\nMJ X=1400 Y=200 Z=1700 A=5 B=70 C=10 {words}\n")
    assert done.status == "finished", done.session.failure
    start = np.array([20, 10, -20, 30, 40, 50]) * DEG
    X = pose((1400, 200, 1700), rotation(5, 70, 10))
    assert np.abs(done.joints[-1] - nearest(X, references, start)).max() < 1e-9


def test_joints_left_out_stay() -> None:
    done = run("MJ P7 F90\nMJ J2=0 J6=-300\n")
    assert np.abs(done.joints[-1] / DEG - [20, 0, -20, 30, 40, -300]).max() < 1e-9


def test_all_joints_start_and_end_together() -> None:
    done = run("MJ J1=10 J2=5 J3=-20 J4=1 J5=40 J6=-3 F60\n")
    q = done.joints[1:-1] / (np.array([10, 5, -20, 1, 40, -3]) * DEG)
    assert np.ptp(q, axis=1).max() < 1e-9


def test_joint_references_on_a_joint_point_are_refused() -> None:
    with pytest.raises(Exception, match="E2"):
        run("MJ P7 J1=3\n")


# --- speeds ------------------------------------------------------------------------------------------

LONG = "MJ P1 F90\n{}\n"


@pytest.mark.parametrize(
    ("statement", "kind", "speed"),
    [
        ("ML Y=300 F150", "mm", 150),
        ("ML Y=300 FC150", "mm", 150),
        ("ML A=0 B=40 C=0 F20", "deg", 20),  # a rotation in place: the generic number is deg/s
        ("ML A=0 B=40 C=0 FC20", "deg", 20),  # no TCP length: generic
        ("ML Y=300 FA90", "mm", 90),  # no rotation: generic
        ("ML Y=300 A=0 B=40 C=0 FA10", "deg", 10),
        ("ML Y=0 A=0 B=40 C=0 FC90", "mm", 90),
        ("ML Y=300 A=0 B=40 C=0 F60", "mm", 60),  # the slower decides: 600 mm take longer than 50 deg
        ("ML Y=-270 A=0 B=40 C=0 F20", "deg", 20),
        ("MJ J1=30 J2=10 F25", "joint", 25),
        ("MJ J1=40 FC200", "mm", 200),
        ("MJ J1=40 FA15", "deg", 15),
        ("MC P3 QX=1650 QY=300 QZ=1700 F120", "mm", 120),
        ("MS P3 F120", "mm", 120),
    ],
)
def test_programmed_speed(statement: str, kind: str, speed: float) -> None:
    reached = rates(run(LONG.format(statement)), 2)[kind]
    assert reached <= speed * (1.0 + 1e-9)
    assert reached > 0.99 * speed


def test_speed_is_modal_across_kinds_and_subroutines() -> None:
    done = run("MJ P1 F60\nML Y=-100\nSUB S\nML Y=300\nEND\nS: MJ J1=5 FC80\nMJ P1 FA9\nMJ P1 F70\nEND\n")
    assert rates(done, 2)["mm"] == pytest.approx(60, rel=0.01)
    assert rates(done, 4)["mm"] == pytest.approx(70, rel=0.01)


def test_without_a_speed_the_default_of_the_cell_holds() -> None:
    done = run("MJ J1=30\nML Y=700\n")
    assert rates(done, 1)["joint"] == pytest.approx(20, rel=0.01)
    assert rates(done, 2)["mm"] == pytest.approx(100, rel=0.01)


def test_a_speed_over_the_limits_is_run_at_the_limits() -> None:
    done = run("MJ P1 F90\nML Y=300 F90000\nMJ J1=90 J5=0 F90000\n")
    assert done.status == "finished"
    assert not done.over_limits()


# --- shapes ------------------------------------------------------------------------------------------

CIRCLE = "MJ P1 F90\nMC X=1500 Y=-100 QX=1600 QY=-200 QZ=1500 {}\n"


@pytest.mark.parametrize(
    ("code", "angle", "end"),
    [
        ("", 180, (1.5, -0.1)),
        ("H90", 90, (1.6, -0.2)),
        ("H360", 360, (1.5, -0.3)),
        ("H-90", 90, (1.4, -0.2)),
        ("H-450", 450, (1.4, -0.2)),
        ("H725", 725, None),
    ],
)
def test_an_arc_covers_its_angle_either_way_round(
    code: str, angle: float, end: tuple[float, float] | None
) -> None:
    done = run(CIRCLE.format(code + " F300"))
    block = done.events("block", 2)[0]
    assert block.data["length_mm"] == pytest.approx(100.0 * angle * DEG, rel=1e-9)
    if end is not None:
        assert np.abs(done.column("position")[-1] - [*end, 1.5]).max() < 1e-9


def test_a_rotation_in_place_holds_the_tcp() -> None:
    done = run("MJ P1 T1 F90\nML A=10 B=60 C=-20 T1 F40\n")
    rows = done.column("line") == 2
    assert np.ptp(done.column("position")[rows], axis=0).max() < 1e-9


@pytest.mark.parametrize("again", ["ML P1", "MJ P1", "MS P1", "ML X=1500"])
def test_motions_without_length_take_no_time(again: str) -> None:
    plain = run("HOME\nMJ P1 F90\nML Y=0 F200\n")
    done = run(f"HOME\nHOME\nMJ P1 F90\n{again}\n{again}\nML Y=0 F200\n")
    assert done.status == "finished"
    assert np.array_equal(done.joints, plain.joints)


def test_a_motion_without_length_does_not_hide_a_corner() -> None:
    """The corner before and after it are one; the first R programmed there counts."""
    done = run(f"{START}ML Y=0 F200 R40\nML Y=0\nSET DO1\nML X=1700\n")
    assert done.reasons[2] == "ZERO_LENGTH"
    assert done.reasons[3] == "ROUNDED"
    assert done.column("speed")[done.end_of(3)] > 0.1
    assert done.events("output")[0].tick == done.end_of(2) == done.end_of(3)


# --- corners -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("asked", "effective"), [(30, 30), (200, 100), (5000, 100)])
def test_a_large_r_is_clamped_to_half_of_the_shorter_side(asked: float, effective: float) -> None:
    done = run(f"{START}ML Y=-100 F200 R{asked}\nML X=1900\n")
    assert done.session.corners[1].transition.effective == pytest.approx(effective * 1e-3, abs=1e-12)
    off = np.linalg.norm(done.column("position") - [1.5, -0.1, 1.5], axis=1).min()
    assert off > 0.1 * effective * 1e-3


def test_r0_stops_even_where_the_path_goes_straight_on() -> None:
    smooth, stopping = run(f"{START}ML Y=0 F200\nML Y=200\n"), run(f"{START}ML Y=0 F200 R0\nML Y=200\n")
    assert smooth.reasons[2] == "SMOOTH"
    assert stopping.reasons[2] == "R_ZERO"
    assert smooth.column("speed")[smooth.end_of(2)] == pytest.approx(0.2, rel=2e-3)
    assert stopping.column("speed")[stopping.end_of(2)] < 1e-3


@pytest.mark.parametrize(
    "after", ["", "END\nML P3\n", "IF DI1\nENDIF\nML P3\n", "WAIT 0\nML P3\n", "T 1\nML P3\n"]
)
def test_r_has_no_effect_where_the_path_must_stop(after: str) -> None:
    done = run(f"{START}ML Y=0 F200 R50\n{after}")
    tick = done.end_of(2)
    assert np.linalg.norm(done.joints[tick] - done.joints[tick - 1]) < 1e-6
    assert done.session.corners[1].transition.effective == 0.0


def test_end_in_the_middle_ends_the_run() -> None:
    done = run(f"{START}SET DO1\nEND\nHOME\nSET DO2\n")
    assert [e.line for e in done.events("block")] == [1]
    assert [e.line for e in done.events("output")] == [2]


# --- flow --------------------------------------------------------------------------------------------


def test_a_counted_jump_runs_its_body_so_many_times() -> None:
    done = run("MJ P1 F90\nL: ML Y=-290 F200\nML Y=-300\nGOTO L 3\nSET DO1\n")
    assert [e.line for e in done.events("block")] == [1, 2, 3, 2, 3, 2, 3]


def test_a_subroutine_runs_so_many_times_and_comes_back() -> None:
    done = run("MJ P1 F90\nSUB S 2\nSET DO9\nEND\nS: ML Y=-290 F200\nSET DO1\nML Y=-300\nEND\n")
    order = [(e.kind, e.line) for e in done.session.events if e.kind in ("block", "output")]
    once = [("block", 5), ("output", 6), ("block", 7)]
    assert order == [("block", 1), *once, *once, ("output", 3)]


def test_an_endless_path_without_stops_can_be_cut_short() -> None:
    square = "MJ P1 F90\nL: ML P2 F800 R80\nML P3 R80\nML P4 R80\nML P1 R80\nGOTO L\n"
    by_time = run(square, max_time=9.0)
    assert (by_time.status, by_time.session.kernel.tick) == ("stopped", 9000)
    by_cycles = run(square, cycles=2)
    assert by_cycles.status == "stopped"
    assert [e.line for e in by_cycles.events("block")] == [1, 2, 3, 4, 5, 2, 3, 4, 5]
    assert by_cycles.column("speed")[-1] < 1e-3
    assert not by_cycles.over_limits()
