"""Where the statements of a program stand in its text."""

from __future__ import annotations

from array import array
from operator import itemgetter, sub

from viapoint.language import tree
from viapoint.vm.program import SpanMap


def span_map(program: tree.Program, addresses: array[int]) -> SpanMap:
    """Line and columns of every statement. All by mapping over fields: a loop would cost as much again."""
    statements = program.statements
    lines = array("I", map(itemgetter(0), statements))
    before = [0, *(start - 1 for start in program.source.line_starts)]  # by line: column = offset - before
    bases = list(map(before.__getitem__, lines))
    return SpanMap(
        addresses,
        lines,
        array("I", map(sub, map(itemgetter(1), statements), bases)),
        array("I", map(sub, map(itemgetter(2), statements), bases)),
    )
