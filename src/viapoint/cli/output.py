"""Text for people and JSON for programs, on standard output. No colour here: tables are plain text."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from viapoint.cli.failures import UsageError
from viapoint.narration import fixed

__all__ = ["aligned", "fixed", "keep_inputs", "note", "print_json", "print_table"]


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


def note(text: str) -> None:
    """Something beside the result: to standard error, so that standard output stays what was asked for."""
    print(text, file=sys.stderr)


def keep_inputs(output: Path, *inputs: Path | None) -> None:
    """Raises UsageError where what is to be written would replace a file that is read."""
    for given in inputs:
        if given is not None and given.resolve() == output.resolve():
            raise UsageError(f"{output} is read by this command: write to another file")
