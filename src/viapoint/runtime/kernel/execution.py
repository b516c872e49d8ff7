"""Entries of the motion buffer taking effect, one after the other, in the tick in which the path is there."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import assert_never

from viapoint.language.units import MM
from viapoint.runtime.kernel.blocks import Blocks
from viapoint.runtime.kernel.buffer import Entry, MotionBuffer
from viapoint.runtime.kernel.dialogue import Dialogue
from viapoint.runtime.kernel.failure import ExecutionError
from viapoint.runtime.kernel.interrupts import Interrupts
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.onpath import OnPath
from viapoint.runtime.kernel.planner import Planner
from viapoint.runtime.kernel.pulses import Pulses
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.signals import SignalWorld
from viapoint.vm.ports import (
    BEGINNING,
    Barrier,
    Decision,
    Dwell,
    End,
    HandleErrors,
    Modal,
    Motion,
    PathAction,
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

RoomFor = Callable[[int, int], ExecutionError | None]
"""What keeps the robot from having a tool where it stands, if anything, at a source line."""


class Execution:
    """Where the program is, as far as the robot has come: line, tool, what it waits out."""

    def __init__(
        self,
        buffer: MotionBuffer,
        world: SignalWorld,
        trace: Trace,
        planner: Planner,
        mover: Mover,
        room_for: RoomFor,
        interrupts: Interrupts,
    ) -> None:
        self.tool = 0
        self.tangent: float | None = None
        """deg between tool and heading while the tool keeps to the tangent; None: it does not."""
        self.statements = 0
        """Statements executed so far."""
        self.dwell_until: int | None = None
        """Tick in which a wait for a time is over."""
        self.ended = False
        """The program's end has been executed."""
        self.decision: Decision | None = None
        """What it says of the error that was handled."""
        self.blocks = Blocks(planner.route, mover, trace)
        self.track: Callable[[Track], None] = lambda call: None
        """What a TRK does when the path has reached it."""
        self.on_path = OnPath(planner.route, mover, trace.tick_s)
        self.pulses = Pulses()
        self.interrupts = interrupts
        self._modal = BEGINNING
        self._buffer = buffer
        self._world = world
        self._trace = trace
        self._planner = planner
        self._mover = mover
        self._room_for = room_for
        self._line = 0  # of the last entry executed
        self._roomy: tuple[int, set[int]] = (-1, set())  # tools for which there is room, in that tick
        self._travelled = (0.0, 0.0)  # the place on the route asked for last, and the TCP length up to it, m

    @property
    def tick(self) -> int:
        """The present tick."""
        return self._trace.tick

    @property
    def front(self) -> Entry | None:
        """The entry to take effect next, if it has been planned."""
        return self._buffer.to_execute()

    @property
    def line(self) -> int:
        """Source line the path is in."""
        entry = self.front
        return entry.call.line if entry is not None and isinstance(entry.call, Motion) else self._line

    @property
    def travelled_mm(self) -> float:
        """TCP length travelled to where the path is now. Many actions may ask in one place."""
        s, travelled = self._travelled
        if s != self._mover.s:
            s, travelled = self._travelled = self._mover.s, self._planner.route.travelled(self._mover.s)
        return travelled / MM

    @property
    def modal(self) -> Modal:
        """What holds at the robot's place: speed and tool as programmed by then."""
        entry = self.front
        if entry is None or not isinstance(entry.call, Motion) or self._mover.s <= self.blocks.begin.s:
            return self._modal
        return self._modal._replace(speed=entry.call.speed)

    def begin(self, modal: Modal, line: int | None = None) -> None:
        """A program begins in a line, with what holds there."""
        self._modal = modal
        self._line = self._line if line is None else line

    def accompany(self, other: Execution) -> None:
        """Begin beside another one at its place: what it has begun goes on here."""
        self.tool, self.tangent, self.statements = other.tool, other.tangent, other.statements
        self.pulses = other.pulses
        self._travelled = (math.nan, 0.0)

    def resume(self, other: Execution, travelled: float) -> None:
        """Go on where this was left, after `other` has travelled so far beside this path, m."""
        self.statements = other.statements
        self.blocks.shift(travelled)
        self._travelled = (math.nan, 0.0)

    def execute(self, entry: Entry, dialogue: Dialogue) -> None:
        """The path has reached `entry`: it takes effect in this tick and its slot is free."""
        call, trace = entry.call, self._trace
        self._line = call.line
        match call:
            case Motion():
                self._modal = self._modal._replace(speed=call.speed)
                for action in self.on_path.leave(entry):
                    self._write(action.call)
                self._finish_block(call, entry.number)
            case SetOutput() | SetLevel() | SetVariable() | Pulse():
                self._write(call)
            case SelectTool(line=line, tool=tool):
                self._pick_up(tool, line)
                self._modal = self._modal._replace(tool=tool)
                trace.emit("tool", line, index=tool)
            case RaiseM():
                self._write(call)
                dialogue.raise_m(call)
            case Dwell():
                self._dwell(call)
            case Barrier():
                dialogue.reach_barrier(call, self.statements)
            case End(decision=decision):
                self.ended, self.decision = True, decision
            case Tangent(line=line, on=on, offset=offset):
                self.tangent = offset if on else None
                trace.emit("tangent", line, on=on, offset_deg=offset)
            case Track():
                self.track(call)
            case SwitchOn():
                self.interrupts.switch_on(call, trace.tick)
            case HandleErrors():
                self.interrupts.handles_errors = call
            case SwitchOff():
                self.interrupts.switch_off(call)
            case _:
                assert_never(call)
        self._buffer.executed()
        self.statements += 0 if isinstance(call, Barrier) else 1

    def act(self, action: PathAction) -> None:
        """The path has reached the place of an action on the motion it is in."""
        self._write(action.call)
        self.on_path.done(action)

    def end_pulses(self) -> None:
        """Switch off the outputs whose pulse is over by now."""
        for pulse in self.pulses.over(self._trace.tick):
            self._switch(pulse.line, pulse.index, False)

    def _write(self, call: Write | RaiseM) -> None:
        world, trace = self._world, self._trace
        match call:
            case SetOutput(line=line, index=index, value=value):
                self.pulses.cancel(index)
                self._switch(line, index, value)
            case Pulse(line=line, index=index, seconds=seconds):
                self.pulses.start(call, trace.tick + max(world.ticks(seconds), 1))
                self._switch(line, index, True)
            case SetLevel(line=line, index=index, value=value):
                world.write_level(index, value, trace.tick)
                trace.emit("output", line, signal=f"AO{index}", value=value, s_mm=self.travelled_mm)
            case SetVariable(line=line, name=name, value=given, adds=adds):
                value = world.write_variable(name, given, trace.tick, adds=adds)
                trace.emit("output", line, signal=f"${name}", value=value, s_mm=self.travelled_mm)
            case RaiseM(line=line, index=index):
                world.raise_m(index, trace.tick)
                trace.emit("m", line, index=index, action="raised")
            case _:
                assert_never(call)

    def _switch(self, line: int, index: int, value: bool) -> None:
        self._world.write_output(index, value, self._trace.tick)
        self._trace.emit("output", line, signal=f"DO{index}", value=value, s_mm=self.travelled_mm)

    def passable(self, entry: Entry) -> bool:
        """Whether an action takes effect on a moving path; others, and motions, need their place first."""
        match entry.call:
            case Track():
                return False
            case (
                SetOutput() | SetLevel() | SetVariable() | Pulse() | SwitchOn() | HandleErrors() | SwitchOff()
            ):
                return True
            case Tangent(on=on, offset=offset):
                return (offset if on else None) == self.tangent
            case RaiseM(synchronous=synchronous):
                return not synchronous
            case SelectTool(tool=tool):
                return tool == self.tool
            case Motion() | Barrier() | Dwell() | End():
                return False
            case _:
                assert_never(entry.call)

    def _dwell(self, call: Dwell) -> None:
        ticks = max(self._world.ticks(call.seconds), 1) if call.seconds > 0.0 else 0
        self.dwell_until = self._trace.tick + ticks if ticks else None
        until = self._trace.time_of(self._trace.tick + ticks)
        self._trace.emit("wait", call.line, t_end=until, reason=f"{call.seconds:g} s")

    def _pick_up(self, tool: int, line: int) -> None:
        """From now on the robot has that tool. Raises ExecutionError where there is no room for it."""
        tick, roomy = self._roomy
        if tick != self._trace.tick:
            self._roomy = self._trace.tick, (roomy := {self.tool})
        if tool not in roomy:
            if failure := self._room_for(tool, line):
                raise failure
            roomy.add(tool)
        self.tool = tool

    def _finish_block(self, motion: Motion, number: int) -> None:
        try:
            self.blocks.finish(motion, number)
        except ExecutionError as error:
            self._planner.abort(error)  # the robot may be moving: it stops where the path known by now ends
