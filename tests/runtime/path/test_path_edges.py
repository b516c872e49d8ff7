"""Corners: what is rounded and how far, what stops and why, and who owns which part of an edge."""

from __future__ import annotations

import numpy as np
import pytest
from path_moves import arm_pose, circle, joint, line, path_of, pose, position_only, run, spline

from viapoint.runtime.path import Corner, Move, Piece, Pose, Reason, Space

SEED = 90
R = 0.02


def corner_of(first: Move, second: Move) -> tuple[Reason, float]:
    row = run(first, second).transitions[0]
    assert row.stop is row.reason.stops
    assert (row.tag, row.next_tag, row.asked) == (first.tag, second.tag, first.corner.radius)
    return row.reason, row.effective


def shifted(start: Pose, x: float, y: float, z: float) -> Pose:
    return Pose(start.position + np.array([x, y, z]), start.quaternion)


def right_angle(radius: float | None = R, *, stop: bool = False, length: float = 0.2) -> list[Move]:
    return [
        line(1, pose(0, 0, 0), pose(0.1, 0, 0), Corner(stop, radius)),
        line(2, pose(0.1, 0, 0), pose(0.1, length, 0)),
    ]


def edge_poses(pieces: list[Piece], t: np.ndarray) -> np.ndarray:
    """Positions at t in 0 … 1 over the two halves of an edge."""
    a, b = pieces
    w = t * (a.length + b.length)
    first = w <= a.length
    return np.concatenate((a.poses(w[first]).position, b.poses(w[~first] - a.length).position))


