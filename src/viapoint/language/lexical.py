"""The lexical rules: numbers, names, blanks, comments, and where the words of a line stand.

Regular expressions and small scanners shared by the fast path, the grammar and the diagnosis of bad
lines. Everything is ASCII here: other characters may stand in comments and strings only.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from viapoint.language.commands import CODES_BEFORE_DIGITS, KEYWORDS
from viapoint.language.source import Source, Span
from viapoint.language.tree import Motion

NUMBER: Final = r"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
"""A decimal number without its sign."""

NAME: Final = r"[A-Za-z][A-Za-z0-9_]*"

SIGNED: Final = re.compile(rf"[-+]?{NUMBER}")
NAME_PATTERN: Final = re.compile(NAME)

MAX_LINE: Final = 4096
"""Longest line in characters: no statement comes near; keeps one mangled line from costing a minute."""

_REFUSED: Final = re.compile(rf"(?:{'|'.join(sorted(CODES_BEFORE_DIGITS))})[0-9]+")
_LETTERS_AND_NUMBER: Final = re.compile("[A-Za-z]{1,2}[0-9]+")
"""Read otherwise, now or one day: P1, DI3, X100. No cell has such names."""

_STRING_OR_COMMENT: Final = re.compile(r'"(?:[^"\\]|\\.)*"|//|"')


def is_keyword(name: str) -> bool:
    """Whether `name` is reserved."""
    return name.upper() in KEYWORDS


def is_code(name: str) -> bool:
    """Whether `name` is a code followed by digits, like P1 or DI3."""
    return _REFUSED.fullmatch(name.upper()) is not None


def is_free_name(name: str) -> bool:
    """Whether a label may be called `name`, which is a name lexically."""
    upper = name.upper()
    return upper not in KEYWORDS and _REFUSED.fullmatch(upper) is None


def is_cell_name(name: str) -> bool:
    """Whether a cell may call something `name`: not a word of the language, not letters and a number."""
    return name.upper() not in KEYWORDS and _LETTERS_AND_NUMBER.fullmatch(name) is None


def code_end(text: str) -> tuple[int, int | None]:
    """Where the code of a line ends (a comment begins), and where an unterminated string begins."""
    if '"' not in text:
        at = text.find("//")
        return (len(text) if at < 0 else at), None
    for found in _STRING_OR_COMMENT.finditer(text):
        if found.group() == "//":
            return found.start(), None
        if found.group() == '"':
            return len(text), found.start()
    return len(text), None


def words(text: str) -> Iterator[tuple[int, int]]:
    """Start and end of the words of `text`: what blanks separate outside parentheses."""
    start, depth = -1, 0
    for at, character in enumerate(text):
        if character in " \t\r" and depth == 0:
            if start >= 0:
                yield start, at
                start = -1
            continue
        if start < 0:
            start = at
        if character == "(":
            depth += 1
        elif character == ")" and depth > 0:
            depth -= 1
    if start >= 0:
        yield start, len(text)


def parameter_spans(source: Source, motion: Motion) -> tuple[Span, ...]:
    """Place of every parameter of `motion`, in the order of its layout."""
    places = list(words(source.text[motion.start : motion.end]))[1:]
    return tuple(Span(motion.start + start, motion.start + end) for start, end in places)
