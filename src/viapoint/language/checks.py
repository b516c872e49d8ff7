"""Checks of a motion's parameters against the command table.

What depends on the codes alone (unknown, twice, excluded, missing) is told apart from what depends on
the values (domain), because many statements share the former. No places here: parameters are named by
their position in the statement; `lines.py` turns findings into diagnostics.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from viapoint.language.commands import (
    MAX_AXIS,
    MOTION_BY_WORD,
    MOTIONS,
    Form,
    MotionCommand,
    Need,
    Parameter,
)
from viapoint.language.tree import Layout


class Finding(NamedTuple):
    """Something wrong with parameter number `at`; `other` is the earlier parameter it clashes with."""

    code: str
    at: int
    message: str
    hint: str | None = None
    other: int | None = None


def base_key(key: str) -> str:
    """The table's key of a key as written: J1= gives J, X= gives X=, P gives P."""
    return key.rstrip("=").rstrip("0123456789") if key[-1] == "=" and key[-2:-1].isdigit() else key


@lru_cache(maxsize=64)
def parameters_of(word: str) -> dict[str, Parameter]:
    """Parameters of a motion command by key."""
    return {parameter.key: parameter for parameter in MOTION_BY_WORD[word].parameters}


@lru_cache(maxsize=1)
def all_parameters() -> dict[str, Parameter]:
    """Parameters of all motion commands by key."""
    return {parameter.key: parameter for command in MOTIONS for parameter in command.parameters}


def takers(key: str) -> list[str]:
    """Motion commands that take the parameter."""
    return [command.word for command in MOTIONS if key in parameters_of(command.word)]


@lru_cache(maxsize=4096)
def check_layout(layout: Layout) -> tuple[Finding, ...]:
    """What is wrong with the codes of a statement, apart from missing ones."""
    known = parameters_of(layout.command)
    findings: list[Finding] = []
    seen: dict[str, int] = {}
    for at, key in enumerate(layout.codes):
        parameter = known.get(base_key(key))
        if parameter is None:
            findings.append(_foreign(layout.command, at, key))
        elif key in seen:
            findings.append(Finding("E122", at, f"`{key}` is given twice", "keep one of them", seen[key]))
        else:
            clash = next((seen[each] for each in parameter.excludes if each in seen), None)
            if clash is not None:
                findings.append(_clash(layout.codes[clash], key, at, clash))
            findings.extend(_axis(parameter, key, at))
            seen[key] = at
    return tuple(findings)


def _foreign(word: str, at: int, key: str) -> Finding:
    others = takers(base_key(key))
    if not others:
        return Finding("E120", at, f"there is no parameter `{key}`")
    known = " ".join(parameter.shown for parameter in MOTION_BY_WORD[word].parameters)
    message = f"`{word}` has no parameter `{key}`; {_join(others)} {'has' if len(others) == 1 else 'have'}"
    return Finding("E121", at, message, f"{word} takes {known}")


def _join(items: list[str]) -> str:
    quoted = [f"`{item}`" for item in items]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} and {quoted[-1]}"


def _clash(first: str, second: str, at: int, other: int) -> Finding:
    if {first, second} <= {"F", "FC", "FA"}:
        hint = "a motion has one speed: keep one of F, FC, FA"
    else:
        hint = "give either the point of the cell or its coordinates"
    return Finding("E127", at, f"`{second}` cannot stand beside `{first}`", hint, other)


def _axis(parameter: Parameter, key: str, at: int) -> list[Finding]:
    if parameter.form is not Form.NUMBERED:
        return []
    number = int(key[len(parameter.code) : -1])
    if 1 <= number <= MAX_AXIS:
        return []
    return [
        Finding("E124", at, f"`{key}`: axes are numbered from 1 to {MAX_AXIS}", f"`{parameter.shown}`, …")
    ]


@lru_cache(maxsize=4096)
def check_missing(layout: Layout) -> tuple[Need, ...]:
    """The mandatory parts that the codes do not give."""
    command: MotionCommand = MOTION_BY_WORD[layout.command]
    given = {base_key(key) for key in layout.codes}
    return tuple(need for need in command.needs if not _met(need, given))


def _met(need: Need, given: set[str]) -> bool:
    if any(key in given for key in need.any_of):
        return True
    return bool(need.all_of) and all(key in given for key in need.all_of)


def is_sound(layout: Layout) -> bool:
    """Whether nothing is wrong with the codes of a statement."""
    return not check_layout(layout) and not check_missing(layout)
