"""From set points as sent to what others see of them: windows of ticks and peak ratios to the limits."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.peaks import PeakMeter
from viapoint.runtime.kernel.torques import TorqueMeter
from viapoint.runtime.records import Floats, Ints, Window

_ARRAYS: Final = tuple(name for name in Window.__dataclass_fields__ if name not in ("first_tick", "time"))


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
        self._torques = TorqueMeter(cell, self._columns[:-4])
        self.programmed_speed_ratio = 0.0
        """Peak of speed ÷ programmed speed so far."""

    @property
    def columns(self) -> Floats:
        """Axis functions (n + k + 4,) as last sent."""
        return self._columns

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

    def standing(self, first: int, count: int, told: Ints, status: Status) -> Window:
        """Ticks in which nothing moves; `told` (3,) as for `window`. One row, seen `count` times."""
        self._meter.stand(count)
        self._torques.stand(self._columns[:-4])
        one = self._window(first, self._columns[None], self._columns[-2], told[None], status)
        seen = {name: _repeated(getattr(one, name), count) for name in _ARRAYS}
        return Window(first_tick=first, time=self._times(first, count), **seen)

    def meter_speed(self, s_before: float, s: Floats, bound: Floats) -> None:
        """Compare the path parameter's ticks s (N,) with the programmed bounds (N + 1,) at s_before and s.

        Within a tick the bound may jump; the larger of its ends is the one that held.
        """
        ratio = _steps(s, s_before) / self._cell.tick / np.maximum(bound[1:], bound[:-1])
        self.programmed_speed_ratio = max(self.programmed_speed_ratio, float(ratio.max()))

    def window(
        self, first: int, columns: Floats, told: Ints, status: Status, deviation: Floats | None = None
    ) -> Window:
        """The window of ticks first, first + 1, … from their axis functions (N, n + k + 4).

        `told` (N, 3): line of the path, line of the interpreter, buffer fill. `deviation` (N,) m: how far
        the TCP is from where the path has it.
        """
        self._meter.feed(columns[:, :-2])
        before, self._columns = self._columns[-2], columns[-1]
        return self._window(first, columns, before, told, status, deviation)

    def _window(
        self,
        first: int,
        columns: Floats,
        before: float,
        told: Ints,
        status: Status,
        deviation: Floats | None = None,
    ) -> Window:
        """The same, after a tick with so much TCP length behind it."""
        n, count, length = self._n, len(columns), columns[:, -2]
        joints = columns[:, :n]
        position, quaternion = self._cell.robot.tcp(joints, self._cell.tools[status.tool].X_flange_tool)
        return Window(
            first_tick=first,
            time=self._times(first, count),
            line=told[:, 0],
            interpreter_line=told[:, 1],
            s=length,
            speed=_steps(length, before) / self._cell.tick,
            override=np.full(count, status.override),
            buffer_fill=told[:, 2],
            joints=joints,
            actual=joints,
            auxiliary=columns[:, n:-4],
            torque=self._torques.feed(columns[:, :-4], status.tool),
            position=position,
            quaternion=quaternion,
            deviation=np.zeros(count) if deviation is None else deviation,
        )

    def _times(self, first: int, count: int) -> Floats:
        return np.arange(first, first + count, dtype=np.float64) * self._cell.tick


def _steps(x: Floats, before: float) -> Floats:
    """(N,) from one to the next; as numpy's `diff` with a value before them, in a third of the time."""
    steps = np.empty(len(x))
    steps[0] = x[0] - before
    np.subtract(x[1:], x[:-1], out=steps[1:])
    return steps


def _repeated(row: npt.NDArray[Any], count: int) -> npt.NDArray[Any]:
    """One row (1, ...) seen `count` times; as numpy's `broadcast_to`, which takes five times as long."""
    return np.ndarray((count, *row.shape[1:]), row.dtype, row, 0, (0, *row.strides[1:]))
