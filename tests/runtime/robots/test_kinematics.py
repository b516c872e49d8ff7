"""Properties of forward and inverse kinematics over random and singular poses."""

from __future__ import annotations

import numpy as np
import pytest

from viapoint.runtime.robots import Robot, load_robot, robot_names
from viapoint.runtime.rotations import Floats

from .oracle import numeric_solutions, pin_fk_and_jacobian, pose_error, wrap

SEED = 4021
HALF = np.pi / 2
ELBOW_IN_LINE = -np.arctan2(1.111, 0.230)  # J3 of frigeni6 with the arm stretched


@pytest.fixture(name="robot", params=robot_names())
def fixture_robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


@pytest.fixture(name="frigeni6", scope="module")
def fixture_frigeni6() -> Robot:
    return load_robot("frigeni6")


def random_joints(count: int, seed: int = SEED) -> Floats:
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, 6))


def on_axis_1(robot: Robot, q: Floats) -> Floats:
    """J2 turned until the wrist point stands on axis 1."""
    low, high = -0.2, -1.4
    for _ in range(200):
        middle = 0.5 * (low + high)
        q[1] = middle
        if robot.link_points(np.array([0, *q[1:]]))[5, 0] > 0:
            low = middle
        else:
            high = middle
    return q


def singular_joints(robot: Robot) -> Floats:
    """Joint vectors of frigeni6 at each singularity and at several of them."""
    shoulder = on_axis_1(robot, np.array([0.3, 0.0, -0.2, 0.4, 0.5, -0.6]))
    both = on_axis_1(robot, np.array([-1.3, 0.0, 0.1, 0.9, 0.0, 0.2]))
    return np.array(
        [
            [0, 0, 0, 0, 0, 0],
            [0.5, 0.2, -0.4, 0.7, 0.0, -0.3],
            [0.5, 0.2, -0.4, 0.7, np.pi, -0.3],
            [0.5, 0.2, -0.4, 0.7, 1e-12, -0.3],
            [0.5, 0.2, -0.4, 0.7, 1e-9, -0.3],
            [0.5, 0.2, -0.4, 0.7, -1e-6, -0.3],
            [0.1, 0.4, ELBOW_IN_LINE, 0.3, -0.8, 0.2],
            [0.1, 0.4, ELBOW_IN_LINE + np.pi, 0.3, -0.8, 0.2],
            [0.1, 0.4, ELBOW_IN_LINE, 0.3, 0.0, 0.2],
            shoulder,
            both,
        ]
    )


def test_forward_and_jacobian_against_pinocchio(robot: Robot) -> None:
    q = random_joints(50)
    X, J = robot.fk(q), robot.jacobian(q)
    for i, joints in enumerate(q):
        X_pin, J_pin = pin_fk_and_jacobian(robot.name, joints)
        np.testing.assert_allclose(X[i], X_pin, atol=1e-12, err_msg=f"seed {SEED} row {i}")
        np.testing.assert_allclose(J[i], J_pin, atol=1e-12, err_msg=f"seed {SEED} row {i}")


def test_every_branch_reaches_the_pose(robot: Robot) -> None:
    q = random_joints(10_000)
    X = robot.fk(q)
    solutions = robot.ik(X)
    error = np.abs(pose_error(robot.fk(solutions.q), X[:, None])).max(axis=-1)
    assert error[solutions.valid].max() < 1e-9, f"seed {SEED}"
    itself = np.abs(wrap(solutions.q - q[:, None])).max(axis=-1)
    assert np.where(solutions.valid, itself, np.inf).min(axis=1).max() < 1e-7, f"seed {SEED}"
    apart = np.abs(wrap(solutions.q[:, :, None] - solutions.q[:, None])).max(axis=-1)
    both = solutions.valid[:, :, None] & solutions.valid[:, None] & ~np.eye(8, dtype=bool)
    assert apart[both].min() > 1e-7, f"seed {SEED}"
    assert (np.abs(solutions.q) <= np.pi).all()


def test_branch_of_a_joint_vector_leads_back_to_it(robot: Robot) -> None:
    q = random_joints(10_000, SEED + 1)
    back, reachable = robot.ik_branch(robot.fk(q), robot.configuration(q), q)
    assert reachable.all()
    np.testing.assert_allclose(back, q, atol=1e-7)


