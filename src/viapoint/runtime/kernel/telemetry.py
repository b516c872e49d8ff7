"""From set points as sent to what others see of them: windows of ticks and peak ratios to the limits."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.peaks import PeakMeter
from viapoint.runtime.kernel.torques import TorqueMeter
from viapoint.runtime.records import Floats, Ints, Window


class Told(NamedTuple):
    """Of one tick: line of the path, line of the interpreter, entries in the buffer."""

    line: int
    interpreter_line: int
    buffer_fill: int


Tellings = list[tuple[int, Told]]
"""What is told of the rows of a window, each from its row on; ascending, the first one of row 0."""


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
        self._stands = -1, self._columns, self._columns  # tool, TCP (1, 3) and (1, 4), of the row last sent
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

    def standing(self, first: int, count: int, told: Told, status: Status) -> Window:
        """Ticks in which nothing moves: one row, seen `count` times."""
        self._meter.stand(count)
        one = self._columns[None]
        self._torques.stand(one[:, :-4])
        joints = _repeated(one[:, : self._n], count)
        position, quaternion = self._standing_tcp(status.tool)
        line, interpreter_line, fill = np.array(told)[:, None]
        nothing = _repeated(np.zeros(1), count)
        return Window(
            first_tick=first,
            time=self._times(first, count),
            line=_repeated(line, count),
            interpreter_line=_repeated(interpreter_line, count),
            s=_repeated(one[:, -2], count),
            speed=nothing,
            override=_repeated(np.array([status.override]), count),
            buffer_fill=_repeated(fill, count),
            joints=joints,
            actual=joints,
            auxiliary=_repeated(one[:, self._n : -4], count),
            torque=_repeated(self._torques.feed(one[:, :-4], status.tool), count),
            position=_repeated(position, count),
            quaternion=_repeated(quaternion, count),
            deviation=nothing,
        )

    def meter_speed(self, ratio: float) -> None:
        """So many times the programmed speed was sent."""
        self.programmed_speed_ratio = max(self.programmed_speed_ratio, ratio)

    def window(
        self, first: int, columns: Floats, told: Tellings, status: Status, deviation: Floats | None = None
    ) -> Window:
        """The window of ticks first, first + 1, … from their axis functions (N, n + k + 4).

        `deviation` (N,) m: how far the TCP is from where the path has it.
        """
        self._meter.feed(columns[:, :-2])
        n, count, length, joints = self._n, len(columns), columns[:, -2], columns[:, : self._n]
        speed = _steps(length, self._columns[-2])
        speed /= self._cell.tick
        position, quaternion = self._tcp(joints, status.tool)
        self._columns = columns[-1]
        self._stands = status.tool, position[-1:], quaternion[-1:]
        line, interpreter_line, fill = _spread(told, count)
        return Window(
            first_tick=first,
            time=self._times(first, count),
            line=line,
            interpreter_line=interpreter_line,
            s=length,
            speed=speed,
            override=_repeated(np.array([status.override]), count),
            buffer_fill=fill,
            joints=joints,
            actual=joints,
            auxiliary=columns[:, n:-4],
            torque=self._torques.feed(columns[:, :-4], status.tool),
            position=position,
            quaternion=quaternion,
            deviation=_repeated(np.zeros(1), count) if deviation is None else deviation,
        )

    def _tcp(self, joints: Floats, tool: int) -> tuple[Floats, Floats]:
        """Position (N, 3) and quaternion (N, 4) at joints (N, n)."""
        return self._cell.robot.tcp(joints, self._cell.tools[tool].X_flange_tool)

    def _standing_tcp(self, tool: int) -> tuple[Floats, Floats]:
        """The same (1, …) of the row last sent."""
        known, position, quaternion = self._stands
        if known != tool:
            position, quaternion = self._tcp(self._columns[None, : self._n], tool)
            self._stands = tool, position, quaternion
        return position, quaternion

    def _times(self, first: int, count: int) -> Floats:
        times = np.arange(first, first + count, dtype=np.float64)
        times *= self._cell.tick
        return times


def _steps(x: Floats, before: float) -> Floats:
    """(N,) from one to the next; as numpy's `diff` with a value before them, in a third of the time."""
    steps = np.empty(len(x))
    steps[0] = x[0] - before
    np.subtract(x[1:], x[:-1], out=steps[1:])
    return steps


def _repeated(row: npt.NDArray[Any], count: int) -> npt.NDArray[Any]:
    """One row (1, ...) seen `count` times; as numpy's `broadcast_to`, which takes five times as long."""
    return np.ndarray((count, *row.shape[1:]), row.dtype, row, 0, (0, *row.strides[1:]))


def _spread(told: Tellings, count: int) -> Ints:
    """(3, count): what is told of each row."""
    if len(told) == 1:
        return _repeated(np.array(told[0][1])[None], count).T
    spread = np.empty((3, count), dtype=np.int64)
    for (row, values), (end, _) in pairwise((*told, (count, told[0][1]))):
        for each, value in zip(spread, values, strict=True):
            each[row:end] = value
    return spread
