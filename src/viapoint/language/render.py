"""Diagnostics as text for people and as objects for programs; no finding is made or changed here."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from viapoint.language.diagnostics import Diagnostic, Label, Severity
from viapoint.language.source import Source, Span

_RESET: Final = "\x1b[0m"
_BOLD: Final = "\x1b[1m"
_BLUE: Final = "\x1b[1;34m"
_COLOURS: Final = {Severity.ERROR: "\x1b[1;31m", Severity.WARNING: "\x1b[1;33m", Severity.INFO: "\x1b[1;36m"}

MAX_EXCERPT: Final = 160
"""Widest piece of a source line that is shown; longer lines are cut around the place."""

_CONTEXT: Final = 40
"""Characters kept before the place when a line is cut."""


def to_json(diagnostic: Diagnostic) -> dict[str, Any]:
    """The object of `check --format json`: lines and columns from 1, the end exclusive."""
    extent = diagnostic.extent
    line, column, end_line, end_column = extent if extent is not None else (None, None, None, None)
    return {
        "code": diagnostic.code,
        "severity": diagnostic.severity.value,
        "message": diagnostic.message,
        "file": diagnostic.file_name,
        "line": line,
        "column": column,
        "end_line": end_line,
        "end_column": end_column,
        "hint": diagnostic.hint,
    }


def to_text(diagnostic: Diagnostic, *, colour: bool = False) -> str:
    """A finding with its place, an excerpt of the source where there is one, labels and hint."""
    return "\n".join(_Page(colour).lines(diagnostic))


def render(diagnostics: Iterable[Diagnostic], *, colour: bool = False) -> str:
    """All findings, a blank line between them; empty for none."""
    return "\n\n".join(to_text(diagnostic, colour=colour) for diagnostic in diagnostics)


def summary(diagnostics: Iterable[Diagnostic]) -> str:
    """`2 errors, 1 warning`; `no problems` for none."""
    counts = dict.fromkeys(Severity, 0)
    for diagnostic in diagnostics:
        counts[diagnostic.severity] += 1
    parts = [
        f"{count} {severity.value}{'s' if count > 1 else ''}" for severity, count in counts.items() if count
    ]
    return ", ".join(parts) or "no problems"


class _Page:
    """Lays out one diagnostic, with or without colour."""

    def __init__(self, colour: bool) -> None:
        self._colour = colour

    def _paint(self, text: str, code: str) -> str:
        return f"{code}{text}{_RESET}" if self._colour else text

    def lines(self, diagnostic: Diagnostic) -> list[str]:
        colour = _COLOURS[diagnostic.severity]
        head = self._paint(f"{diagnostic.severity.value}[{diagnostic.code}]", colour)
        lines = [f"{head}{self._paint(': ' + diagnostic.message, _BOLD)}"]
        width = len(str(diagnostic.extent[2])) if diagnostic.extent is not None else 1
        span = diagnostic.span or _whole_line(diagnostic)
        if diagnostic.source is not None and span is not None:
            lines += self._excerpts(diagnostic.source, span, diagnostic.labels, width, colour)
        else:
            lines += self._place(diagnostic, width)
        if diagnostic.hint is not None:
            bar = self._paint("=", _BLUE)
            lines.append(f"{' ' * width} {bar} {self._paint('hint', _BOLD)}: {diagnostic.hint}")
        return lines

    def _place(self, diagnostic: Diagnostic, width: int) -> list[str]:
        if diagnostic.file_name is None:
            return []
        parts = [diagnostic.file_name]
        if diagnostic.line is not None:
            parts.append(str(diagnostic.line))
        key = f", at `{diagnostic.key}`" if diagnostic.key is not None else ""
        return [f"{' ' * width}{self._paint('-->', _BLUE)} {':'.join(parts)}{key}"]

    def _excerpts(
        self, source: Source, span: Span, labels: tuple[Label, ...], width: int, colour: str
    ) -> list[str]:
        line, column = source.position(span.start)
        arrow = self._paint("-->", _BLUE)
        lines = [f"{' ' * width}{arrow} {source.name}:{line}:{column}", self._gutter("", width)]
        marks = [(span, "^", "", colour), *((label.span, "-", label.text, _BLUE) for label in labels)]
        by_line: dict[int, list[tuple[Span, str, str, str]]] = {}
        for mark in marks:
            by_line.setdefault(source.position(mark[0].start)[0], []).append(mark)
        for number in sorted(by_line):
            lines += self._line(source, number, by_line[number], width)
        return lines

    def _gutter(self, number: str, width: int, text: str = "") -> str:
        return f"{self._paint(f'{number:>{width}} |', _BLUE)}{text}"

    def _line(
        self, source: Source, number: int, marks: list[tuple[Span, str, str, str]], width: int
    ) -> list[str]:
        text = source.line_text(number)
        start = source.line_start(number)
        first = min(mark[0].start for mark in marks) - start
        cut = max(0, first - _CONTEXT) if len(text) > MAX_EXCERPT else 0
        shown = _printable(text[cut : cut + MAX_EXCERPT])
        lines = [self._gutter(str(number), width, f" {shown}")]
        for span, mark, label, colour in marks:
            begin = span.start - start - cut
            length = max(1, min(span.end - start - cut, len(shown)) - begin)
            note = f" {label}" if label else ""
            lines.append(
                self._gutter("", width, f" {' ' * begin}{self._paint(mark * length + note, colour)}")
            )
        return lines


def _whole_line(diagnostic: Diagnostic) -> Span | None:
    """The text of the line a diagnostic speaks of, where it has a source and no span."""
    if diagnostic.source is None or diagnostic.line is None:
        return None
    text = diagnostic.source.line_text(diagnostic.line)
    start = diagnostic.source.line_start(diagnostic.line)
    return Span(start + len(text) - len(text.lstrip()), start + len(text.rstrip()))


def _printable(text: str) -> str:
    """Tabs become single blanks and control characters dots, so that columns stay where they are."""
    return "".join(
        " " if character == "\t" else character if character.isprintable() else "·" for character in text
    )
