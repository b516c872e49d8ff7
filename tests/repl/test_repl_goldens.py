"""Whole sittings, word for word: the golden file holds what is typed (behind its prompt) and what is said.

What the time law decides is masked: durations, times, the lengths travelled in a tick, and where the
robot is when it is stopped on its way. Where a belt lets it go is compared to 0.01 mm: following the belt's
noise magnifies rounding, and the last digits differ from one machine to another.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from repl_sittings import FILES, Sitting

GOLDEN = Path(__file__).parents[1] / "golden" / "repl"
NAMES = sorted(path.stem for path in GOLDEN.glob("*.txt"))

_PROMPT = re.compile(r"^(?:via>|\.\.\.>) ?(.*)$")
_FIGURES = re.compile(r"\d+\.\d+ (s|mm)\b")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
_ON_ITS_WAY = re.compile(r"(?<=\bat )[^,]*(?=,)")


def typed(transcript: str) -> str:
    """The lines that were typed."""
    found = (_PROMPT.match(line) for line in transcript.splitlines())
    return "\n".join(line[1] for line in found if line)


def masked(transcript: str) -> str:
    lines = (_FIGURES.sub(r"# \1", line) for line in transcript.splitlines())
    return "\n".join(_ON_ITS_WAY.sub("…", line) if line.startswith("stopped") else line for line in lines)


def let_go_as_in(golden: str, transcript: str) -> str:
    """The transcript with the golden places where a belt lets the robot go, as far as within 0.01 mm."""
    wanted, lines = golden.splitlines(), transcript.splitlines()
    if len(wanted) != len(lines):
        return transcript
    for k in range(1, len(lines)):
        if lines[k - 1].endswith("decoupled") and _near(lines[k], wanted[k]):
            lines[k] = wanted[k]
    return "\n".join(lines)


def _near(line: str, wanted: str) -> bool:
    pairs = zip(_NUMBER.findall(line), _NUMBER.findall(wanted), strict=False)
    same_words = _NUMBER.sub("", line) == _NUMBER.sub("", wanted)
    return same_words and all(abs(float(a) - float(b)) <= 0.01 for a, b in pairs)


@pytest.mark.parametrize("name", NAMES)
def test_sitting(name: str, monkeypatch: pytest.MonkeyPatch, check_golden) -> None:
    """With a scenario where the test files have one of that name."""
    monkeypatch.chdir(FILES)
    scenario = FILES / f"{name}_scenario.toml"
    sitting = Sitting(scenario if scenario.exists() else None)
    text = (GOLDEN / f"{name}.txt").read_text(encoding="utf-8")
    check_golden(f"repl/{name}.txt", let_go_as_in(text, masked(sitting.read(typed(text)))))


def test_there_are_sittings() -> None:
    assert len(NAMES) >= 6
