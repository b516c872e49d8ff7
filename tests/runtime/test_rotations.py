"""Conversions between the descriptions of a rotation: inverse of one another, delicate cases included."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from both_cores import by_both
from viapoint.runtime import rotations as rot

SEED = 20240


@pytest.fixture(name="matrices", scope="module")
def fixture_matrices() -> rot.Floats:
    """Random rotations, half turns, tiny turns and both gimbal locks."""
    rng = np.random.default_rng(SEED)
    q = rng.normal(size=(2000, 4))
    q[:200, 0] = 0.0  # half turns
    q[200:220, 0] = 1e-14
    q[300:400, 1:] *= 1e-9  # tiny turns
    angles = rng.uniform(-np.pi, np.pi, (400, 3))
    angles[:, 1] = np.repeat([np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, 1e-7 - np.pi / 2], 100)
    special = rot.abc_to_matrix(
        np.array(np.meshgrid(*[[0, np.pi / 2, np.pi, -np.pi / 2]] * 3)).reshape(3, -1).T
    )
    return np.concatenate(
        (rot.quaternion_to_matrix(q / np.linalg.norm(q, axis=1)[:, None]), rot.abc_to_matrix(angles), special)
    )


def test_round_trips(matrices: rot.Floats) -> None:
    for there, back in (
        (rot.matrix_to_abc, rot.abc_to_matrix),
        (rot.matrix_to_quaternion, rot.quaternion_to_matrix),
        (rot.matrix_to_rotation_vector, rot.rotation_vector_to_matrix),
    ):
        np.testing.assert_allclose(
            back(there(matrices)), matrices, atol=3e-12, err_msg=f"{there.__name__} {SEED}"
        )


def test_against_pinocchio(matrices: rot.Floats) -> None:
    for R in matrices[::17]:
        quaternion = rot.matrix_to_quaternion(R)
        theirs = pin.Quaternion(R)
        assert abs(abs(quaternion @ [theirs.w, theirs.x, theirs.y, theirs.z]) - 1) < 1e-12
        if np.linalg.norm(theirs.vec()) < 1 - 1e-6:  # its logarithm is delicate at half turns
            np.testing.assert_allclose(rot.matrix_to_rotation_vector(R), pin.log3(R), atol=1e-7)


def test_abc_is_rz_ry_rx() -> None:
    a, b, c = 0.3, -0.7, 1.9
    expected = pin.utils.rotate("z", c) @ pin.utils.rotate("y", b) @ pin.utils.rotate("x", a)
    np.testing.assert_allclose(rot.abc_to_matrix([a, b, c]), expected, atol=1e-15)


@pytest.mark.parametrize("b", [np.pi / 2, -np.pi / 2])
def test_gimbal_lock_has_c_zero(b: float) -> None:
    a, b_back, c = rot.matrix_to_abc(rot.abc_to_matrix([0.4, b, 0.9]))
    assert c == 0.0
    assert b_back == pytest.approx(b, abs=1e-12)
    assert a == pytest.approx(0.4 - 0.9 * np.sign(b), abs=1e-12)  # F 2-20 with its sign corrected


def test_angle_between_orientations_is_the_full_angle() -> None:
    for angle in (0.0, 1e-9, 0.5, np.pi / 2, np.pi):
        q = rot.rotation_vector_to_quaternion(angle * np.array([0.6, 0.0, 0.8]))
        identity = np.array([1.0, 0.0, 0.0, 0.0])
        assert rot.quaternion_angle(identity, -q) == pytest.approx(angle, rel=1e-12)


def test_products_and_inverses(matrices: rot.Floats) -> None:
    q = rot.matrix_to_quaternion(matrices)
    product = rot.quaternion_to_matrix(rot.quaternion_multiply(q[:-1], q[1:]))
    np.testing.assert_allclose(product, matrices[:-1] @ matrices[1:], atol=1e-12)
    X = rot.make_pose(np.arange(3.0), matrices)
    np.testing.assert_allclose(rot.invert_pose(X) @ X, np.broadcast_to(np.eye(4), X.shape), atol=1e-12)
    assert (q[:, 0] >= -1e-12).all()


def test_compiled_conversions_are_those_of_the_twin() -> None:
    q = np.random.default_rng(5).normal(size=(4, 50, 4))
    q[0, :, 0] = 0.0
    q[0, :25, 3] = 0.0
    q[0, :9, 2] = 0.0
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    twin, compiled = by_both(lambda: rot.quaternion_to_matrix(q), "_rotations")
    assert np.abs(twin - compiled).max() <= 1e-15
    twin_products, products = by_both(
        lambda: rot.quaternion_multiply(q, rot.quaternion_conjugate(q[:, :1])), "_rotations"
    )
    assert products.shape == q.shape
    assert np.array_equal(twin_products, products)
    back, compiled = by_both(lambda: rot.matrix_to_quaternion(twin), "_rotations")
    assert np.abs(back - compiled).max() <= 1e-15
    one = by_both(lambda: rot.matrix_to_quaternion(twin[2, 7]), "_rotations")
    assert np.abs(one[0] - back[2, 7]).max() <= 1e-15
    assert np.abs(one[1] - back[2, 7]).max() <= 1e-15
