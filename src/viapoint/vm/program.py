"""A compiled program: code, constants, labels and the map back to the source. Data only.

The file format is `container.py`, the check that every loaded file passes is `verifier.py`.
"""

from __future__ import annotations

import hashlib
from array import array
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import NamedTuple


class Span(NamedTuple):
    """Where a statement stands in the source: line and columns from 1, `end_column` exclusive."""

    line: int
    column: int
    end_column: int


class Label(NamedTuple):
    """A label and the address of its LABEL instruction."""

    name: str
    address: int


@dataclass(frozen=True, slots=True)
class SpanMap:
    """One entry per statement, addresses ascending; of several at one address the last one counts."""

    addresses: array[int] = field(default_factory=lambda: array("I"))
    lines: array[int] = field(default_factory=lambda: array("I"))
    columns: array[int] = field(default_factory=lambda: array("I"))
    end_columns: array[int] = field(default_factory=lambda: array("I"))

    def at(self, address: int) -> Span:
        """The statement that the instruction at `address` was made from."""
        entry = bisect_right(self.addresses, address) - 1
        if entry < 0:
            return Span(1, 1, 1)
        return Span(self.lines[entry], self.columns[entry], self.end_columns[entry])

    def line_at(self, address: int) -> int:
        """Its line alone."""
        entry = bisect_right(self.addresses, address) - 1
        return self.lines[entry] if entry >= 0 else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """What the machine runs.

    `numbers` are in the language's units (mm, deg, s). A *shape* is the list of a motion's parameters
    ("P F R"), whose values stand in `numbers` in that order. `source_hash` is the SHA-256 of the source
    text in UTF-8; `source_text` is the text itself where it was embedded.
    """

    name: str
    code: bytes
    numbers: array[float]
    shapes: tuple[str, ...]
    texts: tuple[str, ...]
    labels: tuple[Label, ...]
    spans: SpanMap
    source_hash: bytes
    source_text: str | None = None

    def line_at(self, address: int) -> int:
        """Source line of the instruction at `address`."""
        return self.spans.line_at(address)

    def source_lines(self) -> list[str]:
        """The lines of the embedded source, as the parser counts them; empty without it."""
        return [] if self.source_text is None else self.source_text.replace("\r\n", "\n").split("\n")


def hash_source(text: str) -> bytes:
    """SHA-256 of a source text."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).digest()
