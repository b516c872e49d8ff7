"""Did you mean: the closest of the words that would be right, and words of other robot languages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

CUTOFF: Final = 0.6
"""Similarity (difflib ratio) from which a word is worth suggesting; below, it only confuses."""

FOREIGN: Final = {
    "MOVEL": "ML",
    "MOVE": "ML",
    "LIN": "ML",
    "G1": "ML",
    "LINEAR": "ML",
    "MOVEJ": "MJ",
    "PTP": "MJ",
    "G0": "MJ",
    "JOINT": "MJ",
    "MOVEC": "MC",
    "CIRC": "MC",
    "G2": "MC",
    "G3": "MC",
    "SPLINE": "MS",
    "SPL": "MS",
    "DELAY": "WAIT",
    "SLEEP": "WAIT",
    "DWELL": "WAIT",
    "CALL": "SUB",
    "GOSUB": "SUB",
    "JUMP": "GOTO",
    "JMP": "GOTO",
    "RETURN": "END",
    "RET": "END",
    "EXIT": "END",
    "HALT": "END",
    "ELIF": "ELSEIF",
    "ELSIF": "ELSEIF",
    "FI": "ENDIF",
    "TOOL": "T",
    "TRACK": "TRK",
    "TANGENT": "TANG",
    "SETDO": "SET DO",
    "RESETDO": "RESET DO",
    "CLEAR": "RESET DO",
}
"""What people who know other languages or G-code write, and what it is called here."""


def closest(word: str, candidates: Iterable[str]) -> str | None:
    """The candidate most like `word`, whatever its case; None if none is like it."""
    from difflib import get_close_matches

    by_upper = {candidate.upper(): candidate for candidate in candidates}
    found = get_close_matches(word.upper(), by_upper, n=1, cutoff=CUTOFF)
    return by_upper[found[0]] if found else None


def did_you_mean(word: str, candidates: Iterable[str]) -> str | None:
    """The hint `did you mean …?`, or None."""
    found = closest(word, candidates)
    return None if found is None else f"did you mean `{found}`?"


def command_hint(word: str, commands: Iterable[str]) -> str:
    """What to say about an unknown command."""
    foreign = FOREIGN.get(word.upper())
    if foreign is not None:
        return f"it is called `{foreign}` here"
    listed = tuple(commands)
    return did_you_mean(word, listed) or f"commands are {' '.join(listed)}"
