"""Moves for the tests of the path, and an arm of their own kinematics (scipy rotations, no robot model)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation
from whole_path import Path

from viapoint.runtime.path import Chain, Corner, Move, MoveKind, Piece, Pose, Poses

TOLERANCE = 2e-5


def quaternions(rotation: Rotation) -> np.ndarray:
    return np.roll(rotation.as_quat(), 1, axis=-1)


def rotation(quaternion: np.ndarray) -> Rotation:
    return Rotation.from_quat(np.roll(quaternion, -1, axis=-1))


def pose(x: float, y: float, z: float, a: float = 0.0, b: float = 0.0, c: float = 0.0) -> Pose:
    """m and degrees; fixed axes."""
    return Pose(np.array([x, y, z], dtype=float), quaternions(Rotation.from_euler("xyz", [a, b, c], True)))


def position_only(x: float, y: float, z: float) -> Pose:
    return Pose(np.array([x, y, z], dtype=float), None)


def arm(q: np.ndarray) -> Poses:
    """Six revolute joints z y y x y x: (N, 6) → poses."""
    R, p = Rotation.identity(len(q)), np.zeros((len(q), 3))
    links = [
        ("z", (0.4, 0, 0.65)),
        ("y", (0, 0, 0.68)),
        ("y", (0.77, 0, 0.23)),
        ("x", (0.1, 0, 0)),
        ("y", (0.34, 0, 0)),
        ("x", (0.1, 0, 0.05)),
    ]
    for i, (axis, link) in enumerate(links):
        R = R * Rotation.from_euler(axis, q[:, i : i + 1])
        p = p + R.apply(np.tile(link, (len(q), 1)))
    return Poses(p, quaternions(R))


def arm_pose(q: np.ndarray) -> Pose:
    poses = arm(np.asarray(q)[None])
    return Pose(poses.position[0], poses.quaternion[0])


def line(tag: int, start: Pose, target: Pose, corner: Corner | None = None) -> Move:
    return Move(kind=MoveKind.LINE, tag=tag, start=start, target=target, corner=corner or Corner())


def spline(tag: int, start: Pose, target: Pose, corner: Corner | None = None) -> Move:
    return Move(kind=MoveKind.SPLINE, tag=tag, start=start, target=target, corner=corner or Corner())


def circle(
    tag: int, start: Pose, via: Pose, target: Pose, angle: float | None = None, corner: Corner | None = None
) -> Move:
    return Move(
        kind=MoveKind.CIRCLE,
        tag=tag,
        start=start,
        via=via,
        target=target,
        angle=angle,
        corner=corner or Corner(),
    )


def joint(tag: int, q_start: np.ndarray, q_target: np.ndarray, corner: Corner | None = None) -> Move:
    return Move(
        kind=MoveKind.JOINT,
        tag=tag,
        start=arm_pose(q_start),
        target=arm_pose(q_target),
        q_start=np.asarray(q_start, dtype=float),
        q_target=np.asarray(q_target, dtype=float),
        fk=arm,
        corner=corner or Corner(),
    )


def run(*moves: Move, tolerance: float = TOLERANCE) -> Chain:
    chain = Chain(tolerance=tolerance)
    for move in moves:
        chain.push(move)
    chain.close()
    return chain


def path_of(chain: Chain) -> Path:
    path = Path()
    path.extend(chain)
    return path


def end_derivatives(
    f: Callable[[np.ndarray], np.ndarray], w: float, h: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value, first and second derivative at w from one side only: w, w + h, … (h may be negative)."""
    k = np.arange(8.0)
    values = f(w + k * h)
    fitted = np.polynomial.polynomial.polyfit(k, values - values[0], 7)
    return values[0], fitted[1] / h, 2.0 * fitted[2] / h**2


def local(piece: Piece, reference: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Position, rotation vector relative to a reference orientation, auxiliary axes, by w: (N, 6 + k)."""

    def values(w: np.ndarray) -> np.ndarray:
        p, q = piece.poses(w)
        pose = np.hstack((p, (rotation(q) * rotation(reference).inv()).as_rotvec()))
        return pose if piece.segment.auxiliary is None else np.hstack((pose, piece.auxiliary(w)))

    return values


def jumps(left: Piece, right: Piece) -> tuple[float, float, float]:
    """Largest jumps of pose, first and second derivative by w over a boundary.

    The second is relative to the bend of the pieces: a curvature that is not matched jumps by about that.
    """
    reference = right.poses(np.zeros(1)).quaternion[0]
    a = end_derivatives(local(left, reference), left.length, -0.04 * left.length)
    b = end_derivatives(local(right, reference), 0.0, 0.04 * right.length)
    scale = max(1.0 / min(left.length, right.length), np.abs(a[2]).max(), np.abs(b[2]).max())
    value, first, second = (float(np.abs(x - y).max()) for x, y in zip(a, b, strict=True))
    return value, first, second / scale


def require_smooth(chain: Chain, note: str = "") -> int:
    """C² at every boundary that is no stop; how many there were."""
    passed = 0
    for i, (left, right) in enumerate(zip(chain.pieces[:-1], chain.pieces[1:], strict=True)):
        if left.stop:
            continue
        value, first, second = jumps(left, right)
        told = f"{note} boundary {i}, tags {left.tag} and {right.tag}: {value:.1e} {first:.1e} {second:.1e}"
        assert value < 1e-9, told
        assert first < 1e-5, told
        assert second < 1e-4, told
        passed += 1
    return passed
