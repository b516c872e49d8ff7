"""Program text to tree: the walk over the lines.

Text is taken in blocks. In a block all numbers are cut out at once; what is left of a line is its shape,
and a line whose shape is known becomes a statement right here. Every other line goes to `lines.py`.
Never raises for a bad program: what is wrong is in the diagnostics.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from operator import call
from typing import Final

from viapoint.language import tree
from viapoint.language.diagnostics import Diagnostic, has_errors, sort_key
from viapoint.language.lexical import MAX_LINE
from viapoint.language.lines import LineReader
from viapoint.language.shapes import HOLE, SPLIT_NUMBERS, build, flow, template, templates
from viapoint.language.source import Source, Span

BLOCK: Final = 1 << 16
"""Characters taken at a time: bounds the working memory beside the tree."""

MAX_ERRORS: Final = 1000
"""After so many errors the file is probably no program; the rest is not read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParseResult:
    """The statements that are right, and what is wrong with the others."""

    program: tree.Program
    diagnostics: tuple[Diagnostic, ...]

    @property
    def ok(self) -> bool:
        """Whether the program has no syntax error."""
        return not has_errors(self.diagnostics)


def parse(source: Source, *, use_shapes: bool = True) -> ParseResult:
    """Parse a program. `use_shapes=False` sends every line to the grammar: slow, for comparison."""
    reader = LineReader(source, use_shapes=use_shapes)
    line = 1
    for start, text in _blocks(source.text):
        lines = text.split("\n")
        if not use_shapes or HOLE in text or max(map(len, lines)) > MAX_LINE:
            _read_slowly(reader, line, start, lines)
        else:
            _read_block(reader, line, start, text, lines)
        line += len(lines)
        if len(reader.diagnostics) >= MAX_ERRORS:
            _give_up(reader, source)
            break
    program = tree.Program(source=source, statements=tuple(reader.statements))
    return ParseResult(program=program, diagnostics=tuple(sorted(reader.diagnostics, key=sort_key)))


def _blocks(text: str) -> Iterator[tuple[int, str]]:
    """Offset and text of blocks of whole lines, without the line end between two blocks."""
    start = 1 if text.startswith("\ufeff") else 0
    while True:
        end = text.find("\n", start + BLOCK)
        if end < 0:
            yield start, text[start:]
            return
        yield start, text[start:end]
        start = end + 1


def _read_slowly(reader: LineReader, line: int, start: int, lines: list[str]) -> None:
    for number, text in enumerate(lines, line):
        reader.read(number, start, text)
        start += len(text) + 1
        if len(reader.diagnostics) >= MAX_ERRORS:
            return


def _read_block(reader: LineReader, line: int, start: int, block: str, lines: list[str]) -> None:
    """The hot loop: about 2 µs a line. `at` is the index of the line's first number."""
    parts = SPLIT_NUMBERS.split(block)
    shapes = HOLE.join(parts[::2]).split("\n")
    numbers = parts[1::2]
    append, known, motion, new = reader.statements.append, templates.get, tree.Motion, tuple.__new__
    at = 0
    for number, (shape, text) in enumerate(zip(shapes, lines, strict=True), line):
        found = known(shape)
        if found is None:
            _read_other(reader, number, start, shape, text, numbers, at)
            at += shape.count(HOLE)
        else:
            layout, converters, count, indent, trailing, node, tail = found
            first = start + indent
            end = start + len(text) - trailing
            try:
                values = tuple(map(call, converters, numbers[at : at + count]))
            except ValueError:
                reader.read(number, start, text)
            else:
                if layout is not None:
                    append(new(motion, (number, first, end, layout, values, ())))
                else:
                    append(new(node, (number, first, end, *values, *tail)))
            at += count
        start += len(text) + 1


def _read_other(
    reader: LineReader, line: int, start: int, shape: str, text: str, numbers: list[str], at: int
) -> None:
    """A line of unknown shape: blank, a comment, a label or jump, a new shape, or one for the grammar."""
    comment = text.find("//")
    if comment >= 0:
        if '"' in text:
            reader.read(line, start, text)
            return
        text = text[:comment]
        shape = shape[: shape.find("//")]
    body = text.rstrip(" \t\r").lstrip(" \t")
    if not body:
        return
    first = start + len(text) - len(text.lstrip(" \t"))
    made = flow(body, line, first)
    if made is None:
        found = template(shape)
        if found is not None:
            made = build(found, numbers[at : at + found.holes], line, first, first + len(body))
    if made is None:
        reader.read(line, start, text)
    else:
        reader.statements.append(made)


def _give_up(reader: LineReader, source: Source) -> None:
    del reader.diagnostics[MAX_ERRORS:]
    last = reader.diagnostics[-1]
    end = last.span.end if last.span is not None else 0
    message = f"more than {MAX_ERRORS} errors; the rest of the file is not read"
    reader.diagnostics.append(
        Diagnostic(code="E139", message=message, source=source, span=Span(end - 1, end))
    )
