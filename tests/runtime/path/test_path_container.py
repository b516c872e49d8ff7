"""The path: one parameter through all pieces, lengths travelled, dropping, steadiness of what is finished."""

from __future__ import annotations

import numpy as np
import pytest
from path_moves import circle, joint, line, path_of, pose, position_only, rotation, run, spline
from whole_path import Path

from viapoint.runtime.path import Chain, Corner, Move

Q0 = np.array([0.1, -0.3, 0.4, 0.2, 0.9, 0.1])


def mixed() -> list[Move]:
    """One of each, rounded, with turning tools."""
    r = Corner(radius=0.03)
    a, b, c = pose(0, 0, 0), pose(0.2, 0, 0, 0, 0, 40), pose(0.3, 0.2, 0.1, 20)
    return [
        line(10, a, b, r),
        circle(11, b, position_only(0.3, 0.05, 0.02), c, None, r),
        spline(12, c, pose(0.1, 0.3, 0.1), r),
        spline(13, pose(0.1, 0.3, 0.1), pose(0, 0.2, 0), r),
        line(14, pose(0, 0.2, 0), pose(0, 0, 0.1, 0, 30), r),
    ]


def brute(path: Path, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Arc length and turned angle by summing 400,000 chords, at s."""
    dense = np.linspace(0, path.end, 400_001)
    position, quaternion = path.poses(dense)
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)
    turns = (rotation(quaternion[1:]) * rotation(quaternion[:-1]).inv()).magnitude()
    return tuple(np.interp(s, dense, np.concatenate(([0.0], np.cumsum(x)))) for x in (steps, turns))


def test_lengths_against_dense_sampling() -> None:
    path = path_of(run(*mixed()))
    s = np.linspace(0, path.end, 300)
    arc, angle = brute(path, s)
    np.testing.assert_allclose(path.sigma(s), arc, atol=1e-6 * arc[-1])
    np.testing.assert_allclose(path.theta(s), angle, atol=1e-6 * angle[-1])


def test_lengths_of_joint_moves_against_dense_sampling() -> None:
    q1 = Q0 + np.array([0.8, 0.5, -0.6, 1.5, -0.9, 2.0])
    path = path_of(run(joint(1, Q0, q1, Corner(radius=0.3)), joint(2, q1, Q0 + 0.3)))
    s = np.linspace(0, path.end, 100)
    arc, angle = brute(path, s)
    np.testing.assert_allclose(path.sigma(s), arc, atol=1e-6 * arc[-1])
    np.testing.assert_allclose(path.theta(s), angle, atol=1e-6 * angle[-1])


@pytest.mark.parametrize("turn", [0.0, 60.0, 170.0, 179.0])
def test_length_of_a_sharp_edge(turn: float) -> None:
    a = np.radians(turn)
    end = pose(1 + np.cos(a), np.sin(a), 0)
    path = path_of(
        run(line(1, pose(0, 0, 0), pose(1, 0, 0), Corner(radius=0.4)), line(2, pose(1, 0, 0), end))
    )
    arc, _ = brute(path, np.array([path.end]))
    np.testing.assert_allclose(path.sigma(np.array([path.end])), arc, rtol=1e-6)


def test_rates_are_the_derivatives_of_the_lengths() -> None:
    for piece in run(*mixed(), mixed_end()).pieces:
        w = np.linspace(0.1, 0.9, 11) * piece.length
        h = 1e-4 * piece.length
        for length, rate in ((piece.arc_length, piece.arc_rate), (piece.angle_length, piece.angle_rate)):
            np.testing.assert_allclose(
                (length(w + h) - length(w - h)) / (2 * h), rate(w), rtol=1e-5, atol=1e-6
            )


def mixed_end() -> Move:
    return line(15, pose(0, 0, 0.1, 0, 30), pose(0, 0, 0.3, 0, 30))


def test_locate_and_breaks() -> None:
    path = path_of(run(*mixed()))
    index, w = path.locate(path.breaks)
    np.testing.assert_array_equal(index[:-1], np.arange(len(path.pieces)))
    assert index[-1] == len(path.pieces) - 1
    np.testing.assert_allclose(w[:-1], 0.0)
    assert w[-1] == pytest.approx(path.pieces[-1].length)
    np.testing.assert_array_equal(path.stops, [path.end])


def test_order_of_the_samples_does_not_matter() -> None:
    path = path_of(run(*mixed()))
    s = np.linspace(0, path.end, 500)
    shuffled = np.random.default_rng(8).permutation(500)
    np.testing.assert_array_equal(path.poses(s).position[shuffled], path.poses(s[shuffled]).position)
    np.testing.assert_array_equal(path.sigma(s)[::-1], path.sigma(s[::-1]))
    assert path.poses(np.empty(0)).position.shape == (0, 3)


def test_dropping_changes_nothing_of_the_rest() -> None:
    whole, cut = path_of(run(*mixed())), path_of(run(*mixed()))
    s = np.linspace(whole.breaks[6], whole.end, 200)
    cut.drop_before(whole.breaks[6] - 1e-3)
    assert len(cut.pieces) == len(whole.pieces) - 5
    assert cut.start == whole.breaks[5]
    np.testing.assert_array_equal(cut.poses(s).position, whole.poses(s).position)
    np.testing.assert_allclose(cut.sigma(s), whole.sigma(s), rtol=1e-15)
    np.testing.assert_allclose(cut.theta(s), whole.theta(s), rtol=1e-15)
    assert cut.place(14) == whole.place(14)
    with pytest.raises(KeyError):
        cut.place(10)


def test_finished_pieces_do_not_depend_on_when_they_are_taken() -> None:
    at_once, stepwise = path_of(run(*mixed())), Path()
    chain = Chain(tolerance=2e-5)
    for move in mixed():
        chain.push(move)
        stepwise.extend(chain)
        assert not chain.pieces
        assert not stepwise.has_place(14)
    chain.close()
    stepwise.extend(chain)
    np.testing.assert_array_equal(at_once.breaks, stepwise.breaks)
    s = np.linspace(0, at_once.end, 100)
    np.testing.assert_array_equal(at_once.poses(s).position, stepwise.poses(s).position)
    assert [at_once.place(t) for t in range(10, 15)] == [stepwise.place(t) for t in range(10, 15)]


def test_after_a_close_the_path_goes_on_from_rest() -> None:
    chain = Chain(tolerance=2e-5)
    chain.push(line(1, pose(0, 0, 0), pose(1, 0, 0)))
    chain.close()
    chain.push(spline(2, pose(1, 0, 0), pose(1, 1, 0)))
    chain.close()
    np.testing.assert_allclose(chain.pieces[1].tangents(np.zeros(1))[0], [0, 1, 0], atol=1e-12)
    assert [piece.stop for piece in chain.pieces] == [True, True]
