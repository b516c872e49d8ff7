"""The grammar of one statement at work: its parser and its actions. Its text is made in `rules.py`.

lark is imported at the first use, because canonical programs never need it and its import takes as
long as parsing 20,000 lines. The actions build values and conditions; what they find wrong is raised
as a `Fault`. Statements are judged one by one, so a bad one never disturbs the next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from viapoint.language import tree
from viapoint.language.commands import BARE_CODES, ERRNO, FOUND, INDEX, NUMBERS, SIGNALS, TRUTHS
from viapoint.language.lexical import is_cell_name
from viapoint.language.rules import SEARCH, grammar_text, rule_of, starts

if TYPE_CHECKING:
    from lark import Lark, Token

MAX_DEPTH: Final = 64
"""Deepest nesting of parentheses, NOT and signs: keeps every later walk of the tree shallow."""


@dataclass(slots=True)
class Fault(Exception):
    """An error of one statement; `start` and `end` are offsets into the text that was parsed."""

    code: str
    message: str
    start: int
    end: int
    hint: str | None = None


@dataclass(slots=True)
class Unexpected(Exception):
    """The text does not follow the grammar from offset `at` on; `at` is its length if it ends early."""

    at: int


class Part(NamedTuple):
    """An expression: a number (`value`), or what is read (`node`): a condition, an analog signal, a variable.

    Places include parentheses.
    """

    start: int
    end: int
    value: float | None
    node: tree.Condition | None
    depth: int


class Given(NamedTuple):
    """A parameter as written: its code (upper case, with `=`) and its value, or the name of a point."""

    start: int
    end: int
    key: str
    value: float
    name: str | None = None


class Operands(NamedTuple):
    """What an auxiliary statement was given: which of its commands, word, values, condition.

    `label` is a label, a name, or the word that says which form it is (DO, AO, AHEAD, D, S, %).
    """

    command: str
    label: Token | None
    parts: tuple[Part, ...]
    given: Given | None
    action: Operands | None = None


@lru_cache(maxsize=1)
def parser() -> Lark:
    """The parser, made once."""
    from lark import Lark

    return Lark(
        grammar_text(),
        parser="lalr",
        lexer="contextual",
        start=["motion", "disjunction", *starts()],
        transformer=Actions(),
        maybe_placeholders=False,
    )


def _run(text: str, start: str) -> Any:
    from lark.exceptions import UnexpectedInput, UnexpectedToken

    try:
        return parser().parse(text, start=start)
    except UnexpectedInput as error:
        ended = isinstance(error, UnexpectedToken) and error.token.type == "$END"
        raise Unexpected(len(text) if ended else error.pos_in_stream or 0) from None


def parse_motion(text: str) -> list[Given]:
    """Parameters of a motion from the text after its word. Raises Fault, Unexpected."""
    given: list[Given] = _run(text, "motion")
    return given


def parse_action(word: str, text: str) -> Operands:
    """Operands of an auxiliary statement from the text after its first word. Raises as above."""
    operands: Operands = _run(text, rule_of(word))
    return operands


def parse_search(text: str) -> Operands:
    """What stands behind UNTIL: a condition and the point to keep. Raises as above."""
    operands: Operands = _run(text, SEARCH)
    return operands


def parse_value(text: str) -> Part:
    """A constant expression that stands for a number. Raises as above."""
    part: Part = _run(text, "disjunction")
    return as_number(part)


def as_number(part: Part) -> Part:
    """`part` if it is a number. Raises Fault if it is a condition, or read from the outside world."""
    if part.value is None:
        if isinstance(part.node, tree.Named):
            message = (
                f"`{part.node.name}` is a name; naming values is not part of this version of the language"
            )
            raise Fault("E118", message, part.node.start, part.node.end, "write the number itself")
        if isinstance(part.node, tree.Variable):
            message = (
                f"`${part.node.name}` changes while the program runs; this number has to be known before"
            )
            hint = "a variable can be compared with a number, and `INC` adds to it"
            raise Fault("E132", message, part.start, part.end, hint)
        if isinstance(part.node, tree.Signal) and part.node.kind in NUMBERS:
            what = "`ERRNO`" if part.node.kind == ERRNO else f"`{part.node.kind}{part.node.number}`"
            message = f"{what} changes while the program runs; this number has to be known before"
            raise Fault("E132", message, part.start, part.end, "it can be compared with a number")
        message = "a number is expected here, this is a condition"
        raise Fault("E132", message, part.start, part.end, "compare numbers; test signals with AND, OR, NOT")
    return part


def as_condition(part: Part) -> tree.Condition:
    """The condition of `part`. Raises Fault if it is a number."""
    if part.node is None or (isinstance(part.node, tree.Signal) and part.node.kind in NUMBERS):
        message = "a condition is expected here, this is a number"
        hint = "test a signal, as in `DI3`, or compare two numbers, as in `1 < 2`"
        raise Fault("E131", message, part.start, part.end, hint)
    return part.node


def as_comparable(part: Part) -> tree.Comparable:
    """What a comparison compares: a number, an analog signal, a name, a variable. Raises Fault otherwise."""
    match part.node:
        case tree.Named() | tree.Variable():
            return part.node
        case tree.Signal(kind=kind) if kind in NUMBERS:
            return part.node
        case _:
            return tree.Number(part.start, part.end, as_number(part).value or 0.0)


def as_value(part: Part) -> tree.Value:
    """What a variable is given: any number, and all that is true or false."""
    return (
        part.node
        if part.value is None and part.node
        else tree.Number(part.start, part.end, part.value or 0.0)
    )


def _deeper(inner: Part, start: int, end: int) -> int:
    if inner.depth >= MAX_DEPTH:
        raise Fault("E119", f"the expression is nested deeper than {MAX_DEPTH} levels", start, end)
    return inner.depth + 1


def _number(start: int, end: int, value: float, depth: int) -> Part:
    if not math.isfinite(value):
        raise Fault("E107", "the number is too large to represent", start, end)
    return Part(start, end, value, None, depth)


def _arithmetic(operator: Token, left: float, right: float) -> float:
    sign = operator.upper()
    if sign in "/MOD" and right == 0:
        raise Fault("E128", "division by zero", operator.start_pos or 0, operator.end_pos or 0)
    match sign:
        case "+":
            return left + right
        case "-":
            return left - right
        case "*":
            return left * right
        case "/":
            return left / right
        case "MOD":
            return left % right
    raise AssertionError(operator)


class Actions:
    """One method per rule of the grammar; lark calls them with the rule's children."""

    def motion(self, children: list[Given]) -> list[Given]:
        for before, after in pairwise(children):
            if before.end == after.start:
                raise missing_blank(after.start, after.end)
        for each in children:
            if each.name is not None and each.key == "P" and each.name.upper() in BARE_CODES:
                raise Unexpected(each.start)
        return children

    def glued(self, children: list[Any]) -> Given:
        code, part = children
        if isinstance(part.node, tree.Named) and code.upper() in ("P", "Q"):
            _touching(code, part)
            return Given(code.start_pos, part.end, code.upper(), 0.0, part.node.name)
        _adjacent(code, part)
        return Given(code.start_pos, part.end, code.upper(), part.value)

    def point(self, children: list[Any]) -> Given:
        name = _free(children[0])
        return Given(name.start_pos or 0, name.end_pos or 0, "P", 0.0, str(name))

    def search(self, children: list[Any]) -> Part:
        word = children[0]
        start, end = word.start_pos, word.end_pos
        return Part(start, end, None, tree.Signal(start, end, FOUND, 0), 0)

    def truth(self, children: list[Any]) -> Part:
        start, end = children[0].start_pos, children[0].end_pos
        return Part(start, end, None, tree.Truth(start, end, TRUTHS[children[0].upper()]), 0)

    def variable(self, children: list[Any]) -> Part:
        start, end = children[0].start_pos, children[0].end_pos
        return Part(start, end, None, tree.Variable(start, end, str(children[0])[1:]), 0)

    def error_number(self, children: list[Any]) -> Part:
        word = children[0]
        start, end = word.start_pos, word.end_pos
        return Part(start, end, None, tree.Signal(start, end, ERRNO, 0), 0)

    def named(self, children: list[Any]) -> Part:
        name = _free(children[0])
        start, end = name.start_pos or 0, name.end_pos or 0
        return Part(start, end, None, tree.Named(start, end, str(name)), 0)

    def assigned(self, children: list[Any]) -> Given:
        code, part = children
        _adjacent(code, part)
        letters = code.upper().rstrip("=").rstrip("0123456789")
        digits = code[len(letters) : -1]
        key = f"{letters}{int(digits)}=" if digits else f"{letters}="
        return Given(code.start_pos, part.end, key, part.value)

    def signed(self, children: list[Any]) -> Part:
        start, end = children[0].start_pos, children[-1].end_pos
        if len(children) == 2 and children[0].end_pos != children[1].start_pos:
            raise Fault("E106", "the sign must touch its number", start, end)
        return _number(start, end, float("".join(children)), 0)

    def enclosed(self, children: list[Any]) -> Part:
        inner: Part = children[1]
        start, end = children[0].start_pos, children[2].end_pos
        return inner._replace(start=start, end=end, depth=_deeper(inner, start, end))

    def disjunction(self, children: list[Any]) -> Part:
        return self._chain(tree.Or, children)

    def conjunction(self, children: list[Any]) -> Part:
        return self._chain(tree.And, children)

    def _chain(self, node: type[tree.And] | type[tree.Or], children: list[Any]) -> Part:
        parts: list[Part] = children[::2]
        start, end = parts[0].start, parts[-1].end
        depth = max(_deeper(part, start, end) for part in parts)
        return Part(start, end, None, node(start, end, tuple(map(as_condition, parts))), depth)

    def negated(self, children: list[Any]) -> Part:
        word, inner = children
        start, end = word.start_pos, inner.end
        made = tree.Not(start, end, as_condition(inner))
        return Part(start, end, None, made, _deeper(inner, start, end))

    def comparison(self, children: list[Any]) -> Part:
        left, operator, right = children[0], str(children[1]), children[2]
        made = tree.Compare(left.start, right.end, operator, as_comparable(left), as_comparable(right))
        return Part(left.start, right.end, None, made, max(left.depth, right.depth))

    def sum(self, children: list[Any]) -> Part:
        result = as_number(children[0])
        for operator, operand in zip(children[1::2], children[2::2], strict=True):
            right = as_number(operand)
            value = _arithmetic(operator, result.value or 0.0, right.value or 0.0)
            result = _number(result.start, right.end, value, max(result.depth, right.depth))
        return result

    product = sum

    def opposite(self, children: list[Any]) -> Part:
        sign, inner = children[0], as_number(children[1])
        value = (inner.value or 0.0) * (-1 if sign == "-" else 1)
        start, end = sign.start_pos, inner.end
        return _number(start, end, value, _deeper(inner, start, end))

    def number(self, children: list[Any]) -> Part:
        return _number(children[0].start_pos, children[0].end_pos, float(children[0]), 0)

    def signal(self, children: list[Any]) -> Part:
        word, number = children
        return _signal(word, number.start_pos, number.end_pos, float(number), number.end_pos)

    def signal_of(self, children: list[Any]) -> Part:
        word, _, inner, closing = children
        part = as_number(inner)
        return _signal(word, part.start, part.end, part.value or 0.0, closing.end_pos)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("take_"):
            command = name.removeprefix("take_").upper()
            return lambda children: _operands(command, children)
        raise AttributeError(name)


