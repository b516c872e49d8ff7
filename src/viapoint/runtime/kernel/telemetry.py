"""From set points as sent to what others see of them: windows of ticks and peak ratios to the limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.peaks import PeakMeter
from viapoint.runtime.records import Floats, Ints, Window
from viapoint.runtime.rotations import matrix_to_quaternion


class Status(NamedTuple):
    """What is the same in all ticks of a window."""

    override: float
    tool: int


class Telemetry:
    """Follows the axis functions tick by tick.

    They are n joints, k auxiliary axes, limited TCP length and angle, and both as travelled.
    """

    def __init__(self, cell: Cell, q_start: Floats) -> None:
        self._cell = cell
        self._n = len(q_start)
        self._columns: Floats = np.concatenate((q_start, AuxiliaryAxes.of(cell).start, np.zeros(4)))
        self._meter = PeakMeter(self._columns[:-2], cell.tick)
        self.programmed_speed_ratio = 0.0
        """Peak of speed ÷ programmed speed so far."""

    @property
    def joints(self) -> Floats:
        """Set points (n,) as last sent."""
        return self._columns[: self._n]

    @property
    def auxiliary(self) -> Floats:
        """Auxiliary axes (k,) as last sent."""
        return self._columns[self._n : -4]

    @property
    def peaks(self) -> Floats:
        """(3, n + k + 2): peak speed, acceleration and jerk so far, TCP length and TCP angle last."""
        return self._meter.peaks

    def standing(self, first: int, told: Ints, status: Status) -> Window:
        """Ticks in which nothing moves; `told` (N, 3) as for `window`."""
        columns = np.tile(self._columns, (len(told), 1))
        return self.window(first, columns, told, status)

    def meter_speed(self, s_before: float, s: Floats, bound: Floats) -> None:
        """Compare the path parameter's ticks s (N,) with the programmed bounds (N + 1,) at s_before and s.

        Within a tick the bound may jump; the larger of its ends is the one that held.
        """
        rate = np.diff(s, prepend=s_before) / self._cell.tick
        ratio = rate / np.maximum(bound[1:], bound[:-1])
        self.programmed_speed_ratio = max(self.programmed_speed_ratio, float(ratio.max()))

    def window(self, first: int, columns: Floats, told: Ints, status: Status) -> Window:
        """The window of ticks first, first + 1, … from their axis functions (N, n + k + 4).

        `told` (N, 3): line of the path, line of the interpreter, buffer fill.
        """
        n, count, tick = self._n, len(columns), self._cell.tick
        self._meter.feed(columns[:, :-2])
        length, before = columns[:, -2], self._columns[-2]
        self._columns = columns[-1]
        joints = columns[:, :n]
        X = self._cell.robot.fk(joints) @ self._cell.tools[status.tool].X_flange_tool
        return Window(
            first_tick=first,
            time=np.arange(first, first + count, dtype=np.float64) * tick,
            line=told[:, 0],
            interpreter_line=told[:, 1],
            s=length,
            speed=np.diff(length, prepend=before) / tick,
            override=np.full(count, status.override),
            buffer_fill=told[:, 2],
            joints=joints,
            actual=joints,
            auxiliary=columns[:, n:-4],
            position=X[:, :3, 3],
            quaternion=matrix_to_quaternion(X[:, :3, :3]),
        )
