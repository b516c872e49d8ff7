"""The trace of a run: what happened in which tick, at which line, told to a listener."""

from __future__ import annotations

from collections.abc import Callable

from viapoint.runtime.records import Event, EventValue


class Trace:
    """Knows the present tick and makes events of it."""

    def __init__(self, listener: Callable[[Event], None], tick_s: float, robot: int = 1) -> None:
        self.tick = 0
        self._robot = robot
        self._listener = listener
        self.tick_s = tick_s

    @property
    def time(self) -> float:
        """Present time, s."""
        return self.time_of(self.tick)

    def time_of(self, tick: int) -> float:
        """Time of a tick, s."""
        return tick * self.tick_s

    def emit(self, kind: str, line: int, *, tick: int | None = None, **data: EventValue) -> None:
        """Tell an event of the present tick, or of an earlier one."""
        at = self.tick if tick is None else tick
        event = Event(tick=at, t=self.time_of(at), line=line, kind=kind, robot=self._robot, data=data)
        self._listener(event)
