"""Every transition that is passed without a stop is C² in position and orientation, whatever meets there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from path_moves import (
    TOLERANCE,
    arm_pose,
    circle,
    joint,
    line,
    path_of,
    pose,
    position_only,
    require_smooth,
    run,
    spline,
)

from viapoint.runtime.path import Corner, Move, MoveKind, Piece, Pose, Reason

SEED = 7131
Q = np.array(
    [
        [0.1, -0.3, 0.4, 0.2, 0.9, 0.1],
        [0.35, -0.1, 0.2, 0.5, 0.7, -0.2],
        [0.2, 0.2, 0.3, 0.1, 1.1, 0.3],
    ]
)


def move_between(kind: MoveKind, tag: int, q0: np.ndarray, q1: np.ndarray, corner: Corner) -> Move:
    """A move of that kind between two poses of the arm."""
    start, target = arm_pose(q0), arm_pose(q1)
    match kind:
        case MoveKind.LINE:
            return line(tag, start, target, corner)
        case MoveKind.SPLINE:
            return spline(tag, start, target, corner)
        case MoveKind.JOINT:
            return joint(tag, q0, q1, corner)
        case MoveKind.CIRCLE:
            middle = 0.5 * (start.position + target.position) + [0.02, -0.03, 0.05]
            return circle(tag, start, Pose(middle, None), target, corner=corner)


@pytest.mark.parametrize(("first", "second"), list(product(MoveKind, MoveKind)))
def test_round_edges_between_all_kinds(first: MoveKind, second: MoveKind) -> None:
    chain = run(
        move_between(first, 1, Q[0], Q[1], Corner(radius=0.03)),
        move_between(second, 2, Q[1], Q[2], Corner()),
    )
    expected = Reason.TOLERANCE if first is second is MoveKind.SPLINE else Reason.ROUNDED
    # Between a spline and a motion that gives it its tangent, R makes a round edge too.
    assert chain.transitions[0].reason is expected
    assert require_smooth(chain) >= 2


@pytest.mark.parametrize(("first", "second"), list(product(MoveKind, MoveKind)))
def test_auxiliary_axes_are_smooth_over_every_passage(first: MoveKind, second: MoveKind) -> None:
    """With R; and without, where nothing but their rate jumps."""
    e = np.array([[0.0, 0.1], [0.2, 0.0], [0.1, -0.3]])
    moves = [
        replace(move_between(kind, k + 1, Q[k], Q[k + 1], corner), e_start=e[k], e_target=e[k + 1])
        for k, (kind, corner) in enumerate(((first, Corner(radius=0.03)), (second, Corner())))
    ]
    chain = run(*moves)
    assert not chain.transitions[0].stop
    assert all(piece.segment.auxiliary is not None for piece in chain.pieces)
    assert require_smooth(chain) >= 2


def test_turns_in_place_pass_into_each_other() -> None:
    """About one axis without a stop; about another with one, as they have no tangent in common."""
    a, b, c, d = (pose(1, 0, 1, *abc) for abc in ((0, 0, 0), (30, 0, 0), (70, 0, 0), (70, 40, 0)))
    chain = run(line(1, a, b), line(2, b, c), line(3, c, d))
    assert [t.stop for t in chain.transitions] == [False, True, True]
    assert require_smooth(chain) >= 1
    aside = np.array([[0.0], [0.1], [0.05]])
    first, second = (
        replace(move, e_start=aside[k], e_target=aside[k + 1])
        for k, move in enumerate((line(1, a, b), line(2, b, c)))
    )
    chain = run(first, second)
    assert chain.transitions[0].reason is Reason.TOLERANCE
    assert require_smooth(chain) >= 2


@pytest.mark.parametrize("radius", [0.01, 0.1, 1.0])
def test_a_joint_move_between_edges_of_two_measures(radius: float) -> None:
    """In m along the TCP's path before it, in joint space after it: they never overlap."""
    turned = Q[1] + np.array([0.0, 0.02, -0.02, 0.9, 0.1, 0.4])  # the TCP's way is not even in the joints'
    chain = run(
        line(1, arm_pose(Q[0]), arm_pose(Q[1]), Corner(radius=radius)),
        joint(2, Q[1], turned, Corner(radius=radius)),
        joint(3, turned, Q[0], Corner()),
    )
    assert [t.reason for t in chain.transitions[:2]] == [Reason.ROUNDED] * 2
    assert require_smooth(chain) >= 4


def collinear_with_rate_jump() -> list[Move]:
    return [
        line(1, pose(0, 0, 0), pose(0.1, 0, 0, 30)),
        line(2, pose(0.1, 0, 0, 30), pose(0.2, 0, 0, 30, 20)),
    ]


def line_into_arc() -> list[Move]:
    r = 0.05
    s = r * np.sqrt(0.5)
    on_arc = position_only(0.1 + s, r - s, 0)
    return [
        line(1, pose(0, 0, 0), pose(0.1, 0, 0)),
        circle(2, pose(0.1, 0, 0), on_arc, pose(0.1 + r, r, 0, 0, 0, 90)),
        line(3, pose(0.1 + r, r, 0, 0, 0, 90), pose(0.1 + r, r + 0.1, 0, 0, 0, 90)),
    ]


