"""What a held jog moves: joints and auxiliary axes, or the TCP along and about the axes of a space.

Both say which limits each of their coordinates has, and where a way in them leads. Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.rotations import invert_pose, rotation_vector_to_matrix

_PART: Final = 0.999
"""Part of the limits used: ticks are differenced, and rounding is part of a difference."""

_ACCELERATION_SHARE: Final = 0.5
"""Part of the joints' acceleration and jerk that a way of the TCP may use where it begins: further on, and by
the curvature of the joints' ways, the same way may need more of them."""

_SPEED_SHARE: Final = 0.8
"""The same of their speed: near a singular pose a jog slows down before a joint is at its limit."""

_LEAST_NEED: Final = 1e-9
"""rad/s per m/s, and the like: a joint that moves less bounds nothing."""


@dataclass(frozen=True, slots=True)
class Here:
    """Where the robot is: axes (n + k,), joints first, and the pose of its TCP X_base_tcp (4, 4)."""

    axes: Floats
    X: Floats


@dataclass(frozen=True, slots=True)
class Bounds:
    """Largest rate, acceleration and jerk of each coordinate, (m,) each."""

    rate: Floats
    acceleration: Floats
    jerk: Floats


@dataclass(frozen=True, slots=True)
class Placed:
    """Where a way leads, row by row: axes (N, n + k), TCP poses (N, 4, 4), and which rows can be reached."""

    axes: Floats
    X: Floats
    reachable: Bools


class Coordinates(Protocol):
    """What a jog counts its way in."""

    @property
    def count(self) -> int:
        """How many there are."""
        ...

    def bounds(self, here: Here, moving: Bools) -> Bounds:
        """What each may do where the robot is, while those that are `moving` (m,) share what they share."""
        ...

    def place(self, here: Here, way: Floats) -> Placed:
        """Where ways (N, m), counted from here, lead."""
        ...


class Drives:
    """The axes themselves: J1 …, then E1 …, each within its own limits."""

    def __init__(self, cell: Cell, tool: int) -> None:
        joints, others = cell.robot.limits, AuxiliaryAxes.of(cell).limits
        self._robot = cell.robot
        self._X_flange_tool = cell.tools[tool].X_flange_tool
        self._bounds = Bounds(
            _PART * np.append(joints.speed, others.speed),
            _PART * np.append(joints.acceleration, others.acceleration),
            _PART * np.append(joints.jerk, others.jerk),
        )

    @property
    def count(self) -> int:
        return len(self._bounds.rate)

    def bounds(self, here: Here, moving: Bools) -> Bounds:
        return self._bounds

    def place(self, here: Here, way: Floats) -> Placed:
        axes = here.axes + way
        X = self._robot.fk(axes[:, : self._robot.joint_count]) @ self._X_flange_tool
        return Placed(axes, X, np.ones(len(way), dtype=np.bool_))


class TcpAxes:
    """The TCP along, then about, the axes of R_base_space (3, 3), in one configuration of the robot."""

    def __init__(self, cell: Cell, tool: int, R: Floats, configuration: int) -> None:
        self.R = R
        self._robot = cell.robot
        self._path = cell.path_limits
        self._X_tool_flange = invert_pose(cell.tools[tool].X_flange_tool)
        self._configuration = configuration

    @property
    def count(self) -> int:
        return 6

    def bounds(self, here: Here, moving: Bools) -> Bounds:
        """Those of the path, and what the joints allow where the robot is."""
        path, joints = self._path, self._robot.limits
        needs = np.maximum(self._needs(here), _LEAST_NEED)  # (n, 6)
        sharing = max(int(moving.sum()), 1)
        along = np.repeat([True, False], 3)
        share = _PART / np.sqrt(sharing)
        acceleration = share * np.where(
            along, min(path.acceleration, path.deceleration), path.angular_acceleration
        )
        jerk = share * np.where(along, path.jerk, path.angular_jerk)
        part = _ACCELERATION_SHARE / sharing
        return Bounds(
            np.minimum(
                _PART * np.where(along, path.speed, path.angular_speed),
                _SPEED_SHARE * (joints.speed[:, None] / needs).min(axis=0),
            ),
            np.minimum(acceleration, part * (joints.acceleration[:, None] / needs).min(axis=0)),
            np.minimum(jerk, part * (joints.jerk[:, None] / needs).min(axis=0)),
        )

    def _needs(self, here: Here) -> Floats:
        """|joint speed| (n, 6) per rate of each coordinate."""
        n = self._robot.joint_count
        X_base_flange = here.X @ self._X_tool_flange
        lever = X_base_flange[:3, 3] - here.X[:3, 3]
        twists = np.zeros((6, 6))
        twists[:3, :3] = twists[3:, 3:] = self.R
        twists[:3, 3:] = np.cross(self.R.T, lever).T
        J = self._robot.jacobian(here.axes[:n])
        return np.asarray(np.abs(np.linalg.lstsq(J, twists, rcond=None)[0]))

    def place(self, here: Here, way: Floats) -> Placed:
        n = self._robot.joint_count
        X = np.tile(here.X, (len(way), 1, 1))
        X[:, :3, 3] += way[:, :3] @ self.R.T
        X[:, :3, :3] = self._turned(way[:, 3:]) @ here.X[:3, :3]
        q, reachable, _ = self._robot.ik_path(X @ self._X_tool_flange, self._configuration, here.axes[:n])
        others = np.tile(here.axes[n:], (len(way), 1))
        return Placed(np.concatenate((q, others), axis=1), X, reachable)

    def _turned(self, angles: Floats) -> Floats:
        """(N, 3, 3) after angles (N, 3) about the axes of the space; about several, in small steps."""
        turning = np.flatnonzero(angles.any(axis=0))
        if len(turning) < 2:
            return rotation_vector_to_matrix(angles @ self.R.T)
        steps = rotation_vector_to_matrix(np.diff(angles, axis=0, prepend=0.0) @ self.R.T)
        R = np.empty_like(steps)
        turned = np.eye(3)
        for row, step in enumerate(steps):
            turned = R[row] = step @ turned
        return R
