"""Rotations and poses as arrays: Euler angles A B C, matrices, quaternions, rotation vectors.

Batched numpy, batch first, radians and metres. Quaternions are w x y z. No interpolation and no
robot: curves of orientation belong to the path, kinematics to the robots. `_rotations` has the conversions
of batches compiled.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from viapoint.runtime.core import chosen

Floats = npt.NDArray[np.float64]

# Below this cos B the angles A and C cannot be told apart: C := 0, and the matrix recomposed from the
# angles differs from the given one by no more than this.
GIMBAL_LOCK = 1e-12
# |w| below this is a half turn up to rounding; the axis then has two equally good signs.
HALF_TURN = 1e-12
# Below this angle sin(x)/x equals its series 1 − x²/6 to double precision.
SMALL_ANGLE = 1e-4
_CORE = "_rotations"


def abc_to_matrix(abc: npt.ArrayLike) -> Floats:
    """(..., 3) A B C in rad → (..., 3, 3): R = Rz(C)·Ry(B)·Rx(A), fixed axes (F 2-15)."""
    angles = np.asarray(abc, dtype=np.float64)
    c, s = np.cos(angles), np.sin(angles)
    (cx, cy, cz), (sx, sy, sz) = _components(c), _components(s)
    R = np.empty((*angles.shape[:-1], 3, 3))
    R[..., 0, 0] = cz * cy
    R[..., 0, 1] = cz * sy * sx - sz * cx
    R[..., 0, 2] = sz * sx + cz * sy * cx
    R[..., 1, 0] = sz * cy
    R[..., 1, 1] = cz * cx + sz * sy * sx
    R[..., 1, 2] = sz * sy * cx - cz * sx
    R[..., 2, 0] = -sy
    R[..., 2, 1] = cy * sx
    R[..., 2, 2] = cy * cx
    return R


def _components(v: Floats) -> tuple[Floats, ...] | list[float]:
    """The components of (..., k), as numbers where v is one vector: those are quicker."""
    return v.tolist() if v.ndim == 1 else tuple(np.moveaxis(v, -1, 0))


def matrix_to_abc(R: Floats) -> Floats:
    """(..., 3, 3) → (..., 3) A B C in rad, B in −π/2 … π/2; where cos B = 0, C = 0.

    A follows from the rows of Rz(−C)·R, not from R32 and R33 (F 2-17): those lose their digits near
    B = ±90°, and at B = −90° this also has the right signs (F 2-20 prints them wrong).
    """
    cos_b = np.hypot(R[..., 0, 0], R[..., 1, 0])
    locked = cos_b < GIMBAL_LOCK
    c_angle = np.where(locked, 0.0, np.arctan2(R[..., 1, 0], R[..., 0, 0]))
    cc, sc = np.cos(c_angle), np.sin(c_angle)
    a_angle = np.arctan2(sc * R[..., 0, 2] - cc * R[..., 1, 2], cc * R[..., 1, 1] - sc * R[..., 0, 1])
    abc = np.stack((a_angle, np.arctan2(-R[..., 2, 0], cos_b), c_angle), axis=-1)
    return abc + 0.0  # no negative zeros


def matrix_to_quaternion(R: Floats) -> Floats:
    """(..., 3, 3) → (..., 4) unit quaternion, w ≥ 0.

    The matrix determines 4·q·qᵀ; its row with the largest diagonal element is q without cancellation,
    at 180° too (F 5-15 divides by zero there).
    """
    if (core := chosen(_CORE)) is not None:
        matrices = np.ascontiguousarray(R).reshape(-1, 3, 3)
        return np.asarray(core.matrix_to_quaternion(matrices)).reshape(*R.shape[:-2], 4)
    d = np.stack((R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]), axis=-1)
    outer = np.empty((*R.shape[:-2], 4, 4))
    outer[..., 0, 0] = 1.0 + d[..., 0] + d[..., 1] + d[..., 2]
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        outer[..., i + 1, i + 1] = 1.0 + d[..., i] - d[..., j] - d[..., k]
        outer[..., 0, i + 1] = outer[..., i + 1, 0] = R[..., k, j] - R[..., j, k]
        outer[..., j + 1, k + 1] = outer[..., k + 1, j + 1] = R[..., k, j] + R[..., j, k]
    best = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, best[..., None, None], axis=-2)[..., 0, :]
    return canonical_quaternion(q / np.linalg.norm(q, axis=-1, keepdims=True))


def canonical_quaternion(q: Floats) -> Floats:
    """Of q and −q, the same rotation, the one with w > 0; at a half turn the one with z, y or x > 0."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    leader = w
    for component in (z, y, x):
        leader = np.where(np.abs(leader) < HALF_TURN, component, leader)
    return np.where((leader < 0.0)[..., None], -q, q)


