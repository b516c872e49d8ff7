"""Whole sittings, word for word: the golden file holds what is typed (behind its prompt) and what is said.

What the time law decides is masked: durations, times, the lengths travelled in a tick, and where the
robot is when it is stopped on its way or let go by a belt.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import pytest
from repl_sittings import FILES, Sitting

GOLDEN = Path(__file__).parents[1] / "golden" / "repl"
NAMES = sorted(path.stem for path in GOLDEN.glob("*.txt"))

_PROMPT = re.compile(r"^(?:via>|\.\.\.>) ?(.*)$")
_FIGURES = re.compile(r"\d+\.\d+ (s|mm)\b")
_ON_ITS_WAY = re.compile(r"(?<=\bat )[^,]*(?=,)")


def typed(transcript: str) -> str:
    """The lines that were typed."""
    found = (_PROMPT.match(line) for line in transcript.splitlines())
    return "\n".join(line[1] for line in found if line)


def masked(transcript: str) -> str:
    lines = (_FIGURES.sub(r"# \1", line) for line in transcript.splitlines())
    return "\n".join(
        _ON_ITS_WAY.sub("…", line) if line.startswith("stopped") or before.endswith("decoupled") else line
        for before, line in pairwise(("", *lines))
    )


@pytest.mark.parametrize("name", NAMES)
def test_sitting(name: str, monkeypatch: pytest.MonkeyPatch, check_golden) -> None:
    """With a scenario where the test files have one of that name."""
    monkeypatch.chdir(FILES)
    scenario = FILES / f"{name}_scenario.toml"
    sitting = Sitting(scenario if scenario.exists() else None)
    text = (GOLDEN / f"{name}.txt").read_text(encoding="utf-8")
    check_golden(f"repl/{name}.txt", masked(sitting.read(typed(text))))


def test_there_are_sittings() -> None:
    assert len(NAMES) >= 6
