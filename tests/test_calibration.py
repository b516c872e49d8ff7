"""Calibration of tools and frames against what was put in, against scipy, and against the book's figures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from viapoint.calibration import CalibrationError, calibrate_frame, calibrate_tool
from viapoint.runtime.records import Floats

BOOK = np.array(  # F table 10-1: X Y Z A B C of five mounting points
    [
        [1577.256, 1243.340, 1192.628, -70.356, 50.789, -43.760],
        [1410.702, 1078.277, 1067.784, -41.706, 26.505, -0.183],
        [1659.391, 749.691, 1067.892, 81.321, 26.524, 74.411],
        [2042.116, 988.606, 1125.491, 86.419, 36.737, 163.088],
        [1873.821, 1234.896, 1221.280, 155.174, 58.236, -127.965],
    ]
)


def poses(rows: Floats) -> Floats:
    """X Y Z A B C in mm and deg → (n, 4, 4) m; fixed axes, as scipy's lower-case letters."""
    X = np.tile(np.eye(4), (len(rows), 1, 1))
    X[:, :3, :3] = Rotation.from_euler("xyz", rows[:, 3:], degrees=True).as_matrix()
    X[:, :3, 3] = rows[:, :3] / 1000.0
    return X


def touching(rng: np.random.Generator, n: int, tool: Floats, point: Floats, noise: float = 0.0) -> Floats:
    X = np.tile(np.eye(4), (n, 1, 1))
    X[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-0.8, 0.8, (n, 3))).as_matrix()
    X[:, :3, 3] = point - X[:, :3, :3] @ tool + rng.normal(0.0, noise, (n, 3))
    return X


def test_the_books_example() -> None:
    found = calibrate_tool(poses(BOOK))
    np.testing.assert_allclose(found.xyz * 1000.0, [380.0, 0.0, 0.0], atol=5e-3)
    np.testing.assert_allclose(found.point * 1000.0, [1750.758, 1077.189, 898.194], atol=5e-3)
    assert found.largest < 1e-5


@pytest.mark.parametrize("seed", range(5))
def test_what_was_put_in_comes_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tool, point = rng.uniform(-0.4, 0.4, 3), rng.uniform(-2.0, 2.0, 3)
    found = calibrate_tool(touching(rng, 4 + seed, tool, point))
    np.testing.assert_allclose(found.xyz, tool, atol=1e-12)
    np.testing.assert_allclose(found.point, point, atol=1e-12)
    assert found.rms < 1e-12


@pytest.mark.parametrize("seed", range(5))
def test_with_noise_it_is_the_least_squares_answer(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    tool, point = rng.uniform(-0.4, 0.4, 3), rng.uniform(-2.0, 2.0, 3)
    X = touching(rng, 8, tool, point, noise=1e-3)

    def errors(unknown: Floats) -> Floats:
        return (X[:, :3, :3] @ unknown[:3] + X[:, :3, 3] - unknown[3:]).ravel()

    best = least_squares(errors, np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    found = calibrate_tool(X)
    np.testing.assert_allclose(found.xyz, best.x[:3], atol=1e-9)
    np.testing.assert_allclose(
        found.residuals, np.linalg.norm(errors(best.x).reshape(-1, 3), axis=1), atol=1e-9
    )
    assert np.linalg.norm(found.xyz - tool) < 5.0 * np.linalg.norm(found.uncertainty)


def test_the_uncertainty_is_the_spread_of_many_calibrations() -> None:
    rng = np.random.default_rng(7)
    tool, point = np.array([0.2, 0.05, 0.1]), np.array([1.5, 0.2, 0.8])
    exact = touching(rng, 12, tool, point)
    found, told = [], []
    for _ in range(400):
        X = exact.copy()
        X[:, :3, 3] += rng.normal(0.0, 5e-4, (12, 3))
        one = calibrate_tool(X)
        found.append(one.xyz)
        told.append(one.uncertainty)
    np.testing.assert_allclose(np.mean(told, axis=0), np.std(found, axis=0), rtol=0.15)


def test_a_pose_that_missed_stands_out() -> None:
    rng = np.random.default_rng(3)
    X = touching(rng, 6, np.array([0.3, 0.0, 0.0]), np.array([1.0, 0.0, 1.0]))
    X[4, :3, 3] += [0.0, 0.01, 0.0]
    assert calibrate_tool(X).residuals.argmax() == 4


@pytest.mark.parametrize(
    ("vectors", "words"),
    [
        (np.zeros((5, 3)), "one orientation"),
        (np.outer(np.linspace(0.0, 0.05, 5), [0.0, 0.0, 1.0]), "one orientation"),
        (np.outer(np.linspace(-1.0, 1.0, 5), [0.0, 0.0, 1.0]), "(0.00, 0.00, 1.00)"),
        (np.outer(np.linspace(-1.0, 1.0, 5), [-0.6, 0.0, -0.8]), "(0.60, 0.00, 0.80)"),
    ],
)
def test_orientations_that_do_not_determine_a_tool(vectors: Floats, words: str) -> None:
    X = np.tile(np.eye(4), (5, 1, 1))
    X[:, :3, :3] = Rotation.from_rotvec(vectors).as_matrix()
    with pytest.raises(CalibrationError) as found:
        calibrate_tool(X)
    assert words in str(found.value)


@pytest.mark.parametrize(
    ("X", "words"),
    [
        (np.tile(np.eye(4), (3, 1, 1)), "at least 4 poses, 3 are given"),
        (np.full((4, 4, 4), np.nan), "finite"),
        (np.zeros((4, 3, 3)), "4 by 4"),
        (np.tile(2.0 * np.eye(4), (5, 1, 1)), "no rotation"),
    ],
)
def test_what_are_no_poses(X: Floats, words: str) -> None:
    with pytest.raises(CalibrationError, match=words):
        calibrate_tool(X)


@pytest.mark.parametrize("two_on_x", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_a_frame_from_points_in_it(seed: int, two_on_x: bool) -> None:
    rng = np.random.default_rng(seed)
    R, origin = Rotation.random(random_state=seed).as_matrix(), rng.uniform(-1.0, 1.0, 3)
    a, b, c = rng.uniform(0.1, 0.5, 3)
    if two_on_x:
        local = np.array([[a, 0.0, 0.0], [a + b, 0.0, 0.0], [0.0, c, 0.0]])
    else:
        local = np.array([[0.0, 0.0, 0.0], [a, 0.0, 0.0], [b - 0.3, c, 0.0]])
    X = calibrate_frame(local @ R.T + origin, two_on_x=two_on_x)
    np.testing.assert_allclose(X[:3, :3], R, atol=1e-12)
    np.testing.assert_allclose(X[:3, 3], origin, atol=1e-12)
    assert X[3].tolist() == [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0, 0, 0], [0, 0, 0.0005], [1, 0, 0]], "points 1 and 2 are 0.500 mm apart"),
        ([[0, 0, 0], [1, 0, 0], [1, 0, 0]], "points 2 and 3 are 0.000 mm apart"),
        ([[0, 0, 0], [1, 0, 0], [-0.5, 0.004, 0]], "point 3 is only 4.000 mm beside the line"),
        ([[0, 0, 0], [1, 0, np.inf], [0, 1, 0]], "finite"),
        ([[0, 0, 0], [1, 0, 0]], "three points"),
    ],
)
def test_points_that_do_not_determine_a_frame(points: list[list[float]], words: str) -> None:
    with pytest.raises(CalibrationError, match=words):
        calibrate_frame(np.array(points, dtype=float))
