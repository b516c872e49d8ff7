"""Collects the compiler's diagnostics and words the hints about a cell's indices."""

from __future__ import annotations

from collections.abc import Collection

from viapoint.language.diagnostics import Diagnostic, Label
from viapoint.language.parser import MAX_ERRORS
from viapoint.language.source import Source, Span
from viapoint.language.tree import Goto, Off, On, OnError, Sub, WaitFor

LISTED = 8
"""How many of the defined indices a hint names."""


class Findings:
    """A list of diagnostics of one source."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._errors = 0
        self.diagnostics: list[Diagnostic] = []

    @property
    def full(self) -> bool:
        """Whether there are so many errors that further ones are not worth the work of wording them."""
        return self._errors >= MAX_ERRORS

    def label_span(self, statement: Goto | Sub | WaitFor | On | OnError | Off, label: str) -> Span:
        """The label that a GOTO, SUB or OFF, or the end of a WAIT or ON, names."""
        text = self._source.text[statement.start : statement.end]
        start = statement.end - len(label)
        if not isinstance(statement, WaitFor | On | OnError):
            behind_word = text.split(None, 1)[1]
            start = statement.end - len(behind_word)
        return Span(start, start + len(label))

    def add(
        self, code: str, span: Span, message: str, hint: str | None = None, *labels: tuple[Span, str]
    ) -> None:
        """One finding at `span`; `labels` are second places that explain it."""
        if code[0] == "E":
            if self.full:
                return
            self._errors += 1
        self.diagnostics.append(
            Diagnostic(
                code=code,
                message=message,
                source=self._source,
                span=span,
                hint=hint,
                labels=tuple(Label(place, text) for place, text in labels),
            )
        )


def defined_are(kind: str, letter: str, index: int, defined: Collection[int]) -> str:
    """The hint for an index that does not exist: those that do, the nearest ones of many."""
    if not defined:
        return f"the cell defines no {kind}s"
    if isinstance(defined, range) and len(defined) > LISTED:
        return f"the cell has {letter}{defined[0]} to {letter}{defined[-1]}"
    nearest = sorted(sorted(defined, key=lambda each: (abs(each - index), each))[:LISTED])
    more = " and others" if len(defined) > LISTED else ""
    return f"defined are {', '.join(f'{letter}{each}' for each in nearest)}{more}"