def _signal(word: Token, start: int, end: int, value: float, whole_end: int) -> Part:
    if not INDEX.holds(value):
        code = "E125" if value < 0 or not value.is_integer() else "E124"
        raise Fault(code, f"the number of a {SIGNALS[word.upper()]} must be {INDEX.text}", start, end)
    first = word.start_pos or 0
    made = tree.Signal(first, whole_end, word.upper(), int(value))
    return Part(first, whole_end, None, made, 0)


def _free(name: Token) -> Token:
    """`name` if something can be called so. Raises Unexpected for words and codes of the language."""
    if not is_cell_name(name):
        raise Unexpected(name.start_pos or 0)
    return name


def _adjacent(code: Token, part: Part) -> None:
    _touching(code, part)
    as_number(part)


def _touching(code: Token, part: Part) -> None:
    if code.end_pos != part.start:
        start, end = code.start_pos or 0, part.end
        hint = f"write the number directly after `{code}`"
        raise Fault("E126", f"`{code}` and its value stand apart", start, end, hint)


def missing_blank(start: int, end: int) -> Fault:
    """The fault of two parameters that touch."""
    return Fault(
        "E116", "a blank is missing before this parameter", start, end, "separate parameters by blanks"
    )


def _operands(command: str, children: list[Any]) -> Operands:
    label: Any = next((child for child in children if isinstance(child, str)), None)
    parts = tuple(child for child in children if isinstance(child, Part))
    if label is not None and command in ("SET", "RESET", "PULSE") and label.type == "NAME":
        _free(label)
    given = next((child for child in children if isinstance(child, Given)), None)
    action = next((child for child in children if isinstance(child, Operands)), None)
    return Operands(command, label, parts, given, action)
