"""Case files: many little programs in one text, each with its expectations on the offending lines.

    --- name of the case
    MLL P1      //! E110 "MLL" "did you mean `ML`?"
    PRINT "x
    //!^ E105 "\\"x"

A program is expected to give exactly the diagnostics named in its `//!` comments: code, text of the
span, and optionally a piece of message or hint; several are separated by `&&`. `//!^` speaks of the line
above, for lines that end in a string or have to end without a comment. Escapes as in Python.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from pathlib import Path

from viapoint.language.diagnostics import Diagnostic

_EXPECTATION = re.compile(r'([EWI]\d{3})\s+("(?:[^"\\]|\\.)*")(?:\s+("(?:[^"\\]|\\.)*"))?\s*(?:&&\s*|$)')


@dataclass(frozen=True, slots=True)
class Expected:
    line: int
    code: str
    text: str
    piece: str


@dataclass(frozen=True, slots=True)
class Case:
    name: str
    text: str
    expected: tuple[Expected, ...]


def read_cases(folder: Path) -> list[Case]:
    """The cases of all files of a folder."""
    return [case for file in sorted(folder.glob("*.via")) for case in read_listing(file)]


def read_listing(file: Path) -> list[Case]:
    """The cases of one file."""
    chunks = re.split(r"^--- ?(.*)\n", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return [
        Case(f"{file.stem}: {title}", text, expectations(text))
        for title, text in zip(chunks[1::2], chunks[2::2], strict=True)
    ]


def expectations(text: str) -> tuple[Expected, ...]:
    """What the comments of a program expect."""
    found = []
    for number, line in enumerate(text.split("\n"), 1):
        at = line.rfind("//!")
        if at < 0:
            continue
        rest, number = (line[at + 4 :], number - 1) if line[at + 3] == "^" else (line[at + 3 :], number)
        found += [Expected(number, *each) for each in parse_expectations(rest.strip())]
    return tuple(found)


def parse_expectations(text: str) -> list[tuple[str, str, str]]:
    """Code, span text and piece of message of each expectation of a comment."""
    found, at = [], 0
    while at < len(text):
        match = _EXPECTATION.match(text, at)
        assert match is not None, f"cannot read the expectation {text[at:]!r}"
        code, span, piece = match.groups()
        found.append((code, ast.literal_eval(span), ast.literal_eval(piece) if piece else ""))
        at = match.end()
    return found


def mismatch(case: Case, diagnostics: tuple[Diagnostic, ...]) -> str | None:
    """What differs between the diagnostics given and those expected; None if nothing does."""
    missing = list(case.expected)
    surplus = []
    for each in diagnostics:
        found = next((wanted for wanted in missing if fits(wanted, each)), None)
        if found is None:
            surplus.append(each)
        else:
            missing.remove(found)
    if not missing and not surplus:
        return None
    lines = [f"missing: {each}" for each in missing]
    lines += [f"not expected: {shown(each)}" for each in surplus]
    return "\n".join([case.text, *lines])


def fits(wanted: Expected, given: Diagnostic) -> bool:
    assert given.source is not None
    assert given.span is not None
    assert given.extent is not None
    return (
        given.code == wanted.code
        and given.extent[0] == wanted.line
        and given.source.slice(given.span) == wanted.text
        and wanted.piece in f"{given.message} | {given.hint}"
    )


def shown(given: Diagnostic) -> str:
    assert given.source is not None
    assert given.span is not None
    text = given.source.slice(given.span)
    line = given.extent[0] if given.extent is not None else 0
    return f"line {line}: {given.code} {text!r}: {given.message} | {given.hint}"
