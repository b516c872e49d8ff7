"""The catalogue is complete, and the examples of syntax errors raise what they say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import viapoint
from viapoint.language.catalogue import CATALOGUE, Entry, Example, explain
from viapoint.language.diagnostics import Diagnostic
from viapoint.language.parser import parse
from viapoint.language.reading import decode, read_source
from viapoint.language.source import Source

SYNTAX = [entry for entry in CATALOGUE.values() if entry.code.startswith("E1")]
PACKAGE = Path(viapoint.__file__).parent
CODE = re.compile(r'"([EWI][1-6]\d\d)"')


def diagnose(example: Example) -> tuple[Diagnostic, ...]:
    if example.path is not None:
        return read_source(example.path).diagnostics
    if example.data is not None:
        return decode("example.via", example.data).diagnostics
    assert example.program is not None
    return parse(Source("example.via", example.program)).diagnostics


@pytest.mark.parametrize("entry", SYNTAX, ids=lambda entry: entry.code)
def test_examples_of_syntax_errors_raise_their_code(entry: Entry) -> None:
    assert entry.examples
    for example in entry.examples:
        codes = [diagnostic.code for diagnostic in diagnose(example)]
        assert codes[-1] == entry.code
        assert set(codes) <= {entry.code} | ({"E110"} if entry.code == "E139" else set())


@pytest.mark.parametrize("entry", CATALOGUE.values(), ids=lambda entry: entry.code)
def test_entries_say_what_is_needed(entry: Entry) -> None:
    assert re.fullmatch(r"E[1-4]\d\d|W5\d\d|I6\d\d", entry.code)
    assert entry.title == entry.title.strip()
    assert not entry.title.endswith(".")
    assert entry.explanation.endswith((".", ")"))
    text = explain(entry.code.lower())
    assert text is not None
    assert text.startswith(f"{entry.code} ({entry.severity.value}): {entry.title}\n")
    assert max(map(len, text.splitlines()[3:]), default=0) < 120


def test_unknown_codes_have_no_explanation() -> None:
    assert explain("E999") is None
    assert explain("nonsense") is None


def test_codes_in_the_source_are_those_of_the_catalogue() -> None:
    used: set[str] = set()
    for file in PACKAGE.rglob("*.py"):
        if file.parent.name != "codes":
            used |= set(CODE.findall(file.read_text(encoding="utf-8")))
    assert used - set(CATALOGUE) == set(), "raised but not in the catalogue"
    assert set(CATALOGUE) - used == set(), "in the catalogue but never raised"