def test_configuration_names_describe_the_arm(frigeni6: Robot) -> None:
    solutions = frigeni6.ik(frigeni6.fk(np.radians([20.0, -30, 20, 30, 40, 50])))
    assert solutions.valid.all()
    for index, q in enumerate(solutions.q):
        names = frigeni6.configuration_names(index)
        assert int(frigeni6.configuration(q)) == index
        assert (names[2] == "POSITIVE") == (q[4] > 0)
        assert (names[0] == "FRONT") == (abs(q[0]) < HALF)
        _, _, shoulder, elbow, _, wrist, _ = frigeni6.link_points(q)
        along = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
        above = (elbow - shoulder) - along * (along @ (elbow - shoulder))
        assert (names[1] == "UP") == (above[2] > 0)


def test_no_solution_missed(frigeni6: Robot) -> None:
    starts = random_joints(300, SEED + 2)
    for X in frigeni6.fk(random_joints(6, SEED + 3)):
        solutions = frigeni6.ik(X)
        ours = solutions.q[solutions.valid]
        theirs = numeric_solutions(frigeni6, X, starts)
        distance = np.abs(wrap(theirs[:, None] - ours)).max(axis=-1)
        assert distance.min(axis=1).max() < 1e-6, f"the numeric search found one more, seed {SEED + 2}"
        assert distance.min(axis=0).max() < 1e-6, "the search did not reach all of ours"


def test_singular_poses_hold(frigeni6: Robot) -> None:
    for q in singular_joints(frigeni6):
        X = frigeni6.fk(q)
        solutions = frigeni6.ik(X)
        assert solutions.valid.any()
        assert np.abs(pose_error(frigeni6.fk(solutions.q[solutions.valid]), X)).max() < 1e-9, q
        ours = solutions.q[solutions.valid]
        apart = np.abs(wrap(ours[:, None] - ours)).max(axis=-1) + np.eye(len(ours))
        assert apart.min() > 1e-7, q


def test_free_joint_keeps_the_reference(frigeni6: Robot) -> None:
    poses = singular_joints(frigeni6)
    rng = np.random.default_rng(SEED)
    for row, free in [(0, [3]), (1, [3]), (2, [3]), (3, [3]), (8, [3]), (9, [0]), (10, [0, 3])]:
        q = poses[row]
        reference = q + rng.uniform(-3, 3, 6)
        X = frigeni6.fk(q)[None]
        configuration = int(frigeni6.configuration(q))
        found, reachable = frigeni6.ik_branch(X, configuration, reference)
        assert reachable.all()
        assert np.abs(pose_error(frigeni6.fk(found), X)).max() < 1e-9, (row, SEED)
        if row != 10:  # with J1 turned the wrist is no longer straight
            np.testing.assert_allclose(found[0, free], reference[free], atol=1e-12)
        same, _ = frigeni6.ik_branch(X, configuration, q)
        np.testing.assert_allclose(same[0], q, atol=1e-7, err_msg=f"row {row}")


def test_path_through_a_singular_stretch_keeps_the_free_joint(frigeni6: Robot) -> None:
    """Only A turns while J5 = 0: J4 stands still, J6 follows through several turns."""
    start = np.radians([10.0, 5, -5, 40, 0, 10])
    q = np.repeat(start[None], 400, axis=0)
    q[:, 5] += np.linspace(0, 15, 400)
    found, reachable, free = frigeni6.ik_path(frigeni6.fk(q), 0, start)
    assert free
    assert reachable.all()
    np.testing.assert_allclose(found, q, atol=1e-9)


def test_path_is_continuous_over_turns(frigeni6: Robot) -> None:
    q = np.linspace(np.radians([-170, 5, -5, 300, 30, -300]), np.radians([170, 5, -15, -300, 40, 300]), 2000)
    found, _, free = frigeni6.ik_path(frigeni6.fk(q), 0, q[0])
    assert not free
    np.testing.assert_allclose(found, q, atol=1e-9)