def quaternion_to_matrix(q: Floats) -> Floats:
    """(..., 4) unit quaternion → (..., 3, 3)."""
    if (core := chosen(_CORE)) is not None:
        quaternions = np.ascontiguousarray(q).reshape(-1, 4)
        return np.asarray(core.quaternion_to_matrix(quaternions)).reshape(*q.shape[:-1], 3, 3)
    w, x, y, z = np.moveaxis(q, -1, 0)
    R = np.empty((*q.shape[:-1], 3, 3))
    R[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    R[..., 0, 1] = 2.0 * (x * y - w * z)
    R[..., 0, 2] = 2.0 * (x * z + w * y)
    R[..., 1, 0] = 2.0 * (x * y + w * z)
    R[..., 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    R[..., 1, 2] = 2.0 * (y * z - w * x)
    R[..., 2, 0] = 2.0 * (x * z - w * y)
    R[..., 2, 1] = 2.0 * (y * z + w * x)
    R[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return R


def quaternion_multiply(a: Floats, b: Floats) -> Floats:
    """Hamilton product (..., 4): the rotation b followed by a, as R(a)·R(b)."""
    if (core := chosen(_CORE)) is not None:
        shape = np.broadcast_shapes(a.shape, b.shape)
        rows = (np.ascontiguousarray(np.broadcast_to(q, shape)).reshape(-1, 4) for q in (a, b))
        return np.asarray(core.quaternion_multiply(*rows)).reshape(shape)
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ),
        axis=-1,
    )


def quaternion_conjugate(q: Floats) -> Floats:
    """(..., 4): the opposite rotation."""
    conjugate: Floats = q * np.array([1.0, -1.0, -1.0, -1.0])
    return conjugate


def quaternion_angle(a: Floats, b: Floats) -> Floats:
    """(..., 4), (..., 4) → (...) full angle in 0 … π between two orientations.

    Twice the angle of F 5-12, and by atan2, which keeps its digits for small angles.
    """
    relative = quaternion_multiply(quaternion_conjugate(a), b)
    angle: Floats = 2.0 * np.arctan2(np.linalg.norm(relative[..., 1:], axis=-1), np.abs(relative[..., 0]))
    return angle


def quaternion_to_rotation_vector(q: Floats) -> Floats:
    """(..., 4) unit quaternion → (..., 3) axis times angle, angle in 0 … π: the logarithm."""
    w, v = q[..., 0], q[..., 1:]
    sine = np.linalg.norm(v, axis=-1)
    angle = 2.0 * np.arctan2(sine, np.abs(w))
    # q and −q are one rotation; at w = 0 the vector part's own sign stands.
    scale = np.where(w < 0.0, -1.0, 1.0) * np.divide(
        angle, sine, out=np.full_like(sine, 2.0), where=sine > 0.0
    )
    vector: Floats = v * scale[..., None]
    return vector


def rotation_vector_to_quaternion(v: Floats) -> Floats:
    """(..., 3) axis times angle → (..., 4) unit quaternion: the exponential."""
    half = 0.5 * np.linalg.norm(v, axis=-1)
    small = half < SMALL_ANGLE
    safe = np.where(small, 1.0, half)
    scale = 0.5 * np.where(small, 1.0 - half * half / 6.0, np.sin(safe) / safe)
    return np.concatenate((np.cos(half)[..., None], v * scale[..., None]), axis=-1)


def matrix_to_rotation_vector(R: Floats) -> Floats:
    """(..., 3, 3) → (..., 3) axis times angle, good to rounding from 0 to 180° inclusive."""
    return quaternion_to_rotation_vector(matrix_to_quaternion(R))


def rotation_vector_to_matrix(v: Floats) -> Floats:
    """(..., 3) axis times angle → (..., 3, 3)."""
    return quaternion_to_matrix(rotation_vector_to_quaternion(v))


def make_pose(position: npt.ArrayLike, R: npt.ArrayLike) -> Floats:
    """(..., 3) m and (..., 3, 3) → homogeneous (..., 4, 4)."""
    p, rotation = np.asarray(position, dtype=np.float64), np.asarray(R, dtype=np.float64)
    X = np.zeros((*np.broadcast_shapes(p.shape[:-1], rotation.shape[:-2]), 4, 4))
    X[..., :3, :3] = rotation
    X[..., :3, 3] = p
    X[..., 3, 3] = 1.0
    return X


def pose_from_xyzabc(xyz: npt.ArrayLike, abc: npt.ArrayLike) -> Floats:
    """(..., 3) m and (..., 3) rad → (..., 4, 4)."""
    return make_pose(xyz, abc_to_matrix(abc))


def invert_pose(X: Floats) -> Floats:
    """(..., 4, 4) X_a_b → X_b_a (F 4-28)."""
    if X.ndim == 2:
        inverse, R = np.zeros((4, 4)), X[:3, :3].T
        inverse[:3, :3], inverse[:3, 3], inverse[3, 3] = R, -(R @ X[:3, 3]), 1.0
        return inverse
    R_inverse = np.swapaxes(X[..., :3, :3], -1, -2)
    return make_pose(-(R_inverse @ X[..., :3, 3:])[..., 0], R_inverse)
