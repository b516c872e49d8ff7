"""Program text with a name, and places in it.

A place is a pair of character offsets (`Span`); line and column are derived from it when somebody
wants to read them. Files are read in `reading.py`, not here.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import NamedTuple


class Span(NamedTuple):
    """Half-open range of character offsets into a source text."""

    start: int
    end: int


class Source:
    """An immutable text and the name it is reported under (a path, or `<prompt>`)."""

    __slots__ = ("_starts", "name", "text")

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.text = text
        self._starts: list[int] | None = None

    def __repr__(self) -> str:
        return f"Source({self.name!r}, {len(self.text)} characters)"

    @property
    def line_starts(self) -> list[int]:
        """Offset of the first character of every line; made at the first use, in linear time."""
        if self._starts is None:
            starts = [0]
            append, find = starts.append, self.text.find
            at = find("\n")
            while at >= 0:
                append(at + 1)
                at = find("\n", at + 1)
            self._starts = starts
        return self._starts

    def position(self, offset: int) -> tuple[int, int]:
        """Line and column of `offset`, both from 1; columns count characters."""
        starts = self.line_starts
        line = bisect_right(starts, offset)
        return line, offset - starts[line - 1] + 1

    def line_start(self, line: int) -> int:
        """Offset at which line `line` (from 1) begins."""
        return self.line_starts[line - 1]

    def line_text(self, line: int) -> str:
        """Text of line `line` (from 1) without its line end."""
        start = self.line_starts[line - 1]
        end = self.text.find("\n", start)
        text = self.text[start:] if end < 0 else self.text[start:end]
        return text.removesuffix("\r")

    def slice(self, span: Span) -> str:
        """The text of `span`."""
        return self.text[span.start : span.end]
