"""Paths for the oracles: a program's path between its first and its last stop, as the time law sees it.

The machine runs against the planner alone; the route that it lays is the very one the robot would run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.buffer import MotionBuffer
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.path import Piece
from viapoint.runtime.timing import AxisLimits
from viapoint.session import compile_text
from viapoint.vm import Machine
from viapoint.vm.conditions import Condition, Reading
from viapoint.vm.ports import Call, End, Ended

Floats = npt.NDArray[np.float64]


class Answers:
    """WorldPort of programs that ask nothing."""

    def read_input(self, index: int, *, line: int, ahead: bool) -> bool:
        return False

    def read_output(self, index: int, *, line: int, ahead: bool) -> bool:
        return False

    def read_m(self, index: int, *, line: int, ahead: bool) -> bool:
        return False

    def read_level(self, reading: Reading, *, line: int, ahead: bool) -> float:
        return 0.0

    def holds(self, condition: Condition, *, line: int) -> bool:
        return False

    def live_place(
        self, points: tuple[int | None, ...], frame: int, *, line: int, arrived: bool
    ) -> str | None:
        return None

    def found(self) -> bool:
        return False

    def m_is_synchronous(self, index: int) -> bool:
        return True


class Laying:
    """MotionPort: every call is planned at once and forgotten; `pieces` are those of the path."""

    def __init__(self, cell: Cell) -> None:
        self.pieces: list[Piece] = []
        self._buffer: MotionBuffer = MotionBuffer(cell.lookahead)
        self.planner = Planner(cell, self._buffer, np.asarray(cell.home))
        self.planner.laid = self.pieces.extend

    def submit(self, call: Call) -> bool:
        self._buffer.put(call)
        self.planner.plan()
        while self._buffer.to_execute() is not None:
            self._buffer.executed()
        if isinstance(call, End):
            self.planner.close(call.line)
            self.planner.stop()
        return True


@dataclass
class Section:
    """One path from rest to rest: an AxisCurve with its limits and the programmed speed."""

    route: Route
    limits: AxisLimits
    begin: float
    end: float
    blocks: int
    tick: float
    pieces: list[Piece]

    @property
    def breaks(self) -> Floats:
        return self.route.programmed.breaks(self.begin, self.end)

    def values(self, s: Floats) -> Floats:
        return self.route.axes.values(s)

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        return self.route.axes.derivatives(s)

    def bound(self, s: Floats) -> Floats:
        return self.route.speed_bound(s)

    def inner(self) -> Floats:
        """Ends of the pieces inside."""
        ends = np.asarray(self.route.ends)
        return ends[(ends > self.begin + 1e-9) & (ends < self.end - 1e-9)]


def lay(text: str, cell: Cell) -> Section:
    """The path of a program from the stop after its first motion to its end; there is no stop in between."""
    port = Laying(cell)
    outcome = Machine(compile_text(text, cell=cell).program, port, Answers()).run()
    planner = port.planner
    if planner.failure is not None or not isinstance(outcome, Ended):
        raise SystemExit(f"a path of the benchmarks cannot be planned: {planner.failure or outcome}")
    route = planner.route
    stops = [s for s in route.stops if s > 0.0]
    if len(stops) != 2:
        raise SystemExit(f"a path of the benchmarks stops on its way, at {stops} m")
    blocks = sum(line.startswith("M") for line in text.splitlines()) - 1
    limits = Mover(cell, route, 1.0).limits
    return Section(route, limits, stops[0], stops[1], blocks, cell.tick, port.pieces)
