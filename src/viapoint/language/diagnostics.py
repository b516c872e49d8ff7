"""What a diagnostic is: data. Rendering is in `render.py`, meaning and advice in `catalogue.py`.

Three kinds of place fit: a span of a program text, a key of a file (cell, robot, scenario) with its
line where it is known, and none.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum, unique

from viapoint.language.source import Source, Span


@unique
class Severity(Enum):
    """Errors forbid running, warnings and infos do not."""

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"


_BY_LETTER = {"E": Severity.ERROR, "W": Severity.WARNING, "I": Severity.INFO}


@dataclass(frozen=True, slots=True)
class Label:
    """A second place that explains the first: 'first declared here'."""

    span: Span
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnostic:
    """One finding.

    `code` is a key of the catalogue, `message` one sentence in the user's terms, `hint` what to write
    instead. Place: `source` and `span`; or `file` with `line` (from 1) and the dotted `key`.
    """

    code: str
    message: str
    source: Source | None = None
    span: Span | None = None
    file: str | None = None
    line: int | None = None
    key: str | None = None
    hint: str | None = None
    labels: tuple[Label, ...] = ()

    @property
    def severity(self) -> Severity:
        """From the letter of the code."""
        return _BY_LETTER[self.code[0]]

    @property
    def is_error(self) -> bool:
        """True when the program must not run."""
        return self.code[0] == "E"

    @property
    def file_name(self) -> str | None:
        """Name of the source or file it is about."""
        return self.source.name if self.source is not None else self.file

    @property
    def extent(self) -> tuple[int, int, int, int] | None:
        """Line, column, end line, end column: all from 1, the end exclusive. None without a place."""
        if self.source is not None and self.span is not None:
            return (*self.source.position(self.span.start), *self.source.position(self.span.end))
        if self.line is None:
            return None
        if self.source is not None:
            return self.line, 1, self.line, len(self.source.line_text(self.line)) + 1
        return self.line, 1, self.line, 1


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """Whether any of them is an error."""
    return any(diagnostic.is_error for diagnostic in diagnostics)


def sort_key(diagnostic: Diagnostic) -> tuple[str, int, int, str]:
    """Order of reports: by file, then place, then code."""
    if diagnostic.source is not None and diagnostic.span is not None:
        place = diagnostic.span.start, diagnostic.span.end
    else:
        place = diagnostic.line or 0, 0
    return diagnostic.file_name or "", *place, diagnostic.code
