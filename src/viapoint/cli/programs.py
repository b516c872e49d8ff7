"""Commands about program texts: check, compile, dis, explain. Nothing moves here."""

from __future__ import annotations

import sys
from argparse import Namespace
from typing import TYPE_CHECKING, Any

from viapoint.cli.failures import Refusal, UsageError
from viapoint.cli.loading import bytecode_from, cell_from
from viapoint.cli.output import keep_inputs, note, print_json

if TYPE_CHECKING:
    from viapoint.checking import CheckReport
    from viapoint.language.diagnostics import Diagnostic

PROSE_WIDTH = 90


def check(chosen: Namespace) -> int:
    from viapoint.checking import check_program
    from viapoint.language.diagnostics import has_errors
    from viapoint.language.render import to_json

    try:
        cell = cell_from(chosen.cell, chosen.files[0]) if chosen.cell is not None else None
    except Refusal as refusal:
        if chosen.format != "json":
            raise
        found = [to_json(diagnostic) for diagnostic in refusal.diagnostics]
        print_json({"diagnostics": found, **_rows([], several=False)})
        return 1
    reports = [check_program(path, cell) for path in chosen.files]
    diagnostics = [diagnostic for report in reports for diagnostic in report.diagnostics]
    if chosen.format == "json":
        found = [to_json(diagnostic) for diagnostic in diagnostics]
        print_json({"diagnostics": found, **_rows(reports, several=len(reports) > 1)})
    else:
        for report in reports:
            _print_report(report, heading=len(reports) > 1)
        _print_summary(diagnostics)
    return 1 if has_errors(diagnostics) else 0


ROWS = ("blends", "statements", "slowdowns", "zones", "configurations", "tracking")
"""Tables of the JSON report that planning fills."""


def _rows(reports: list[CheckReport], *, several: bool) -> dict[str, Any]:
    """The tables of the JSON report; with several files every row names its own."""

    def named(report: CheckReport, row: dict[str, Any]) -> dict[str, Any]:
        return {"file": report.file, **row} if several else row

    seen = [(report, report.outlook) for report in reports if report.outlook is not None]
    tables: dict[str, Any] = {
        name: [named(report, row) for report, outlook in seen for row in getattr(outlook, name)]
        for name in ROWS
    }
    tables["decisions"] = [named(report, row) for report in reports for row in report.decisions]
    tables["cycles"] = [named(report, outlook.cycle) for report, outlook in seen if outlook.cycle is not None]
    return tables


def _print_report(report: CheckReport, *, heading: bool) -> None:
    from viapoint.cli.check_text import print_tables
    from viapoint.language.render import render

    if heading:
        print(f"{report.file}:")
    if report.diagnostics:
        print(render(report.diagnostics, colour=sys.stdout.isatty()), end="\n\n")
    print_tables(report, report.source_lines)


def _print_summary(found: list[Diagnostic]) -> None:
    from viapoint.language.render import summary

    print(summary(found))


def compile_program(chosen: Namespace) -> int:
    from viapoint.vm import save

    keep_inputs(chosen.output, chosen.file, chosen.cell)
    cell = cell_from(chosen.cell, chosen.file) if chosen.cell is not None else None
    program, diagnostics = bytecode_from(chosen.file, cell)
    data = save(program)
    try:
        chosen.output.parent.mkdir(parents=True, exist_ok=True)
        chosen.output.write_bytes(data)
    except OSError as error:
        raise Refusal(f"cannot write {chosen.output}: {error.strerror or error}") from error
    _note_diagnostics(diagnostics)
    note(f"program: {chosen.output}, {len(data)} bytes")
    return 0


def _note_diagnostics(diagnostics: tuple[Diagnostic, ...]) -> None:
    if diagnostics:
        from viapoint.language.render import render

        note(render(diagnostics, colour=sys.stderr.isatty()) + "\n")


def dis(chosen: Namespace) -> int:
    from viapoint.vm import disassemble

    program, _ = bytecode_from(chosen.file, None)
    print(disassemble(program), end="")
    return 0


def explain(chosen: Namespace) -> int:
    from viapoint.language.catalogue import CATALOGUE
    from viapoint.language.catalogue import explain as explained
    from viapoint.language.suggestions import closest

    text = explained(chosen.code)
    if text is None:
        near = closest(chosen.code, CATALOGUE)
        hint = f"did you mean `{near}`?" if near else "codes look like E201, W501"
        raise UsageError(f"there is no code `{chosen.code}`; {hint}")
    print(wrapped(text))
    return 0


def wrapped(text: str) -> str:
    """Long lines of prose broken; indented ones are examples and stay."""
    import textwrap

    lines = []
    for line in text.splitlines():
        lines += [line] if line.startswith(" ") or not line else textwrap.wrap(line, PROSE_WIDTH)
    return "\n".join(lines)
