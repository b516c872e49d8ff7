"""The torques of the joints in the ticks that are sent, where the masses of the arm are known."""

from __future__ import annotations

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.records import Floats
from viapoint.runtime.robots.dynamics import STANDARD_GRAVITY, Dynamics, Load

_BEFORE = 2
"""Rows before a tick that its differences need."""


class TorqueMeter:
    """Follows the axes (n + k,) tick by tick; speeds and accelerations are backward differences."""

    def __init__(self, cell: Cell, axes: Floats) -> None:
        self.known = cell.robot.masses is not None
        """Whether there are masses to compute with."""
        self._cell = cell
        self._n = cell.robot.joint_count
        self._carrier = AuxiliaryAxes.of(cell).carrier
        self._past: Floats = np.tile(axes, (_BEFORE, 1))
        self._dynamics: dict[int, Dynamics] = {}

    def stand(self, axes: Floats) -> None:
        """The axes (1, n + k) are at rest there from the next tick on."""
        if self.known:
            self._past = np.repeat(axes, _BEFORE, axis=0)

    def feed(self, axes: Floats, tool: int) -> Floats:
        """Torques (N, n) of the next ticks (N, n + k), or (N, 0) where masses are not known."""
        if not self.known:
            return np.zeros((len(axes), 0))
        rows = np.concatenate((self._past, axes))
        self._past = rows[-_BEFORE:]
        tick, n = self._cell.tick, self._n
        first, second = np.diff(rows[1:], axis=0) / tick, np.diff(rows, n=2, axis=0) / tick**2
        base = np.zeros((len(axes), 3))
        if self._carrier is not None:
            base[:, 0] = second[:, n + self._carrier]
        return self._of(tool).torques(axes[:, :n], first[:, :n], second[:, :n], base)

    def _of(self, tool: int) -> Dynamics:
        if tool not in self._dynamics:
            carried = self._cell.tools[tool]
            load = Load(carried.mass, carried.com, np.diag(carried.inertia))
            down = self._cell.X_world_base[:3, :3].T @ np.array([0.0, 0.0, -STANDARD_GRAVITY])
            self._dynamics[tool] = Dynamics(self._cell.robot, load, down)
        return self._dynamics[tool]
