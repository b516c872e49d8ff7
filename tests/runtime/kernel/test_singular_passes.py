"""Paths through singular poses and past them, however closely: on the path, within limits."""

from __future__ import annotations

import numpy as np
import pytest
from programs_at_random import Arm, Floats

from session_runs import Run, cell, run
from viapoint.runtime.kernel.bearings import fit
from viapoint.runtime.kernel.warp import Warp

ON_PATH = 1e-9
"""m from the programmed path: 1e-6 mm."""

TURN = 180.0 / 200.0 + 200.0 / 900.0 + 900.0 / 9000.0
"""s that J4 of frigeni6 takes for half a turn from rest to rest."""

OFFSETS = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
"""mm by which the singular pose is missed; below 2e-7 it is passed as if exactly."""

HOME = np.array([1.755, 0.0, 2.660])
"""m. There, with A = B = C = 0, all joints of frigeni6 are zero."""

OVERHEAD = "MJ J2=30 J3=-165.16312861650462 J5=90 F50\n"
"""The wrist point stands on axis 1."""


@pytest.fixture(scope="module")
def arm() -> Arm:
    return Arm()


def poses(done: Run, arm: Arm, line: int, every: int = 3) -> Floats:
    """Flange (N, 4, 4) in ticks of a line, by independent kinematics."""
    ticks = np.flatnonzero(done.column("line") == line)[::every]
    return np.array([arm.flange(q) for q in done.joints[ticks]])


def above(offset: float) -> Floats:
    """m. So many mm above HOME."""
    return HOME + np.array([0.0, 0.0, 1e-3 * offset])


def assert_good(done: Run) -> None:
    assert done.status == "finished", done.session.failure
    assert not done.over_limits()


def assert_straight(X: Floats, start: Floats, direction: Floats, R: Floats | None = None) -> None:
    unit = direction / np.linalg.norm(direction)
    away = X[:, :3, 3] - start
    assert np.linalg.norm(away - np.outer(away @ unit, unit), axis=1).max() < ON_PATH
    assert np.abs(X[:, :3, :3] - (np.eye(3) if R is None else R)).max() < ON_PATH


@pytest.mark.parametrize("tilt", [0, 37, 90, 135, -60])
def test_a_line_crosses_in_any_direction(tilt: float, arm: Arm) -> None:
    step = np.array([0.0, np.cos(np.radians(tilt)), np.sin(np.radians(tilt))])
    first, last = 1e3 * (HOME - 0.15 * step), 1e3 * (HOME + 0.15 * step)
    done = run(
        f"MJ X={first[0]:.12f} Y={first[1]:.12f} Z={first[2]:.12f} A=0 B=0 C=0 F90\n"
        f"ML X={last[0]:.12f} Y={last[1]:.12f} Z={last[2]:.12f} F300\n"
    )
    assert_good(done)
    assert_straight(poses(done, arm, 2), HOME, step)
    q = done.joints[np.flatnonzero(done.column("line") == 2)]
    assert q[0, 4] * q[-1, 4] < 0.0  # the wrist changes its sign
    assert np.ptp(q[:, [3, 5]], axis=0).max() < np.radians(15.0)
    middle = len(q) // 2
    assert done.column("speed")[done.end_of(2) - middle] > 0.299


def test_a_turn_of_the_hand_crosses_through_a_singular_pose() -> None:
    done = run("MJ J1=5 J5=10 F90\nML B=-20 F200\nML B=20\n")
    assert_good(done)
    assert np.ptp(np.sign(done.joints[:, 4])) == 2.0


@pytest.mark.parametrize("offset", OFFSETS)
def test_a_line_that_misses_is_followed_and_slows_only_there(offset: float, arm: Arm) -> None:
    done = run(f"MJ X=1755 Y=-150 Z={2660 + offset:.12f} A=0 B=0 C=0 F90\nML Y=150 F200\n")
    exact = run("MJ X=1755 Y=-150 Z=2660 A=0 B=0 C=0 F90\nML Y=150 F200\n")
    assert_good(done)
    assert_straight(poses(done, arm, 2), above(offset), np.array([0.0, 1.0, 0.0]))
    slower = (done.end_of(2) - done.end_of(1) - exact.end_of(2) + exact.end_of(1)) * 1e-3
    turned = abs(done.joints[-1, 3] - done.joints[done.end_of(1), 3])
    if offset < 2e-7:
        assert abs(slower) < 0.003
        assert turned < 0.1
        return
    assert turned > np.radians(165.0)
    assert slower < TURN + 0.25
    speed, y = done.column("speed"), done.column("position")[:, 1]
    away = (np.abs(y) > 0.05) & (np.abs(y) < 0.09) & (done.column("line") == 2)
    assert speed[away].min() > 0.17


