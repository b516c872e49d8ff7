"""Text in, program or diagnostics out: parse, lower, check. Pure, and never raises for a bad program."""

from __future__ import annotations

import re
from dataclasses import dataclass

from viapoint.compiler.cell_names import CellNames
from viapoint.compiler.findings import Findings
from viapoint.compiler.lowering import Lowering
from viapoint.compiler.reports import Decision, decision_report
from viapoint.language import tree
from viapoint.language.diagnostics import Diagnostic, has_errors, sort_key
from viapoint.language.lexical import NAME
from viapoint.language.parser import MAX_ERRORS, ParseResult, parse
from viapoint.language.source import Source, Span
from viapoint.vm.program import Program

_BLOCK_WORD = re.compile(r"\s*(?:[A-Za-z]\w*:\s*)?(?:IF|ELSE|ELSEIF|ENDIF)\b", re.IGNORECASE)
_DECLARED = re.compile(rf"\s*({NAME})\s*:")

_BLOCK_CODES = frozenset({"E205", "E206", "E207", "E208"})
"""Errors that one refused line of a block may cause elsewhere."""

_LABEL_CODES = frozenset({"E201", "E202", "E203", "E204", "E214"})
"""Errors with which, as with those of blocks, the course is not known: lint of it would mislead."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CompileResult:
    """`program` is None when a diagnostic is an error. `tree` holds the statements that parsed."""

    program: Program | None
    tree: tree.Program
    diagnostics: tuple[Diagnostic, ...]

    @property
    def ok(self) -> bool:
        """Whether there is a program to run."""
        return self.program is not None

    def decisions(self, cell_names: CellNames | None = None) -> tuple[Decision, ...]:
        """The decision report."""
        return decision_report(self.tree, cell_names)


def compile_source(source: Source, cell_names: CellNames | None = None) -> CompileResult:
    """Compile a program text; indices are checked against `cell_names` where they are given."""
    return compile_tree(parse(source), cell_names)


def compile_tree(parsed: ParseResult, cell_names: CellNames | None = None) -> CompileResult:
    """Compile what `parse` gave."""
    findings = Findings(parsed.program.source)
    lowering = Lowering(parsed.program, findings, cell_names)
    lowering.run()
    declared, blocks_known = _refused_lines(parsed)
    lowering.finish(declared)
    found = findings.diagnostics
    if not blocks_known:
        found = [each for each in found if each.code not in _BLOCK_CODES and each.code != "E204"]
    if not parsed.ok or any(each.code in _BLOCK_CODES | _LABEL_CODES for each in found):
        found = [each for each in found if each.is_error]
    if findings.full:
        found.append(_too_many(parsed.program.source))
    diagnostics = tuple(sorted((*parsed.diagnostics, *found), key=sort_key))
    program = None if has_errors(diagnostics) else lowering.program()
    return CompileResult(program=program, tree=parsed.program, diagnostics=diagnostics)


def _too_many(source: Source) -> Diagnostic:
    end = len(source.text)
    message = f"more than {MAX_ERRORS} errors; the rest is not shown"
    return Diagnostic(code="E139", message=message, source=source, span=Span(end, end))


def _refused_lines(parsed: ParseResult) -> tuple[frozenset[str], bool]:
    """Labels declared on lines that the parser refused, and whether none of these belongs to a block."""
    source = parsed.program.source
    declared = set()
    blocks_known = True
    for diagnostic in parsed.diagnostics:
        if diagnostic.span is None or not diagnostic.is_error:
            continue
        text = source.line_text(source.position(diagnostic.span.start)[0])
        label = _DECLARED.match(text)
        if label is not None:
            declared.add(tree.name_key(label[1]))
        if _BLOCK_WORD.match(text):
            blocks_known = False
    return frozenset(declared), blocks_known
