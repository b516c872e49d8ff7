"""The command run: a session with a live line, a recording, and the report at the end."""

from __future__ import annotations

import signal
import sys
from argparse import Namespace
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from viapoint.cli.failures import Refusal, UsageError
from viapoint.cli.loading import cell_from, cells_from, program_from, scenario_from
from viapoint.cli.output import keep_inputs, note, print_json

if TYPE_CHECKING:
    from viapoint.language.diagnostics import Diagnostic
    from viapoint.realtime import Sender
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.path import Piece
    from viapoint.runtime.recording import Recorder, RunInfo
    from viapoint.runtime.records import Event, Floats, Window
    from viapoint.runtime.signals import Scenario
    from viapoint.serving import Attendant
    from viapoint.session import Listener, Loaded, Session

# Options that change what a run does; a recording names these and no others, so that the same run
# writes the same bytes wherever it is written to.
TELLING = (
    *("cell", "scenario", "override", "max_time", "cycles", "first", "to", "reference", "step"),
    *("dry_run", "drives"),
)
FLAGS = {"first": "from"}  # `from` is a word of Python
OUTLINE = 17  # points of a curved piece of path in the scene
STRAIGHT = 1e-5  # m; pieces this near to their chord are drawn as two points
DEFAULTS = {"override": 100.0, "drives": "ideal"}


def run(chosen: Namespace) -> int:
    try:
        return _run(chosen)
    except Refusal as refusal:
        if chosen.format != "json" or not refusal.diagnostics:
            raise
        from viapoint.language.render import to_json

        print_json(refused([to_json(diagnostic) for diagnostic in refusal.diagnostics]))
        return 1


def _run(chosen: Namespace) -> int:
    cells = cells_from(chosen.cell)
    if len(cells) > 1:
        from viapoint.cli.stations import run_station

        return run_station(chosen, cells)
    if chosen.file is None:
        raise UsageError("a program is missing")
    job = _Job(chosen, cells[0])
    if chosen.format == "json":
        _run_for_json(job)
    else:
        _run_for_people(job, chosen)
    return job.exit_code


def _run_for_people(job: _Job, chosen: Namespace) -> None:
    from viapoint.cli.live import live_line
    from viapoint.cli.report_text import print_report, punctuality_text

    if job.session.start is not None:
        from viapoint.start_report import start_lines

        for line in start_lines(job.session.start, job.loaded.source.text.splitlines()):
            print(line)
        print(flush=True)
    with live_line(chosen.file.name, job.loaded.source) as live:
        job.run(live)
    print_report(job.session, job.peaks, job.diagnostics(), chosen.file.name)
    if job.sender is not None and job.sender.punctuality is not None:
        print(punctuality_text(job.sender.punctuality))
    if chosen.record is not None:
        note(f"recording: {chosen.record}")


def _run_for_json(job: _Job) -> None:
    from viapoint.language.render import to_json
    from viapoint.report import run_report

    job.run()
    report = run_report(job.session, [to_json(diagnostic) for diagnostic in job.diagnostics()])
    if job.session.start is not None:
        from viapoint.start_report import start_data

        report["start"] = start_data(job.session.start)
    if job.sender is not None and job.sender.punctuality is not None:
        report["realtime"] = asdict(job.sender.punctuality)
    print_json(report)


def refused(diagnostics: list[dict[str, Any]]) -> dict[str, Any]:
    """The report of a run that never began."""
    return {
        "status": "error",
        "duration_s": 0.0,
        "ticks": 0,
        "statements": 0,
        "realtime_factor": 0.0,
        "final": None,
        "limits": None,
        "deviation": None,
        "diagnostics": diagnostics,
        "events": [],
    }


class Peaks:
    """Listener: the fastest TCP speed of every stretch of ticks, for the blocks of the report."""

    def __init__(self) -> None:
        self.speeds: list[Any] = []

    def window(self, window: Window) -> None:
        self.speeds.append(window.speed)

    def event(self, event: Event) -> None:
        """Nothing: the session keeps the events."""


