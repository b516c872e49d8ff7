"""Commands about recordings: plot, export, diff."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from viapoint.cli.failures import Refusal, UsageError
from viapoint.cli.output import fixed, keep_inputs, note, print_json, print_table

if TYPE_CHECKING:
    from viapoint.runtime.recording import Recording
    from viapoint.runtime.recording.compare import Comparison, StatementTime
    from viapoint.runtime.records import Event

RECORDING_SUFFIX = ".mcap"
MILLISECONDS = 1000.0


def recording_from(path: Path) -> Recording:
    """The recording in a file; what is missing at its end is noted. Raises Refusal."""
    from viapoint.runtime.recording import RecordingError, load_recording

    try:
        recording = load_recording(path)
    except RecordingError as error:
        raise Refusal(str(error)) from error
    if recording.problem is not None:
        note(f"viapoint: {recording.problem}")
    return recording


def plot(chosen: Namespace) -> int:
    keep_inputs(chosen.output, chosen.file, chosen.cell, chosen.scenario)
    from viapoint.runtime.pictures import PictureError, draw_run

    if chosen.file.suffix == RECORDING_SUFFIX:
        given = {"--cell": chosen.cell, "--scenario": chosen.scenario, "--max-time": chosen.max_time}
        superfluous = [name for name, value in given.items() if value is not None]
        if superfluous:
            raise UsageError(f"{superfluous[0]} belongs to a program; {chosen.file} is a recording")
        recording = recording_from(chosen.file)
        info, trace, good = recording.info, recording.trace, True
        events: Sequence[Event] = [*recording.events, *recording.paces]
    else:
        from viapoint.cli.running import run_quietly

        info, trace, events, good = run_quietly(chosen)
    try:
        draw_run(info, trace, events, chosen.output)
    except PictureError as error:
        raise Refusal(str(error)) from error
    note(f"picture: {chosen.output}")
    return 0 if good else 1


def export(chosen: Namespace) -> int:
    from viapoint.runtime.recording.export import write_csv

    keep_inputs(chosen.output, chosen.file)
    recording = recording_from(chosen.file)
    info = recording.info
    if str(chosen.output) == "-":
        write_csv(recording.trace, info.axes, sys.stdout, info.auxiliary)
        return 0
    try:
        chosen.output.parent.mkdir(parents=True, exist_ok=True)
        with chosen.output.open("w", encoding="utf-8", newline="") as out:
            rows = write_csv(recording.trace, info.axes, out, info.auxiliary)
    except OSError as error:
        raise Refusal(f"cannot write {chosen.output}: {error.strerror or error}") from error
    note(f"table: {chosen.output}, {rows} rows")
    return 0


# --- diff ---------------------------------------------------------------------------------------


def diff(chosen: Namespace) -> int:
    """Always 0 for two readable recordings: a difference is an answer, not an error."""
    from viapoint.runtime.recording.compare import compare

    a, b = recording_from(chosen.a), recording_from(chosen.b)
    result = compare(a, b)
    if chosen.format == "json":
        print_json(_as_object(result))
        return 0
    for line in _event_lines(result, a, b):
        print(line)
    for line in _path_lines(result, a, b):
        print(line)
    print()
    _print_times(result)
    return 0


def _describe(event: Event | None, recording: Recording) -> str:
    if event is None:
        return "no more events"
    data = "  ".join(f"{key} {_shown(value)}" for key, value in event.data.items())
    source = recording.source_line(event.line)
    return f"t {event.t:.3f} s  line {event.line}  {event.kind}  {data}{f'   | {source}' if source else ''}"


def _shown(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _event_lines(result: Comparison, a: Recording, b: Recording) -> Iterator[str]:
    found = result.event
    if found is None:
        yield f"events: the same ({len(a.events)})"
        return
    yield f"events: first difference at event {found.index + 1}"
    yield f"  A  {_describe(found.a, a)}"
    yield f"  B  {_describe(found.b, b)}"


def _path_lines(result: Comparison, a: Recording, b: Recording) -> Iterator[str]:
    found = result.path
    if found is None:
        yield f"path:   the same ({result.length_a_mm:.3f} mm)"
        return
    more = result.length_a_mm - result.length_b_mm
    if found.distance_mm > found.largest_mm:  # where one ends, the other goes on
        longer = "A" if more > 0.0 else "B"
        yield f"path:   the same for {found.s_mm:.3f} mm, then {longer} goes on for {abs(more):.3f} mm"
    else:
        yield (
            f"path:   first difference after {found.s_mm:.3f} mm, {found.distance_mm:.6f} mm apart; "
            f"largest {found.largest_mm:.6f} mm"
        )
    yield f"  A  t {found.t_a:.3f} s  line {found.line_a}   | {a.source_line(found.line_a)}"
    yield f"  B  t {found.t_b:.3f} s  line {found.line_b}   | {b.source_line(found.line_b)}"


def _print_times(result: Comparison) -> None:
    def cell(value: float | None) -> str:
        return "–" if value is None else fixed(value, 3)

    def difference(one: StatementTime) -> str:
        if one.seconds_a is None or one.seconds_b is None:
            return ""
        return signed((one.seconds_b - one.seconds_a) * MILLISECONDS)

    def signed(milliseconds: float) -> str:
        text = fixed(milliseconds, 1)
        return text if text.startswith("-") or not text.strip("0.") else f"+{text}"

    rows = [
        [_lines(one), one.text, cell(one.seconds_a), cell(one.seconds_b), difference(one)]
        for one in result.statements
    ]
    total = signed((result.seconds_b - result.seconds_a) * MILLISECONDS)
    rows.append(["", "whole run", cell(result.seconds_a), cell(result.seconds_b), total])
    print_table(("line", "statement", "A s", "B s", "B−A ms"), rows, "><>>>")


def _lines(one: StatementTime) -> str:
    lines = [str(line) for line in (one.line_a, one.line_b) if line is not None]
    return lines[0] if len(set(lines)) == 1 else "→".join(lines)


def _as_object(result: Comparison) -> dict[str, object]:
    from dataclasses import asdict

    from viapoint.report import event_data

    event = result.event
    return {
        "same": result.same,
        "event": None
        if event is None
        else {
            "index": event.index,
            "a": None if event.a is None else event_data(event.a),
            "b": None if event.b is None else event_data(event.b),
        },
        "path": None if result.path is None else asdict(result.path),
        "duration_s": {"a": result.seconds_a, "b": result.seconds_b},
        "length_mm": {"a": result.length_a_mm, "b": result.length_b_mm},
        "statements": [asdict(one) for one in result.statements],
    }
