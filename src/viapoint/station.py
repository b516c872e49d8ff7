"""A station: all robots of a cell at work, each with its own program and controller, on one tick.

They share signals, scenario and time. Every robot is a session; the station lets all of them pass the same
ticks, up to the first in which one of them may read or write, so that nobody sees anything too early or too
late. When nobody can go on any more it says who waits for what.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from viapoint.language.diagnostics import Diagnostic
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel import ExclusiveZones, ExecutionError, MotionError
from viapoint.runtime.records import Event, Window
from viapoint.runtime.signals import Scenario, SignalWorld
from viapoint.runtime.workspace import Encounters, Meeting
from viapoint.session import DEFAULT_WINDOW, CompileError, Listener, Loaded, Session, Status, compile_file

_FORESIGHT: Final = 1.0
"""s that are looked ahead whether robots will touch: longer than any of them needs to stop."""

_WATCHFUL: Final = 64
"""Ticks left before two robots must be stopped in which every one is looked at."""

Windows = tuple[tuple[Window, ...], ...]
"""Per robot the windows of the same ticks."""


def compile_programs(cells: Sequence[Cell], otherwise: Path | None = None) -> tuple[Loaded, ...]:
    """The programs that the cell names for its robots; `otherwise` where it names none.

    Raises CompileError holding all diagnostics.
    """
    loaded: list[Loaded] = []
    faults: list[Diagnostic] = []
    for cell in cells:
        try:
            loaded.append(_program_of(cell, otherwise))
        except CompileError as error:
            faults += error.diagnostics
    if faults:
        raise CompileError(faults)
    return tuple(loaded)


def _program_of(cell: Cell, otherwise: Path | None) -> Loaded:
    program = cell.program or otherwise
    if program is None:
        message = f"the cell names no program for {name_of(cell)}"
        hint = 'add program = "NAME.via" to its [[robots]], or give a program for those without'
        raise CompileError([Diagnostic(code="E279", message=message, file=cell.source.name, hint=hint)])
    return compile_file(program, cell)


def name_of(cell: Cell) -> str:
    """A robot as messages name it."""
    return f"robot {cell.number}" + (f" ({cell.robot_name})" if cell.robot_name else "")


class Station:
    """One run of the programs of all robots of a cell.

    Parameters as those of Session; `listeners` are given per robot. A robot that fails stops the others on
    their paths and ends the run with an error. Where `patient`, somebody outside may still bring what robots
    wait for.
    """

    def __init__(
        self,
        cells: Sequence[Cell],
        programs: Sequence[Loaded],
        *,
        scenario: Scenario | None = None,
        override: float = 1.0,
        window: int = DEFAULT_WINDOW,
        max_time: float | None = None,
        cycles: int | None = None,
        step: bool = False,
        dry_run: bool = False,
        patient: bool = False,
        listeners: Sequence[Sequence[Listener]] = (),
    ) -> None:
        first = cells[0]
        self.world = SignalWorld(first, scenario, first.tick, dry_run=dry_run)
        self.status = Status.RUNNING
        self._window = window
        self._patient = patient
        self._last_tick = math.inf if max_time is None else round(max_time / first.tick)
        self._zones = ExclusiveZones()
        self._encounters = Encounters(cells)
        self._foresight = round(_FORESIGHT / first.tick)
        self.sessions = tuple(
            Session(
                cell,
                program,
                scenario=scenario,
                override=override,
                window=window,
                max_time=max_time,
                cycles=cycles,
                step=step,
                patient=True,
                world=self.world.seen_by(cell.number),
                zones=self._zones,
                listeners=listeners[i] if listeners else (),
            )
            for i, (cell, program) in enumerate(zip(cells, programs, strict=True))
        )

    @property
    def tick(self) -> int:
        """The tick computed last."""
        return self.sessions[0].kernel.tick

    def set_window(self, ticks: int) -> None:
        """The most ticks computed at once."""
        self._window = ticks

    @property
    def events(self) -> list[Event]:
        """What happened, in time order; within a tick robot by robot."""
        every = [event for session in self.sessions for event in session.events]
        return sorted(every, key=lambda event: event.tick)

    @property
    def failures(self) -> list[tuple[Session, MotionError]]:
        """What ended the run with an error, per robot."""
        return [(each, each.failure) for each in self.sessions if each.failure is not None]

    def run(self) -> Iterator[Windows]:
        """Run on to the end; yields what all robots did in the same ticks."""
        if self.status is not Status.RUNNING:
            return
        yield tuple((session.begin(),) for session in self.sessions)
        while ticks := self._common_ticks():
            yield tuple(_advanced(session, ticks) for session in self.sessions)
        self.status = self._final_status()

    def finish(self) -> Status:
        """Run to the end without looking at the windows."""
        for _ in self.run():
            pass
        return self.status

    def _common_ticks(self) -> int:
        """How many ticks all robots may pass before anyone looks at anything again; 0: the run is over."""
        self._give_parts()
        self._give_zones()
        self._look_for_deadlock()
        if self.failures:
            for session in self.sessions:
                session.stop()
        if all(session.kernel.over for session in self.sessions):
            return 0
        left = min(self._window, self._last_tick - self.tick)
        change = self.world.next_change(self.tick)
        if change is not None:
            left = min(left, change - self.tick)
        for session in self.sessions:
            if left > 0 and not session.kernel.over:
                left = min(left, session.kernel.undisturbed(int(left)))
        return self._apart(int(left)) if left > 0 and self._encounters.active else int(left)

    def _apart(self, ticks: int) -> int:
        """How many of the next ticks may pass before looking again whether robots will touch.

        Those that will are stopped, as late as is safe: until then one of them may turn another way.
        """
        kernels = [session.kernel for session in self.sessions]
        axes = [kernel.foreseen(ticks + self._foresight) for kernel in kernels]
        meeting = self._encounters.first(axes, [kernel.tool for kernel in kernels])
        if meeting is None:
            return ticks
        pair = [self.sessions[i] for i in meeting.robots]
        if any(session.failure is not None or session.kernel.over for session in pair):
            return ticks
        spare = meeting.row - max(session.kernel.ticks_to_rest() for session in pair)
        if spare > 1:
            return min(ticks, spare // 2 if spare > _WATCHFUL else 1)
        for session in pair:
            session.kernel.alarm(_collision(pair, meeting, session))
        return 1

    def _give_zones(self) -> None:
        """Exclusive zones that robots asked for in the last tick go to one each."""
        for session in self.sessions:
            session.kernel.ask_for_zones()
        lucky = self._zones.decide()
        for session in self.sessions:
            if session.cell.number in lucky:
                session.kernel.zones_granted()

    def _give_parts(self) -> None:
        """Parts on belts go to the robots that wait for one, in the order of their claims."""
        waiting = [(claim, each.kernel) for each in self.sessions if (claim := each.kernel.claim) is not None]
        for _, kernel in sorted(waiting, key=lambda pair: pair[0]):
            kernel.take_part()

    def _look_for_deadlock(self) -> None:
        """Nobody moves, nothing is scheduled, every robot waits, and nobody helps: none will ever go on."""
        working = [session for session in self.sessions if not session.kernel.over]
        stuck = [session.kernel.stuck(alone=not self._patient) for session in working]
        if not working or not all(stuck):
            return
        reasons = [
            f"{name_of(session.cell)} in line {error.line}: {error.message}"
            for session, error in zip(working, stuck, strict=True)
            if error is not None
        ]
        for session, error in zip(working, stuck, strict=True):
            if error is not None and len(working) > 1:
                session.kernel.fail(
                    ExecutionError("E450", "no robot can go on: " + "; ".join(reasons), error.line)
                )
            elif error is not None:
                session.kernel.fail(error)

    def _final_status(self) -> Status:
        for session in self.sessions:
            session.status = session.final_status() if session.kernel.over else Status.STOPPED
        found = {session.status for session in self.sessions}
        return next(s for s in (Status.ERROR, Status.STOPPED, Status.FINISHED) if s in found)


def _collision(pair: Sequence[Session], meeting: Meeting, session: Session) -> ExecutionError:
    sides = [
        f"{part} of {name_of(each.cell)}, in line {each.kernel.line},"
        for each, part in zip(pair, meeting.parts, strict=True)
    ]
    when = f"would touch in {meeting.row * session.cell.tick:.3f} s" if meeting.row else "touch"
    message = f"{sides[0]} and {sides[1]} {when}"
    hint = "let one of them wait for the other: an exclusive zone, a signal, or M with a rendezvous"
    return ExecutionError("E451", message, session.kernel.line, hint)


def _advanced(session: Session, ticks: int) -> tuple[Window, ...]:
    windows = []
    while ticks > 0:
        window = session.advance(ticks)
        windows.append(window)
        ticks -= len(window)
    return tuple(windows)