@pytest.mark.parametrize("offset", [1e-7, 1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("kind", ["circle", "touch", "spline", "edge", "corner"])
def test_other_shapes_pass(kind: str, offset: float) -> None:
    lines = {
        "circle": f"MC X=1755 Y=150 Z=2600 QX=1755 QY=0 QZ={2660 + offset:.9f}\n",
        "touch": f"MC X=1755 Y=150 Z=2600 QX=1755 QY=0 QZ={2660 - offset:.9f} A=1 B=1\n",
        "spline": f"MS X=1755 Y=0 Z={2660 + offset:.9f}\nMS Y=150 Z=2680\n",
        "edge": f"ML Y=-60 Z={2600 + offset:.9f}\nML Y=60 Z={2720 + offset:.9f} R20\nML Y=150\n",
        "corner": f"ML Y=0 Z={2660 + offset:.9f} R30\nML Y=120 Z=2600\n",
    }
    done = run(f"MJ X=1755 Y=-150 Z=2600 A=0 B=0 C=0 F90\nML Z=2599 F300\n{lines[kind]}HOME\n")
    assert_good(done)
    assert np.abs(done.joints[-1]).max() < 1e-12


@pytest.mark.parametrize("offset", [0.0, 1e-6, 1e-4, 1e-2])
def test_two_lines_join_in_or_beside_a_singular_pose(offset: float, arm: Arm) -> None:
    z = f"{2660 + offset:.9f}"
    done = run(f"MJ X=1755 Y=-150 Z={z} A=0 B=0 C=0 F90\nML Y=0 F200\nML Y=150\nMJ J1=3\nHOME\n")
    assert_good(done)
    for line in (2, 3):
        assert_straight(poses(done, arm, line), above(offset), np.array([0.0, 1.0, 0.0]))


@pytest.mark.parametrize("short", [0.0, 1e-6, 1e-4, 1e-2, 1.0])
def test_a_line_ends_in_or_shortly_before_a_singular_pose(short: float) -> None:
    start = "MJ J1=-12 J5=14 F90\nML X=1755 Y=-150 Z=2500 A=0 B=0 C=0 F200\n"
    for after in ("HOME\n", "MJ J4=90\nML Y=100\nHOME\n", "ML Z=2500\nHOME\n"):
        done = run(f"{start}ML Y={-short:.9f} Z=2660\n{after}")
        assert_good(done)
        assert np.abs(done.joints[-1]).max() < 1e-12


def test_where_no_branch_goes_on_the_tcp_is_held_while_the_free_joints_turn(arm: Arm) -> None:
    """Around axis 1 the wrist stays stretched; the tangent that follows leaves it sideways."""
    q = f"QX={1755 * np.sqrt(0.5):.12f} QY={1755 * np.sqrt(0.5):.12f} QZ=2660"
    done = run(f"HOME F50\nMC X=0 Y=1755 Z=2660 {q} A=0 B=0 C=90 F400\nML X=-100\nHOME\n")
    assert_good(done)
    assert done.reasons[2] == "TOLERANCE"
    turning = np.flatnonzero(np.abs(np.diff(done.joints[:, 3])) > 1e-6)
    turning = turning[turning < done.end_of(3)]
    X = np.array([arm.flange(q) for q in done.joints[turning]])
    assert np.abs(np.ptp(done.joints[turning, 3]) - 0.5 * np.pi) < 1e-3
    held = np.abs(X - X[0]).max(axis=(1, 2)) < ON_PATH
    assert held.sum() > 0.9 * len(held)


@pytest.mark.parametrize("offset", [1e-6, 1e-3, 1.0])
def test_a_line_past_axis_1_turns_the_base(offset: float, arm: Arm) -> None:
    x = 1e3 * arm.flange(run(OVERHEAD).joints[-1])[0, 3] + offset
    done = run(f"{OVERHEAD}ML X={x:.12f} Y=150 F200\nML Y=-150\n")
    assert_good(done)
    q = done.joints[np.flatnonzero(done.column("line") == 3)]
    assert np.ptp(q[:, 0]) > np.radians(175.0)
    X = poses(done, arm, 3)
    assert_straight(X, np.array([1e-3 * x, 0.0, X[0, 2, 3]]), np.array([0.0, 1.0, 0.0]), X[0, :3, :3])


def test_the_wrist_point_goes_exactly_over_axis_1(arm: Arm) -> None:
    done = run(f"{OVERHEAD}ML Y=150 F200\nML Y=-150\n")
    assert_good(done)
    q = done.joints[np.flatnonzero(done.column("line") == 3)]
    assert np.ptp(q[:, 0]) < 1e-6  # J1 stays, the arm leans over to the back
    X = poses(done, arm, 3)
    assert_straight(X, X[0, :3, 3], np.array([0.0, 1.0, 0.0]), X[0, :3, :3])


def test_the_end_of_reach_is_told() -> None:
    start = "MJ J2=60 J3=-60 J5=20 F50\n"
    assert run(f"{start}ML X=3200 F200\n").code == "E302"
    bend = np.degrees(np.arctan2(766 + 345, 230))  # J3 at which upper arm and forearm are in line
    x, _, z = 1e3 * Arm().flange(np.radians([0.0, 60.0, -bend, 0.0, 40.0, 0.0]))[:3, 3]
    done = run(f"{start}ML X={x:.12f} Z={z:.12f} A=0 B={100 - bend:.12f} C=0 F200\n")
    assert done.code == "E302"
    assert done.failed_line == 2
    assert run(f"{start}ML X={x - 1e-3:.12f} Z={z:.12f} A=0 B={100 - bend:.12f} C=0 F200\n").code is None


def test_two_singularities_at_once_are_refused() -> None:
    done = run("MJ J2=30 J3=-165.1631 F50\nML Y=200 F100\n")
    assert done.code == "E304"
    assert done.failed_line == 2


def test_joints_join_with_three_derivatives_through_a_crossing() -> None:
    done = run("MJ X=1755 Y=-150 Z=2660 A=0 B=0 C=0 F90\nML Y=150 Z=2700 X=1760 A=3 B=0 C=2 F200\nHOME\n")
    again = run("MJ X=1755 Y=-150 Z=2660 A=0 B=0 C=0 F90\nML Y=0 F200\nML Y=150\n")
    for each in (done, again):
        route = each.session.kernel.planner.route
        for end in route.ends[1:-1]:
            if end in route.stops:
                continue
            before, after = (route.axes.derivatives(np.array([end + side])) for side in (-1e-9, 1e-9))
            for order, size in enumerate((1e-7, 1e-5, 1e-2)):
                assert np.abs(after[order] - before[order]).max() < size


@pytest.mark.parametrize("distance", [1e-10, 1e-7, 1e-4])
def test_a_warp_is_its_own_inverse_to_the_last_digits(
    distance: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    warp = Warp(distance, 0.05)
    x = np.geomspace(distance / 100.0, 0.06, 60)
    x = np.concatenate((-x[::-1], [0.0], x))
    s = warp.parameter(x)
    np.testing.assert_allclose(warp.place(s), x, rtol=1e-13, atol=0.0)
    monkeypatch.setattr("viapoint.runtime.kernel.warp._STEPS", 10)  # rounding is not followed any further
    np.testing.assert_allclose(warp.place(s), x, rtol=1e-13, atol=0.0)
    h = 1e-7
    slope = (warp.place(s + h) - warp.place(s - h)) / (2.0 * h)
    np.testing.assert_allclose(warp.rate(x), slope, rtol=1e-5)


@pytest.mark.parametrize(
    ("zeros", "within"),
    [((0.001,), 1), ((0.001, 0.002), 2), ((0.001 + 1e-6j,), 0), ((-0.02, 0.001), 1), ((-0.01,), 0)],
)
def test_a_bearing_divides_the_real_zeros_out(zeros: tuple[complex, ...], within: int) -> None:
    """V = (0.6 + 0.8i)·Π(w − zero) on −0.01 … 0.01."""

    def vector(w: Floats) -> np.ndarray:
        return (0.6 + 0.8j) * np.prod([w - zero for zero in zeros], axis=0)

    bearing = fit(vector, 3, 0.0, -0.01, 0.01, 1e-3)
    assert bearing is not None
    assert bearing.within == within
    assert bearing.begins_singular == (-0.01 in zeros)
    x = np.linspace(-0.0099, 0.0099, 101)
    angle = bearing.angle(x)
    wanted = np.angle(vector(x))
    if all(zero.imag for zero in np.atleast_1d(np.array(zeros, dtype=complex))):
        np.testing.assert_allclose(angle, wanted, atol=1e-6)
    else:
        assert np.ptp(angle) < 1e-6
        assert abs(np.exp(1j * angle[0]) - np.exp(1j * wanted[0])) < 1e-6  # as it comes in


def test_the_vectors_of_the_free_joints_point_where_the_joints_do() -> None:
    robot = cell().robot
    rng = np.random.default_rng(7)
    for q in rng.uniform(-1.2, 1.2, (200, 6)):
        X = robot.fk(q[None])
        configuration = int(robot.configuration(q))
        vectors = robot.kinematics.free_vectors(X, q[None], configuration)[0]
        joints = [q[k] for k in robot.kinematics.free_joints]
        np.testing.assert_allclose(np.exp(1j * np.angle(vectors)), np.exp(1j * np.array(joints)), atol=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_a_stop_close_by_a_singular_pose_is_led_on_from(seed: int, arm: Arm) -> None:
    """A nanometre from it, where the next path does not leave by the joints in which this one stops."""
    print(f"seed {seed}")
    draw = np.random.default_rng(seed)
    arrive, leave, aside = (v / np.linalg.norm(v) for v in draw.normal(size=(3, 3)))
    stop = 1e3 * HOME + 10.0 ** draw.uniform(-7.0, -6.0) * aside
    first, last = stop - 100.0 * arrive, stop + 60.0 * leave
    words = [f"X={p[0]:.12f} Y={p[1]:.12f} Z={p[2]:.12f}" for p in (first, stop, last)]
    done = run(f"MJ {words[0]} A=0 B=0 C=0 F90\nML {words[1]} F200\nWAIT 0\nML {words[2]}\n")
    assert_good(done)
    assert_straight(poses(done, arm, 4), 1e-3 * stop, leave)
    assert np.linalg.norm(arm.flange(done.joints[-1])[:3, 3] - 1e-3 * last) < ON_PATH


@pytest.mark.parametrize(
    "lines",
    [
        "MJ X=1755 Y=-200 Z=2400 A=0 B=0 C=0 F50\nML Z=2600 F200\nMS Y=200\nMJ Z=2300 F50\n",
        "MJ X=1782.2 Y=-18.3 Z=2607.6 A=0 B=17.9 C=0 F60\nML X=1842.7 Y=78.3 Z=2585.8 F200 R30\n"
        "MJ X=1828 Y=43.2 Z=2596.8 A=-3.4 B=-8.6 C=3.3 F50 R51\n"
        "ML X=1739.5 Y=77.4 Z=2456.4 A=23.6 B=18.9 C=-18.3 F200 R31\nHOME\n",
        "MJ X=1608.1 Y=-129.3 Z=2425.6 A=7.4 B=9.3 C=5.9 F50\nML X=1634.2 Y=27.8 Z=2453 F200 R58\n"
        "MJ X=1620.9 Y=56.3 Z=2521.8 A=16.2 B=10.8 C=-13.2 F50 R37\nHOME\n",
    ],
    ids=["behind a spline", "behind a round edge", "behind its own round edge"],
)
def test_a_joint_move_beside_a_singular_pose_starts_where_the_path_ends(lines: str) -> None:
    assert_good(run(lines))


@pytest.mark.parametrize("r", [18, 40])
def test_round_edges_on_both_sides_of_a_joint_move_leave_each_other_room(r: int) -> None:
    """One is measured along the TCP's path, the other in joint space."""
    done = run(
        "MJ X=1718 Y=-68 Z=2470 A=-4 B=-12 C=-25 F60\nML X=1635 Y=34 Z=2361 R54 F200\n"
        f"MJ X=1652 Y=-29 Z=2409 F50 R{r}\nHOME\n"
    )
    assert_good(done)
