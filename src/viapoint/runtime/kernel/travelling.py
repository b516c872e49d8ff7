"""Ticks in which the path advances: what stands on it takes effect, and what was computed too far is left.

A window is evaluated as far as was asked for, and kept up to the first tick in which something changes the
law. Not here: what happens at rest.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from viapoint.runtime.kernel.failure import ExecutionError, MotionError
from viapoint.runtime.kernel.interrupting import Interrupting
from viapoint.runtime.kernel.manual import Manual
from viapoint.runtime.kernel.states import Hold
from viapoint.runtime.kernel.telemetry import Tellings
from viapoint.runtime.records import Floats, Window


class Travelling(Manual, Interrupting):
    """The side of a kernel that moves along the path."""

    @abstractmethod
    def _interpret(self) -> bool:
        """Let the interpreter run if it may; True if it did."""

    @abstractmethod
    def fail(self, failure: MotionError | None) -> None:
        """End the run with what went wrong, if anything did; the robot stands."""

    def _move(self, ticks: int) -> Window:
        first = self.trace.tick + 1
        if self.outlet.feed.tracker.active:
            ticks = min(ticks, self._ticks_to_look)
        planned = self.mover.rows(first, ticks)
        if not np.isfinite(planned.columns).all():
            return self._trip(first)
        rows = self.outlet.offer(planned, first, ticks, self._now)
        if rows is None:
            return self._let_down(ticks)
        told = [(0, self._told)]
        used = self._pass_places(rows.s, first, told)
        arrived = rows.arrived and used == len(rows.s)
        s = rows.s[:used]
        self.telemetry.meter_speed(self.planner.route.speed_ratio(self._last_s, s, self.cell.tick))
        self._last_s = self.mover.s = float(s[-1])
        self._frontier = max(self._frontier, self._last_s)
        window = self.outlet.take(rows, used, first, told, self._now)
        self.trace.tick = first + used - 1
        self.world.advance(self.trace.tick)
        alarmed = self.outlet.look_back(used, self.line)
        if arrived:
            self.mover.law = None
            self._settle()
        elif alarmed:
            self._hold_back(Hold.STOP)
        elif self._looks_now:
            self.look_out()
        return window

    def _let_down(self, ticks: int) -> Window:
        """Off the path: every axis brakes by itself; then the failure ends the run."""
        if not self.outlet.feed.lets_down:
            self.tell_loss()
        window = self.outlet.let_down(self.trace.tick + 1, ticks, self._told, self._now)
        self.trace.tick += len(window)
        self.world.advance(self.trace.tick)
        if self.outlet.feed.down:
            self.fail(self.outlet.feed.failure)
        return window

    def _trip(self, tick: int) -> Window:
        """The last door before the drives: what is not a finite number does not pass; the robot is held."""
        window = self.telemetry.standing(tick, 1, self._told, self._now.status)
        self.trace.tick = tick
        self.mover.law = None
        self.fail(ExecutionError("E490", "a set point is not a finite number", self.line))
        return window

    def _pass_places(self, s: Floats, first: int, told: Tellings) -> int:
        """Execute what stands on the path within rows s (N,), in order; returns how many rows stay valid.

        What is `_told` of them is kept up in `told`.
        """
        row, finished = 0, False
        while True:
            passed = self._passing.next(s, row, first, self._frontier)
            if finished and (passed is None or passed.row != row):
                if self._look_ahead():
                    return row + 1
                told.append((row + 1, self._told))
                finished = False
            elif passed is None:
                return len(s)
            else:
                row = passed.row
                self.trace.tick = first + row
                self.mover.s = float(s[row])
                self.world.advance(self.trace.tick)
                changed = passed.happens()
                changed = self._watch() or changed
                told.append((row, self._told))
                finished |= passed.ends_motion
                if changed or passed.stops:
                    return row + 1

    def _next_row(self, s: Floats) -> int | None:
        passed = self._passing.next(s, 0, self.trace.tick + 1, self._frontier)
        return None if passed is None else passed.row

    def _look_ahead(self) -> bool:
        """Blocks were finished while moving: interpreter and planner go on; True if the law changed."""
        while self._interpret() or self.planner.plan(self.mover.wanted):
            pass
        stopping = self._held or self._hold is not Hold.NONE or self.interrupts.stopping
        standing = stopping or self.outlet.follows(self.mover.law, self.trace.tick)
        return not standing and self.mover.extend(self.trace.tick)
