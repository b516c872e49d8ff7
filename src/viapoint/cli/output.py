"""Text for people and JSON for programs, on standard output. No colour here: tables are plain text."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from viapoint.cli.failures import UsageError
from viapoint.narration import fixed

__all__ = ["aligned", "fixed", "keep_inputs", "note", "print_json", "print_table", "shortened"]

# Longer tables show their beginning and end; all rows are in the JSON report and in the recording.
FIRST_ROWS, LAST_ROWS = 80, 20


def print_json(value: Any) -> None:
    """One object, and nothing but it. Raises ValueError for NaN or infinity: they are not JSON."""
    print(json.dumps(value, indent=1, allow_nan=False, ensure_ascii=False))


def aligned(head: Sequence[str], rows: Iterable[Sequence[str]], right: str) -> Iterator[str]:
    """Lines of a table; `right` has a `>` for every column set to the right, else `<`."""
    table = [list(head), *(list(row) for row in rows)]
    widths = [max(len(row[i]) for row in table) for i in range(len(head))]
    for row in table:
        cells = (
            cell.rjust(width) if side == ">" else cell.ljust(width)
            for cell, width, side in zip(row, widths, right, strict=True)
        )
        yield "  ".join(cells).rstrip()


def print_table(head: Sequence[str], rows: Iterable[Sequence[str]], right: str, indent: str = "") -> None:
    for line in aligned(head, rows, right):
        print(f"{indent}{line}".rstrip())


def shortened(rows: list[list[str]]) -> list[list[str]]:
    """Rows for people: of a long table its beginning and its end."""
    if len(rows) <= FIRST_ROWS + LAST_ROWS:
        return rows
    left_out = len(rows) - FIRST_ROWS - LAST_ROWS
    gap = ["…", f"… {left_out} more", *[""] * (len(rows[0]) - 2)]
    return [*rows[:FIRST_ROWS], gap, *rows[-LAST_ROWS:]]


def note(text: str) -> None:
    """Something beside the result: to standard error, so that standard output stays what was asked for."""
    print(text, file=sys.stderr)


def keep_inputs(output: Path, *inputs: Path | None) -> None:
    """Raises UsageError where what is to be written would replace a file that is read."""
    for given in inputs:
        if given is not None and given.resolve() == output.resolve():
            raise UsageError(f"{output} is read by this command: write to another file")
