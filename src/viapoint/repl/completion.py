"""What a line may go on with: commands, parameters, points, labels, signals, files. Text in, words out."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from typing import Final

from viapoint.language.commands import (
    ACTION_BY_WORD,
    MOTION_BY_WORD,
    ActionCommand,
    Form,
    Operand,
    Parameter,
)
from viapoint.language.tree import name_key
from viapoint.repl.commands import BY_NAME, COMMANDS
from viapoint.repl.console import Console
from viapoint.repl.entry import label_of
from viapoint.runtime.cell import SignalKind

_LAST_WORD: Final = re.compile(r"\S*$")
_NUMBERED_SIGNALS: Final = 8
"""Signals without a name that are offered by their number; more would only fill the screen."""

_AT_A_PLACE: Final = ("SET", "RESET", "PULSE", "M", "LET", "INC")
"""What can be done at a place of the next motion."""


def complete(console: Console, text: str) -> tuple[list[str], int]:
    """Words that can stand where `text` ends, and how many of its last characters they replace."""
    found = _LAST_WORD.search(text)
    word = found.group() if found else ""
    before = text[: len(text) - len(word)]
    if before.strip() == "" and word.startswith(":"):
        candidates: Iterable[str] = (f":{command.name}" for command in COMMANDS)
    elif text.lstrip().startswith(":"):
        candidates = _argument(console, before.split()[0][1:], word)
    else:
        candidates = _statement(console, before)
    key = word.upper()
    fitting = [each for each in dict.fromkeys(candidates) if each.upper().startswith(key) and each != word]
    return fitting, len(word)


def _argument(console: Console, name: str, word: str) -> Iterable[str]:
    command = BY_NAME.get(name.lower())
    for kind in command.words.split() if command is not None else ():
        match kind:
            case "file":
                yield from _files(word)
            case "label":
                yield from _labels(console)
            case "signal":
                yield from _signals(console, tuple(kind.value for kind in SignalKind))
            case "point":
                yield from (f"P{index}" for index in sorted(console.session.points))
            case "command":
                yield from BY_NAME
            case _:
                yield kind


def _statement(console: Console, before: str) -> Iterable[str]:
    label = label_of(before)
    words = (before.partition(":")[2] if label else before).upper().split()
    if not words:
        yield from MOTION_BY_WORD
        yield from ACTION_BY_WORD
    elif words[0] in MOTION_BY_WORD:
        yield from _parameters(console, words)
    elif words[0] in ACTION_BY_WORD:
        yield from _operand(console, ACTION_BY_WORD[words[0]], words)


def _operand(console: Console, action: ActionCommand, words: list[str]) -> Iterable[str]:
    cell = console.session.cell
    match action.operand:
        case Operand.LABEL_TIMES | Operand.LABEL:
            yield from _labels(console)
        case Operand.INTERRUPT if words[-1] == "SUB":
            yield from _labels(console)
        case Operand.INTERRUPT:
            yield from ("ERROR", *_condition(console, action, words)) if len(words) == 1 else ("SUB",)
            yield from _condition(console, action, words) if len(words) > 1 and words[1] != "ERROR" else ()
        case Operand.NEXT:
            yield "NEXT"
        case Operand.CONDITION | Operand.WAIT:
            yield from _condition(console, action, words)
        case Operand.LEVEL:
            yield from _signals(console, ("DO", "AO"))
        case Operand.LET if "=" in words:
            yield from _signals(console, tuple(kind.value for kind in SignalKind))
            yield from ("TRUE", "FALSE", "NOT")
        case Operand.LET | Operand.INC if len(words) == 1:
            yield from _signals(console, (SignalKind.VARIABLE.value,))
        case Operand.OUTPUT | Operand.PULSE:
            yield from _signals(console, ("DO",))
        case Operand.PLACE if len(words) == 2:
            yield from _AT_A_PLACE
        case Operand.PLACE if len(words) > 2 and words[2] in _AT_A_PLACE:
            yield from _operand(console, ACTION_BY_WORD[words[2]], words[2:])
        case Operand.VALUE if action.word == "T":
            yield from (str(index) for index in sorted(cell.tools))
        case Operand.VALUE if action.word == "TRK":
            yield from (str(index) for index in (0, *sorted(cell.conveyors)))


def _condition(console: Console, action: ActionCommand, words: list[str]) -> Iterable[str]:
    if words[-1] == "GOTO":
        yield from _labels(console)
        return
    yield from _signals(console, tuple(kind.value for kind in SignalKind))
    if len(words) > 1:
        yield from ("AND", "OR", "NOT")
    else:
        yield from ("NOT", "AHEAD") if action.operand is Operand.CONDITION else ("NOT",)
    if action.operand is Operand.WAIT and len(words) > 1:
        yield from ("TIMEOUT", "GOTO")


def _parameters(console: Console, words: list[str]) -> Iterable[str]:
    session = console.session
    parameters = MOTION_BY_WORD[words[0]].parameters
    given = [each for each in parameters if any(_is(each, word) for word in words[1:])]
    barred = {key for each in given for key in (each.key, *each.excludes)}
    for parameter in parameters:
        if parameter.key in barred or any(each.key in parameter.excludes for each in given):
            continue
        match parameter.key:
            case "P" | "Q" as code:
                yield from (f"{code}{index}" for index in sorted(session.points))
                if code == "P":
                    yield from (point.name for point in session.points.values() if point.name is not None)
            case "Z":
                yield from (f"Z{index}" for index in sorted(session.cell.frames))
            case "T":
                yield from (f"T{index}" for index in sorted(session.cell.tools))
            case "J":
                yield from (f"J{i + 1}=" for i in range(session.cell.robot.joint_count))
            case "E":
                yield from (f"E{number}=" for number in sorted(session.cell.auxiliary_axes))
            case key:
                yield key


def _is(parameter: Parameter, word: str) -> bool:
    """Whether a word gives the parameter; joints and axes can be given more than once."""
    if parameter.form is Form.NUMBERED:
        return False
    if parameter.form is Form.ASSIGNED:
        return word.startswith(parameter.key)
    return re.fullmatch(rf"{parameter.code}[-+.0-9E]+", word) is not None


def _labels(console: Console) -> Iterable[str]:
    yield from (label_of(text) or "" for text in console.subroutines.values())
    if console.loaded is not None:
        known = set(console.subroutines)
        yield from (each.name for each in console.loaded.program.labels if name_key(each.name) not in known)


def _signals(console: Console, kinds: tuple[str, ...]) -> Iterable[str]:
    io = console.session.cell.io
    for kind in kinds:
        yield from (name for name, signal in io.names.items() if signal.kind.value == kind)
        signals = io.of_kind(SignalKind(kind))
        few = signals if kind == SignalKind.VARIABLE.value else islice(signals, _NUMBERED_SIGNALS)
        yield from map(str, few)


def _files(word: str) -> Iterable[str]:
    """Files and folders that begin so; nothing where the folder cannot be read."""
    folder, begin = os.path.split(word)
    try:
        names = sorted(os.listdir(folder or "."))
    except OSError:
        return
    for name in names:
        if name.startswith(begin) and not name.startswith("."):
            path = os.path.join(folder, name)
            yield f"{path}{os.sep}" if Path(path).is_dir() else path