@pytest.mark.parametrize("seed", range(SEED, SEED + 10))
def test_edge_of_two_lines_is_the_quartic_of_f_5_29(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, p, b = rng.uniform(-1, 1, (3, 3))
    d = 0.04
    chain = run(line(1, pose(*a), pose(*p), Corner(radius=d)), line(2, pose(*p), pose(*b)))
    p0, p4 = p + d * (a - p) / np.linalg.norm(a - p), p + d * (b - p) / np.linalg.norm(b - p)
    control = [p0, (p0 + p) / 2, p, (p + p4) / 2, p4]
    t = np.linspace(0, 1, 101)[:, None]
    s = 1 - t
    terms = (s**4, 4 * s**3 * t, 6 * s**2 * t**2, 4 * s * t**3, t**4)
    expected = sum(weight * c for weight, c in zip(terms, control, strict=True))
    edge = chain.pieces[1:3]
    np.testing.assert_allclose(edge_poses(edge, t[:, 0]), expected, atol=1e-12, err_msg=f"seed {seed}")
    assert sum(piece.length for piece in edge) == pytest.approx(2 * d)
    # The middle is 3/16 of |u + v|·d off the corner: the control points weigh 1 4 6 4 1.
    off = np.linalg.norm(expected[50] - p)
    u, v = (p - p0) / d, (p4 - p) / d
    assert off == pytest.approx(3 / 16 * d * np.linalg.norm(v - u))


def test_tags_places_and_halves() -> None:
    chain = run(*right_angle())
    assert [(p.tag, p.is_edge, p.ends, p.stop) for p in chain.pieces] == [
        (1, False, False, False),
        (1, True, True, False),
        (2, True, False, False),
        (2, False, True, True),
    ]
    path = path_of(chain)
    assert path.place(1) == pytest.approx(0.08 + R)
    assert path.place(2) == pytest.approx(path.end)
    middle = path.poses(np.array([path.place(1)])).position[0]
    np.testing.assert_allclose(middle, [0.1 - 3 / 16 * R, 3 / 16 * R, 0], atol=1e-12)
    np.testing.assert_array_equal(path.tags(np.array([0.0, 0.0999, 0.1001, path.end])), [1, 1, 2, 2])


@pytest.mark.parametrize(
    ("moves", "reason"),
    [
        (right_angle(0.0), Reason.R_ZERO),
        (right_angle(None), Reason.CORNER),
        (right_angle(R, stop=True), Reason.ASKED),
        (right_angle(R, length=1e-7), Reason.TOO_SHORT),
        (
            [
                line(1, pose(0, 0, 0), pose(1, 0, 0), Corner(radius=R)),
                line(2, pose(1, 0, 0), pose(0.5, 1e-4, 0)),
            ],
            Reason.REVERSAL,
        ),
        (
            [
                line(1, pose(0, 0, 0), pose(1, 0, 0), Corner(radius=R)),
                line(2, pose(1, 0, 0), pose(1, 0, 0, 30)),
            ],
            Reason.IN_PLACE,
        ),
        (
            [line(1, pose(0, 0, 0), pose(1, 0, 0), Corner(radius=0)), line(2, pose(1, 0, 0), pose(2, 0, 0))],
            Reason.R_ZERO,
        ),
        ([line(1, pose(0, 0, 0), pose(1, 0, 0)), line(2, pose(1, 0, 0), pose(2, 0, 0))], Reason.SMOOTH),
        (
            [line(1, pose(0, 0, 0), pose(0, 0, 0, 30)), line(2, pose(0, 0, 0, 30), pose(0, 0, 0, 70))],
            Reason.SMOOTH,
        ),
        (
            [line(1, pose(0, 0, 0), pose(0, 0, 0, 30)), line(2, pose(0, 0, 0, 30), pose(0, 0, 0, 30, 40))],
            Reason.CORNER,
        ),
    ],
)
def test_reasons(moves: list[Move], reason: Reason) -> None:
    chain = run(*moves)
    assert chain.transitions[0].reason is reason
    assert [piece.stop for piece in chain.pieces].count(True) == 1 + reason.stops


def test_radius_is_clamped_to_half_of_the_shorter_motion() -> None:
    assert corner_of(*right_angle(0.09)) == (Reason.ROUNDED, pytest.approx(0.05))
    assert corner_of(*right_angle(0.09, length=0.03)) == (Reason.ROUNDED, pytest.approx(0.015))
    quarter = circle(
        2,
        pose(0.1, 0, 0),
        position_only(0.1 + 0.05 * 0.5**0.5, 0.05 * (1 - 0.5**0.5), 0),
        pose(0.15, 0.05, 0),
    )
    first = line(1, pose(0, -0.1, 0), pose(0.1, 0, 0), Corner(radius=1.0))
    assert corner_of(first, quarter) == (Reason.ROUNDED, pytest.approx(0.05 * np.pi / 4))


def test_edges_on_both_sides_may_meet_in_the_middle() -> None:
    corners = [pose(0, 0, 0), pose(0.1, 0, 0), pose(0.1, 0.1, 0), pose(0.2, 0.1, 0)]
    moves = [line(i, corners[i], corners[i + 1], Corner(radius=1.0)) for i in range(3)]
    chain = run(*moves)
    assert [(p.tag, p.is_edge) for p in chain.pieces] == [
        (0, False),
        (0, True),
        (1, True),
        (1, True),
        (2, True),
        (2, False),
    ]


def test_a_large_rotation_limits_the_edge() -> None:
    q = np.zeros(6)
    turned = np.array([0.0, 0.0, 0.0, 0.3, 0.0, 6.0])
    row = run(
        joint(1, q, turned, Corner(radius=1.0)),
        line(2, arm_pose(turned), shifted(arm_pose(turned), 0, 0.3, 0)),
    ).transitions[0]
    assert row.reason is Reason.ROUNDED
    chain = run(joint(1, q, turned))
    (piece,) = chain.pieces
    total = piece.arc_length(np.array([piece.length]))[0]
    assert row.effective < 0.5 * total
    assert row.effective > 0.15 * total


def test_edge_between_joint_moves_is_measured_in_joint_space() -> None:
    q = [np.zeros(6), np.array([0.4, 0, 0, 0, 0.3, 0]), np.array([0.4, 0.3, -0.2, 0, 0.3, 0])]
    chain = run(joint(1, q[0], q[1], Corner(radius=0.1)), joint(2, q[1], q[2]))
    assert chain.transitions[0].effective == pytest.approx(0.1)
    assert all(piece.space is Space.JOINT for piece in chain.pieces)
    assert [piece.length for piece in chain.pieces] == pytest.approx(
        [0.4, 0.1, 0.1, np.hypot(0.3, 0.2) - 0.1]
    )
    u, v = (q[1] - q[0]) / 0.5, (q[2] - q[1]) / np.hypot(0.3, 0.2)
    middle = chain.pieces[1].joints(np.array([0.1]))[0]
    np.testing.assert_allclose(middle, q[1] + 3 / 16 * 0.1 * (v - u), atol=1e-12)


def test_edge_between_joint_move_and_line_is_measured_along_the_tcp() -> None:
    q = [np.array([0.1, -0.3, 0.4, 0.2, 0.9, 0.1]), np.array([0.4, 0, 0.2, 0.3, 0.6, 0])]
    end = arm_pose(q[1])
    after = line(2, end, shifted(end, 0, 0, -0.3))
    chain = run(joint(1, q[0], q[1], Corner(radius=0.05)), after)
    assert [p.space for p in chain.pieces] == [Space.JOINT, Space.POSE, Space.POSE, Space.POSE]
    whole, cut = run(joint(1, q[0], q[1])).pieces[0], chain.pieces[0]
    lost = whole.arc_length(np.array([whole.length])) - cut.arc_length(np.array([cut.length]))
    assert lost[0] == pytest.approx(0.05, abs=1e-7)
    assert chain.pieces[3].length == pytest.approx(0.25, abs=1e-9)


def test_motions_of_zero_length_are_passed_over() -> None:
    a, b, c = pose(0, 0, 0), pose(0.1, 0, 0), pose(0.1, 0.2, 0)
    chain = run(line(1, a, b, Corner(radius=R)), line(2, b, b), line(3, b, b), line(4, b, c))
    assert [t.reason for t in chain.transitions] == [
        Reason.ZERO_LENGTH,
        Reason.ZERO_LENGTH,
        Reason.ROUNDED,
        Reason.END,
    ]
    path = path_of(chain)
    assert path.place(1) == path.place(2) == path.place(3) == pytest.approx(0.1)
    stopped = run(line(1, a, b, Corner(radius=R)), line(2, b, b, Corner(radius=0.0)), line(4, b, c))
    assert [t.stop for t in stopped.transitions] == [False, True, True]
    lonely = run(line(1, a, a), line(2, a, b))
    assert path_of(lonely).place(1) == 0.0


def test_a_stop_does_not_hide_the_neighbour_from_a_spline() -> None:
    a, b, c = pose(0, 0, 0), pose(0.1, 0, 0), pose(0.2, 0.2, 0)
    chain = run(line(1, a, b, Corner(radius=0.0)), spline(2, b, c))
    start = chain.pieces[1].tangents(np.zeros(1))[0]
    np.testing.assert_allclose(start, [1, 0, 0], atol=1e-12)
