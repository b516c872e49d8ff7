"""Catalogue entries of syntax (E10x to E13x)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "E101",
        "file is not UTF-8",
        "Program files are text in UTF-8. A byte of this file does not belong to any character of that "
        "encoding; the file was probably saved in another one, or is no text at all. Save it as UTF-8.",
        Example(data=b"ML P1 // gr\xfc\xdfe\n"),
    ),
)
