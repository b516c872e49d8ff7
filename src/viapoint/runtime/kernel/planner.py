"""The planner: takes entries from the motion buffer in program order and lays the route for them.

It runs ahead of the robot as far as the buffer reaches, takes no simulated time, and decides where the
path must stop. What it cannot plan becomes a failure that stands behind everything before it: the robot
runs on to the last exact stop that is sure, and halts there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.language.units import DEG
from viapoint.runtime.cell import Cell, Frame, Point, SignalKind
from viapoint.runtime.kernel.acting import ActingMotions
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.buffer import Entry, MotionBuffer
from viapoint.runtime.kernel.failure import ExecutionError, MotionError, PlanningError
from viapoint.runtime.kernel.guard import PathGuard, ZoneCrossing
from viapoint.runtime.kernel.resolver import Resolver, Tangency
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.kernel.winding import Winding
from viapoint.runtime.kernel.zones import Passage
from viapoint.runtime.path import Chain, Corners, GeometryError, Piece, Transition
from viapoint.runtime.records import Floats
from viapoint.runtime.workspace import Monitor
from viapoint.vm.conditions import Reading
from viapoint.vm.ports import (
    Barrier,
    Dwell,
    End,
    HandleErrors,
    Motion,
    Pulse,
    RaiseM,
    SelectTool,
    SetLevel,
    SetOutput,
    SetVariable,
    SwitchOff,
    SwitchOn,
    Tangent,
    Track,
    Write,
)

_BATCH: Final = 32
"""Entries planned at a time, and at least ahead of the robot."""


@dataclass(frozen=True, slots=True)
class Corner:
    """A row of the blend report: how the path passes from one motion into the next."""

    line: int
    next_line: int | None
    transition: Transition
    forced_by_line: int | None


class Planner:
    """Owns the chain of geometry and the route; `failure` is set once, and planning ends with it."""

    def __init__(
        self, cell: Cell, buffer: MotionBuffer, q_start: Floats, *, tool: int = 0, stepping: bool = False
    ) -> None:
        self.route = Route(cell.robot, q_start, AuxiliaryAxes.of(cell))
        self.failure: MotionError | None = None
        self.corners: list[Corner] = []
        self.laid: Callable[[Sequence[Piece]], None] | None = None
        """Told of every finished piece of path, for drawings."""
        self.zone_crossings: list[ZoneCrossing] = []
        """Where the path enters and leaves exclusive zones."""
        self.crossed: Callable[[Passage], None] | None = None
        """Told of them too, by their place on the route."""
        self.tracks = False
        """Whether TRK is a barrier: what lies behind it depends on where the belt is then."""
        self._aside = False  # beside the program's path
        self._barred = False
        self._aborted: MotionError | None = None  # behind the barrier
        self._buffer = buffer
        self._resolver = Resolver(cell, q_start)
        self._corners = Corners(cell.path_tolerance)
        self._chain = self._new_chain()
        self._stepping = stepping
        self._winding = Winding()
        self._io = cell.io
        self._acting = ActingMotions(self.route)
        self._lines: dict[int, int] = {}  # of the motions from the oldest one whose end is undecided on
        self._decided: set[int] = set()  # tags among them whose end is
        self._open: int | None = None  # tag of the motion whose corner is not decided yet
        self._tool = tool
        self._last = -1  # tag of the last motion
        self._forced_by: dict[int, int] = {}  # tag of a motion to the line that makes its end a stop
        self.monitor = Monitor(cell)
        self._guard = PathGuard(self.monitor, self.route.tool_of, self._cross)
        self._watch_path()

    def _new_chain(self) -> Chain:
        return Chain(tolerance=self._corners.tolerance, corners=self._corners)

    def _cross(self, crossing: ZoneCrossing, begin: float) -> None:
        self.zone_crossings.append(crossing)
        if self.crossed is not None:
            s = begin + crossing.place * crossing.length
            self.crossed(Passage(s, crossing.zone, crossing.enters))

    @property
    def tangency(self) -> Tangency:
        """What a tangential tool leaves to the motions that come."""
        return self._resolver.tangency

    def take_over(self, tangency: Tangency) -> None:
        """Begin where a tangential tool has left this."""
        self._resolver.take_over(tangency)

    @property
    def undecided(self) -> bool:
        """Whether the last motion waits to know what comes after it."""
        return self._open is not None

    def plan(self, s: float = np.inf) -> bool:
        """Plan what the buffer holds, as far as a robot that shall see the route up to `s` needs it.

        True if there was anything to plan. A batch of entries is planned at a time, since many at once
        cost less than one by one.
        """
        if self.failure is not None or self._barred or self._buffer.to_plan() is None or self._sees(s):
            return False
        try:
            batch = self._buffer.planner + _BATCH if np.isfinite(s) else None
            while (
                (entry := self._buffer.to_plan()) is not None and entry.number != batch and not self._barred
            ):
                self._plan(entry)
                self._buffer.planned()
        except MotionError as error:
            self._fail(error)
        else:
            self._lay()
        return True

    def _sees(self, s: float) -> bool:
        return self._buffer.planner - self._buffer.generator >= _BATCH and self.route.end >= s

    def place(self, what: Point | Frame) -> None:
        """A live point or frame is here from now on."""
        self._resolver.places.place(what)

    def keep(self, point: int, motion: Motion, s: float) -> None:
        """The point of the cell becomes the pose at s, in the frame of `motion`."""
        q, e = self.stand(s)
        self._resolver.places.keep(point, motion, q, e)

    def accompany(self, other: Planner, offset: float | None) -> None:
        """Plan a path beside that of `other`: points and frames as there, in one report, one drawing.

        `offset` (rad) is that of a tangential tool, None without one; its orientation is as it stands.
        """
        self._aside = True
        self._resolver.places.adopt(other._resolver.places)
        self._resolver.offset = offset
        self.corners, self.zone_crossings, self.laid = other.corners, other.zone_crossings, other.laid

    def end_here(self, tag: int, s: float) -> float:
        """Motion `tag`, behind which nothing is planned, ends at s; s of that place from now on."""
        place = self.route.cut(tag, s)
        self._chain = self._new_chain()
        self._acting.begin_anew()
        self._resolver.begin_anew(*self.stand(place))
        return place

    def begin_anew(self, s: float, tool: int, offset: float | None) -> float:
        """After a failure: what is not executed yet is planned again, from where the robot stands at s.

        It has a tool there, and a tangential one the offset (rad). s of that place from now on.
        """
        self._buffer.plan_again()
        self.route.unplace(self._buffer.generator)
        place = self.route.part(s)
        self.failure, self._barred, self._open, self._tool = None, False, None, tool
        self._chain = self._new_chain()
        self._acting.begin_anew()
        self._winding.begin()
        self._lines.clear()
        self._decided.clear()
        self._resolver.begin_anew(*self.stand(place))
        self._resolver.take_over(Tangency(offset))
        self._watch_path(planned=not self._resolver.places.shift.any())
        return place

    def stand(self, s: float) -> tuple[Floats, Floats]:
        """Joints (n,) and auxiliary axes (k,) at s."""
        axes = self.route.axes
        columns = axes.standing(s)
        return columns[: axes.n], columns[axes.n : axes.driven]

    def stop(self) -> None:
        """Nothing more will come for now: the path stops exactly at the end of the last motion."""
        self.close()
        self._lay()

    def close(self, line: int | None = None) -> None:
        """The path stops exactly at the end of the last motion; `line` is the statement that makes it."""
        if self._open is None:
            return
        self._open = None
        with self._named(self._last):
            self._chain.close()
        if line is not None:
            self._forced_by[self._last] = line

    def abort(self, error: MotionError) -> None:
        """The interpreter cannot go on: what is in the buffer is still run, then `error` stands."""
        self.plan()
        if self._barred:
            self._aborted = self._aborted or error
        elif self.failure is None:
            self._fail(error)

    def go_on(self) -> None:
        """Plan what lies behind a TRK."""
        self._barred = False
        if self._aborted is not None:
            error, self._aborted = self._aborted, None
            self.abort(error)

    def rebase(self, q: Floats, shift: Floats) -> None:
        """At a TRK: the path goes on from joints q (n,), with all frames displaced by `shift` (3,) m."""
        self.route.rebase(q)
        self._resolver.rebase(q, shift)
        self._watch_path(planned=not shift.any())  # a belt's path is looked at where it really is, per tick
        self.go_on()

    def _watch_path(self, *, planned: bool = True) -> None:
        if self.monitor.active:
            self._guard.begin_anew()
            self.route.axes.inspect = self._guard.inspect if planned else None

    def _plan(self, entry: Entry) -> None:
        match entry.call:
            case Motion() as motion:
                self._motion(motion, entry.number)
            case SelectTool(line=line, tool=tool):
                self._resolver.places.tool(tool, line)
                if tool != self._tool:
                    self.close(line)
                    self._tool = tool
            case Barrier(line=line) | Dwell(line=line) | End(line=line):
                self.close(line)
            case RaiseM(line=line, synchronous=synchronous):
                if synchronous:
                    self.close(line)
            case SetOutput() | SetLevel() | SetVariable() | Pulse() as write:
                self._check_write(write)
            case SwitchOn():
                self._check_readings(entry.call)
            case SwitchOff() | HandleErrors():
                pass
            case Track(line=line) if self._aside:
                what = "a subroutine that interrupts cannot follow a conveyor, or leave one"
                raise PlanningError("E322", what, line)
            case Track(line=line, conveyor=conveyor):
                if conveyor and self._resolver.rides:
                    what = "conveyor tracking (TRK) with an axis that carries the robot cannot be run yet"
                    raise PlanningError("E390", what, line)
                self.close(line)
                self._barred = self.tracks
            case Tangent(line=line, on=on, offset=offset):
                self._tangent(offset * DEG if on else None, line)

    def _tangent(self, offset: float | None, line: int) -> None:
        """From here on the tool keeps to the tangent, with an offset in rad, or no longer: from a stop on."""
        if offset != self._resolver.offset:
            self.close(line)
            self._resolver.offset = offset
            self._winding.begin()

    def _check_write(self, write: Write) -> None:
        if isinstance(write, SetVariable):
            variable = self._io.variable(write.name)
            switch = not write.adds and isinstance(write.value, bool)
            if variable is None:
                raise PlanningError("E314", f"the cell declares no variable ${write.name}", write.line)
            if self._io.is_switch(variable) is not switch:
                what = f"in this cell {variable} is {'a number' if switch else 'true or false'}"
                raise PlanningError("E314", what, write.line)
            return
        kind = SignalKind.ANALOG_OUTPUT if isinstance(write, SetLevel) else SignalKind.DIGITAL_OUTPUT
        if write.index > self._io.counts[kind]:
            raise PlanningError("E314", f"the cell has no output {kind.value}{write.index}", write.line)

    def _check_readings(self, call: SwitchOn) -> None:
        for reading in call.condition.readings:
            if not self._has(reading):
                kind = f" that is {'true or false' if reading.is_switch else 'a number'}"
                what = f"the cell has no {reading}{kind if reading.name else ''}"
                raise ExecutionError("E411", what, call.line)

    def _has(self, reading: Reading) -> bool:
        if reading.name:
            variable = self._io.variable(reading.name)
            return variable is not None and self._io.is_switch(variable) is reading.is_switch
        return reading.kind == "M" or 1 <= reading.number <= self._io.counts[SignalKind(reading.kind)]

    def _motion(self, motion: Motion, tag: int) -> None:
        for action in motion.actions:
            if not isinstance(action.call, RaiseM):
                self._check_write(action.call)
        if motion.tool != self._tool:
            self.close(motion.line)
            self._tool = motion.tool
        if self._resolver.must_stop_before(motion):
            self.close(motion.line)
        if self._open is None:  # the path stops here: what it really ends in is known
            self._take()
            self._resolver.arrive(self.route.axes.q_end)
        resolved = self._resolver.resolve(motion, tag)
        move = resolved.move if resolved.move.tag == tag else replace(resolved.move, tag=tag)
        if self._stepping:
            move = replace(move, corner=replace(move.corner, stop=True))
        self.route.announce(tag, resolved, motion.line, motion.tool, motion.frame)
        self._acting.announce(motion.actions, tag, self._last, move)
        self._lines[tag] = motion.line
        self._open = self._last = tag
        with self._named(tag):
            self._chain.push(move, resolved.segment)

    @contextmanager
    def _named(self, tag: int) -> Iterator[None]:
        """Geometry that fails names the line of its motion, or else that of motion `tag`."""
        try:
            yield
        except GeometryError as error:
            line = self.route.line_of(tag if error.tag is None else error.tag)
            raise PlanningError(error.code, error.message, line) from None

    def _take(self) -> None:
        """Hand finished pieces and decided corners over."""
        pieces, marks, transitions = self._chain.take()
        if self.laid is not None:
            self.laid(pieces)
        for transition in transitions:
            self._report(transition)
        known, marks = self._acting.hold_back(pieces, marks)
        try:
            self.route.take(known, marks)
        except MotionError as error:
            raise self._winding.explained(error, known, self.route.line_of) from None
        self._winding.take(known)
        self._acting.check()

    def _report(self, transition: Transition) -> None:
        """A row of the blend report. A motion of no length may be decided before the one ahead of it."""
        tag, following = transition.tag, transition.next_tag
        next_line = None if following is None else self._lines[following]
        self.corners.append(Corner(self._lines[tag], next_line, transition, self._forced_by.pop(tag, None)))
        self._decided.add(tag)
        while self._lines and (oldest := next(iter(self._lines))) in self._decided:
            self._decided.remove(oldest)
            del self._lines[oldest]

    def _lay(self) -> None:
        """Lay the route for what is decided. Where it fails, nothing that comes after has a place."""
        try:
            self._take()
        except MotionError as error:
            self.failure = error
            self._open = None
            self.route.stop_here()

    def _fail(self, error: MotionError) -> None:
        """Everything before the failure stands, and the path ends there at rest."""
        self.failure = error
        try:
            self.close()
        except MotionError as earlier:  # of a spline that waited for what comes after it
            self.failure = earlier
        self._chain.close()
        self._lay()  # what came before may not be plannable either: then that is the failure
        self.route.stop_here()
