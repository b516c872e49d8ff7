"""The corpus of the benchmarks is what it claims to be, and plain for the fast path."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import pytest

from viapoint.language import lines
from viapoint.language.commands import MOTION_BY_WORD
from viapoint.language.parser import parse
from viapoint.language.source import Source

SIZE = 5000
FLOW = {"IF", "ENDIF", "GOTO", "SUB", "END"}


@pytest.fixture
def text(monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "benchmarks"))
    from corpus import corpus

    assert corpus(SIZE) == corpus(SIZE), "the same arguments give the same text"
    sys.modules.pop("corpus")
    return corpus(SIZE)


def kind(line: str) -> str:
    word = line.split()[0]
    if word in MOTION_BY_WORD:
        return "motion"
    if word == "//":
        return "comment"
    return "flow" if word in FLOW or word.endswith(":") else "signal"


def test_shares_are_those_stated(text: str) -> None:
    counts = Counter(kind(line) for line in text.splitlines())
    assert abs(counts.total() - SIZE) <= 3
    for name, share in {"motion": 0.60, "signal": 0.20, "flow": 0.15, "comment": 0.05}.items():
        assert counts[name] / counts.total() == pytest.approx(share, abs=0.02)


def test_it_parses_without_the_grammar(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a line of the corpus reached the grammar")

    monkeypatch.setattr(lines, "parse_motion", refuse)
    monkeypatch.setattr(lines, "parse_action", refuse)
    result = parse(Source("corpus.via", text))
    assert result.ok
    assert len({tuple(each[3:]) for each in result.program.statements}) > SIZE / 2
