"""What keeps a jog from going on: ticks to come are looked at before the first of them is sent."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.guard import PLANNED, where
from viapoint.runtime.kernel.jogaxes import Placed
from viapoint.runtime.records import Floats
from viapoint.runtime.workspace import TOUCH, Monitor, Ticks, Violation, Watch

_HISTORY: Final = 3
_QUANTITIES: Final = ("speed", "acceleration", "jerk")
_ROUNDING: Final = 1.0 + 1e-6
"""Of differences over a tick to a limit."""

_NEAR: Final = 0.3
"""rad, and m for lengths: a singular pose nearer than this is named as the reason of a joint's speed."""


class Obstacle(NamedTuple):
    """Why a tick cannot be sent. `is_place`: it is where it is, at whatever speed the robot comes."""

    code: str
    reason: str
    is_place: bool


class Lookout:
    """Knows the ticks that were sent, and looks at those that may come after them."""

    def __init__(self, cell: Cell, monitor: Monitor, axes: Floats, tool: int) -> None:
        """`axes` (n + k,): where the robot stands."""
        joints, others = cell.robot.limits, AuxiliaryAxes.of(cell).limits
        self._cell = cell
        self._tool = tool
        self._n = cell.robot.joint_count
        self._names = [f"J{i + 1}" for i in range(self._n)]
        self._names += [AuxiliaryAxes.of(cell).name(k) for k in range(len(others.lower))]
        self._ranges = joints, others
        self._limits = [
            np.append(joints.speed, others.speed),
            np.append(joints.acceleration, others.acceleration),
            np.append(joints.jerk, others.jerk),
        ]
        self._past: Floats = np.tile(axes, (_HISTORY, 1))
        self._monitor = monitor if monitor.active else None
        self._floor: Floats | None = None  # clearances (K,) where the robot began, if it broke a rule there
        if self._monitor is not None:
            clearances = self._monitor.clearances(axes[None, : self._n], tool)[0][0]
            self._floor = np.minimum(clearances, 0.0) if (clearances < -TOUCH).any() else None

    def sent(self, rows: Floats) -> None:
        """Rows (N, n + k) went out."""
        self._past = np.concatenate((self._past, rows))[-_HISTORY:]

    def wrong(self, placed: Placed, factor: float) -> Obstacle | None:
        """What is wrong with the first tick that cannot be sent; `factor` of acceleration and jerk limits."""
        found = [
            each
            for each in (
                self._out_of_reach(placed),
                self._out_of_range(placed.axes),
                self._too_fast(placed.axes, factor),
                self._breaks_rule(placed.axes[:, : self._n]),
            )
            if each is not None
        ]
        return min(found, key=lambda each: each[0])[1] if found else None

    def hardly_moves(self, axes: Floats) -> Obstacle:
        """What keeps the TCP from moving at more than a crawl, at axes (n + k,)."""
        return Obstacle("E304", f"the joints cannot follow{self._next_to(axes)}", False)

    def _out_of_reach(self, placed: Placed) -> tuple[int, Obstacle] | None:
        if placed.reachable.all():
            return None
        return int(np.argmin(placed.reachable)), Obstacle("E302", "the robot does not reach farther", True)

    def _out_of_range(self, axes: Floats) -> tuple[int, Obstacle] | None:
        joints, others = self._ranges
        inside = np.concatenate(
            (joints.contain(axes[:, : self._n]), others.contain(axes[:, self._n :])), axis=1
        )
        if inside.all():
            return None
        row = int(np.argmin(inside.all(axis=1)))
        k = int(np.argmin(inside[row]))
        low, high = np.append(joints.lower, others.lower)[k], np.append(joints.upper, others.upper)[k]
        prismatic = np.append(
            self._cell.robot.prismatic, [a.prismatic for a in AuxiliaryAxes.of(self._cell).axes]
        )[k]
        unit, name = (MM, "mm") if prismatic else (DEG, "deg")
        reason = f"{self._names[k]} comes to the end of its range {low / unit:g} … {high / unit:g} {name}"
        return row, Obstacle("E303" if k < self._n else "E307", reason, True)

    def _too_fast(self, axes: Floats, factor: float) -> tuple[int, Obstacle] | None:
        rows = np.concatenate((self._past, axes))
        first: tuple[int, Obstacle] | None = None
        for order, (limit, what) in enumerate(zip(self._limits, _QUANTITIES, strict=True), start=1):
            differences = np.diff(rows[_HISTORY - order :], n=order, axis=0) / self._cell.tick**order
            ratios = np.abs(differences) / (limit * (1.0 if order == 1 else factor))
            over = ~(ratios <= _ROUNDING)  # also where it is no number
            if not over.any():
                continue
            row = int(np.argmax(over.any(axis=1)))
            if first is None or row < first[0]:
                k = int(np.argmax(over[row]))
                first = row, self._cannot_follow(axes[row], k, what)
        return first

    def _cannot_follow(self, axes: Floats, k: int, what: str) -> Obstacle:
        near = self._next_to(axes) if k < self._n else ""
        return Obstacle("E304", f"{self._names[k]} would pass its {what} limit{near}", False)

    def _next_to(self, axes: Floats) -> str:
        measures = self._cell.robot.singularity(axes[: self._n]).measures
        name = min(measures, key=lambda each: abs(measures[each]), default=None)
        near = name is not None and abs(measures[name]) < _NEAR
        return f", next to the {name} singularity" if near else ""

    def _breaks_rule(self, joints: Floats) -> tuple[int, Obstacle] | None:
        monitor, tool = self._monitor, self._tool
        if monitor is None:
            return None
        if self._floor is None:
            motion = Ticks(joints, self._past[-1, : self._n], monitor.pace(tool))
            found = Watch(monitor).look(motion, tool).violation
            return None if found is None else (found.row, self._broken(found, joints))
        # out of where it stands, not deeper into it
        worse = monitor.clearances(joints, tool)[0] - self._floor
        if (worse >= -TOUCH).all():
            return None
        row = int(np.argmax((worse < -TOUCH).any(axis=1)))
        return row, self._broken(monitor.violation(worse, row, tool), joints)

    def _broken(self, violation: Violation, joints: Floats) -> Obstacle:
        assert self._monitor is not None, "only a monitor finds violations"
        tcp = where(self._monitor.tcp(joints[violation.row], self._tool))
        return Obstacle(PLANNED[violation.rule], f"{violation}, {tcp}", True)
