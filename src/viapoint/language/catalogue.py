"""The catalogue: one table of all diagnostic codes.

The documentation, `viapoint explain` and the tests of the examples are made from it. The entries stand
in `codes/`, one module per number range; add an entry there and it is everywhere. Codes are never
reused. This module joins them and knows nothing of how diagnostics are found or shown.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from viapoint.language.codes import cells, execution, files, meaning, notes, planning, syntax
from viapoint.language.codes.entry import Entry, Example

__all__ = ["CATALOGUE", "Entry", "Example", "explain"]


SHOWN_LINES: Final = 40
SHOWN_WIDTH: Final = 100
"""How much of an example `explain` prints; a few examples are long on purpose."""


def _join() -> dict[str, Entry]:
    table: dict[str, Entry] = {}
    for part in (syntax, meaning, files, cells, planning, execution, notes):
        for entry in part.ENTRIES:
            if entry.code in table:
                raise ValueError(f"diagnostic code {entry.code} stands in the catalogue twice")
            table[entry.code] = entry
    return dict(sorted(table.items()))


CATALOGUE: Final = MappingProxyType(_join())
"""Entry by code, sorted by code."""


def explain(code: str) -> str | None:
    """The text `viapoint explain CODE` prints; None for an unknown code."""
    entry = CATALOGUE.get(code.upper())
    if entry is None:
        return None
    parts = [f"{entry.code} ({entry.severity.value}): {entry.title}", "", entry.explanation]
    for example in entry.examples:
        for name, text in example.files():
            parts += ["", f"Example ({name}):", ""]
            parts += _excerpt(text)
    return "\n".join(parts)


def _excerpt(text: str) -> list[str]:
    """The lines of an example, indented; those that are long on purpose are cut."""
    lines = text.rstrip("\n").split("\n")
    shown = [line if len(line) <= SHOWN_WIDTH else f"{line[:SHOWN_WIDTH]} …" for line in lines[:SHOWN_LINES]]
    if len(lines) > SHOWN_LINES:
        shown.append(f"… {len(lines) - SHOWN_LINES} more lines")
    return [f"    {line}".rstrip() for line in shown]
