"""A session: a program on a simulated cell. The one place that knows compiler, machine and runtime.

Command line and library share it. It runs in windows of ticks, hands every window and event to its
listeners, and reports. It prints nothing and reads no arguments. Compiling is `viapoint.compiling`'s, whose
names are here too.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import Enum, unique
from functools import partial
from typing import Any, Final, Protocol

import numpy as np

from viapoint.compiling import CompileError, Loaded, cell_names, check_file, compile_file, compile_text
from viapoint.jogging import HeldJog, demand
from viapoint.runtime.cell import Cell, moved_frame, moved_point
from viapoint.runtime.kernel import (
    AuxiliaryAxes,
    Command,
    Corner,
    ExclusiveZones,
    Kernel,
    MotionError,
    Sensor,
    Start,
    State,
    referenced,
)
from viapoint.runtime.records import Event, Floats, Window
from viapoint.runtime.signals import Scenario, SignalBank, SignalWorld
from viapoint.starting import Approaching, LineStart, start_at
from viapoint.vm import Machine

__all__ = [
    "DEFAULT_WINDOW",
    "CompileError",
    "Listener",
    "Loaded",
    "Session",
    "Status",
    "cell_names",
    "check_file",
    "compile_file",
    "compile_text",
]

DEFAULT_WINDOW = 1024

_RESTING: Final = (State.HALTED, State.EMERGENCY)
_AWAITING: Final = (State.WAITING, State.POLLING)


@unique
class Status(Enum):
    """How a run ended, or that it has not."""

    RUNNING = "running"
    FINISHED = "finished"
    STOPPED = "stopped"
    ERROR = "error"


class Listener(Protocol):
    """Gets every window and every event once, in time order."""

    def window(self, window: Window) -> None: ...
    def event(self, event: Event) -> None: ...


class Session:
    """One run of one program on one cell, with simulated drives and signals.

    `max_time` (s) and `cycles` (passes of the main program's endless loop) end endless programs;
    `first_line` is where it starts, with what the lines above leave (`start`); `last_line` is the last one
    executed. With `step` every motion ends in an exact stop.
    `sensors` correct the path while it runs, beside the scenario's corrections.
    `window` is the most ticks computed at once; it has no influence on the result. `events` and `corners`
    hold all of the run, or with `keep` about the last so many, for runs without end; listeners hear every
    event. A session runs once.
    Raises ValueError for an override outside 0 … 1 (0 excluded), a window of no ticks, a time not finite, or
    less than one event to keep; StartError, which is one, for a line from which it cannot start.
    """

    def __init__(
        self,
        cell: Cell,
        program: Loaded,
        *,
        scenario: Scenario | None = None,
        override: float = 1.0,
        window: int = DEFAULT_WINDOW,
        max_time: float | None = None,
        cycles: int | None = None,
        first_line: int | None = None,
        last_line: int | None = None,
        step: bool = False,
        dry_run: bool = False,
        patient: bool = False,
        keep: int | None = None,
        world: SignalWorld | None = None,
        zones: ExclusiveZones | None = None,
        sensors: Sequence[Sensor] = (),
        listeners: Sequence[Listener] = (),
    ) -> None:
        _require(override, window, max_time, keep)
        self.cell = cell
        self.program = program
        self.events: list[Event] = []
        self.status = Status.RUNNING
        self._keep = keep
        self._motions = 0  # finished so far
        self._listeners = tuple(listeners)
        self._window = window
        self._last_tick = None if max_time is None else round(max_time / cell.tick)
        self._world = world or SignalWorld(cell, scenario, cell.tick, dry_run=dry_run)
        self._cycles, self._last_line = cycles, last_line
        self.start: LineStart | None = None
        """What holds at `first_line`."""
        if first_line is not None:
            self.start = start_at(program.program, cell, first_line, cycles=cycles, last_line=last_line)
        self._made = partial(
            Kernel,
            world=self._world,
            listener=self._hear,
            stepping=step,
            patient=patient,
            zones=zones,
            sensors=sensors,
        )
        here = replace(Start.at_home(cell), tool=self.start.tool if self.start is not None else 0)
        self.kernel = self._made(cell, override=override, start=here)
        self._machine = self._interpreter()
        self._wall = 0.0

    def _interpreter(self) -> Machine:
        """The program at its beginning, for the kernel."""
        ports = self.kernel.dialogue
        if self.start is not None:
            return self.start.machine.twin(Approaching(ports, self.start), ports)
        cycles, last_line = self._cycles, self._last_line
        return Machine(self.program.program, ports, ports, max_cycles=cycles, last_line=last_line)

    def _renew(self, here: Start | None = None) -> None:
        """A new kernel where the robot stands, or `here`: what the old one had planned ahead is dropped."""
        old = self.kernel
        self.kernel = self._made(self.cell, override=old.mover.override, start=here or old.here)
        self.kernel.goes_on = old.goes_on
        self.kernel.keep_override(old)
        self.kernel.planner.laid = old.planner.laid
        self.kernel.execution.blocks.paced = old.execution.blocks.paced

    def run(self) -> Iterator[Window]:
        """Run on to the end, window by window. The first window of a session is tick 0.

        The iteration may be left and `run` called again: the run goes on where it was left.
        """
        while not self.kernel.over:
            if self.kernel.state is State.READY:
                yield self.begin()
                continue
            left = self._window
            if self._last_tick is not None:
                left = min(left, self._last_tick - self.kernel.tick)
                if left <= 0:
                    self.status = Status.STOPPED
                    return
            yield self.advance(left)
        self.status = self.final_status()

    def begin(self) -> Window:
        """Tick 0, with all that happens in it. `run` does it by itself."""
        return self._tell(self._timed(partial(self.kernel.begin, self._machine)))

    def advance(self, ticks: int) -> Window:
        """At least one and at most so many ticks more; after the end of the program the robot stands."""
        by_hand = self.kernel.state is State.JOGGING
        window = self._tell(self._timed(partial(self.kernel.advance, ticks)))
        if by_hand and self.kernel.state in (State.READY, State.STOPPED):
            self._stand_anew()
        return window

    def _stand_anew(self, here: Start | None = None) -> None:
        """The robot was moved by hand, or said to stand `here`: the program begins from there."""
        if self.kernel.state is State.READY:
            self._renew(here)
            self._machine = self._interpreter()

    def finish(self) -> Status:
        """Run to the end without looking at the windows."""
        for _ in self.run():
            pass
        return self.status

    def step(self) -> list[Window]:
        """Run until the next motion is finished, in a session made with `step`; its windows.

        After a halt it goes on with the motion that was halted. It ends early where the robot is held: by
        an emergency stop that is not reset, or an override of 0.
        """
        windows = []
        motions = self._motions
        self.kernel.resume()
        for window in self.run():
            windows.append(window)
            if self._motions > motions or self.kernel.state in (State.HALTED, State.EMERGENCY):
                break
        return windows

    def refusal(self, command: Command) -> str | None:
        """Why a command would not be taken now; None if it would be."""
        return self.kernel.refusal(command)

    def halt(self) -> str | None:
        """Stop on the path within the limits. Time goes on with `run`; the path with `resume`.

        This and the other commands answer why they are refused, where they are; then nothing happens.
        """
        return self.kernel.halt()

    def resume(self) -> str | None:
        """Go on along the path after a halt."""
        return self.kernel.resume()

    def set_override(self, override: float) -> str | None:
        """Scale all speeds by -1 … 1 from the next tick on. Raises ValueError for anything else."""
        return self.kernel.set_override(override)

    def stop(self) -> str | None:
        """Stop on the path within the limits and end the run there."""
        return self.kernel.stop()

    def emergency_stop(self) -> str | None:
        """Stop on the path with the emergency deceleration; `reset`, then `resume`, goes on."""
        return self.kernel.emergency_stop()

    def reset(self) -> str | None:
        """Acknowledge an emergency stop once the robot stands; the run is then halted, a jog at its end."""
        refused = self.kernel.reset()
        if refused is None and self.kernel.by_hand:
            self._stand_anew()
        return refused

    def hold(self, held: HeldJog) -> str | None:
        """Jog from the next tick on, before the run has begun, for as long as it is held; `advance` does it.

        Another one takes the place of the one before: within one space the robot goes over into it in
        motion, else it comes to rest first. The same again is held anew for its `seconds`. The robot slows
        down and stops by itself before the end of a joint's range, a singular pose, a zone, its own body:
        the event `jog` says before what. Raises JogError for what the robot has not.
        """
        wanted = demand(self, held)
        seconds = held.seconds
        return self.kernel.jog(wanted, None if seconds is None else max(1, round(seconds / self.cell.tick)))

    def let_go(self) -> str | None:
        """End a held jog: the robot comes to rest within the limits."""
        return self.kernel.let_go()

    def reference(self, axes: Mapping[str, float]) -> str | None:
        """Say where the axes stand, before the run has begun: as encoders read, in deg and mm, by name.

        Nothing moves and no time passes; axes that are not named stay where they are. Answers why it is
        refused: also for a value outside an axis' range, and where the robot would break a rule of its
        workspace. Raises ValueError for an axis that the robot has not, and a number that is not finite.
        """
        there = referenced(self.cell, self.kernel.here, axes)
        refused = self.kernel.refuses_to_stand(there)
        if refused is None:
            self._stand_anew(there)
            self.kernel.tell_reference(axes)
        return refused

    def set_input(self, name: str, value: bool | float) -> None:
        """Set an input (`"DI3"` or its name in the cell) from outside, from the next tick on.

        Raises KeyError for a signal the cell has not, ValueError for an output.
        """
        self._world.set_input(name, value, self.kernel.tick)

    def variable(self, name: str) -> bool | float:
        """The present value of a variable shared with the program. Raises KeyError for one not declared."""
        return self._world.bank.read(self._world.bank.resolve(f"${name}"))

    def set_variable(self, name: str, value: bool | float) -> None:
        """Give a variable (by its name, without `$`) a value, seen from the next tick on.

        Raises KeyError for one that the cell does not declare, ValueError for a value of another kind.
        """
        self._world.set_variable(name, value, self.kernel.tick)

    def set_point(self, point: int | str, pose: Sequence[float]) -> None:
        """Move a live point (index or name) to x, y, z (mm), a, b, c (deg). Raises ValueError: not live."""
        self.kernel.place(moved_point(self.cell, point, pose))

    def set_frame(self, frame: int | str, pose: Sequence[float]) -> None:
        """Move a live frame (index or name), as the cell file gives its pose. Raises ValueError: not live."""
        self.kernel.place(moved_frame(self.cell, frame, pose))

    def force(self, name: str, value: bool | float) -> None:
        """Hold a signal at a value, whatever is written to it. Raises KeyError."""
        self._world.force(name, value, self.kernel.tick)

    def release(self, name: str) -> None:
        """End forcing a signal. Raises KeyError."""
        self._world.release(name, self.kernel.tick)

    def reset_m(self, index: int) -> None:
        """Answer an M function, from the next tick on."""
        self._world.reset_m(index, self.kernel.tick)

    @property
    def signals(self) -> SignalBank:
        """The signals as they are now."""
        return self._world.bank

    @property
    def flags(self) -> frozenset[int]:
        """The M functions whose flag is raised."""
        return self._world.flags

    @property
    def pose(self) -> Floats:
        """X_base_tcp (4, 4) of the tool the robot has."""
        X_base_flange = self.cell.robot.fk(self.kernel.telemetry.joints)
        return np.asarray(X_base_flange @ self.cell.tools[self.kernel.tool].X_flange_tool)

    def frame(self, index: int) -> Floats:
        """X_base_frame (4, 4) with the base where it is now. Raises KeyError."""
        X_base_frame = self.cell.frames[index].X_base_frame.copy()
        axes = AuxiliaryAxes.of(self.cell)
        if index and axes.carrier is not None:
            X_base_frame[0, 3] -= self.kernel.telemetry.auxiliary[axes.carrier]
        return X_base_frame

    @property
    def at_rest(self) -> bool:
        """Whether nothing goes on by itself: it is over, halted, or waits for somebody outside."""
        state = self.kernel.state
        waits = state in _AWAITING and not self._world.pending() and self.kernel.dialogue.deadline is None
        return self.kernel.over or state in _RESTING or waits

    def set_window(self, ticks: int) -> None:
        """The most ticks computed at once."""
        self._window = ticks

    @property
    def corners(self) -> list[Corner]:
        """The blend report so far."""
        return self.kernel.planner.corners

    @property
    def failure(self) -> MotionError | None:
        """What ended the run with an error."""
        return self.kernel.failure

    @property
    def realtime_factor(self) -> float:
        """Simulated time ÷ computing time so far."""
        return self.kernel.tick * self.cell.tick / self._wall if self._wall > 0.0 else 0.0

    def _hear(self, event: Event) -> None:
        self.events.append(event)
        self._motions += event.kind == "block"
        for listener in self._listeners:
            listener.event(event)

    def _tell(self, window: Window) -> Window:
        if self._keep is not None:
            planner = self.kernel.planner
            _shorten(self.events, self._keep)
            _shorten(planner.corners, self._keep)
            _shorten(planner.zone_crossings, self._keep)
        for listener in self._listeners:
            listener.window(window)
        return window

    def _timed(self, compute: Callable[[], Window]) -> Window:
        start = time.perf_counter()
        window = compute()
        self._wall += time.perf_counter() - start
        return window

    def final_status(self) -> Status:
        """How the run has ended, once it has."""
        if self.kernel.state is State.FAILED:
            return Status.ERROR
        stopped = self.kernel.state is State.STOPPED or self._machine.cut_short
        return Status.STOPPED if stopped else Status.FINISHED


def _require(override: float, window: int, max_time: float | None, keep: int | None) -> None:
    if not 0.0 < override <= 1.0:
        raise ValueError(f"an override of {override!r} is not above 0 and at most 1")
    if window < 1:
        raise ValueError(f"a window of {window!r} ticks holds none")
    if max_time is not None and not (math.isfinite(max_time) and max_time >= 0.0):
        raise ValueError(f"a run cannot end after {max_time!r} s")
    if keep is not None and keep < 1:
        raise ValueError(f"to keep {keep!r} events is to keep none")


def _shorten(history: list[Any], keep: int) -> None:
    del history[: max(0, len(history) - keep)]
