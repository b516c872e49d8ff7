"""Splines: the tangent rules, control points, key orientations, and when a spline is finished."""

from __future__ import annotations

import numpy as np
import pytest
from path_moves import circle, line, pose, position_only, require_smooth, rotation, run, spline

from viapoint.runtime.path import Chain, Corner, Piece, Pose, Reason


def controls(start: Pose, target: Pose, tangent0: np.ndarray, tangent3: np.ndarray) -> np.ndarray:
    p0, p3 = start.position, target.position
    third = np.linalg.norm(p3 - p0) / 3
    return np.stack((p0, p0 + third * tangent0, p3 - third * tangent3, p3))


def de_casteljau(points: np.ndarray, t: float) -> np.ndarray:
    """F 5-26…5-28."""
    while len(points) > 1:
        points = (1 - t) * points[:-1] + t * points[1:]
    return points[0]


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)


def require_bezier(piece: Piece, expected: np.ndarray) -> None:
    """The whole segment under the piece, whatever its ends were rounded to."""
    w = np.linspace(0, piece.segment.length, 23)
    points = [de_casteljau(expected, t) for t in np.linspace(0, 1, 23)]
    np.testing.assert_allclose(piece.segment.poses(w).position, points, atol=1e-12)


A, B, C, D = pose(0, 0, 0), pose(0.1, 0.05, 0), pose(0.2, 0.05, 0.1), pose(0.3, 0, 0.1)


def test_interior_tangents_are_parallel_to_the_chord_of_the_neighbours() -> None:
    chain = run(spline(1, A, B), spline(2, B, C), spline(3, C, D))
    whole = [p for p in chain.pieces if not p.is_edge]
    at_b, at_c = unit(C.position - A.position), unit(D.position - B.position)
    require_bezier(whole[1], controls(B, C, at_b, at_c))
    # The ends have no neighbour: their tangents point to the neighbouring control point.
    inner_b = B.position - np.linalg.norm(B.position) / 3 * at_b
    require_bezier(whole[0], controls(A, B, unit(inner_b), at_b))
    inner_c = C.position + np.linalg.norm(D.position - C.position) / 3 * at_c
    require_bezier(whole[2], controls(C, D, at_c, unit(D.position - inner_c)))


def test_neighbouring_line_and_circle_give_their_tangents() -> None:
    before = line(1, pose(-0.1, 0, 0), A)
    after = circle(3, B, position_only(0.15, 0.1, 0), pose(0.2, 0.05, 0))
    chain = run(before, spline(2, A, B), after)
    piece = next(p for p in chain.pieces if p.tag == 2 and not p.is_edge)
    require_bezier(piece, controls(A, B, np.array([1.0, 0, 0]), np.array([0, 1.0, 0])))


def test_a_lonely_spline_is_a_line() -> None:
    (piece,) = run(spline(1, A, B)).pieces
    require_bezier(piece, np.linspace(A.position, B.position, 4))
    assert piece.arc_length(np.array([piece.length]))[0] == pytest.approx(np.linalg.norm(B.position))


def test_a_turn_in_place_gives_no_tangent() -> None:
    turn = pose(*A.position, 0, 30)
    chain = run(line(1, A, turn), spline(2, turn, pose(*B.position, 0, 30)))
    require_bezier(chain.pieces[-1], np.linspace(A.position, B.position, 4))
    assert chain.transitions[0].reason is Reason.IN_PLACE


def test_returning_spline_has_no_interior_tangent_and_stops() -> None:
    assert run(spline(1, A, B), spline(2, B, A)).transitions[0].reason is Reason.REVERSAL


def test_a_spline_is_finished_with_the_motion_after_it() -> None:
    chain = Chain(tolerance=2e-5)
    counts = []
    for move in (spline(1, A, B), spline(2, B, C), spline(3, C, D), line(4, D, pose(0.4, 0, 0.2))):
        chain.push(move)
        counts.append(len(chain.pieces))
    chain.close()
    counts.append(len(chain.pieces))
    # A corner needs the segments on both sides; a spline's needs the motion after it, a line's does not.
    assert counts == [0, 0, 3, 9, 10]


def test_r_between_splines_has_no_effect_but_r0_stops() -> None:
    plain = run(spline(1, A, B), spline(2, B, C)).transitions[0]
    with_r = run(spline(1, A, B, Corner(radius=0.05)), spline(2, B, C)).transitions[0]
    assert (with_r.reason, with_r.effective) == (Reason.TOLERANCE, plain.effective)
    assert run(spline(1, A, B, Corner(radius=0.0)), spline(2, B, C)).transitions[0].stop


def test_orientation_passes_the_key_orientations() -> None:
    keys = [pose(0, 0, 0), pose(0.1, 0.05, 0, 20), pose(0.2, 0.05, 0.1, 20, 30), pose(0.3, 0, 0.1, 0, 0, 50)]
    chain = run(*(spline(i, keys[i], keys[i + 1]) for i in range(3)))
    for piece in chain.pieces:
        if piece.is_edge:
            continue
        ends = piece.segment.poses(np.array([0.0, piece.segment.length])).quaternion
        for q, key in zip(ends, keys[piece.tag : piece.tag + 2], strict=True):
            assert (rotation(q) * rotation(key.quaternion).inv()).magnitude() < 1e-12
    assert require_smooth(chain) == 6


def test_constant_rate_of_orientation_is_kept() -> None:
    keys = [pose(0.1 * i, 0, 0, 0, 0, 10 * i) for i in range(4)]
    chain = run(*(spline(i, keys[i], keys[i + 1]) for i in range(3)))
    assert [t.reason for t in chain.transitions[:-1]] == [Reason.SMOOTH] * 2
    for piece in chain.pieces:
        w = np.linspace(0, piece.length, 9)
        position, quaternion = piece.poses(w)
        np.testing.assert_allclose(
            rotation(quaternion).as_euler("xyz", True)[:, 2], 100 * position[:, 0], atol=1e-9
        )


def test_a_quick_turn_beside_a_long_still_spline_is_not_overshot() -> None:
    keys = [pose(0, 0, 0), pose(0.01, 0.001, 0, 0, 0, 90), pose(0.5, 0.1, 0, 0, 0, 90)]
    chain = run(spline(0, keys[0], keys[1]), spline(1, keys[1], keys[2]))
    for piece in chain.pieces:
        angles = rotation(piece.poses(np.linspace(0, piece.length, 200)).quaternion).as_euler("xyz", True)
        assert angles[:, 2].min() > -0.2
        assert angles[:, 2].max() < 90.2


@pytest.mark.parametrize("seed", range(20))
def test_no_turn_is_further_than_the_most_that_is_told_of_it(seed: int) -> None:
    """By dense sampling of the orientations; and what is told is not far above it."""
    draw = np.random.default_rng(seed)
    poses = [pose(0.1 * k, *draw.uniform(-0.05, 0.05, 2), *draw.uniform(-80, 80, 3)) for k in range(5)]
    for piece in run(*(spline(k, *poses[k : k + 2]) for k in range(4))).pieces:
        segment = piece.segment
        q = rotation(segment.poses(np.linspace(0, segment.length, 2000)).quaternion)
        turned = float((q[1:] * q[:-1].inv()).magnitude().sum())
        most = segment.turn.most(segment.length)
        assert turned - 1e-9 <= most <= 3.0 * turned + 1e-9, seed