class _Job:
    """One run with everything it needs; loading happens at construction and may refuse."""

    def __init__(self, chosen: Namespace, cell: Cell) -> None:
        self._chosen = chosen
        if getattr(chosen, "record", None) is not None:
            keep_inputs(chosen.record, chosen.file, chosen.cell, chosen.scenario)
        self.cell = cell
        self.scenario = scenario_from(chosen.scenario, self.cell)
        self.loaded: Loaded = program_from(chosen.file, self.cell)
        self.peaks = Peaks()
        self.recorder: Recorder | None = None
        if getattr(chosen, "record", None) is not None:
            self.recorder = recorder_of(chosen, cell, self.loaded, self.scenario)
        self.sender: Sender | None = None
        window = getattr(chosen, "window", 1024)
        if getattr(chosen, "realtime", False):
            from viapoint.realtime import Sender

            self.sender = Sender(self.cell.tick)
            window = min(window, self.sender.window)
        listeners: list[Listener] = [self.peaks]
        if self.recorder is not None:
            listeners.append(self.recorder)
        self.attendant = attendant_of(chosen)
        if self.attendant is not None:
            listeners.append(self.attendant.ear(cell.number))
        self.interrupted = False
        self.session = self._session(listeners, window)
        if self.attendant is not None:
            self.attendant.bind(self.session, window)
        if self.recorder is not None:
            record_plan(self.recorder, self.session)

    def _session(self, listeners: Sequence[Listener], window: int) -> Session:
        from viapoint.session import Session
        from viapoint.starting import StartError

        chosen = self._chosen
        try:
            session = Session(
                self.cell,
                self.loaded,
                scenario=self.scenario,
                override=getattr(chosen, "override", 100.0) / 100.0,
                window=window,
                max_time=chosen.max_time,
                cycles=chosen.cycles,
                first_line=getattr(chosen, "first", None),
                last_line=getattr(chosen, "to", None),
                step=getattr(chosen, "step", False),
                dry_run=getattr(chosen, "dry_run", False),
                patient=self.attendant is not None,
                listeners=listeners,
            )
        except StartError as error:
            raise UsageError(str(error)) from error
        if (axes := getattr(chosen, "reference", None)) is not None:
            try:
                refused = session.reference(axes)
            except ValueError as error:
                raise UsageError(f"--reference: {error}") from error
            if refused is not None:
                raise Refusal(f"the robot cannot stand there: {refused}")
        return session

    def run(self, live: Any = None) -> None:
        """To the end, or to Ctrl-C: then to a stop on the path. The recording is closed in any case."""
        from viapoint.session import Status

        try:
            with self.sender or nullcontext(), Stop() as stop:
                self._attend(stop)
                if stop.asked:  # before it has begun: then nothing moves
                    self.session.halt()
                for window in self.session.run():
                    if live is not None:
                        live(window, self.session)
                    if self.sender is not None:
                        self.sender.send(window)
                    self._attend(stop)
                    if self.interrupted and self.session.at_rest:
                        break  # after an emergency stop there is nothing to stop
                    if stop.asked and not self.interrupted:
                        self.interrupted = True
                        self.session.stop()
        except KeyboardInterrupt:
            self.interrupted = True
        finally:
            if self.interrupted:
                self.session.status = Status.STOPPED
            if self.attendant is not None:
                self.attendant.end()
            if self.recorder is not None:
                self.recorder.close(result_of(self.session))

    def _attend(self, stop: Stop) -> None:
        if self.attendant is not None:
            self.attendant.attend(lambda: stop.asked)

    def diagnostics(self) -> list[Diagnostic]:
        """Those of compilation, then what ended the run."""
        return diagnostics_of(self.session, str(self._chosen.file))

    @property
    def exit_code(self) -> int:
        """0 where the program finished or a limit of the user's ended it."""
        return 1 if self.interrupted or self.session.status.value == "error" else 0


def result_of(session: Session) -> dict[str, str]:
    """How a run ended, for the end of its recording."""
    tick = session.kernel.tick
    return {
        "status": session.status.value,
        "ticks": str(tick),
        "duration_s": repr(round(tick * session.cell.tick, 9)),
    }


def diagnostics_of(session: Session, name: str) -> list[Diagnostic]:
    """Those of the program, then what ended its run; `name` is its file's."""
    from viapoint.checking import motion_diagnostic

    found = list(session.program.diagnostics)
    if session.failure is not None:
        source = session.program.source if session.program.source.text else None
        found.append(motion_diagnostic(session.failure, source, name))
    return found


