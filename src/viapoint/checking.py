"""What can be said of a program without running it: diagnostics, decisions and, with a cell, its corners.

Without a cell it needs no robot and no numerics. With one, the program's motions are planned as they
come when every input answers no, and once more when every input answers yes: geometry, reach and
configuration are checked, time laws are not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from viapoint.compiler import compile_source
from viapoint.language.diagnostics import Diagnostic, sort_key
from viapoint.language.reading import read_source
from viapoint.language.source import Source, Span
from viapoint.vm import Program, ProgramFileError, load

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.kernel import Corner, MotionError

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
    blends: tuple[dict[str, Any], ...] = ()
    decisions: tuple[dict[str, Any], ...] = ()


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
        {"line": one.line, "reads": list(one.reads), "barrier": one.barrier}
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
        return CheckReport(str(path), checked.diagnostics, decisions=checked.decisions)
    survey = _Survey()
    for answer in (False, True):
        survey.plan(checked.program, cell, answer)
    found = [*checked.diagnostics]
    found += [motion_diagnostic(error, checked.source, str(path)) for error in survey.failures.values()]
    return CheckReport(
        str(path), tuple(sorted(found, key=sort_key)), tuple(survey.blends()), checked.decisions
    )


def motion_diagnostic(error: MotionError, source: Source | None, file: str) -> Diagnostic:
    """A failure of planning or execution at the statement that it came from."""
    if source is None or not 0 < error.line <= len(source.line_starts):
        line = error.line if error.line > 0 else None
        return Diagnostic(code=error.code, message=error.message, file=file, line=line, hint=error.hint)
    text = source.line_text(error.line)
    code = text.partition("//")[0].rstrip()
    start = source.line_start(error.line) + len(code) - len(code.lstrip())
    span = Span(start, source.line_start(error.line) + len(code))
    return Diagnostic(code=error.code, message=error.message, source=source, span=span, hint=error.hint)


@dataclass(slots=True)
class _Survey:
    """Corners and failures found by planning; each place is told once."""

    corners: dict[tuple[int, int | None], Corner] = field(default_factory=dict)
    failures: dict[tuple[str, int], MotionError] = field(default_factory=dict)
    joint_lines: set[int] = field(default_factory=set)
    edges: dict[int, float | None] = field(default_factory=dict)

    def plan(self, program: Program, cell: Cell, answer: bool) -> None:
        from viapoint.surveying import survey

        found = survey(program, cell, answer)
        self.joint_lines |= found.joint_lines
        self.edges |= found.edges
        for corner in found.corners:
            self.corners.setdefault((corner.line, corner.next_line), corner)
        if found.failure is not None:
            self.failures.setdefault((found.failure.code, found.failure.line), found.failure)

    def blends(self) -> Iterator[dict[str, Any]]:
        """Rows of the blend report; between two joint moves R is in deg, whatever its key says."""
        from viapoint.language.units import DEG, MM

        for line, following in sorted(self.corners, key=lambda key: (key[0], key[1] or 0)):
            corner = self.corners[line, following]
            passed = corner.transition
            unit = DEG if {line, following} <= self.joint_lines else MM
            yield {
                "line": line,
                "next_line": following,
                "asked_mm": self.edges[line],
                "effective_mm": _tidy(passed.effective / unit),
                "stop": passed.stop,
                "forced_by_line": corner.forced_by_line,
                "reason": passed.reason.value,
            }


def _tidy(value: float) -> float:
    """Without the rounding noise of the units."""
    return round(value, 9) + 0.0
