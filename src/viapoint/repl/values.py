"""Words of commands as numbers and signals; what is wrong with one is said in the user's terms. Pure."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Final

from viapoint.language.suggestions import did_you_mean
from viapoint.repl.console import Complaint

if TYPE_CHECKING:
    from viapoint.interactive import Interactive

_LEVELS: Final = {"on": True, "true": True, "1": True, "off": False, "false": False, "0": False}


def number(word: str, what: str) -> float:
    """A finite number."""
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise Complaint(f"`{word}` is not a number: {what} is needed")
    return value


def positive(word: str, what: str) -> float:
    """A number above 0."""
    value = number(word, what)
    if value <= 0.0:
        raise Complaint(f"`{word}` is not above 0: {what} is needed")
    return value


def count(words: list[str]) -> int:
    """A whole number from 1, 1 where nothing is said."""
    if not words:
        return 1
    if len(words) > 1 or not re.fullmatch(r"[1-9][0-9]{0,8}", words[0]):
        raise Complaint(f"`{' '.join(words)}` is not a whole number from 1")
    return int(words[0])


def index(word: str, code: str) -> int:
    """The number behind a code: 5 of P5."""
    found = re.fullmatch(rf"{code}([0-9]{{1,5}})", word, re.IGNORECASE)
    if found is None:
        raise Complaint(f"`{word}` is not {code} and a number, such as {code}5")
    return int(found[1])


def seconds(words: list[str]) -> float | None:
    """`for S`: so many seconds; None where nothing is said."""
    if not words:
        return None
    if len(words) != 2 or words[0].lower() != "for":
        raise Complaint(f"`{' '.join(words)}` should be `for` and a number of seconds")
    return positive(words[1], "a time in s")


def signal(session: Interactive, word: str) -> str:
    """The code of a signal given by code or name."""
    try:
        return str(session.signals.resolve(word))
    except KeyError:
        io = session.cell.io
        near = did_you_mean(word, (*io.names, *(f"${name}" for name in io.variables)))
        hint = near or "write DI1, DO1, AI1, AO1, or a name of the cell"
        if word.startswith("$"):
            hint = near or "variables are declared in the cell, under [variables]"
            raise Complaint(f"the cell declares no variable `{word}`; {hint}") from None
        raise Complaint(f"the cell has no signal `{word}`; {hint}") from None


def level(session: Interactive, code: str, word: str) -> bool | float:
    """A value for a signal or variable: on or off, or a number where it is one."""
    found = session.cell.io.find(code)
    if found is not None and not session.cell.io.is_switch(found):
        return number(word, f"a value for {code}")
    value = _LEVELS.get(word.lower())
    if value is None:
        raise Complaint(f"{code} is `on` or `off`, not `{word}`")
    return value
