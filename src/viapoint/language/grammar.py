"""The grammar of one statement: `via.lark` completed from the command table, and its actions.

lark is imported at the first use, because canonical programs never need it and its import takes as
long as parsing 20,000 lines. The actions build values and conditions; what they find wrong is raised
as a `Fault`. Statements are judged one by one, so a bad one never disturbs the next.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from viapoint.language import tree
from viapoint.language.commands import (
    ACTIONS,
    INDEX,
    MOTIONS,
    SIGNALS,
    Form,
    Operand,
)
from viapoint.language.lexical import NAME, NUMBER

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
    """An expression: a number (`value`) or a condition (`node`). Places include parentheses."""

    start: int
    end: int
    value: float | None
    node: tree.Condition | None
    depth: int


class Given(NamedTuple):
    """A parameter as written: its code (upper case, with `=`) and its value."""

    start: int
    end: int
    key: str
    value: float


class Operands(NamedTuple):
    """What an auxiliary statement was given: which of its commands, label, values, condition."""

    command: str
    label: Token | None
    parts: tuple[Part, ...]
    given: Given | None


def rule_of(word: str) -> str:
    """Start rule of the statements whose first word is `word`."""
    return "motion" if any(word == command.word for command in MOTIONS) else f"on_{word.lower()}"


def _alternation(codes: set[str]) -> str:
    return "|".join(sorted(codes, key=lambda code: (-len(code), code)))


def _codes(form: Form) -> str:
    return _alternation({p.code for m in MOTIONS for p in m.parameters if p.form is form})


_OPERAND_RULES: Final = {
    Operand.NOTHING: "",
    Operand.VALUE: "value",
    Operand.LABEL_TIMES: "NAME value?",
    Operand.CONDITION: "disjunction",
    Operand.TANGENT: "value parameter?",
}


def _rules() -> tuple[str, tuple[str, ...]]:
    """Rules of the auxiliary commands, one start rule per first word, and their names."""
    alternatives: dict[str, list[str]] = {}
    keywords: set[str] = set()
    for command in ACTIONS:
        first, *more = command.words
        keywords.update(more)
        body = " ".join([*(f"_{word}" for word in more), _OPERAND_RULES[command.operand]])
        alias = "take_" + "_".join(command.words).lower()
        alternatives.setdefault(first, []).append(f"{body} -> {alias}")
    lines = [f"{rule_of(word)}: " + "\n  | ".join(bodies) for word, bodies in alternatives.items()]
    lines += [f"_{word}: /{word}(?![A-Za-z_])/i" for word in sorted(keywords)]
    lines += [f"{word}: /{word}(?![A-Za-z0-9_])/i" for word in ("AND", "OR", "NOT", "MOD")]
    return "\n".join(lines), tuple(rule_of(word) for word in alternatives)


def grammar_text() -> str:
    """The complete grammar, as lark reads it."""
    filled = {
        "RULES": _rules()[0],
        "GLUED": _codes(Form.GLUED),
        "ASSIGNED": _codes(Form.ASSIGNED),
        "NUMBERED": _codes(Form.NUMBERED),
        "SIGNALS": _alternation(set(SIGNALS)),
        "NUMBER": NUMBER,
        "NAME": NAME,
    }
    text = files("viapoint.language").joinpath("via.lark").read_text(encoding="utf-8")
    return re.sub(r"\$([A-Z]+)", lambda found: filled[found.group(1)], text)


@lru_cache(maxsize=1)
def parser() -> Lark:
    """The parser, made once."""
    from lark import Lark

    rules, starts = _rules()
    assert rules
    return Lark(
        grammar_text(),
        parser="lalr",
        lexer="contextual",
        start=["motion", "disjunction", *starts],
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


def parse_value(text: str) -> Part:
    """A constant expression that stands for a number. Raises as above."""
    part: Part = _run(text, "disjunction")
    return as_number(part)


def as_number(part: Part) -> Part:
    """`part` if it is a number. Raises Fault if it is a condition."""
    if part.value is None:
        message = "a number is expected here, this is a condition"
        raise Fault("E132", message, part.start, part.end, "compare numbers; test signals with AND, OR, NOT")
    return part


def as_condition(part: Part) -> tree.Condition:
    """The condition of `part`. Raises Fault if it is a number."""
    if part.node is None:
        message = "a condition is expected here, this is a number"
        hint = "test a signal, as in `DI3`, or compare two numbers, as in `1 < 2`"
        raise Fault("E131", message, part.start, part.end, hint)
    return part.node


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
        return children

    def glued(self, children: list[Any]) -> Given:
        code, part = children
        _adjacent(code, part)
        return Given(code.start_pos, part.end, code.upper(), part.value)

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
        left, operator, right = as_number(children[0]), str(children[1]), as_number(children[2])
        ends = [tree.Number(part.start, part.end, part.value or 0.0) for part in (left, right)]
        made = tree.Compare(left.start, right.end, operator, ends[0], ends[1])
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
            command = name.removeprefix("take_").upper().replace("_", " ")
            return lambda children: _operands(command, children)
        raise AttributeError(name)


def _signal(word: Token, start: int, end: int, value: float, whole_end: int) -> Part:
    if not INDEX.holds(value):
        raise Fault("E125", f"the number of a {SIGNALS[word.upper()]} must be {INDEX.text}", start, end)
    first = word.start_pos or 0
    made = tree.Signal(first, whole_end, word.upper(), int(value))
    return Part(first, whole_end, None, made, 0)


def _adjacent(code: Token, part: Part) -> None:
    if code.end_pos != part.start:
        start, end = code.start_pos or 0, part.end
        hint = f"write the number directly after `{code}`"
        raise Fault("E126", f"`{code}` and its value stand apart", start, end, hint)
    as_number(part)


def missing_blank(start: int, end: int) -> Fault:
    """The fault of two parameters that touch."""
    return Fault(
        "E116", "a blank is missing before this parameter", start, end, "separate parameters by blanks"
    )


def _operands(command: str, children: list[Any]) -> Operands:
    label = next((child for child in children if isinstance(child, str)), None)
    parts = tuple(child for child in children if isinstance(child, Part))
    given = next((child for child in children if isinstance(child, Given)), None)
    return Operands(command, label, parts, given)  # type: ignore[arg-type]
