"""What can be said of a program without running it: diagnostics, decisions and, with a cell, its corners.

Without a cell it needs no robot and no numerics. With one, every way through the program is planned:
geometry, reach, configuration, zones, and the time each statement takes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viapoint.compiler import compile_source
from viapoint.language.diagnostics import Diagnostic, sort_key
from viapoint.language.reading import read_source
from viapoint.language.source import Source, Span
from viapoint.vm import Program, ProgramFileError, load

if TYPE_CHECKING:
    from viapoint.outlook import Outlook
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.kernel import MotionError
    from viapoint.surveying import Survey

COMPILED_SUFFIX = ".viac"


@dataclass(frozen=True, slots=True)
class Checked:
    """A program file after compilation: the program if it has no error, its source if it could be read."""

    program: Program | None
    source: Source | None
    diagnostics: tuple[Diagnostic, ...]
    decisions: tuple[dict[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class CheckReport:
    """All that `viapoint check` says of one file; the rows are those of its JSON contract."""

    file: str
    diagnostics: tuple[Diagnostic, ...]
    decisions: tuple[dict[str, Any], ...] = ()
    outlook: Outlook | None = None
    """What planning shows; None where nothing was planned."""
    source_lines: tuple[str, ...] = ()


def compile_only(path: Path, cell: Cell | None = None) -> Checked:
    """Compile a `.via` file or load a `.viac` file; never raises for what stands in it."""
    if path.suffix == COMPILED_SUFFIX:
        return _load_compiled(path)
    source, unreadable = read_source(path)
    if source is None:
        return Checked(None, None, unreadable)
    names = None
    if cell is not None:
        from viapoint.session import cell_names

        names = cell_names(cell)
    result = compile_source(source, names)
    decisions = tuple(
        {"line": one.line, "reads": list(one.reads), "barrier": one.barrier, "watched": one.watched}
        for one in result.decisions(names)
    )
    return Checked(result.program, source, result.diagnostics, decisions)


def _load_compiled(path: Path) -> Checked:
    try:
        program = load(path.read_bytes())
    except OSError as error:
        message = f"cannot read the file: {error.strerror or error}"
        return Checked(None, None, (Diagnostic(code="E100", message=message, file=str(path)),))
    except ProgramFileError as error:
        refused = Diagnostic(code=error.code, message=error.message, file=str(path))
        return Checked(None, None, (refused,))
    source = None if program.source_text is None else Source(str(path), program.source_text)
    return Checked(program, source, ())


def check_program(path: Path, cell: Cell | None = None) -> CheckReport:
    """Everything about one file; with a cell its motions are planned too."""
    checked = compile_only(path, cell)
    if checked.program is None or cell is None:
        return CheckReport(str(path), checked.diagnostics, checked.decisions)
    from viapoint.outlook import outlook
    from viapoint.surveying import survey

    surveyed = survey(checked.program, cell)
    seen = outlook(surveyed, cell)
    found = [*checked.diagnostics, *_notes(surveyed, seen, checked.source, str(path))]
    lines = () if checked.source is None else tuple(checked.source.text.splitlines())
    return CheckReport(str(path), tuple(sorted(found, key=sort_key)), checked.decisions, seen, lines)


def _notes(survey: Survey, seen: Outlook, source: Source | None, file: str) -> Iterator[Diagnostic]:
    """What planning found, at its statements."""
    failures = {(error.code, error.line): error for error in reversed(survey.failures)}
    for error in failures.values():
        yield motion_diagnostic(error, source, file)
    excused = {(error.code, error.line): error for error in reversed(survey.excused)}
    for error in excused.values():
        message = f"{error.code}, which ON ERROR handles: {error.message}"
        hint = "the check goes on behind the statement, as with RESUME NEXT"
        yield diagnostic_at("W510", message, error.line, source, file, hint)
    if survey.cut_at is not None:
        message = "not everything behind this line was planned: there are more ways than a check follows"
        yield diagnostic_at("I601", message, survey.cut_at, source, file)
    for stop in seen.stops:
        message = (
            f"the path stops here, behind line {stop.line}: "
            f"about {stop.seconds:.2f} s more than if it ran through"
        )
        yield diagnostic_at("I602", message, stop.by_line, source, file)
    for row in seen.slowdowns:
        if row["singular"] is not None:
            speeds = f"from {row['asked']:.4g} to {row['slowed_to']:.3g} {row['unit']}"
            message = (
                f"{row['axis']} slows this motion {speeds}, {row['place_mm']:.0f} mm after its start: "
                f"the {row['singular']} is nearly singular there"
            )
            yield diagnostic_at("I603", message, row["line"], source, file)
    for track_line in sorted({row["track_line"] for row in seen.tracking}):
        rows = [row for row in seen.tracking if row["track_line"] == track_line]
        yield diagnostic_at("I604", _on_the_belt(rows), track_line, source, file)


def _on_the_belt(rows: list[dict[str, Any]]) -> str:
    """What the motions of one tracked section leave to the belt, the tightest of each limit."""

    def tightest(name: str, pick: Callable[[list[float]], float], none: str) -> str:
        limits = [row[name] for row in rows if row[name] is not None]
        return f"{pick(limits):.1f}" if limits else none

    low, high = tightest("from_mm", max, "below -5000"), tightest("to_mm", min, "above 5000")
    message = (
        "the tracked section is planned with the belt standing; "
        f"it can be reached for {low} to {high} mm of belt travel"
    )
    speed = tightest("fastest_mm_s", min, "")
    return f"{message}, at the planned times up to {speed} mm/s" if speed else message


def motion_diagnostic(error: MotionError, source: Source | None, file: str) -> Diagnostic:
    """A failure of planning or execution at the statement that it came from."""
    return diagnostic_at(error.code, error.message, error.line, source, file, error.hint)


def diagnostic_at(
    code: str, message: str, line: int, source: Source | None, file: str, hint: str | None = None
) -> Diagnostic:
    """A diagnostic at the statement of a line; of the file where that is not known."""
    if source is None or not 0 < line <= len(source.line_starts):
        return Diagnostic(code=code, message=message, file=file, line=line if line > 0 else None, hint=hint)
    text = source.line_text(line)
    statement = text.partition("//")[0].rstrip()
    start = source.line_start(line) + len(statement) - len(statement.lstrip())
    span = Span(start, source.line_start(line) + len(statement))
    return Diagnostic(code=code, message=message, source=source, span=span, hint=hint)
