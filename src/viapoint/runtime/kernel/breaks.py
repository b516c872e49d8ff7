"""Where the robot is to halt on its path before it executes something: breakpoints and single steps.

The path stays what it is, round edges included: the time law only ends at rest at the place where the
statement begins. What halts it is asked of the entries that are planned, whenever a law is made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.buffer import Entry, MotionBuffer
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.records import Floats
from viapoint.vm.ports import End, Motion

HERE: Final = 1e-9
"""m of path within which the robot is at a place already."""


@dataclass(frozen=True, slots=True)
class Start:
    """Where and when a robot begins: its last tick, joints (n,), auxiliary axes (k,), the tool it has."""

    tick: int
    joints: Floats
    auxiliary: Floats
    tool: int = 0

    def placed(self, cell: Cell) -> Cell:
        """The cell with its auxiliary axes where they begin."""
        values = zip(sorted(cell.auxiliary_axes), self.auxiliary.tolist(), strict=True)
        axes = {number: replace(cell.auxiliary_axes[number], start=e) for number, e in values}
        return replace(cell, auxiliary_axes=axes)

    @classmethod
    def at_home(cls, cell: Cell) -> Start:
        """Of a run's beginning."""
        return cls(0, np.asarray(cell.home, dtype=np.float64), AuxiliaryAxes.of(cell).start)


class Breaks:
    """Breakpoints by line, a step to be made, and a step along path that was travelled already."""

    def __init__(self, buffer: MotionBuffer, route: Route) -> None:
        self.lines: Mapping[int, Callable[[], bool]] = {}
        """Lines before which to halt, each with what is asked there, at rest: whether to halt."""
        self._buffer = buffer
        self._route = route
        self._passed = -1  # entries up to this one were halted at already
        self._step: int | None = None  # entries behind this one are not executed by the step being made
        self._until: float | None = None  # s at which a step along travelled path ends

    def begin(self, statements: int | None = None) -> None:
        """A program begins; halt when so many statements have been executed."""
        self.run_on()
        self._passed -= 1
        if statements is not None:
            self.step(statements)

    def step(self, statements: int = 1) -> None:
        """Halt again when so many entries more have been executed."""
        self._step = self._buffer.generator + statements - 1

    def step_back(self, s: float) -> None:
        """From s, going back: halt where the motion before began."""
        self._until = self._route.place_before(s - HERE)

    def step_again(self, s: float, frontier: float) -> None:
        """From s, forward over travelled path: halt where the motion ends, at the latest at `frontier`."""
        self.step(0)
        self._until = min(self._route.place_after(s + HERE), frontier)

    @property
    def steps(self) -> bool:
        """Whether a step is being made."""
        return self._step is not None

    def run_on(self) -> None:
        """Go on from a halt, to the next breakpoint."""
        self._passed = self._buffer.generator
        self._step = self._until = None

    def may_halt(self, entry: Entry) -> bool:
        """Whether the path must be at rest before `entry` takes effect."""
        if self._step is not None and entry.number > self._step:
            return True
        return entry.number > self._passed and entry.call.line in self.lines

    def halts(self, entry: Entry, line: int) -> bool:
        """At rest before `entry`, in `line`: whether to halt there. What is asked is not asked again.

        An end that no statement makes belongs to the last one.
        """
        if not self.may_halt(entry) or (isinstance(entry.call, End) and entry.call.line == line):
            return False
        if self._step is not None and entry.number > self._step:
            return True
        self._passed = entry.number
        return self.lines[entry.call.line]()

    def retraced(self, s: float) -> bool:
        """At rest on travelled path: whether the step along it ends at s."""
        return self._until is not None and abs(s - self._until) <= HERE

    def next_place(self, s: float, direction: float) -> float | None:
        """The next place from s on at which the path is to be at rest, forward or back."""
        if direction < 0.0 or (self._until is not None and self._until > s):
            return self._until
        if self._step is None and not self.lines:
            return None
        place = None
        for entry in self._buffer.planned_entries():
            if self.may_halt(entry) and place is not None and place > s + HERE:
                return place
            if isinstance(entry.call, Motion):
                place = self._route.place(entry.number)
        return None
