"""What a stretch of program will take, without running it: the kernel's own planning, block by block.

A stretch is the calls from one place where the robot stands to the next. Geometry, reach, workspace and
time laws are those of a run: the law is looked at where blocks end, and no tick is computed. Waiting for
the world takes no time here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.breaks import Start
from viapoint.runtime.kernel.buffer import WIDEST, MotionBuffer
from viapoint.runtime.kernel.course import Course, Slowdown
from viapoint.runtime.kernel.failure import MotionError
from viapoint.runtime.kernel.guard import TickGuard
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.planner import Corner, Planner
from viapoint.runtime.kernel.resolver import NO_TANGENCY, Tangency
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.records import Event, Floats
from viapoint.runtime.timing import TimeLaw
from viapoint.vm.ports import Call, Dwell, Motion, SelectTool, Track

_ARRIVED: Final = 1e-10
"""m of path within which two places are one: rounding of summed lengths."""

_FORGET_EVERY: Final = 64
"""Calls after which the route behind is dropped: seldom, since it moves arrays."""

_ROUNDING: Final = 1e-9
"""Part of a tick by which something may pass a tick and count as in it."""

_SAME: Final = 9
"""Decimals (rad, m) by which two places to stand at are told apart."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """Where the robot stands: joints (n,), auxiliary axes (k,), tool, what a tangential tool has left.

    `track` is the TRK behind which it is on a belt, None beside all belts.
    """

    q: Floats
    e: Floats
    tool: int
    tangency: Tangency = NO_TANGENCY
    track: Track | None = None

    @property
    def key(self) -> tuple[float, ...]:
        """Equal for rests that are one but for rounding."""
        values = np.round(np.concatenate((self.q, self.e)), _SAME) + 0.0
        track = (-1.0, -1.0) if self.track is None else (float(self.track.line), float(self.track.conveyor))
        return (*values.tolist(), float(self.tool), *track, *self.tangency.key)


@dataclass(frozen=True, slots=True)
class BlockForecast:
    """One motion: call `number` of the stretch; times s, lengths m, speeds m/s.

    `starting` and `stopping` are the parts of `seconds` that are lost by setting out from rest and by coming
    to rest; 0 where it does neither. `turned` are the names of the configurations it begins and ends in,
    `end` its axes at its end, rounded. On a belt, behind `track`, `joints` (N, n) are places along it; it
    is planned as if the belt stood where it was latched.
    """

    number: int
    line: int
    command: str
    seconds: float
    length: float
    peak: float
    limited_by: str
    starting: float
    stopping: float
    turned: tuple[str, str]
    end: tuple[float, ...]
    track: Track | None = None
    joints: Floats | None = field(default=None, compare=False)

    @classmethod
    def of_nothing(cls, number: int, motion: Motion) -> BlockForecast:
        """A motion that goes nowhere."""
        return cls(number, motion.line, motion.kind.value, 0.0, 0.0, 0.0, "", 0.0, 0.0, ("", ""), ())


@dataclass(frozen=True, slots=True)
class Passing:
    """An exclusive zone is entered or left, `place` m after the start of the motion in `line`."""

    line: int
    zone: str
    enters: bool


@dataclass(frozen=True, slots=True)
class Forecast:
    """A stretch: what it takes and shows, what cannot be planned, and where the robot stands behind it.

    `leaves` and `arrives` are the TCP's directions (3,) where its path begins and ends, None without one.
    """

    blocks: tuple[BlockForecast, ...]
    corners: tuple[Corner, ...]
    slowdowns: tuple[Slowdown, ...]
    passings: tuple[Passing, ...]
    failure: MotionError | None
    end: Rest
    leaves: Floats | None
    arrives: Floats | None


def forecast(cell: Cell, rest: Rest, calls: Sequence[Call]) -> Forecast:
    """Plan `calls` from where the robot stands. It stands again behind the last one."""
    return _Forecaster(cell, rest, calls).run()


class _Forecaster:
    """Plays the kernel's part, from the end of one block to the end of the next."""

    def __init__(self, cell: Cell, rest: Rest, calls: Sequence[Call]) -> None:
        self._cell = cell = Start(0, rest.q, rest.e).placed(cell)
        self._calls = calls
        self._given = 0
        self._buffer = MotionBuffer(WIDEST)
        self._planner = Planner(cell, self._buffer, rest.q, tool=rest.tool)
        self._planner.take_over(rest.tangency)
        self._mover = Mover(cell, self._planner.route, 1.0)
        self._guard = TickGuard(self._planner.monitor, Trace(_nobody, cell.tick))
        self._rest = rest
        self._tool = rest.tool
        self._track = rest.track
        self._tick = 0
        self._begin = (0, 0.0)  # tick and s in which the present block set out
        self._course = Course(cell, self._planner.route)
        self._blocks: list[BlockForecast] = []
        self._slowdowns: list[Slowdown] = []
        self._failure: MotionError | None = None

    def run(self) -> Forecast:
        try:
            self._look_ahead()
            while self._failure is None and (entry := self._buffer.to_execute()) is not None:
                self._pass(entry.number, entry.call)
                self._buffer.executed()
                self._look_ahead()
        except MotionError as error:
            self._failure = error
        planner, axes = self._planner, self._planner.route.axes
        return Forecast(
            blocks=tuple(self._blocks),
            corners=tuple(planner.corners),
            slowdowns=tuple(self._slowdowns),
            passings=tuple(Passing(each.line, each.zone, each.enters) for each in planner.zone_crossings),
            failure=self._failure or planner.failure,
            end=Rest(axes.q_end, axes.e_end, self._tool, planner.tangency, self._track),
            leaves=self._course.leaves,
            arrives=self._course.arrives,
        )

    def _look_ahead(self) -> None:
        """Hand over what there is room for, and plan it as far as a robot here would."""
        while self._feed() or self._planner.plan(self._mover.wanted):
            pass
        if self._given == len(self._calls) and self._planner.undecided and self._buffer.to_plan() is None:
            self._planner.stop()

    def _feed(self) -> bool:
        before = self._given
        while self._given < len(self._calls) and self._buffer.put(self._calls[self._given]):
            self._given += 1
        return self._given > before

    def _pass(self, number: int, call: Call) -> None:
        match call:
            case Motion():
                self._travel(number, call)
            case Dwell(seconds=seconds) if seconds > 0.0:
                self._tick += max(math.ceil(seconds / self._cell.tick - _ROUNDING), 1)
            case SelectTool(line=line, tool=tool) if tool != self._tool:
                self._tool = tool
                self._failure = self._guard.standing(self._planner.route.axes.q_end, tool, line)
            case Track():
                self._track = call if call.conveyor else None
            case _:
                pass

    def _travel(self, number: int, motion: Motion) -> None:
        """Along one motion to its end; its block is noted."""
        mover = self._mover
        place = self._planner.route.place(number)
        if place is None:  # behind what cannot be planned
            self._failure = self._planner.failure
            return
        from_rest = mover.law is None
        if from_rest:
            self._begin = (self._tick, mover.s)
        self._tool = motion.tool
        law = mover.law
        while place > mover.s + _ARRIVED:
            if mover.law is None and not mover.start(self._tick, motion.line):
                break
            law = self._go(place)
        self._note(number, motion, place, law, from_rest=from_rest)
        if law is not None and mover.s >= law.s_end:
            mover.law = None
        if number % _FORGET_EVERY == _FORGET_EVERY - 1:
            self._planner.route.forget(place, number)
            mover.forget(self._tick)

    def _go(self, place: float) -> TimeLaw:
        """To `place`, or to where the law comes to rest before it; the law by which."""
        mover, step = self._mover, self._cell.tick
        mover.extend(self._tick)
        law = mover.law
        assert law is not None, "there is one while moving"
        arrives = law.s_end <= place + _ARRIVED
        time = law.t_end if arrives else float(law.time_of(place))
        self._tick = max(self._tick, math.ceil(time / step - _ROUNDING))
        if arrives:  # the next law begins when the filter has settled
            self._tick += self._cell.filter.ticks
        mover.s = law.s_end if arrives else float(law.at(np.array([self._tick * step]))[0][0])
        if arrives and law.s_end < place - _ARRIVED:
            mover.law = None
        return law

    def _note(
        self, number: int, motion: Motion, place: float, law: TimeLaw | None, *, from_rest: bool
    ) -> None:
        begin, s = self._begin
        passed = self._passed(law)
        self._begin = (passed, place)
        if law is None or place <= s:  # a motion of no length
            self._blocks.append(BlockForecast.of_nothing(number, motion))
            return
        at_rest = self._mover.s >= law.s_end
        seen = self._course.block(law, s, place, motion.line, from_rest=from_rest, at_rest=at_rest)
        self._slowdowns += seen.slowdowns
        self._blocks.append(
            BlockForecast(
                number=number,
                line=motion.line,
                command=motion.kind.value,
                seconds=(passed - begin) * self._cell.tick,
                length=seen.length,
                peak=seen.peak,
                limited_by=self._mover.limiters.longest(self._mover.law, begin, self._tick),
                starting=seen.starting,
                stopping=seen.stopping,
                turned=seen.turned,
                end=seen.end,
                track=self._track,
                joints=None if self._track is None else self._course.joints(s, place),
            )
        )

    def _passed(self, law: TimeLaw | None) -> int:
        """The tick in which a block ends: set points are sent half the filter late on the way."""
        if law is None or self._mover.s >= law.s_end:
            return self._tick
        return self._tick + math.ceil(0.5 * self._cell.filter.ticks)


def _nobody(event: Event) -> None:
    """Events of a forecast are not told."""