def test_batch_size_does_not_matter(frigeni6: Robot) -> None:
    q = np.concatenate((random_joints(1000), singular_joints(frigeni6)))
    X, configuration, reference = frigeni6.fk(q), frigeni6.configuration(q), q + 0.1
    together, _ = frigeni6.ik_branch(X, configuration, reference)
    for size in (1, 7, 64):
        parts = [slice(i, i + size) for i in range(0, len(q), size)]
        apart = [frigeni6.ik_branch(X[s], configuration[s], reference[s])[0] for s in parts]
        np.testing.assert_allclose(np.concatenate(apart), together, rtol=0, atol=1e-12)


def test_turns_are_nearest_to_the_reference_row_by_row(frigeni6: Robot) -> None:
    q = random_joints(500, SEED + 4)
    turns = np.random.default_rng(SEED).integers(-2, 3, q.shape)
    reference = q + 2 * np.pi * turns + 0.3
    found, _ = frigeni6.ik_branch(frigeni6.fk(q), frigeni6.configuration(q), reference)
    np.testing.assert_allclose(found, q + 2 * np.pi * turns, atol=1e-7)


def test_unreachable_poses_are_reported(frigeni6: Robot) -> None:
    X = frigeni6.fk(np.zeros((3, 6)))
    X[1, 0, 3] += 10.0
    X[2, :3, 3] = [0.4 + 0.244, 0.0, 1.33]  # wrist in the shoulder
    _, reachable = frigeni6.ik_branch(X, 0, np.zeros(6))
    assert reachable.tolist() == [True, False, False]
    assert frigeni6.solutions(X[1]) == []
    assert not frigeni6.ik(X).valid[1].any()
    assert not frigeni6.ik(X).valid[2, :4].any()  # from behind it can be reached


def test_solutions_are_in_range_complete_and_sorted(frigeni6: Robot) -> None:
    rng = np.random.default_rng(SEED + 5)
    limits = frigeni6.limits
    for q in rng.uniform(limits.lower, limits.upper, (40, 6)):
        X = frigeni6.fk(q)
        reference = rng.uniform(limits.lower, limits.upper)
        found = frigeni6.solutions(X, reference=reference)
        joints = np.array([solution.joints for solution in found])
        assert limits.contain(joints).all()
        assert np.abs(joints - q).max(axis=1).min() < 1e-7, f"seed {SEED + 5}"
        distances = [frigeni6.distance(j, reference) for j in joints]
        assert distances == sorted(distances)
        for solution in found:
            assert frigeni6.configuration_names(solution.configuration) == solution.names
            assert int(frigeni6.configuration(solution.joints)) == solution.configuration


def test_home_pose_lists_the_reference_first(frigeni6: Robot) -> None:
    """At a pose with a free wrist the reference's own joints come back, once."""
    reference = np.radians([0, 0, 0, 25, 0, -25])
    found = frigeni6.solutions(frigeni6.fk(np.zeros(6)), reference=reference)
    np.testing.assert_allclose(found[0].joints, reference, atol=1e-9)
    assert np.abs(found[1].joints - reference).max() > 1e-3


def test_singularities_are_named(frigeni6: Robot) -> None:
    names = [frigeni6.singularity(q).singular for q in singular_joints(frigeni6)]
    assert names[0] == ("WRIST",)
    assert names[6] == ("ELBOW",)
    assert names[8] == ("WRIST", "ELBOW")
    assert names[9] == ("SHOULDER",)
    assert frigeni6.singularity([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]).singular == ()
    measure = frigeni6.manipulability(singular_joints(frigeni6))
    assert measure.max() < 1e-5
    assert frigeni6.manipulability([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]) > 0.1


def test_wire_frame_runs_from_base_to_flange(robot: Robot) -> None:
    q = random_joints(20)
    points = robot.link_points(q)
    assert np.abs(points[:, 0]).max() == 0
    np.testing.assert_allclose(points[:, -1], robot.fk(q)[:, :3, 3], atol=1e-12)
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(lengths[0], lengths.shape), atol=1e-12)


def test_couplings_are_inverse(frigeni6: Robot) -> None:
    q = random_joints(10)
    np.testing.assert_allclose(frigeni6.motors_to_joints(frigeni6.joints_to_motors(q)), q, atol=1e-12)
