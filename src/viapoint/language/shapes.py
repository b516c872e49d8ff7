"""The fast path: statements recognised by their *shape*, which is their text without its numbers.

`ML P12 F100.5` and `ML P7 F80` have one shape. What a shape means is worked out once, from the command
table, and kept as a template; every further line of that shape costs a look-up and the conversion of
its numbers. Whatever is not plainly right here (a value out of its domain, a shape unknown to the
table) is left to the grammar, which alone decides what is an error: the fast path never reports one.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from operator import call
from typing import Any, Final, NamedTuple

from viapoint.language import tree
from viapoint.language.checks import is_sound
from viapoint.language.commands import (
    ACTIONS,
    COUNT,
    H_TANGENT,
    INDEX,
    MAX_AXIS,
    MOTION_BY_WORD,
    NOT_NEGATIVE,
    POSITIVE,
    SWITCHES,
    Domain,
    Form,
    Operand,
)
from viapoint.language.lexical import NAME, is_free_name

HOLE: Final = "\x01"
"""Stands for a number in a shape. A control character: it is an error in a program text anyway."""

SPLIT_NUMBERS: Final = re.compile(r"([-+]?[0-9]++(?:\.[0-9]++)?+(?:[eE][-+]?[0-9]++)?+(?!=))")
"""Splits a text at its numbers. The number of `J1=` belongs to the code, hence the last condition."""

_PLAIN: Final = re.compile(rf"[{HOLE}\t -~]*")
"""Characters of a plain shape: printable ASCII; a carriage return inside a line is an error."""

_CACHE_SIZE: Final = 4096
"""Templates and conditions kept; beyond it the store starts afresh, so that memory stays bounded."""

Converter = Callable[[str], float]


class Template(NamedTuple):
    """How to build the statement of a shape.

    `indent` blanks stand before it, `trailing` characters after it; `converters` make values of its
    `holes` numbers or raise ValueError; `layout` is None for what is not a motion: then `node` is built
    of the values and `tail`.
    """

    layout: tree.Layout | None
    converters: tuple[Converter, ...]
    holes: int
    indent: int
    trailing: int
    node: type[Any]
    tail: tuple[Any, ...]


def _converter(domain: Domain) -> Converter:
    low, high = domain.low, domain.high
    if domain.is_whole:

        def whole(word: str) -> int:
            value = int(word)
            if low <= value <= high:
                return value
            raise ValueError(word)

        return whole

    def number(word: str) -> float:
        value = float(word)
        if low <= value <= high and (value or not nonzero):
            return value
        raise ValueError(word)

    nonzero = domain.nonzero
    return number


@lru_cache(maxsize=1)
def _motion_words() -> dict[str, dict[str, tuple[str, Converter]]]:
    """By motion command: shape of a parameter → its code as written, and its converter."""
    table: dict[str, dict[str, tuple[str, Converter]]] = {}
    for word, command in MOTION_BY_WORD.items():
        known = table.setdefault(word, {})
        for parameter in command.parameters:
            convert = _converter(parameter.domain)
            if parameter.form is Form.NUMBERED:
                for axis in range(1, MAX_AXIS + 1):
                    code = f"{parameter.code}{axis}="
                    known[code + HOLE] = code, convert
            else:
                known[parameter.key + HOLE] = parameter.key, convert
    return table


_VALUE_NODES: Final[dict[str, tuple[type[Any], tuple[Any, ...]]]] = {
    "T": (tree.SelectTool, ()),
    "TRK": (tree.Track, ()),
    "M": (tree.MFunction, ()),
}
_FORMS: Final[tuple[tuple[str, type[Any], tuple[Domain, ...], tuple[Any, ...]], ...]] = (
    ("WAIT", tree.Wait, (NOT_NEGATIVE,), ()),
    ("WAIT DI", tree.WaitInput, (INDEX,), ()),
    ("SET DO", tree.SetOutput, (INDEX,), (True,)),
    ("RESET DO", tree.SetOutput, (INDEX,), (False,)),
    ("PULSE DO", tree.Pulse, (INDEX, POSITIVE), ()),
)
"""Forms of commands that take more than a number: words, node, domains of the numbers, tail."""

BARE_NODES: Final[dict[str, type[Any]]] = {
    "ELSE": tree.Else,
    "ENDIF": tree.EndIf,
    "END": tree.End,
    "SYNC": tree.Sync,
    "RETRY": tree.Retry,
    "STOP": tree.Stop,
}
CONDITION_NODES: Final[dict[str, type[Any]]] = {"IF": tree.If, "ELSEIF": tree.ElseIf}
JUMP_NODES: Final[dict[str, type[Any]]] = {"GOTO": tree.Goto, "SUB": tree.Sub}


def value_node(word: str) -> tuple[type[Any], tuple[Any, ...]]:
    """Node type of a command with one number, and what follows the number in the node."""
    return _VALUE_NODES[word]


@lru_cache(maxsize=1)
def _action_shapes() -> dict[str, tuple[type[Any], tuple[Converter, ...], tuple[Any, ...]]]:
    """Normalised shape of an auxiliary statement → its node, converters, tail."""
    table: dict[str, tuple[type[Any], tuple[Converter, ...], tuple[Any, ...]]] = {}
    for command in ACTIONS:
        if command.operand is Operand.VALUE and command.domain is not None:
            node, tail = _VALUE_NODES[command.word]
            entry = node, (_converter(command.domain),), tail
            table[f"{command.word} {HOLE}"] = table[f"{command.word}{HOLE}"] = entry
        elif command.operand is Operand.TANGENT and command.domain is not None:
            on = _converter(command.domain)
            table[f"{command.word} {HOLE}"] = tree.Tangent, (on,), (0.0,)
            one, offset = _only_one, _converter(H_TANGENT.domain)
            table[f"{command.word} {HOLE} {H_TANGENT.code}{HOLE}"] = tree.Tangent, (one, offset), ()
        elif command.operand is Operand.NOTHING:
            table[command.word] = BARE_NODES[command.word], (), ()
    for words, node, domains, tail in _FORMS:
        converters = tuple(_converter(domain) for domain in domains)
        if node is tree.WaitInput:
            converters = (_unsigned,)
        form = node, converters, tail
        holes = " ".join([HOLE] * len(domains))
        table[f"{words} {holes}"] = table[f"{words}{holes}"] = form
    return table


def _unsigned(word: str) -> int:
    """The number of a signal as conditions write it."""
    if word.isdecimal() and INDEX.holds(int(word)):
        return int(word)
    raise ValueError(word)


def _only_one(word: str) -> int:
    if int(word) == 1:
        return 1
    raise ValueError(word)


templates: Final[dict[str, Template]] = {}
"""Templates by shape. Only shapes that are right stand here."""


def template(shape: str) -> Template | None:
    """The template of a shape, made and kept if the shape is right; None if it is not."""
    found = templates.get(shape)
    if found is None:
        found = _make(shape)
        if found is not None:
            if len(templates) >= _CACHE_SIZE:
                templates.clear()
            templates[shape] = found
    return found


def _make(shape: str) -> Template | None:
    words = shape.upper().split()
    if not words or _PLAIN.fullmatch(shape.rstrip(" \t\r")) is None:
        return None
    indent = len(shape) - len(shape.lstrip(" \t"))
    trailing = len(shape) - len(shape.rstrip(" \t\r"))
    known = _motion_words().get(words[0])
    if known is None:
        action = _action_shapes().get(" ".join(words))
        if action is None:
            return None
        node, converters, tail = action
        return Template(None, converters, len(converters), indent, trailing, node, tail)
    pairs = [known.get(word) for word in words[1:]]
    good = [pair for pair in pairs if pair is not None]
    layout = tree.Layout(words[0], tuple(code for code, _ in good))
    if len(good) < len(pairs) or not is_sound(layout):
        return None
    converters = tuple(convert for _, convert in good)
    return Template(layout, converters, len(converters), indent, trailing, tree.Motion, ())


def build(found: Template, numbers: list[str], line: int, start: int, end: int) -> tree.Statement | None:
    """The statement of a template; None where a number is not in its domain."""
    try:
        values = tuple(map(call, found.converters, numbers))
    except ValueError:
        return None
    if found.layout is not None:
        return tree.Motion(line, start, end, found.layout, values)
    made: tree.Statement = found.node(line, start, end, *values, *found.tail)
    return made


def _alternatives(nodes: dict[str, type[Any]]) -> str:
    return "|".join(sorted(nodes, key=len, reverse=True))


_FLOW: Final = re.compile(
    rf"(?:({NAME}):|({_alternatives(JUMP_NODES)})[ \t]+({NAME})(?:[ \t]+([0-9]{{1,9}}))?"
    rf"|({_alternatives(CONDITION_NODES)}|ELSE[ \t]+IF)[ \t]+(AHEAD[ \t]+)?(.+))",
    re.IGNORECASE | re.DOTALL,
)
_TERM: Final = re.compile(
    rf"(?:(NOT)[ \t]+)?({'|'.join(SWITCHES)})[ \t]*([0-9]{{1,5}})(?:[ \t]+(AND|OR)[ \t]+|$)", re.IGNORECASE
)


def flow(text: str, line: int, start: int) -> tree.Statement | None:
    """A label, jump or IF from the stripped text of a statement; None if it is not plainly right."""
    found = _FLOW.fullmatch(text)
    if found is None:
        return None
    name, jump, target, times, branch, ahead, _ = found.groups()
    end = start + len(text)
    if name is not None:
        return tree.Label(line, start, end - 1, name) if is_free_name(name) else None
    if jump is not None:
        count = None if times is None else int(times)
        if not is_free_name(target) or (count is not None and not COUNT.holds(count)):
            return None
        made: tree.Statement = JUMP_NODES[jump.upper()](line, start, end, target, count)
        return made
    condition = _condition(text, found.start(7))
    if condition is None:
        return None
    node = CONDITION_NODES[branch.upper() if branch.upper() in CONDITION_NODES else "ELSEIF"]
    conditional: tree.Statement = node(line, start, end, condition, ahead is not None)
    return conditional


@lru_cache(maxsize=_CACHE_SIZE)
def _condition(text: str, at: int) -> tree.Condition | None:
    """A chain of signals, all joined by AND or all by OR; offsets count from the statement's start."""
    terms: list[tree.Condition] = []
    joints: set[str] = set()
    while True:
        found = _TERM.match(text, at)
        if found is None:
            return None
        negated, kind, number, joint = found.groups()
        if int(number) > 65535:
            return None
        term: tree.Condition = tree.Signal(found.start(2), found.end(3), kind.upper(), int(number))
        terms.append(term if negated is None else tree.Not(found.start(1), found.end(3), term))
        if joint is None:
            break
        joints.add(joint.upper())
        at = found.end()
    if len(joints) > 1:
        return None
    if not joints:
        return terms[0]
    node = tree.And if joints == {"AND"} else tree.Or
    return node(terms[0].start, terms[-1].end, tuple(terms))


def quick(text: str, line: int, start: int) -> tree.Statement | None:
    """A statement from its stripped text, without comment; None if the grammar has to judge it."""
    if HOLE in text:
        return None
    parts = SPLIT_NUMBERS.split(text)
    found = template(HOLE.join(parts[::2]))
    if found is None:
        return flow(text, line, start)
    return build(found, parts[1::2], line, start, start + len(text))
