"""What of a kernel belongs to one program: the one it was given, or a subroutine that interrupts it.

Each has a path of its own, and all that knows the path: buffer, planner, mover, what stands on it. Robot,
time, signals, feed and telemetry are one. The level that is put aside keeps everything as it stood.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.breaks import Breaks
from viapoint.runtime.kernel.buffer import Entry, MotionBuffer
from viapoint.runtime.kernel.dialogue import Dialogue
from viapoint.runtime.kernel.execution import Execution
from viapoint.runtime.kernel.interrupts import Interrupts
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.outlet import Outlet
from viapoint.runtime.kernel.passing import Passing
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.searching import Searching
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.kernel.zones import ExclusiveZones, ZoneAccess
from viapoint.runtime.signals import SignalWorld


@dataclass(frozen=True, slots=True)
class Level:
    """A program's own parts, and how far it has come: s of the frontier, and of the last tick computed."""

    buffer: MotionBuffer
    planner: Planner
    mover: Mover
    breaks: Breaks
    execution: Execution
    dialogue: Dialogue
    searching: Searching
    passing: Passing
    access: ZoneAccess | None
    frontier: float = 0.0
    last_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Grounds:
    """What all levels of a kernel share, and whom they call. Motions are timed for the cell `timed`."""

    cell: Cell
    timed: Cell
    world: SignalWorld
    trace: Trace
    outlet: Outlet
    interrupts: Interrupts
    zones: ExclusiveZones | None
    patient: bool
    travelled_mm: Callable[[], float]
    next_pause: Callable[[float, float], float | None]
    execute: Callable[[Entry], None]

    def level(self, planner: Planner, buffer: MotionBuffer, override: float) -> Level:
        """A level on the path of a planner, from its begin on."""
        route, world, trace = planner.route, self.world, self.trace
        mover = Mover(self.timed, route, override)
        mover.pause = self.next_pause
        breaks = Breaks(buffer, route)
        access = None
        if self.zones is not None:
            access = ZoneAccess(self.zones, self.cell)
            planner.crossed = access.lay
        execution = Execution(buffer, world, trace, planner, mover, self.outlet.room_for, self.interrupts)
        dialogue = Dialogue(self.cell, world, buffer, trace, self.travelled_mm, patient=self.patient)
        searching = Searching(world, dialogue, planner, mover)
        passing = Passing(execution, planner, mover, breaks, self.outlet.guard, searching, self.execute)
        return Level(buffer, planner, mover, breaks, execution, dialogue, searching, passing, access)