def attendant_of(chosen: Namespace) -> Attendant | None:
    """Who attends to the clients of --serve; it listens at once and says where."""
    address = getattr(chosen, "serve", None)
    if address is None:
        if getattr(chosen, "await_client", False):
            raise UsageError("--await-client belongs to --serve")
        return None
    from viapoint.serving import Attendant, Hub

    host, port = address
    try:
        hub = Hub(host, port)
    except OSError as error:
        raise Refusal(f"cannot serve on {host}:{port}: {error.strerror or error}") from error
    note(f"serving on {hub.address[0]}:{hub.address[1]}")
    return Attendant(hub, await_client=chosen.await_client, paced=chosen.realtime)


class Stop:
    """Ctrl-C or SIGTERM stops the robot on its path, everything in order; the second one ends at once."""

    def __init__(self) -> None:
        self.asked = False
        self._before: list[tuple[int, Any]] = []

    def __enter__(self) -> Self:
        for number in (signal.SIGINT, signal.SIGTERM):
            with suppress(ValueError):  # not in the main thread: whoever runs it there stops it
                self._before.append((number, signal.signal(number, self._stop)))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before:
            signal.signal(number, handler)

    def _stop(self, number: int, frame: object) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True


def run_quietly(chosen: Namespace) -> tuple[RunInfo, Window, list[Event], bool]:
    """Run a program for its ticks and events alone; what failed is told on standard error."""
    from viapoint.language.render import render
    from viapoint.report import in_time_order
    from viapoint.runtime.recording import join

    job = _Job(chosen, cell_from(chosen.cell, chosen.file))
    windows: list[Window] = []
    paces: list[Event] = []
    job.session.kernel.execution.blocks.paced = paces.append
    job.run(lambda window, session: windows.append(window))
    errors = [diagnostic for diagnostic in job.diagnostics() if diagnostic.is_error]
    if errors:
        note(render(errors, colour=sys.stderr.isatty()) + "\n")
    info = _run_info(chosen, job.cell, job.loaded, job.scenario)
    return info, join(windows), in_time_order([*job.session.events, *paces]), not errors


def _outline(piece: Piece) -> Floats:
    """(K, 3) points of a piece: its two ends where it is straight."""
    import numpy as np

    points = piece.poses(np.linspace(0.0, piece.length, OUTLINE)).position
    chord = np.linspace(points[0], points[-1], OUTLINE)
    straight = bool(np.abs(points - chord).max() < STRAIGHT)
    return points[[0, -1]] if straight else points


# --- recording ----------------------------------------------------------------------------------


def record_plan(recorder: Recorder, session: Session) -> None:
    """Into a recording too: the path as it is planned, and what holds every motion back along it."""

    def draw(pieces: Sequence[Piece]) -> None:
        for piece in pieces:
            recorder.programmed_path(_outline(piece))

    session.kernel.planner.laid = draw
    session.kernel.execution.blocks.paced = recorder.event


def recorder_of(chosen: Namespace, cell: Cell, loaded: Loaded, scenario: Scenario | None) -> Recorder:
    from viapoint.runtime.recording import Recorder

    robot = cell.robot
    radius = robot.body_radius
    try:
        return Recorder(
            chosen.record,
            _run_info(chosen, cell, loaded, scenario),
            skeleton=robot.link_points,
            radii=() if radius is None else tuple(radius.tolist()),
        )
    except OSError as error:
        raise Refusal(f"cannot write {chosen.record}: {error.strerror or error}") from error


def _run_info(chosen: Namespace, cell: Cell, loaded: Loaded, scenario: Scenario | None) -> RunInfo:
    from dataclasses import replace

    from viapoint.cli.version import versions
    from viapoint.run_info import run_info

    info = run_info(cell, loaded, _command_line(chosen), versions(), scenario)
    return replace(info, program_name=chosen.file.name)


def flag_of(name: str) -> str:
    """An option as it is written, of its name here."""
    return FLAGS.get(name, name).replace("_", "-")


def _command_line(chosen: Namespace) -> str:
    words = ["viapoint run", chosen.file.name]
    for name in TELLING:
        value = getattr(chosen, name, None)
        if value is None or value is False or value == DEFAULTS.get(name):
            continue
        words.append(f"--{flag_of(name)}")
        if isinstance(value, dict):
            words.append(",".join(f"{axis}={number!r}" for axis, number in value.items()))
        elif value is not True:
            words.append(value.name if isinstance(value, Path) else f"{value:g}")
    return " ".join(words)
