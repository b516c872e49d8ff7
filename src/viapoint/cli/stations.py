"""The command run for a cell of several robots: one station, a report per robot, events of all together."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viapoint.cli.failures import UsageError
from viapoint.cli.loading import programs_from, scenario_from
from viapoint.cli.output import keep_inputs, note, print_json
from viapoint.cli.running import (
    Peaks,
    Stop,
    attendant_of,
    diagnostics_of,
    flag_of,
    record_plan,
    recorder_of,
    result_of,
)

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.recording import Recorder
    from viapoint.session import Listener

FOR_ONE = {
    "first": "names a line of one program",
    "to": "names a line of one program",
    "reference": "names axes of one robot",
    "realtime": "sends the ticks of one robot",
}
"""Options that are of one robot, and why."""


def run_station(chosen: Namespace, cells: tuple[Cell, ...]) -> int:
    """Run the programs of all robots; FILE is that of the robots for which the cell names none."""
    for name, why in FOR_ONE.items():
        if getattr(chosen, name, None) not in (None, False):
            raise UsageError(f"--{flag_of(name)} {why}; the cell has {len(cells)} robots")
    job = _Job(chosen, cells)
    job.run()
    if chosen.format == "json":
        print_json(_report(job))
    else:
        _print(job)
    return job.exit_code


class _Job:
    """One run of a station; loading happens at construction and may refuse."""

    def __init__(self, chosen: Namespace, cells: tuple[Cell, ...]) -> None:
        from viapoint.station import Station

        self.cells = cells
        self.programs = programs_from(cells, chosen.file)
        self.names = [Path(loaded.source.name).name for loaded in self.programs]
        self.peaks = [Peaks() for _ in cells]
        self.recordings: list[tuple[Path, Recorder]] = []
        self.interrupted = False
        self.scenario = scenario_from(chosen.scenario, cells[0])
        if chosen.record is not None:
            self._prepare_recordings(chosen)
        recorders = [recorder for _, recorder in self.recordings]
        listeners: list[list[Listener]] = [[peaks] for peaks in self.peaks]
        for each, recorder in zip(listeners, recorders, strict=bool(recorders)):
            each.append(recorder)
        self.attendant = attendant_of(chosen)
        if self.attendant is not None:
            for each, cell in zip(listeners, cells, strict=True):
                each.append(self.attendant.ear(cell.number))
        self.station = Station(
            cells,
            self.programs,
            scenario=self.scenario,
            override=chosen.override / 100.0,
            window=chosen.window,
            max_time=chosen.max_time,
            cycles=chosen.cycles,
            step=chosen.step,
            dry_run=chosen.dry_run,
            patient=self.attendant is not None,
            listeners=listeners,
        )
        if self.attendant is not None:
            self.attendant.bind(self.station, chosen.window)
        for recorder, session in zip(recorders, self.station.sessions, strict=False):
            record_plan(recorder, session)

    def _prepare_recordings(self, chosen: Namespace) -> None:
        for cell, loaded in zip(self.cells, self.programs, strict=True):
            own = Namespace(**{**vars(chosen), "file": Path(loaded.source.name)})
            own.record = chosen.record.with_suffix(f".{cell.robot_name or cell.number}{chosen.record.suffix}")
            keep_inputs(own.record, own.file, chosen.cell, chosen.scenario)
            self.recordings.append((own.record, recorder_of(own, cell, loaded, self.scenario)))

    def run(self) -> None:
        """To the end, or to Ctrl-C: then to a stop on the paths. Recordings are closed in any case."""
        from viapoint.session import Status

        try:
            with Stop() as stop:
                self._attend(stop)
                if stop.asked:  # before it has begun: then nothing moves
                    for session in self.station.sessions:
                        session.halt()
                for _ in self.station.run():
                    self._attend(stop)
                    if self.interrupted and all(session.at_rest for session in self.station.sessions):
                        break  # after an emergency stop there is nothing to stop
                    if stop.asked and not self.interrupted:
                        self.interrupted = True
                        for session in self.station.sessions:
                            session.stop()
        except KeyboardInterrupt:
            self.interrupted = True
        finally:
            if self.interrupted:
                self.station.status = Status.STOPPED
            if self.attendant is not None:
                self.attendant.end()
            for (_, recorder), session in zip(self.recordings, self.station.sessions, strict=False):
                recorder.close(result_of(session))

    def _attend(self, stop: Stop) -> None:
        if self.attendant is not None:
            self.attendant.attend(lambda: stop.asked)

    @property
    def exit_code(self) -> int:
        """0 where all programs finished or a limit of the user's ended them."""
        return 1 if self.interrupted or self.station.status.value == "error" else 0


def _print(job: _Job) -> None:
    from viapoint.cli.report_text import print_report
    from viapoint.station import name_of

    for session, peaks, name in zip(job.station.sessions, job.peaks, job.names, strict=True):
        print(f"{name_of(session.cell)}: {name}")
        print()
        print_report(session, peaks, diagnostics_of(session, name), name)
        print()
    for path, _ in job.recordings:
        note(f"recording: {path}")


def _report(job: _Job) -> dict[str, Any]:
    """The JSON object: what is one for all, then a report per robot without its events, then all events."""
    from viapoint.language.render import to_json
    from viapoint.report import event_data, run_report

    robots = []
    for session, name in zip(job.station.sessions, job.names, strict=True):
        own = run_report(session, [to_json(each) for each in diagnostics_of(session, name)])
        cell = session.cell
        head = {"robot": cell.number, "name": cell.robot_name, "program": name}
        robots.append(head | {k: v for k, v in own.items() if k not in ("duration_s", "ticks", "events")})
    first = job.station.sessions[0]
    return {
        "status": job.station.status.value,
        "duration_s": round(job.station.tick * first.cell.tick, 9),
        "ticks": job.station.tick,
        "robots": robots,
        "diagnostics": [each for robot in robots for each in robot["diagnostics"]],
        "events": [event_data(event) for event in job.station.events],
    }
