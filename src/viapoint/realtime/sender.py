"""Sends ticks at their time from a process of its own, which does nothing else.

Whoever computes them hands over windows some time ahead, and is held back when it is too far ahead. So no
computing makes a tick late, as long as it is faster than real time on average over the lead.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import time
from array import array
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Final, Self

from viapoint.realtime.schedule import Punctuality, Schedule
from viapoint.runtime.records import Window

LEAD_S: Final = 0.2
"""How far ahead of the clock ticks are computed: far longer than any block takes to be planned, and short
enough for a halt, which takes effect behind it."""

WINDOWS_AHEAD: Final = 4
"""Windows that the lead should hold at least."""

_PRIORITY: Final = 20
"""Of the real-time class where that is allowed: above ordinary programs, below the system's own threads."""

_FORKS: Final = sys.platform == "linux"
"""A fork needs nothing of the program it is made in; the child touches no numerics. Elsewhere the sink must
be importable by name, from a program that may be imported."""

Sink = Callable[[int, "tuple[float, ...]"], None]
"""Given every tick at its time: its number and the set points (rad, m)."""


class SenderError(Exception):
    """The sending process is gone; the message is for the user."""


@dataclass(frozen=True, slots=True)
class _Ticks:
    """A window on its way: first tick, ticks, axes, set points side by side."""

    first: int
    count: int
    axes: int
    values: bytes


class Sender:
    """Takes windows in time order; `close` waits until the last tick was sent, and says how it went."""

    def __init__(self, tick_s: float, *, sink: Sink | None = None, lead_s: float = LEAD_S) -> None:
        """Starts the process. `sink` is called in it, tick by tick."""
        self.lead = max(round(lead_s / tick_s), 1)
        """Ticks handed over ahead of the clock."""
        self.punctuality: Punctuality | None = None
        """How it went, after the end."""
        self._connection, theirs = multiprocessing.Pipe()
        context = multiprocessing.get_context("fork") if _FORKS else multiprocessing.get_context("spawn")
        ends = (self._connection, theirs)
        self._process = context.Process(target=_send, args=(*ends, tick_s, self.lead, sink), daemon=True)
        self._process.start()
        theirs.close()
        self._given = self._sent = 0

    @property
    def window(self) -> int:
        """Ticks that a window should have at most."""
        return max(self.lead // WINDOWS_AHEAD, 1)

    def send(self, window: Window) -> None:
        """Hand ticks over; comes back when no more than the lead is waiting. Raises SenderError."""
        joints = window.joints
        values = array("d", joints.ravel().tolist()).tobytes()
        try:
            self._connection.send(_Ticks(window.first_tick, len(window), joints.shape[1], values))
            self._given += len(window)
            while self._given - self._sent > self.lead:
                self._sent = self._connection.recv()
        except (EOFError, OSError) as error:
            raise SenderError("the process that sends the ticks has ended") from error

    def close(self) -> Punctuality:
        """Wait for the last tick. Raises SenderError."""
        try:
            self._connection.send(None)
            while not isinstance(said := self._connection.recv(), Punctuality):
                pass
        except (EOFError, OSError) as error:
            raise SenderError("the process that sends the ticks has ended") from error
        self._process.join()
        self.punctuality = said
        return said

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None and self.punctuality is None and self._process.is_alive():
            self.close()
        self._connection.close()
        self._process.terminate()
        self._process.join()


def _send(theirs: Connection, connection: Connection, tick_s: float, lead: int, sink: Sink | None) -> None:
    """The sending process. It has no use for the other end, but would miss its closing."""
    theirs.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one who computes: the path must end
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    priority = raise_priority()
    gc.disable()
    schedule = Schedule(tick_s, time.perf_counter, time.sleep)
    with suppress(EOFError, OSError):  # nobody is there any more
        for ticks, starved in _windows(connection, lead):
            _send_ticks(ticks, schedule, sink, starved=starved)
            connection.send(ticks.first + ticks.count)
        connection.send(schedule.report(priority))


def _windows(connection: Connection, lead: int) -> Iterator[tuple[_Ticks, bool]]:
    """Windows as they come, each with whether it was waited for; the first one when the lead is there."""
    waiting: deque[_Ticks] = deque()
    ticks = 0
    while ticks < lead:
        window: _Ticks | None = connection.recv()
        if window is None:
            yield from ((each, False) for each in waiting)
            return
        waiting.append(window)
        ticks += window.count
    yield from ((each, False) for each in waiting)
    while True:
        starved = not connection.poll(0)
        window = connection.recv()
        if window is None:
            return
        yield window, starved


def _send_ticks(ticks: _Ticks, schedule: Schedule, sink: Sink | None, *, starved: bool) -> None:
    values = memoryview(ticks.values).cast("d")
    for k in range(ticks.count):
        schedule.keep(starved=starved and k == 0)
        if sink is not None:
            sink(ticks.first + k, tuple(values[k * ticks.axes : (k + 1) * ticks.axes]))


def raise_priority() -> str:
    """Ask for real-time scheduling of this process, else for a better share; says what it was given."""
    with suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        return "real time"
    with suppress(AttributeError, OSError):
        os.nice(-10)
        return "raised"
    return "normal"
