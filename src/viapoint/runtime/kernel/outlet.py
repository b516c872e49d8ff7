"""The way out of the kernel: rows of the planned path, what is added to them, a last look, a window.

Nothing reaches the drives but through here. Not here: where the path is, and what stands on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.failure import ExecutionError
from viapoint.runtime.kernel.feed import Feed, Sent, Stand
from viapoint.runtime.kernel.guard import TickGuard
from viapoint.runtime.kernel.motion import Rows
from viapoint.runtime.kernel.offsets import Sensor
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.refusals import Obstacle
from viapoint.runtime.kernel.states import Hold
from viapoint.runtime.kernel.telemetry import Status, Telemetry, Tellings, Told
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.records import Floats, Window
from viapoint.runtime.signals import SignalWorld
from viapoint.runtime.timing import TimeLaw


class Present(NamedTuple):
    """What holds in all ticks of a window: tool, line of the path, override, what holds the path back."""

    tool: int
    line: int
    override: float
    hold: Hold

    @property
    def status(self) -> Status:
        return Status(self.override, self.tool)


class Outlet:
    """Owns feed, guard and telemetry, and takes rows through them in this order."""

    def __init__(
        self,
        cell: Cell,
        planner: Planner,
        trace: Trace,
        q_start: Floats,
        world: SignalWorld,
        sensors: Sequence[Sensor],
    ) -> None:
        self.telemetry = Telemetry(cell, q_start)
        self.guard = TickGuard(planner.monitor, trace)
        self.feed = Feed(cell, planner.route, self.telemetry.columns, world, sensors)
        self._tick = cell.tick
        self._emergency_factor = cell.emergency_deceleration_factor

    def offer(self, rows: Rows, first: int, count: int, now: Present) -> Rows | None:
        """At most `count` rows of the path as they are to be sent from tick `first` on.

        None if the feed gives up the path.
        """
        if self.feed.adds:
            sent = self.feed.send(rows, first, count, self._stand_of(now))
            if sent is None:
                return None
            rows = sent
        return self.guard.watch(rows, self.telemetry.joints, now.tool, now.line)

    def _stand_of(self, now: Present) -> Stand:
        stopping = now.hold in (Hold.STOP, Hold.EMERGENCY)
        factor = self._emergency_factor if now.hold is Hold.EMERGENCY else 1.0
        return Stand(now.tool, now.line, stopping, now.hold is not Hold.NONE, factor)

    def foreseen(self, columns: Floats, first: int, now: Present) -> Floats:
        """Columns (N, m) of the path in ticks from `first` on, with joints as they will about be sent."""
        if not self.feed.tracker.active:
            return columns
        q = self.feed.foreseen(columns, first, self._stand_of(now))
        return np.concatenate((q, columns[:, q.shape[1] :]), axis=1)

    def in_the_way(self, rows: Rows, first: int, now: Present) -> Obstacle | None:
        """What would keep rows of the path from being sent while a belt is followed as it moves now."""
        return self.feed.in_the_way(rows, first, self._stand_of(now))

    def follows(self, law: TimeLaw | None, tick: int) -> bool:
        """Whether the path is at the end of its law after `tick`, while what the filter sends follows."""
        return self.feed.filters and law is not None and law.t_end <= (tick + 1) * self._tick

    def take(self, rows: Rows, used: int, first: int, told: Tellings, now: Present) -> Window:
        """The window of the first `used` of the rows offered last. They are sent."""
        deviation = rows.deviation[:used] if isinstance(rows, Sent) else None
        window = self.telemetry.window(first, rows.columns[:used], told, now.status, deviation)
        if self.feed.adds:
            self.feed.commit(used)
        return window

    def look_back(self, used: int, line: int) -> bool:
        """So many rows were sent: True if the guard wants the robot stopped."""
        if not self.guard.sent(used, line):
            return False
        if self.feed.displaces:  # stopping the path would not stop what is added to it
            self.feed.failure = self.guard.alarm
        return True

    def stand(self, s: float, first: int, count: int, told: Told, now: Present) -> Window | None:
        """At most `count` ticks in which the path stands at s; None as in `offer`."""
        if not self.feed.displaces or self.feed.down:
            return self.telemetry.standing(first, count, told, now.status)
        rows = self.offer(self.feed.resting(s, count), first, count, now)
        if rows is None:
            return None
        window = self.take(rows, len(rows.s), first, [(0, told)], now)
        self.look_back(len(window), now.line)
        return window

    def let_down(self, first: int, count: int, told: Told, now: Present) -> Window:
        """At most `count` ticks in which every axis brakes by itself, off the path."""
        return self.telemetry.window(first, self.feed.let_down(count), [(0, told)], now.status)

    def room_for(self, tool: int, line: int) -> ExecutionError | None:
        """What keeps the robot from having a tool where it stands."""
        return self.guard.standing(self.telemetry.joints, tool, line)