def s_of_two_arcs() -> list[Move]:
    return [
        circle(1, pose(0, 0, 0), position_only(0.05, 0.05, 0), pose(0.1, 0, 0, 0, 10)),
        circle(2, pose(0.1, 0, 0, 0, 10), position_only(0.15, -0.05, 0), pose(0.2, 0, 0)),
    ]


def splines_among_others() -> list[Move]:
    a, b, c, d, e = (
        pose(*p)
        for p in ((0, 0, 0), (0.1, 0.02, 0), (0.2, 0.1, 0, 20), (0.3, 0.1, 0.1), (0.4, 0, 0.1, 0, 0, 40))
    )
    return [
        line(1, a, b),
        spline(2, b, c),
        spline(3, c, d),
        spline(4, d, e),
        line(5, e, pose(0.5, -0.1, 0.1, 0, 0, 40)),
    ]


def splines_between_joint_moves() -> list[Move]:
    q = [*Q, Q[0] + 0.15]
    return [joint(1, q[0], q[1]), spline(2, arm_pose(q[1]), arm_pose(q[2])), joint(3, q[2], q[3])]


def joint_move_into_its_tangent() -> list[Move]:
    first = joint(1, Q[0], Q[1])
    end = arm_pose(Q[1])
    h = 1e-4 * (Q[1] - Q[0])
    along = arm_pose(Q[1] + h).position - arm_pose(Q[1] - h).position
    target = Pose(end.position + 0.2 * along / np.linalg.norm(along), end.quaternion)
    return [first, line(2, end, target)]


def nearly_parallel_joint_moves() -> list[Move]:
    step = Q[1] - Q[0]
    bent = Q[1] + step + 5e-4 * np.array([1, -1, 0, 0, 0.5, 0])
    return [joint(1, Q[0], Q[1]), joint(2, Q[1], bent)]


@pytest.mark.parametrize(
    "made",
    [
        collinear_with_rate_jump,
        line_into_arc,
        s_of_two_arcs,
        splines_among_others,
        splines_between_joint_moves,
        joint_move_into_its_tangent,
        nearly_parallel_joint_moves,
    ],
)
def test_tangential_transitions(made: Callable[[], list[Move]]) -> None:
    moves = made()
    chain = run(*moves)
    inner = chain.transitions[:-1]
    assert [t.reason for t in inner] == [Reason.TOLERANCE] * (len(moves) - 1)
    assert all(t.effective > 0.0 and not t.stop for t in inner)
    require_smooth(chain)
    assert deviation(chain.pieces, moves) <= TOLERANCE * (1.0 + 1e-6)


@pytest.mark.parametrize("made", [collinear_with_rate_jump, line_into_arc, s_of_two_arcs])
def test_tolerance_zero_stops(made: Callable[[], list[Move]]) -> None:
    chain = run(*made(), tolerance=0.0)
    assert all(t.reason is Reason.NO_TOLERANCE and t.stop for t in chain.transitions[:-1])


def test_wider_tolerance_gives_wider_edges_up_to_half_of_the_shorter_motion() -> None:
    widths = [run(*line_into_arc(), tolerance=t).transitions[0].effective for t in (1e-6, 1e-5, 1e-4, 1.0)]
    assert widths == sorted(widths)
    assert widths[-1] == pytest.approx(0.25 * np.pi * 0.05)
    # Curvature jumps: the deviation grows with the square of the distance or quicker, and is used.
    assert widths[1] / widths[0] > 10 ** (1 / 3) * 0.8


def deviation(pieces: list[Piece], moves: list[Move]) -> float:
    """Largest distance of the path from the programmed one, both sampled densely, by brute force."""
    exact = run(*moves, tolerance=0.0).pieces
    reference = np.concatenate([p.poses(np.linspace(0, p.length, 4001)).position for p in exact])
    worst = 0.0
    for piece in pieces:
        for point in piece.poses(np.linspace(0, piece.length, 41)).position:
            distances = np.linalg.norm(reference - point, axis=1)
            near = int(np.argmin(distances))
            worst = max(worst, to_polyline(point, reference[max(near - 3, 0) : near + 4]))
    return worst


def to_polyline(point: np.ndarray, corners: np.ndarray) -> float:
    best = np.inf
    for a, b in pairwise(corners):
        length = float((b - a) @ (b - a))
        t = 0.0 if length == 0.0 else min(max(float((point - a) @ (b - a)) / length, 0.0), 1.0)
        best = min(best, float(np.linalg.norm(point - a - t * (b - a))))
    return best


@pytest.mark.parametrize("seed", range(SEED, SEED + 25))
def test_random_programs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = rng.choice(np.array(list(MoveKind), dtype=object), size=12)
    q = Q[0] + np.cumsum(rng.uniform(-0.25, 0.25, (13, 6)), axis=0)
    moves = []
    for i, kind in enumerate(kinds):
        radius = float(10 ** rng.uniform(-4, -0.5)) if rng.random() < 0.8 else None
        moves.append(move_between(kind, i, q[i], q[i + 1], Corner(radius=radius)))
    chain = run(*moves)
    require_smooth(chain, f"seed {seed}:")
    path = path_of(chain)
    ends = [path.place(i) for i in range(12)]
    assert ends == sorted(ends), f"seed {seed}"
    assert set(path.tags(np.linspace(0, path.end, 5000))) == set(range(12)), f"seed {seed}"
    final = path.poses(np.array([path.end])).position[0]
    np.testing.assert_allclose(final, moves[-1].target.position, atol=1e-9, err_msg=f"seed {seed}")
