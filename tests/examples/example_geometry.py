"""Independent geometry of the examples: forward kinematics of frigeni6, and the curves that motions program.

Nothing of viapoint's numerics is used here, only what the cell file says, in SI.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from viapoint.runtime.cell import Cell
from viapoint.vm.ports import Motion, MotionKind, Target

Floats = npt.NDArray[np.float64]
MM, DEG = 1e-3, np.pi / 180.0

# F table 3-1: the offset before each joint, and its axis; the flange lies 244 mm behind the last one.
CHAIN = (
    ((0, 0, 650), "z"),
    ((400, 0, 680), "y"),
    ((0, 0, 1100), "y"),
    ((766, 0, 230), "x"),
    ((345, 0, 0), "y"),
    ((0, 0, 0), "x"),
)
FLANGE = (244, 0, 0)


def rotation(axis: str, angle: Floats) -> Floats:
    """(N,) rad → (N, 3, 3)."""
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    rows = {
        "x": ((one, zero, zero), (zero, c, -s), (zero, s, c)),
        "y": ((c, zero, s), (zero, one, zero), (-s, zero, c)),
        "z": ((c, -s, zero), (s, c, zero), (zero, zero, one)),
    }[axis]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def pose(R: Floats, p: Floats) -> Floats:
    """(…, 3, 3) and (…, 3) → (…, 4, 4)."""
    X = np.zeros((*R.shape[:-2], 4, 4))
    X[..., :3, :3], X[..., :3, 3], X[..., 3, 3] = R, p, 1.0
    return X


def flange(q: Floats) -> Floats:
    """X_base_flange (N, 4, 4) of joints (N, 6)."""
    X = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for i, (offset, axis) in enumerate(CHAIN):
        X = (
            X
            @ pose(np.eye(3), MM * np.array(offset, dtype=float))
            @ pose(rotation(axis, q[:, i]), np.zeros(3))
        )
    return X @ pose(np.eye(3), MM * np.array(FLANGE, dtype=float))


def inverse(X: Floats) -> Floats:
    """Of one pose (4, 4)."""
    return pose(X[:3, :3].T, -X[:3, :3].T @ X[:3, 3])


def orientation(a: float, b: float, c: float) -> Floats:
    """R = Rz(C) Ry(B) Rx(A), deg."""
    x, y, z = (rotation(axis, np.array(v * DEG)) for axis, v in (("x", a), ("y", b), ("z", c)))
    return z @ y @ x


@dataclass(frozen=True)
class Line:
    """From start (3,) to end (3,)."""

    start: Floats
    end: Floats

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.end - self.start))

    def locate(self, p: Floats) -> tuple[Floats, Floats]:
        """(N, 3) → distance from the curve (N,), and place along it (N,), m."""
        along = (self.end - self.start) / self.length
        u = np.clip((p - self.start) @ along, 0.0, self.length)
        return np.linalg.norm(p - self.start - u[:, None] * along, axis=1), u


@dataclass(frozen=True)
class Circle:
    """Through start, via and target; `turn` rad if H gives it."""

    start: Floats
    via: Floats
    target: Floats
    turn: float | None

    def __post_init__(self) -> None:
        assert np.linalg.norm(np.cross(self.via - self.start, self.target - self.start)) > 0.0

    @property
    def center(self) -> Floats:
        """Equally far from the three points and in their plane: three linear equations."""
        a, b = self.via - self.start, self.target - self.start
        rows = np.stack((a, b, np.cross(a, b)))
        return self.start + np.linalg.solve(rows, np.array([a @ a / 2.0, b @ b / 2.0, 0.0]))

    @property
    def axis(self) -> Floats:
        n = np.cross(self.via - self.start, self.target - self.start)
        return n / np.linalg.norm(n)

    @property
    def radius(self) -> float:
        return float(np.linalg.norm(self.start - self.center))

    def angle(self, p: Floats) -> Floats:
        """(N, 3) → 0 … 2π from the start, in the sense of via."""
        x = (self.start - self.center) / self.radius
        y = np.cross(self.axis, x)
        r = p - self.center
        return np.arctan2(r @ y, r @ x) % (2.0 * np.pi)

    @property
    def swept(self) -> float:
        """Signed angle of the arc."""
        return self.turn if self.turn is not None else float(self.angle(self.target[None])[0])

    @property
    def length(self) -> float:
        return self.radius * abs(self.swept)

    @property
    def end(self) -> Floats:
        x = self.start - self.center
        return self.center + np.cos(self.swept) * x + np.sin(self.swept) * np.cross(self.axis, x)

    def locate(self, p: Floats) -> tuple[Floats, Floats]:
        """(N, 3) in order → distance from the curve (N,), and place along it (N,), m."""
        r = p - self.center
        height = r @ self.axis
        flat = np.linalg.norm(r - height[:, None] * self.axis, axis=1)
        angle = np.unwrap(np.sign(self.swept) * self.angle(p))
        angle -= 2.0 * np.pi * np.round(angle[0] / (2.0 * np.pi))  # it begins near the start
        return np.hypot(flat - self.radius, height), self.radius * angle


Curve = Line | Circle


class Programmed:
    """Follows motions in program order: where each ends, and its curve if it is a line or a circle."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._flange = flange(np.asarray(cell.home, dtype=float)[None])[0]

    def motion(self, motion: Motion) -> Curve | None:
        """The curve of the TCP with the motion's tool; None for joint moves, splines and no motion at all."""
        X_flange_tool = self._cell.tools[motion.tool].X_flange_tool
        start = self._flange @ X_flange_tool
        end = self._target(motion.target, motion, start, X_flange_tool)
        curve: Curve | None = None
        if motion.kind is MotionKind.LINE and np.linalg.norm(end[:3, 3] - start[:3, 3]) > 1e-9:
            curve = Line(start[:3, 3], end[:3, 3])
        elif motion.kind is MotionKind.CIRCLE:
            assert motion.via is not None
            via = self._target(motion.via, motion, start, X_flange_tool)
            turn = None if motion.angle is None else motion.angle * DEG
            curve = Circle(start[:3, 3], via[:3, 3], end[:3, 3], turn)
            if turn is not None:
                assert np.allclose(start[:3, :3], end[:3, :3]), "orientation with H is not followed here"
            end = pose(end[:3, :3], curve.end)
        self._flange = end @ inverse(X_flange_tool)
        return curve

    @property
    def flange(self) -> Floats:
        """X_base_flange (4, 4) at the end of the last motion."""
        return self._flange

    def _target(self, target: Target, motion: Motion, start: Floats, X_flange_tool: Floats) -> Floats:
        """X_base_tcp (4, 4)."""
        X_base_frame = self._cell.frames[motion.frame].X_base_frame
        if motion.kind is MotionKind.HOME:
            return flange(np.asarray(self._cell.home, dtype=float)[None])[0] @ X_flange_tool
        if target.point is not None:
            point = self._cell.points[target.point]
            if point.joints is not None:
                return flange(point.joints[None])[0] @ X_flange_tool
            return X_base_frame @ point.pose
        assert target.coordinates, "the examples program points or coordinates"
        given = dict(target.coordinates)
        X = inverse(X_base_frame) @ start
        for i, name in enumerate("XYZ"):
            X[i, 3] = given[name] * MM if name in given else X[i, 3]
        if any(name in given for name in "ABC"):
            X[:3, :3] = orientation(given["A"], given["B"], given["C"])
        return X_base_frame @ X
