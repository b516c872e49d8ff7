"""Independent oracles: the arms as pinocchio models built joint by joint, and a numeric IK."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from viapoint.runtime.robots import Robot
from viapoint.runtime.rotations import Floats, invert_pose, matrix_to_rotation_vector

MM = 1e-3
Row = tuple[str, tuple[float, float, float]]

FRIGENI6: Sequence[Row] = (
    ("z", (0, 0, 650)),
    ("y", (400, 0, 680)),
    ("y", (0, 0, 1100)),
    ("x", (766, 0, 230)),
    ("y", (345, 0, 0)),
    ("x", (244, 0, 0)),
)
# Denavit-Hartenberg rows alpha, a, theta0, d (deg, mm).
IRB1400_MODIFIED = (
    (0, 0, 0, 475),
    (90, 150, 90, 0),
    (0, 600, 0, 0),
    (90, 120, 0, 720),
    (-90, 0, 0, 0),
    (90, 0, 0, 85),
)
IRB140_STANDARD = (
    (-90, 70, 0, 352),
    (0, -360, 90, 0),
    (90, 0, 0, 0),
    (-90, 0, 0, 380),
    (90, 0, 0, 0),
    (0, 0, 0, 65),
)


def _placement(alpha: float, a: float) -> pin.SE3:
    return pin.SE3(pin.utils.rotate("x", np.radians(alpha)), np.array([a * MM, 0.0, 0.0]))


def _screw(theta: float, d: float) -> pin.SE3:
    return pin.SE3(pin.utils.rotate("z", np.radians(theta)), np.array([0.0, 0.0, d * MM]))


def _revolute(axis: str) -> pin.JointModel:
    return {"x": pin.JointModelRX, "y": pin.JointModelRY, "z": pin.JointModelRZ}[axis]()


def pin_model(name: str) -> tuple[pin.Model, pin.SE3]:
    """The model and the flange's placement on the last joint."""
    model, parent = pin.Model(), 0
    if name == "frigeni6":
        for i, (axis, offset) in enumerate(FRIGENI6):
            # In F's chain the offset comes before its joint, except the last, which comes after joint 6.
            offset = offset if i < 5 else (0, 0, 0)
            placement = pin.SE3(np.eye(3), MM * np.array(offset, dtype=float))
            parent = model.addJoint(parent, _revolute(axis), placement, f"J{i + 1}")
        return model, pin.SE3(np.eye(3), np.array([244 * MM, 0.0, 0.0]))
    flange = pin.SE3.Identity()
    modified = name == "irb1400"
    for i, (alpha, a, theta0, d) in enumerate(IRB1400_MODIFIED if modified else IRB140_STANDARD):
        before = flange * _placement(alpha, a) if modified else flange
        parent = model.addJoint(parent, _revolute("z"), before * _screw(theta0, 0.0), f"J{i + 1}")
        flange = _screw(0.0, d) if modified else _screw(0.0, d) * _placement(alpha, a)
    return model, flange


def pin_fk_and_jacobian(name: str, q: Floats) -> tuple[Floats, Floats]:
    """One joint vector → X_base_flange (4, 4) and the base-frame Jacobian (6, 6) of the flange."""
    model, flange = pin_model(name)
    frame = model.addFrame(pin.Frame("flange", 6, flange, pin.FrameType.OP_FRAME))
    data = model.createData()
    J = pin.computeFrameJacobian(model, data, q, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[frame].homogeneous, J


def pose_error(X: Floats, Y: Floats) -> Floats:
    """(..., 6): translation (m) and rotation vector (rad) between poses, in X's frame."""
    difference = invert_pose(X) @ Y
    return np.concatenate(
        (difference[..., :3, 3], matrix_to_rotation_vector(difference[..., :3, :3])), axis=-1
    )


def numeric_solutions(robot: Robot, X: Floats, starts: Floats, *, steps: int = 60) -> Floats:
    """Damped Newton from every start at once: those (k, 6) that arrived, wrapped to ±π."""
    q = starts.copy()
    for _ in range(steps):
        here = robot.fk(q)
        error = pose_error(here, np.broadcast_to(X, here.shape))
        twist = np.concatenate(
            ((here[:, :3, :3] @ error[:, :3, None])[..., 0], (here[:, :3, :3] @ error[:, 3:, None])[..., 0]),
            axis=-1,
        )
        J = robot.jacobian(q)
        damped = J @ np.swapaxes(J, -1, -2) + 1e-12 * np.eye(6)
        step = (np.swapaxes(J, -1, -2) @ np.linalg.solve(damped, twist[..., None]))[..., 0]
        q += np.clip(step, -0.5, 0.5)
    arrived = np.abs(pose_error(robot.fk(q), np.broadcast_to(X, (len(q), 4, 4)))).max(axis=1) < 1e-10
    return wrap(q[arrived])


def wrap(q: Floats) -> Floats:
    """Angles modulo full turns, in −π … π."""
    wrapped: Floats = q - 2 * np.pi * np.rint(q / (2 * np.pi))
    return wrapped
