"""Little programs with the diagnostics they get, exact to the span."""

from __future__ import annotations

from pathlib import Path

import pytest
from case_files import Case, mismatch, read_cases

from viapoint.language.parser import parse
from viapoint.language.source import Source

CASES = read_cases(Path(__file__).parent / "cases")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_diagnostics_are_those_on_the_lines(case: Case) -> None:
    problem = mismatch(case, parse(Source("case.via", case.text)).diagnostics)
    assert problem is None, problem


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_grammar_alone_says_the_same(case: Case) -> None:
    source = Source("case.via", case.text)
    assert parse(source, use_shapes=False) == parse(source)


def test_names_of_cases_differ() -> None:
    names = [case.name for case in CASES]
    assert len(names) == len(set(names))
