"""What other robots of the cell mean to this one: zones it waits for, bodies it must not touch, common ticks.

A station asks and tells; a robot that is alone in its cell has none of it.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Final

import numpy as np

from viapoint.runtime.kernel.commands import Commands
from viapoint.runtime.kernel.dialogue import Dialogue
from viapoint.runtime.kernel.execution import Execution
from viapoint.runtime.kernel.failure import ExecutionError, MotionError
from viapoint.runtime.kernel.guard import TickGuard
from viapoint.runtime.kernel.outlet import Present
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.states import Hold, State
from viapoint.runtime.kernel.telemetry import Telemetry
from viapoint.runtime.kernel.zones import ZoneAccess
from viapoint.runtime.records import Floats
from viapoint.vm.ports import Barrier

_LOOKED_AT: Final = 128
"""Most ticks in which it is worked out beforehand what is added to the path: they are worked out again when
they pass."""


class Company(Commands):
    """The side of a kernel that a station sees."""

    planner: Planner
    execution: Execution
    dialogue: Dialogue
    guard: TickGuard
    telemetry: Telemetry
    access: ZoneAccess | None = None
    """Zones that others may have; None: the robot is alone."""
    _gate_since: int | None = None  # tick from which on the robot has stood before a zone

    @abstractmethod
    def _look_ahead(self) -> bool:
        """Blocks were finished while moving: interpreter and planner go on; True if the law changed."""

    @abstractmethod
    def _next_row(self, s: Floats) -> int | None:
        """Row of the next ticks, whose places are s (N,), in which something happens; None: in none."""

    @property
    @abstractmethod
    def _may_be_interrupted(self) -> bool:
        """Whether an interrupt may still come about while the robot waits."""

    @property
    @abstractmethod
    def _frontier_pause(self) -> float | None:
        """On the way back to where the program was left, that place, if an interrupt waits there."""

    @property
    @abstractmethod
    def _ticks_to_look(self) -> int:
        """Ticks up to that in which the path may be slowed for the belt it is on; any number: never."""

    @property
    @abstractmethod
    def _now(self) -> Present:
        """What holds in the next ticks."""

    @property
    def statements(self) -> int:
        """Statements executed so far, by the robot."""
        return self.execution.statements

    # --- common ticks --------------------------------------------------------------------------------

    def undisturbed(self, ticks: int) -> int:
        """How many of the next `ticks` pass up to the first in which this robot may do more than move on.

        In the ones before, it neither reads nor writes. What is scheduled in the world is not looked at.
        """
        feed, first = self.outlet.feed, self.trace.tick + 1
        if feed.failure is not None and not feed.down:
            return min(ticks, feed.ticks_of_letdown())
        if feed.alters:
            ticks = min(ticks, _LOOKED_AT, self._ticks_to_look)
        if self.state is State.MOVING:
            if feed.alters:
                offered = self.outlet.offer(self.mover.rows(first, ticks), first, ticks, self._now)
                if offered is None:
                    return 1
                s = offered.s  # up to where something happens
            else:
                s, _ = self.mover.places(first, ticks)
            row = self._next_row(s)
            rows = [ticks - 1, len(s) - 1 if row is None else row]
            if (zone_tick := self._zone_tick()) is not None:
                rows.append(zone_tick - self.trace.tick - 1)
            return min(rows) + 1
        if self.state is State.POLLING:
            return 1
        if feed.displaces:
            resting = feed.resting(self.mover.s, ticks)
            offered = self.outlet.offer(resting, first, ticks, self._now)
            ticks = 1 if offered is None else len(offered.s)
        ends = (self.execution.dwell_until, self.dialogue.deadline, self.execution.pulses.next_end)
        return min([ticks, *(max(1, tick - self.trace.tick) for tick in ends if tick is not None)])

    def stuck(self, *, alone: bool = True) -> MotionError | None:
        """What the robot waits for, if nothing scheduled and nothing it does itself can ever bring it.

        Where the cell is not `alone`, only other robots keep one waiting in vain.
        """
        entry = self.execution.front
        if self.execution.pulses.next_end is not None or self._may_be_interrupted:
            return None
        if self.state is State.WAITING:
            return self._kept_out() or (self.dialogue.in_vain() if alone else None)
        if alone and self.state is State.POLLING and entry is not None and isinstance(entry.call, Barrier):
            return self.dialogue.asks_in_vain(entry.call, self.execution.statements)
        return None

    # --- bodies --------------------------------------------------------------------------------------

    def foreseen(self, ticks: int) -> Floats:
        """(ticks, n + k): joints and auxiliary axes in the next ticks, if nothing changes the present law."""
        standing = np.concatenate((self.telemetry.joints, self.telemetry.auxiliary))
        feed, first = self.outlet.feed, self.trace.tick + 1
        if self.state is State.MOVING:
            columns = self.mover.rows(first, ticks).columns[:, : len(standing)]
            columns = np.concatenate((columns, np.tile(columns[-1], (ticks - len(columns), 1))))
        elif feed.tracker.active and not self.over:
            columns = feed.resting(self.mover.s, ticks).columns[:, : len(standing)]
        else:
            return np.tile(standing, (ticks, 1))
        return self.outlet.foreseen(columns, first, self._now)

    def ticks_to_rest(self) -> int:
        """How many ticks a halt would take."""
        path = self.mover.ticks_to_rest(self.trace.tick) if self.state is State.MOVING else 0
        return max(path, self.outlet.feed.tracker.ticks_to_rest())

    def alarm(self, error: ExecutionError) -> None:
        """Stop on the path, and end the run there with an error."""
        self.guard.alarm = self.guard.alarm or error
        self._hold_back(Hold.STOP)

    # --- zones ---------------------------------------------------------------------------------------

    def ask_for_zones(self) -> None:
        """Ask for the zone that the path enters next, if it is time to; give back what was left."""
        if self.access is None or self.state.over:
            return
        self.access.forget(self.planner.route.begin)
        law = self.mover.law
        self.access.pass_to(self._frontier, self._frontier if law is None else law.s_end)
        if law is not None and self.state is State.MOVING:
            if self._ends_at_gate and self.trace.tick >= self.mover.braking_tick:
                self.access.ask(law.s_end, self.trace.tick)
        elif self.state is State.WAITING and self._at_gate:
            self.access.ask(self.mover.s, self.trace.tick)
            if self._gate_since is None:
                self._gate_since = self.trace.tick

    def zones_granted(self) -> None:
        """A zone was given to the robot: it goes on into it."""
        if self.state is State.WAITING:
            self._tell_wait()
            self._settle()
        elif self.state is State.MOVING:
            self._look_ahead()

    def _tell_wait(self) -> None:
        if self._gate_since is not None:
            self.trace.emit(
                "wait", self.line, tick=self._gate_since, t_end=self.trace.time, reason="exclusive zone"
            )
        self._gate_since = None

    def _zone_tick(self) -> int | None:
        """The tick in which a zone is to be asked for, or given back; None: none is, by the present law."""
        if self.access is None or self.mover.direction < 0.0:
            return None
        ticks = []
        if self._ends_at_gate and self.trace.tick < self.mover.braking_tick:
            ticks.append(self.mover.braking_tick)
        left = self.mover.tick_at(self.access.next_exit(self.mover.s))
        if left is not None:
            ticks.append(left)
        return max(min(ticks), self.trace.tick + 1) if ticks else None

    @property
    def _ends_at_gate(self) -> bool:
        """Moving up to a zone that the robot has not got."""
        law = self.mover.law
        if self.access is None or law is None or self.mover.direction < 0.0:
            return False
        return self.access.blocked(law.s_end) is not None

    @property
    def _at_gate(self) -> bool:
        """Standing where a zone has to be waited for."""
        return self.access is not None and self.access.blocked(self.mover.s) is not None

    def _kept_out(self) -> MotionError | None:
        """What to say of the zone that the robot waits for where it stands."""
        zone = None if self.access is None else self.access.blocked(self.mover.s)
        if self.access is None or zone is None:
            return None
        message = f"it waits for the zone {zone}, which robot {self.access.holder(zone)} has"
        return ExecutionError("E450", message, self.line)

    def _taken(self) -> MotionError | None:
        """What is wrong where the robot stands in a zone that another one has."""
        if self.access is None:
            return None
        for zone in self.guard.zones_at(self.telemetry.joints, self.execution.tool):
            other = self.access.take(zone)
            if other is not None:
                message = f"the robot stands in the exclusive zone {zone}, and robot {other} does too"
                return ExecutionError("E452", message, 0, "give one of them a home position outside")
        return None

    def _next_pause(self, s: float, direction: float) -> float | None:
        """The next place from s on at which the path is to be at rest, forward or back."""
        places = [self.breaks.next_place(s, direction)]
        if direction > 0.0:
            places.append(self._frontier_pause)
        if self.access is not None:
            places.append(self.access.next_place(s, direction))
        known = [place for place in places if place is not None]
        return (min(known) if direction > 0.0 else max(known)) if known else None
