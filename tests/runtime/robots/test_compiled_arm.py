"""The compiled kinematics against the twin: ordinary, singular and unreachable poses, every branch."""

from __future__ import annotations

import numpy as np
import pytest

from both_cores import by_both
from viapoint.runtime.robots import load_robot, robot_names
from viapoint.runtime.rotations import abc_to_matrix, make_pose, quaternion_to_matrix

SAME = 1e-12
"""rad and m: some roundings near a stretched arm."""


def joints(seed: int) -> np.ndarray:
    """(60, 6): at random, with the wrist stretched in some and the arm stretched in others."""
    q = np.random.default_rng(seed).uniform(-2.5, 2.5, (60, 6))
    q[:10, 4] = 0.0
    q[10:20, 1:3] = 0.0
    return q


@pytest.mark.parametrize("name", robot_names())
def test_forward(name: str) -> None:
    arm = load_robot(name).kinematics
    q = joints(1)
    for compute in (arm.fk, arm.link_points, arm.jacobian):
        twin, compiled = by_both(lambda compute=compute: compute(q), "robots._spherical")
        assert np.abs(twin - compiled).max() <= SAME
        one = by_both(lambda compute=compute: compute(q[3]), "robots._spherical")[1]
        assert one.shape == twin.shape[1:]
        assert np.array_equal(one, compiled[3])


@pytest.mark.parametrize("name", robot_names())
@pytest.mark.parametrize("turns", [0, 3, 10**9])
def test_tool_centre(name: str, turns: int) -> None:
    arm, columns = load_robot(name).kinematics, np.zeros((60, 9))
    columns[:, :6] = joints(3) + turns * 2.0 * np.pi
    columns[-1, :6] = 0.0
    tool = make_pose([0.1, -0.2, 0.3], abc_to_matrix([np.pi, 0.0, 0.0]))
    rows = columns[:, :6]  # as in a window of ticks, among other columns
    twin, compiled = by_both(lambda: arm.tcp(rows, tool), "robots._spherical")
    for ours, theirs in zip(twin, compiled, strict=True):
        assert np.abs(ours - theirs).max() <= SAME * (1.0 + turns)
    X = arm.fk(rows) @ tool
    assert np.abs(X[:, :3, 3] - compiled[0]).max() <= SAME * (1.0 + turns)
    assert np.abs(X[:, :3, :3] - quaternion_to_matrix(compiled[1])).max() <= SAME * (1.0 + turns)
    alone = by_both(lambda: arm.tcp(rows[::-1][20:21], tool), "robots._spherical")[1]
    assert np.array_equal(alone[0][0], compiled[0][39])
    assert np.array_equal(alone[1][0], compiled[1][39])
    none = by_both(lambda: arm.tcp(rows[:0], tool), "robots._spherical")
    assert [each.shape for both in none for each in both] == [(0, 3), (0, 4)] * 2


@pytest.mark.parametrize("name", robot_names())
@pytest.mark.parametrize("given", [(), (0,), (3,), (0, 3)])
def test_inverse(name: str, given: tuple[int, ...]) -> None:
    arm = load_robot(name).kinematics
    q = joints(2)
    X = arm.fk(q)
    X[40:50, :3, 3] += 10.0  # out of reach

    def branches() -> list[tuple[np.ndarray, np.ndarray]]:
        own = arm.ik_branch(X, arm.configuration(q), q, given)
        return [own, *(arm.ik_branch(X, index, q[0], given) for index in range(8))]

    twin, compiled = by_both(branches, "robots._spherical")
    for (q_twin, inside_twin), (q_compiled, inside) in zip(twin, compiled, strict=True):
        assert np.array_equal(inside_twin, inside)
        assert inside.any()
        assert not inside[40:50].any()
        turns = np.rint((q_twin - q_compiled) / (2.0 * np.pi)) * 2.0 * np.pi
        assert np.abs(q_twin - q_compiled - turns)[inside].max() <= SAME
    free = by_both(lambda: arm.free_joint(X, q), "robots._spherical")
    assert np.array_equal(free[0], free[1])
    assert free[0][:10].all()
    assert not free[0].all()


@pytest.mark.parametrize("name", robot_names())
def test_solutions(name: str) -> None:
    robot = load_robot(name)
    every = robot.fk(joints(3))
    every[40:50, :3, 3] += 10.0  # out of reach
    reference = np.linspace(-0.5, 0.5, 6)
    for near in (None, reference, np.repeat(reference, 2)[::2]):

        def found(near: np.ndarray | None = near) -> list[tuple[np.ndarray, np.ndarray]]:
            return [robot.inside(X, near) for X in every]

        for twin, compiled in zip(*by_both(found, "robots._inside"), strict=True):
            assert np.array_equal(twin[1], compiled[1])
            assert np.abs(twin[0] - compiled[0]).max(initial=0.0) <= SAME
    twin, compiled = by_both(lambda: robot.ik(every), "robots._spherical")
    assert np.array_equal(twin.valid, compiled.valid)
    assert twin.valid.any(axis=1).sum() == len(every) - 10


@pytest.mark.parametrize("name", robot_names())
def test_turns_are_those_nearest_to_the_reference(name: str) -> None:
    robot = load_robot(name)
    q = joints(4)
    X, turned = robot.fk(q), q + 2.0 * np.pi * np.random.default_rng(4).integers(-3, 4, q.shape)
    for reference in (turned, turned[0]):
        twin, compiled = by_both(
            lambda reference=reference: robot.ik_branch(X, robot.configuration(q), reference),
            "robots._inside",
        )
        assert np.abs(twin[0] - compiled[0]).max() <= SAME
        away = np.abs(compiled[0] - reference)[:, ~robot.prismatic]
        assert away[twin[1]].max() <= np.pi + SAME
    path = np.stack([q[0] + share * 7.0 for share in np.linspace(0.0, 1.0, 40)])
    twin, compiled = by_both(
        lambda: robot.ik_path(robot.fk(path), int(robot.configuration(path[0])), turned[0]), "robots._inside"
    )
    assert np.abs(twin[0] - compiled[0]).max() <= SAME
    assert np.abs(np.diff(compiled[0], axis=0)).max() <= np.pi + SAME


@pytest.mark.parametrize("name", robot_names())
def test_vectors_of_free_joints(name: str) -> None:
    """They point where the joint does, in the branch that the joints are in."""
    arm = load_robot(name).kinematics
    q = joints(5)
    X = arm.fk(q)
    for index in range(8):
        twin, compiled = by_both(lambda index=index: arm.free_vectors(X, q, index), "robots._spherical")
        assert np.abs(twin - compiled).max() <= SAME
    for row in range(20, 60):
        vectors = arm.free_vectors(X[row : row + 1], q[row : row + 1], int(arm.configuration(q[row])))
        turns = (np.angle(vectors[0]) - q[row, list(arm.free_joints)]) / (2.0 * np.pi)
        assert np.abs(turns - np.rint(turns)).max() <= SAME
