"""ON c SUB L as the kernel sees it: the robot stops, runs the subroutine on a path of its own, and goes on.

The program's level is put aside as it stands, as for a halt; the subroutine gets one that begins where the
robot is, and leads back there at its end by a joint move. Interrupts do not interrupt each other.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.language.units import DEG
from viapoint.runtime.cell import Frame, Point
from viapoint.runtime.kernel.breaks import HERE, Start
from viapoint.runtime.kernel.buffer import MotionBuffer
from viapoint.runtime.kernel.failure import ExecutionError, MotionError, may_be_handled
from viapoint.runtime.kernel.interrupts import Interrupts
from viapoint.runtime.kernel.levels import Grounds, Level
from viapoint.runtime.kernel.passing import Passing
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.returning import joint_move
from viapoint.runtime.kernel.searching import Searching
from viapoint.runtime.kernel.states import Hold
from viapoint.runtime.kernel.tracker import Phase
from viapoint.runtime.kernel.tracking import Tracking
from viapoint.runtime.records import Floats
from viapoint.vm.ports import Call, Decision, End, HandleErrors, SelectTool, SwitchOn

_BACK: Final = 1e-12
"""rad or m within which an axis is back where it was: rounding of deg and mm."""

_MOST_IN_A_TICK: Final = 16
"""Errors handled in one tick: more are a loop that never ends."""

_LEAST_BUFFER: Final = 3
"""Slots for the way back: the tool, the move, the end behind it."""


@dataclass(frozen=True, slots=True)
class _Interrupted:
    """What was put aside for an interrupt, and where the robot stood: joints (n,), other axes (k,)."""

    level: Level
    by: SwitchOn | HandleErrors
    q: Floats
    e: Floats
    error: MotionError | None = None
    """Which is handled."""


class Interrupting(Tracking):
    """The side of a kernel that interrupts see."""

    interrupts: Interrupts
    _grounds: Grounds
    _stepping: bool
    _buffer: MotionBuffer
    _searching: Searching
    _passing: Passing
    _last_s = 0.0  # s in the last tick computed
    _interrupted: _Interrupted | None = None
    _handled = (-1, 0)  # the tick in which an error was handled last, and how many were in it

    @property
    @abstractmethod
    def _held(self) -> bool:
        """Whether the path is kept from going on."""

    def place(self, what: Point | Frame) -> None:
        """A live point or frame is here from now on."""
        self.planner.place(what)
        if self._interrupted is not None:
            self._interrupted.level.planner.place(what)

    # --- when ------------------------------------------------------------------------------------------

    def _watch(self) -> bool:
        """Look at the conditions in the present tick; True if the law changed, to stop for one."""
        for call in self.interrupts.look(self.trace.tick) if self.interrupts.any else ():
            self.dialogue.holds(call.condition, line=call.line)  # leaves the reads in the trace
            self._tell(call, "triggered")
        if not self.interrupts.due or self.interrupts.stopping or not self._interruptible:
            return False
        if self.mover.law is None or self.mover.direction < 0.0:
            return False
        self.interrupts.stop_for_them()
        return not self.outlet.feed.settling and self.mover.halt(self.trace.tick)

    @property
    def _interruptible(self) -> bool:
        """Not on a belt, nor while another one runs."""
        return self._interrupted is None and self.outlet.feed.tracker.phase in (Phase.OFF, Phase.WAITING)

    @property
    def _may_be_interrupted(self) -> bool:
        """Whether one may still come about while the robot waits."""
        return self._interrupted is None and self.interrupts.may_come

    @property
    def _frontier_pause(self) -> float | None:
        """On the way back to where the program was left, that place, if an interrupt waits there."""
        astray = self.mover.s < self._frontier - HERE
        return self._frontier if astray and self.interrupts.due and self._interruptible else None

    def _tell(self, call: SwitchOn | HandleErrors, action: str, reason: str = "") -> None:
        label, s_mm = call.handler.label, self.execution.travelled_mm
        if reason:
            self.trace.emit("interrupt", call.line, action=action, label=label, s_mm=s_mm, reason=reason)
        else:
            self.trace.emit("interrupt", call.line, action=action, label=label, s_mm=s_mm)

    # --- levels ----------------------------------------------------------------------------------------

    def _take_up(self, level: Level) -> None:
        """Go on with a level."""
        self._buffer, self.planner, self.mover = level.buffer, level.planner, level.mover
        self.breaks, self.execution, self.dialogue = level.breaks, level.execution, level.dialogue
        self._searching, self._passing, self.access = level.searching, level.passing, level.access
        self._frontier, self._last_s = level.frontier, level.last_s

    def _put_aside(self) -> Level:
        """The present level as it stands."""
        return Level(
            self._buffer,
            self.planner,
            self.mover,
            self.breaks,
            self.execution,
            self.dialogue,
            self._searching,
            self._passing,
            self.access,
            self._frontier,
            self._last_s,
        )

    def _begin_interrupt(self) -> bool:
        """At rest, with nothing that keeps the path from going on: begin with one that is due, if one is."""
        if self._held or not self.interrupts.due or not self._interruptible:
            return False
        call = self.interrupts.take()
        assert call is not None, "one is due"
        self._begin(call)
        return True

    def _begin(self, call: SwitchOn | HandleErrors, error: MotionError | None = None) -> None:
        """At rest: the program is put aside for a subroutine."""
        self._tell_wait()
        below = self._put_aside()
        q, e = below.planner.stand(below.mover.s)
        self._interrupted, self._aside = _Interrupted(below, call, q, e, error), True
        self._take_up(self._level_beside(self._interrupted))
        self.outlet.feed.change_path(self.planner.route, self.mover.s)
        self._tell(call, "begun")

    def _level_beside(self, interrupted: _Interrupted) -> Level:
        """The level of a subroutine, where the robot stands."""
        below, q, e = interrupted.level, interrupted.q, interrupted.e
        error = 0 if interrupted.error is None else int(interrupted.error.code[1:])
        cell, modal, tangent = self._grounds.cell, below.execution.modal, below.execution.tangent
        buffer = MotionBuffer(max(cell.lookahead, _LEAST_BUFFER))
        placed = Start(self.trace.tick, q, e).placed(cell)
        planner = Planner(placed, buffer, q, tool=below.execution.tool, stepping=self._stepping)
        planner.accompany(below.planner, None if tangent is None else tangent * DEG)
        planner.route.axes.beside = _lengths(below)
        level = self._grounds.level(planner, buffer, below.mover.override)
        level.breaks.lines = below.breaks.lines
        level.execution.accompany(below.execution)
        interpreter = below.dialogue.handling(interrupted.by.handler, level.dialogue, modal, error)
        level.execution.begin(modal, interpreter.line)
        level.execution.blocks.paced = below.execution.blocks.paced
        level.dialogue.open(interpreter)
        return level

    def _way_back(self, interrupted: _Interrupted) -> list[Call]:
        """What is left to do until the robot stands as it did, with the tool it had."""
        here, there = np.concatenate(self.planner.stand(self.mover.s)), (interrupted.q, interrupted.e)
        line, tool = self.execution.line, interrupted.level.execution.tool
        way: list[Call] = []
        if self.execution.tool != tool:
            way.append(SelectTool(line=line, tool=tool))
        if np.abs(here - np.concatenate(there)).max() > _BACK:
            way.append(joint_move(self.cell, *there, line=line, tool=tool, speed=None))
        return [*way, End(line=line, decision=self.execution.decision)] if way else []

    def _end_interrupt(self) -> None:
        """The subroutine is over: back to where the path was left, then on along it."""
        interrupted = self._interrupted
        assert interrupted is not None, "an interrupt has begun"
        error, decision = interrupted.error, self.execution.decision
        if error is not None and decision in (None, Decision.STOP):
            raise error
        if way := self._way_back(interrupted):
            for call in way:
                self._buffer.put(call)
            self.execution.ended = False
            return
        self._tell(interrupted.by, "returned", str(decision or ""))
        above, below = self._put_aside(), interrupted.level
        self._interrupted, self._aside = None, False
        more, axes = _lengths(above) - _lengths(below), below.planner.route.axes
        axes.beside = more if axes.beside is None else axes.beside + more
        below.execution.resume(above.execution, float(more[-2]))
        below.mover.override = above.mover.override
        below.breaks.lines = above.breaks.lines
        if above.breaks.steps:
            below.breaks.step(0)
        self._take_up(below)
        if error is not None:
            if decision is Decision.RESUME_NEXT:
                self._buffer.skip(error.line)
            self._begin_anew()
        self.outlet.feed.change_path(self.planner.route, self.mover.s)

    # --- errors ----------------------------------------------------------------------------------------

    def _handle(self, error: MotionError) -> bool:
        """At rest, with an error that would end the run: True if the program handles it, from now on."""
        call = self.interrupts.handles_errors
        if call is None or self._interrupted is not None or not self._can_be_handled(error):
            return False
        tick, times = self._handled
        times = times + 1 if tick == self.trace.tick else 1
        self._handled = self.trace.tick, times
        if times > _MOST_IN_A_TICK:
            what = f"errors are handled again and again without time passing, the last one {error}"
            raise ExecutionError("E414", what, error.line)
        self.trace.emit(
            "interrupt",
            error.line,
            action="triggered",
            label=call.handler.label,
            code=error.code,
            message=error.message,
            s_mm=self.execution.travelled_mm,
        )
        self._begin(call, error)
        return True

    def _can_be_handled(self, error: MotionError) -> bool:
        """Whether it may be, and nobody has asked the robot to stop."""
        stopped = self._hold in (Hold.STOP, Hold.EMERGENCY) or self.guard.alarm is not None
        if stopped or not self._interruptible:
            return False
        return may_be_handled(error)

    def _begin_anew(self) -> None:
        """What the program has not executed yet is planned again from where the robot stands."""
        execution, tangent = self.execution, self.execution.tangent
        if self.access is not None:
            self.access.part(self.mover.s)
        offset = None if tangent is None else tangent * DEG
        place = self.planner.begin_anew(self.mover.s, execution.tool, offset)
        self._last_s = self._frontier = self.mover.s = place
        execution.on_path.relay()
        execution.blocks.relay(place)
        if (failure := self.dialogue.failure) is not None:
            self.planner.abort(failure)


def _lengths(level: Level) -> Floats:
    """(4,): TCP length and angle, limited and as travelled, where the robot stands."""
    return level.planner.route.axes.standing(level.mover.s)[-4:]
