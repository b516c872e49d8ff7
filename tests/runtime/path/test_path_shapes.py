"""Single motions against formulas of their own: lines, circles, turns in place, joint moves, half turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_moves import arm, arm_pose, circle, joint, line, pose, position_only, quaternions, rotation, run
from scipy.spatial.transform import Rotation, Slerp

from viapoint.runtime.path import GeometryError, Move, Piece, Pose, Space, end_pose

SEED = 411
EXACT = 1e-9


def only_piece(move: Move) -> Piece:
    chain = run(move)
    (piece,) = chain.pieces
    assert piece.stop
    assert piece.ends
    assert piece.tag == move.tag
    return piece


def same_orientation(q: np.ndarray, expected: Rotation, tolerance: float = EXACT) -> None:
    assert (rotation(q) * expected.inv()).magnitude().max() < tolerance


@pytest.mark.parametrize("seed", range(SEED, SEED + 10))
def test_line_is_straight_with_slerp(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = [Pose(rng.uniform(-2, 2, 3), quaternions(Rotation.random(random_state=seed + i))) for i in (0, 99)]
    piece = only_piece(line(5, *ends))
    t = np.linspace(0.0, 1.0, 101)
    position, quaternion = piece.poses(t * piece.length)
    a, b = ends
    assert piece.length == pytest.approx(np.linalg.norm(b.position - a.position), abs=EXACT)
    np.testing.assert_allclose(position, a.position + t[:, None] * (b.position - a.position), atol=EXACT)
    keys = Rotation.concatenate([rotation(e.quaternion) for e in ends])
    same_orientation(quaternion, Slerp([0.0, 1.0], keys)(t))
    assert piece.angle_length(np.array([piece.length]))[0] == pytest.approx(
        (keys[1] * keys[0].inv()).magnitude()
    )


@pytest.mark.parametrize("length", [0.0, 1e-8])
def test_turn_in_place(length: float) -> None:
    piece = only_piece(line(1, pose(1, 2, 3), pose(1 + length, 2, 3, c=90)))
    assert piece.length == pytest.approx(np.pi / 2)
    position, quaternion = piece.poses(np.array([0.0, np.pi / 4, np.pi / 2]))
    np.testing.assert_allclose(position[-1], [1 + length, 2, 3], atol=1e-15)
    same_orientation(
        quaternion, Rotation.from_euler("xyz", [[0, 0, 0], [0, 0, 45], [0, 0, 90]], degrees=True)
    )


@pytest.mark.parametrize(
    ("start", "target", "z_axis", "axis"),
    [
        ((0, 0, 0), (0, 0, 180), (0, 0, 1), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 180), (0, 0, -1), (0, 0, -1)),
        ((0, 0, 0), (0, 0, -180), (0, 0, 1), (0, 0, 1)),
        ((0, 0, 180), (0, 0, 0), (0, 0, 1), (0, 0, 1)),
        ((0, 0, 0), (180, 0, 0), (0, 0, 1), (1, 0, 0)),
        ((0, 0, 0), (0, -180, 0), (0, 0, 1), (0, 1, 0)),
        ((0, 0, 0), (0, 0, 179.9), (0, 0, -1), (0, 0, 1)),
    ],
)
def test_half_turns_go_about_plus_z_of_the_frame(
    start: tuple[float, ...], target: tuple[float, ...], z_axis: tuple[float, ...], axis: tuple[float, ...]
) -> None:
    for noise in (0.0, 1e-10, -1e-10):
        end = pose(1, 0, 0, target[0] + noise, target[1] + noise, target[2] + noise)
        move = replace(line(1, pose(0, 0, 0, *start), end), z_axis=np.array(z_axis, dtype=float))
        q = only_piece(move).poses(np.array([0.0, 0.25])).quaternion
        turned = (rotation(q[1]) * rotation(q[0]).inv()).as_rotvec()
        np.testing.assert_allclose(turned / np.linalg.norm(turned), axis, atol=1e-8)


@pytest.mark.parametrize("seed", range(SEED, SEED + 20))
def test_circle_passes_its_points_at_one_distance_from_one_centre(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p = rng.uniform(-1, 1, (3, 3))
    ends = [Pose(p[i], quaternions(Rotation.random(random_state=seed + i))) for i in range(3)]
    piece = only_piece(circle(2, ends[0], ends[1], ends[2]))
    # F 5-21…5-23, with the printed indices turned round for the other two coefficients
    n2 = 2.0 * np.sum(np.cross(p[0] - p[1], p[1] - p[2]) ** 2)
    c = [
        np.sum((p[j] - p[k]) ** 2) * (p[i] - p[j]) @ (p[i] - p[k]) / n2
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    ]
    centre = c[0] * p[0] + c[1] * p[1] + c[2] * p[2]
    radius = np.linalg.norm(p[0] - centre)
    w = np.linspace(0, piece.length, 2001)
    position, quaternion = piece.poses(w)
    scale = max(1.0, radius)
    np.testing.assert_allclose(np.linalg.norm(position - centre, axis=1), radius, atol=EXACT * scale)
    np.testing.assert_allclose(position[[0, -1]], p[[0, 2]], atol=EXACT * scale)
    chord = np.linalg.norm(np.diff(position, axis=0), axis=1)
    np.testing.assert_allclose(2 * radius * np.arcsin(chord / 2 / radius), w[1], rtol=1e-6)
    via = int(np.argmin(np.linalg.norm(position - p[1], axis=1)))
    assert np.linalg.norm(position[via] - p[1]) < w[1]
    assert 0 < via < 2000
    at_via = piece.poses(arc_to(piece, p[1]))
    np.testing.assert_allclose(at_via.position[0], p[1], atol=1e-6 * scale)
    same_orientation(at_via.quaternion, rotation(ends[1].quaternion[None]), 1e-5)
    same_orientation(quaternion[[0, -1]], rotation(np.array([ends[0].quaternion, ends[2].quaternion])))


def arc_to(piece: Piece, point: np.ndarray) -> np.ndarray:
    """w (1,) nearest to a point, by halving."""
    low, high = 0.0, piece.length
    for _ in range(12):
        w = np.linspace(low, high, 41)
        near = int(np.argmin(np.linalg.norm(piece.poses(w).position - point, axis=1)))
        low, high = w[max(near - 1, 0)], w[min(near + 1, 40)]
    return np.array([0.5 * (low + high)])


@pytest.mark.parametrize("degrees", [30.0, 270.0, 360.0, 720.0, 1234.5, -30.0, -360.0, -1234.5])
def test_h_counts_from_the_start_in_the_sense_of_q(degrees: float) -> None:
    """On the unit circle about (2, 0, 0.5), start at angle 0, Q at 90°, target at 200°."""
    at = np.radians([0.0, 90.0, 200.0])
    p = [(2 + np.cos(a), np.sin(a), 0.5) for a in at]
    move = circle(1, pose(*p[0]), position_only(*p[1]), pose(*p[2]), angle=np.radians(degrees))
    piece = only_piece(move)
    w = np.linspace(0, piece.length, 400)
    angle = np.sign(degrees) * w
    expected = np.stack((2 + np.cos(angle), np.sin(angle), np.full_like(w, 0.5)), axis=1)
    assert piece.length == pytest.approx(abs(np.radians(degrees)), abs=EXACT)
    np.testing.assert_allclose(piece.poses(w).position, expected, atol=EXACT)
    np.testing.assert_allclose(end_pose(move).position, expected[-1], atol=EXACT)


@pytest.mark.parametrize("turns", [1.0, 2.0, -1.0, -3.0])
def test_orientation_of_whole_turns_passes_the_keys_and_returns(turns: float) -> None:
    at = np.radians([0.0, 90.0, 200.0])
    p = [(np.cos(a), np.sin(a), 0.0) for a in at]
    start, via, target = pose(*p[0]), pose(*p[1], 30, 0, 0), pose(*p[2], 0, 0, 40)
    piece = only_piece(circle(1, start, via, target, angle=turns * 2 * np.pi))
    for k in range(int(abs(turns))):
        for key, a in zip((start, via, target, start), (*at, 2 * np.pi), strict=True):
            w = k * 2 * np.pi + (a if turns > 0 else 2 * np.pi - a)
            same_orientation(piece.poses(np.array([w])).quaternion, rotation(key.quaternion[None]))


def test_orientation_without_q_is_slerp() -> None:
    a, b = pose(1, 0, 0), pose(0, -1, 0, 10, 20, 30)
    piece = only_piece(circle(1, a, position_only(0, 1, 0), b))
    keys = Rotation.concatenate([rotation(a.quaternion), rotation(b.quaternion)])
    t = np.linspace(0, 1, 50)
    same_orientation(piece.poses(t * piece.length).quaternion, Slerp([0, 1], keys)(t))


@pytest.mark.parametrize(
    ("via", "target"),
    [
        ((0.05, 0, 0), (0.1, 0, 0)),
        ((0.1, 0, 0), (0.05, 0, 0)),
        ((0, 0, 0), (0.1, 0, 0)),
        ((0.1, 0, 0), (0.1, 0, 0)),
        ((0.1, 0, 0), (0, 0, 0)),
        ((0.05, 5e-7, 0), (0.1, 0, 0)),
    ],
)
def test_no_circle(via: tuple[float, ...], target: tuple[float, ...]) -> None:
    for angle in (None, 2 * np.pi):
        with pytest.raises(GeometryError, match="E306") as caught:
            run(circle(1, pose(0, 0, 0), position_only(*via), pose(*target), angle))
        assert caught.value.code == "E306"


def test_joint_move_is_straight_in_the_joints() -> None:
    a, b = np.array([0.1, -0.3, 0.4, 0.2, 0.9, 0.1]), np.array([0.5, 0.1, 0.1, -1.2, 1.0, 3.0])
    piece = only_piece(joint(4, a, b))
    t = np.linspace(0, 1, 30)
    q = a + t[:, None] * (b - a)
    assert piece.space is Space.JOINT
    assert piece.length == pytest.approx(np.linalg.norm(b - a))
    np.testing.assert_allclose(piece.joints(t * piece.length), q, atol=1e-14)
    np.testing.assert_allclose(piece.poses(t * piece.length).position, arm(q).position, atol=1e-14)


def test_weights_set_the_scale_of_a_joint_move() -> None:
    a, b = np.zeros(6), np.array([0.3, 0.1, 0.0, 0.0, 0.0, 0.4])
    weights = np.array([1.0, 5.0, 1.0, 1.0, 1.0, 2.0])
    piece = only_piece(replace(joint(1, a, b), joint_weights=weights))
    assert piece.length == pytest.approx(np.linalg.norm(weights * b))
    np.testing.assert_allclose(piece.joints(np.array([piece.length / 2]))[0], b / 2, atol=1e-15)


def test_moves_must_join_and_be_finite() -> None:
    with pytest.raises(ValueError, match="starts"):
        run(line(1, pose(0, 0, 0), pose(1, 0, 0)), line(2, pose(1.1, 0, 0), pose(2, 0, 0)))
    with pytest.raises(ValueError, match="finite"):
        run(line(1, pose(0, 0, 0), pose(np.nan, 0, 0)))
    with pytest.raises(ValueError, match="fk"):
        run(replace(joint(1, np.zeros(6), np.ones(6)), fk=None))


def test_a_failed_push_leaves_the_chain_as_it_was() -> None:
    good = [line(1, pose(0, 0, 0), pose(1, 0, 0)), line(3, pose(1, 0, 0), pose(1, 1, 0))]
    bad = circle(2, pose(1, 0, 0), position_only(2, 0, 0), pose(3, 0, 0))
    chain = run()
    chain.push(good[0])
    with pytest.raises(GeometryError):
        chain.push(bad)
    chain.push(good[1])
    chain.close()
    assert [p.tag for p in chain.pieces] == [1, 3]
    np.testing.assert_allclose(arm_pose(np.zeros(6)).position, arm(np.zeros((1, 6))).position[0])
