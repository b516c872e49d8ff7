"""Figures printed in the books, to their printed digits."""

from __future__ import annotations

import numpy as np
import pytest

from viapoint.runtime.robots import load_robot
from viapoint.runtime.rotations import Floats, matrix_to_abc, matrix_to_quaternion, pose_from_xyzabc

FORWARD = [  # F tables 3-2 … 3-5
    ((0, 0, 0, 0, 0, 0), (1755, 0, 2660, 0, 0, 0)),
    ((90, 0, 0, 0, 0, 0), (0, 1755, 2660, 0, 0, 90)),
    ((130, -60, 30, 60, -90, 60), (11.8, 314.7, 2740.3, -176.3, -25.7, 23.9)),
    ((-46, 46, 46, 46, 46, 46), (962.3, -814.8, 810.6, -132, 42.6, 89.3)),
]
INVERSE = [  # F tables 4-2 … 4-5
    ((1755, 0, 2660, 0, 0, 0), (0, 0, 0, 0, 0, 0)),
    ((1500, 1000, 2000, 0, 0, 0), (38.5, 7.9, 25.5, -124.7, 49.2, 136.6)),
    ((-500, 1000, 2000, 50, 50, 50), (124.3, -24.7, 43.6, -42.8, 65.6, 140.8)),
    ((600, -1000, 3300, 250, 0, -90), (-51.6, -7.9, -31.3, -51.5, 52.6, -72.7)),
]


def pose(numbers: tuple[float, ...]) -> Floats:
    return pose_from_xyzabc(np.array(numbers[:3]) / 1000, np.radians(numbers[3:]))


@pytest.mark.parametrize(("joints", "expected"), FORWARD)
def test_frigeni6_forward(joints: tuple[float, ...], expected: tuple[float, ...]) -> None:
    X = load_robot("frigeni6").fk(np.radians(joints))
    np.testing.assert_allclose(X[:3, 3] * 1000, expected[:3], atol=0.051)
    np.testing.assert_allclose(np.degrees(matrix_to_abc(X[:3, :3])), expected[3:], atol=0.051)


@pytest.mark.parametrize(("target", "joints"), INVERSE)
def test_frigeni6_inverse(target: tuple[float, ...], joints: tuple[float, ...]) -> None:
    robot = load_robot("frigeni6")
    found = [np.degrees(solution.joints) for solution in robot.solutions(pose(target))]
    assert min(np.abs(q - joints).max() for q in found) < 0.051
    q, reachable = robot.ik_branch(pose(target)[None], 0, np.radians(joints))
    assert reachable.all()
    np.testing.assert_allclose(np.degrees(q[0]), joints, atol=0.051)
    assert robot.configuration_names(0) == ("FRONT", "UP", "POSITIVE")


@pytest.mark.parametrize(
    ("joints", "position", "quaternion"),
    [
        (
            (28.79, -34.07, 19.54, 7.62, 38.93, 56.38),
            (256.169, 146.952, 719.042),
            (0.3553, 0.2202, 0.8095, 0.4122),
        ),
        (
            (-16.15, 34.64, -9.11, 113.11, 46.53, -72.67),
            (651.650, -143.536, 481.847),
            (0.5426, 0.1585, 0.7033, 0.4311),
        ),
    ],
)
def test_irb140_forward(joints: Floats, position: Floats, quaternion: Floats) -> None:
    X = load_robot("irb140").fk(np.radians(joints))
    np.testing.assert_allclose(X[:3, 3] * 1000, position, atol=6e-4)
    np.testing.assert_allclose(matrix_to_quaternion(X[:3, :3]), quaternion, atol=6e-5)


@pytest.mark.parametrize(
    ("joints", "other"),
    [
        ((-16.15, 34.64, -9.11, 113.11, 46.53, -72.67), (-16.15, 34.64, -9.11, -66.89, -46.53, 107.33)),
        ((-79.56, -39.46, -144.26, 71.05, 84.59, -62.73), (-79.56, -95.31, -35.74, 82.67, 71.68, -115.12)),
    ],
)
def test_irb140_other_solutions(joints: Floats, other: Floats) -> None:
    robot = load_robot("irb140")
    solutions = robot.ik(robot.fk(np.radians(joints)))
    errors = np.abs(np.degrees(solutions.q[solutions.valid]) - other).max(axis=1)
    assert errors.min() < 0.011


def test_irb1400() -> None:
    robot = load_robot("irb1400")
    np.testing.assert_allclose(robot.fk(np.zeros(6))[:3, 3], [0.955, 0, 1.195], atol=1e-12)
    q = np.radians([45, 60, 45, 0, 0, 0])
    np.testing.assert_allclose(robot.fk(q)[:3, 3] * 1000, [-490.6, -490.6, 1521.5], atol=0.051)
    assert robot.singularity(q).singular == ("WRIST",)
    expected = [
        [0, -720, -120, 0, 0, 0],
        [955, 0, 0, 0, 0, 0],
        [0, 805, 805, 0, 85, 0],
        [0, 0, 0, 1, 0, 1],
        [0, -1, -1, 0, -1, 0],
        [1, 0, 0, 0, 0, 0],
    ]
    scale = np.array([[1000.0]] * 3 + [[1.0]] * 3)
    np.testing.assert_allclose(robot.jacobian(np.zeros(6)) * scale, expected, atol=1e-9)
