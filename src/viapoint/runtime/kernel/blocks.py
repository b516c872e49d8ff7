"""The blocks of a run: one per motion executed, from the tick in which it sets out to that of its end."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple

from viapoint.language.units import DEG, MM
from viapoint.runtime.kernel.failure import ExecutionError
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.onpath import Begin
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.records import Event, EventValue
from viapoint.vm.ports import Motion

_FORGET_EVERY: Final = 64
"""Motions after which the route behind the robot is dropped: seldom, since it moves arrays."""

_STANDING: Final = 1e-10
"""m of path that a robot where a block begins may be behind that place: rounding of summed lengths."""

_MOST_WITHOUT_TIME: Final = 1000
"""Motions of zero length that may end in one tick; a loop of them would never end."""


class _Begin(NamedTuple):
    """Where a block begins: tick, TCP length travelled (m), s of the route, number of its entry.

    `beside` is how far the TCP has travelled beside the path since, m.
    """

    tick: int
    travelled: float
    s: float
    number: int
    beside: float = 0.0


class Blocks:
    """Follows the motions in execution, reports each, and lets go of the path far behind them."""

    def __init__(self, route: Route, mover: Mover, trace: Trace) -> None:
        self._route = route
        self._mover = mover
        self._trace = trace
        self.paced: Callable[[Event], None] | None = None
        """Told of the pace of every block, for drawings: how fast it was asked to be, what held it back."""
        self._begin = _Begin(trace.tick, route.travelled(0.0), 0.0, -1)
        self._finished = 0  # since the route was last forgotten
        self._kept = self._begin  # from where the route is kept the next time
        self._without_time = (0, 0)  # tick of the last motion, and how many ended in it

    @property
    def begin(self) -> Begin:
        """Where the motion in execution begins, or the next one."""
        return Begin(self._begin.tick, self._begin.s, self.begun)

    @property
    def begun(self) -> float:
        """TCP length travelled where the present block began, and beside the path since, m."""
        return self._begin.travelled + self._begin.beside

    def shift(self, travelled: float) -> None:
        """The TCP has travelled so far beside the path, m: within the block under way, or before it."""
        begin = self._begin
        if self._mover.s > begin.s:
            self._begin = begin._replace(beside=begin.beside + travelled)
        else:
            self._begin = begin._replace(travelled=begin.travelled + travelled)

    def relay(self, s: float) -> None:
        """What comes next is laid anew, from s on."""
        self._begin = self._begin._replace(s=s)

    def set_out(self, number: int) -> None:
        """From rest into the motion of entry `number`, or on within it."""
        begin = self._begin
        if number != begin.number:
            begun = self._mover.s > begin.s + _STANDING
            tick = begin.tick if begun else self._trace.tick
            self._begin = begin._replace(tick=tick, number=number)

    def finish(self, motion: Motion, number: int) -> None:
        """The path has passed the end of `motion`. Raises ExecutionError where motions go round in place."""
        place = self._route.place(number)
        assert place is not None, "a finished motion has a place"
        begin, tick = self._begin, self._trace.tick
        travelled = self._route.travelled(place)
        self._trace.emit(
            "block",
            motion.line,
            tick=begin.tick,
            t_end=self._trace.time,
            command=motion.kind.value,
            length_mm=(travelled - begin.travelled - begin.beside) / MM,
            s0_mm=begin.travelled / MM,
            limited_by=self._mover.limiters.longest(self._mover.law, begin.tick, tick),
        )
        if self.paced is not None:
            self.paced(self._pace(motion, number))
        self._finished += 1
        self._begin = _Begin(tick, travelled, place, number + 1)
        self._check_progress(motion)

    def _pace(self, motion: Motion, number: int) -> Event:
        """Of a block finished now: its programmed speeds, None where there is none, and its limits."""
        tick, trace = self._begin.tick, self._trace
        rule = self._route.rule(number)
        asked = {
            "joint_deg_s": rule.joint / DEG,
            "linear_mm_s": rule.linear / MM,
            "angular_deg_s": rule.angular / DEG,
        }
        data: dict[str, EventValue] = {
            "t_end": trace.time,
            **{key: value if math.isfinite(value) else None for key, value in asked.items()},
            "limits": self._mover.limiters.pace(self._mover.law, tick, trace.tick),
        }
        return Event(tick=tick, t=trace.time_of(tick), line=motion.line, kind="pace", data=data)

    def forget(self) -> None:
        """Now and then, drop the path that lies a good many motions behind: nothing looks back so far."""
        if self._finished >= _FORGET_EVERY:
            self._route.forget(self._kept.s, self._kept.number)
            self._mover.forget(self._kept.tick)
            self._finished, self._kept = 0, self._begin

    def _check_progress(self, motion: Motion) -> None:
        tick, count = self._without_time
        self._without_time = (self._trace.tick, count + 1 if tick == self._trace.tick else 1)
        if count > _MOST_WITHOUT_TIME:
            what = f"the program goes round in a loop through line {motion.line} whose motions have no length"
            raise ExecutionError("E412", what, motion.line)
