"""What a run of a random program must keep: ranges, limits, geometry and end, by independent kinematics.

Used by the tests with some seeds, and by `benchmarks/random_programs.py` with as many as wanted.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from programs_at_random import TOOLS, Arm, Floats, Programmed, Step

from session_runs import Run

ON_PATH = 1e-9
"""m from the programmed line or circle: 1e-6 mm."""

ON_ORIENTATION = 1e-8
"""rad."""

EVERY = 7
"""One tick in so many is checked against the independent kinematics."""

EDGE_MARGIN = 1.0 + 1e-9


def assert_keeps_all(done: Run, program: Programmed, arm: Arm, say: str) -> None:
    """Limits, ranges, path and end of a run; where it was refused, where the robot stands then."""
    assert not done.over_limits(), f"{done.over_limits()} {say}"
    assert_inside_ranges(done, say)
    assert_follows(done, program, arm, say)
    if done.code is not None:
        assert done.code.startswith("E3"), say
        assert_refused_in_time(done, program, arm, say)
    elif done.status == "finished":
        reached = arm.flange(done.joints[-1])
        assert np.abs(reached - program.X_flange).max() < ON_ORIENTATION, say


def assert_inside_ranges(done: Run, say: str) -> None:
    q, limits = done.joints, done.session.cell.robot.limits
    assert np.isfinite(q).all(), say
    assert (q >= limits.lower - 1e-9).all(), say
    assert (q <= limits.upper + 1e-9).all(), say


def assert_refused_in_time(done: Run, program: Programmed, arm: Arm, say: str) -> None:
    """The robot stands before the motion that cannot be run, or on the round edge that leads into it."""
    step = next((step for step in program.steps if step.line == done.failed_line), None)
    assert step is not None, say
    edges = [c.transition.effective for c in done.session.corners if c.next_line == step.line]
    X = arm.flange(done.joints[-1]) @ TOOLS[step.tool]
    inside = float(np.linalg.norm(X[:3, 3] - step.start[:3, 3]))
    assert inside <= max(edges, default=0.0) + ON_PATH, f"it stands {inside} m in line {step.line}. {say}"


def assert_follows(done: Run, program: Programmed, arm: Arm, say: str) -> None:
    """Outside its round edges every line and circle is where it was programmed."""
    q, lines = done.joints, done.column("line")
    before = 0.0
    edges = {corner.line: corner.transition.effective for corner in done.session.corners}
    for step in program.steps:
        after = edges.get(step.line, 0.0)
        ticks = np.flatnonzero(lines == step.line)[::EVERY]
        X = np.array([arm.flange(q[k]) @ TOOLS[step.tool] for k in ticks]).reshape(-1, 4, 4)
        far = (distances(X, step.start) > before * EDGE_MARGIN) & (
            distances(X, step.target) > after * EDGE_MARGIN
        )
        if step.command == "ML":
            assert_on_line(X[far], step, say)
        elif step.command == "MC":
            assert_on_circle(X[far], step, say)
        before = after


def distances(X: Floats, X_from: Floats) -> Floats:
    """(N,) m."""
    return np.asarray(np.linalg.norm(X[:, :3, 3] - X_from[:3, 3], axis=1))


def assert_on_line(X: Floats, step: Step, say: str) -> None:
    a, b = step.start[:3, 3], step.target[:3, 3]
    length = float(np.linalg.norm(b - a))
    share = (X[:, :3, 3] - a) @ (b - a) / length**2 if length > 1e-6 else np.zeros(len(X))
    off = np.linalg.norm(X[:, :3, 3] - a - share[:, None] * (b - a), axis=1).max(initial=0.0)
    assert off < ON_PATH, f"{off} m beside line {step.line}. {say}"
    whole = rotation_vector(step.start[:3, :3].T @ step.target[:3, :3])
    if length < 1e-6 or np.linalg.norm(whole) > 3.1:
        return
    for k, R in enumerate(X[:, :3, :3]):
        turned = rotation_vector(step.start[:3, :3].T @ R)
        assert np.abs(turned - share[k] * whole).max() < ON_ORIENTATION, f"turned in line {step.line}. {say}"


def assert_on_circle(X: Floats, step: Step, say: str) -> None:
    assert step.via is not None
    a, q, b = step.start[:3, 3], step.via, step.target[:3, 3]
    normal = np.cross(q - a, b - a)
    normal /= np.linalg.norm(normal)
    # the centre has equal distances to the three points, and lies in their plane
    centre = np.linalg.solve(
        np.array([q - a, b - a, normal]),
        np.array([0.5 * (q @ q - a @ a), 0.5 * (b @ b - a @ a), normal @ a]),
    )
    p = X[:, :3, 3] - centre
    off = (
        np.abs(p @ normal).max(initial=0.0),
        np.abs(np.linalg.norm(p, axis=1) - np.linalg.norm(a - centre)).max(initial=0.0),
    )
    assert max(off) < ON_PATH, f"{off} m beside the circle of line {step.line}. {say}"


def rotation_vector(R: Floats) -> Floats:
    return np.asarray(pin.log3(R))
