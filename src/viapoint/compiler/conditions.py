"""Lowers conditions to stack code. Equal conditions are lowered once."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias, assert_never

from viapoint.language.commands import ERRNO, FOUND, SETTLED
from viapoint.language.tree import (
    And,
    Comparable,
    Compare,
    Condition,
    Named,
    Not,
    Number,
    Or,
    Signal,
    Truth,
    Value,
    Variable,
)
from viapoint.vm.conditions import BOOLEAN, NUMBER, READINGS
from viapoint.vm.instructions import Instruction, encode

_READS = {kind: instruction for instruction, kind in READINGS.items()}

_COMPARISONS = {
    "=": Instruction.EQUAL,
    "<>": Instruction.NOT_EQUAL,
    "<": Instruction.LESS,
    "<=": Instruction.LESS_EQUAL,
    ">": Instruction.GREATER,
    ">=": Instruction.GREATER_EQUAL,
}

Read: TypeAlias = Signal | Variable
"""What is read of the outside world."""


@dataclass(frozen=True, slots=True)
class LoweredCondition:
    """Code that leaves the value on the stack, what it reads in order, and the text of it."""

    code: bytes
    reads: tuple[Read, ...]
    text: str


def reads_of(value: Value) -> tuple[Read, ...]:
    """What a condition, or a value, reads of the outside world, in order. Any depth of nesting."""
    found: list[Read] = []
    waiting: list[Value] = [value]
    while waiting:
        node = waiting.pop()
        match node:
            case Signal(kind=kind):
                if kind not in SETTLED:  # those are known where they have come about, and nothing outside
                    found.append(node)
            case Variable():
                found.append(node)
            case Named() | Truth() | Number():
                pass  # of a name it is not known which signal it is; that is an error of its own
            case Compare(left=left, right=right):
                waiting += [right, left]
            case Not(operand=operand):
                waiting.append(operand)
            case And(operands=operands) | Or(operands=operands):
                waiting.extend(reversed(operands))
            case _:
                assert_never(node)
    return tuple(found)


def name_of(read: Read) -> str:
    """What is read, as a program writes it: DI3, DO1, M5, $count."""
    return f"${read.name}" if isinstance(read, Variable) else f"{read.kind}{read.number}"


def text_of(condition: Value, *, inner: bool = False) -> str:
    """The condition, or value, as a user writes it, in canonical form."""
    match condition:
        case Signal() | Named() | Variable() | Number():
            return _side(condition)
        case Truth(value=value):
            return "TRUE" if value else "FALSE"
        case Compare(operator=operator, left=left, right=right):
            return f"{_side(left)} {operator} {_side(right)}"
        case Not(operand=operand):
            return f"NOT {text_of(operand, inner=True)}"
        case And(operands=operands):
            text = " AND ".join(text_of(each, inner=True) for each in operands)
        case Or(operands=operands):
            text = " OR ".join(text_of(each, inner=True) for each in operands)
        case _:
            assert_never(condition)
    return f"({text})" if inner else text


def _side(side: Comparable) -> str:
    match side:
        case Signal(kind=kind, number=number):
            return kind if kind in SETTLED else f"{kind}{number}"
        case Named(name=name):
            return name
        case Variable(name=name):
            return f"${name}"
        case Number(value=value):
            return f"{value:.12g}"
        case _:
            assert_never(side)


class ConditionLowering:
    """Lowers conditions and values against one program's numbers; `text` gives the index of a text."""

    def __init__(self, numbers: array[float], text: Callable[[str], int]) -> None:
        self._numbers = numbers
        self._text = text
        self._known: dict[tuple[Value, bool], LoweredCondition] = {}
        self._ahead = False
        self._indices: dict[float, int] = {}

    def lower(self, condition: Value, *, ahead: bool = False) -> LoweredCondition:
        """The code of `condition`, whose depth the parser has bounded."""
        known = self._known.get((condition, ahead))
        if known is None:
            self._ahead = ahead
            code = self._push(condition)
            known = LoweredCondition(code, reads_of(condition), text_of(condition))
            self._known[condition, ahead] = known
        return known

    def _code(self, condition: Condition) -> bytes:
        match condition:
            case Signal(kind=kind) if kind == FOUND:
                return encode(Instruction.READ_FOUND)
            case Signal(kind=kind) if kind == ERRNO:
                return encode(Instruction.READ_ERROR)
            case Signal(kind=kind, number=number):
                return encode(_READS[kind], number, int(self._ahead))
            case Variable(name=name, switch=switch):
                return encode(_READS[BOOLEAN if switch else NUMBER], self._text(name), int(self._ahead))
            case Truth(value=value):
                return encode(Instruction.PUSH_BOOLEAN, int(value))
            case Named():
                return encode(Instruction.READ_INPUT, 0, 0)  # an unknown name: there will be no program
            case Compare(operator=operator, left=left, right=right):
                return self._push(left) + self._push(right) + encode(_COMPARISONS[operator])
            case Not(operand=operand):
                return self._code(operand) + encode(Instruction.NOT)
            case And(operands=operands):
                return self._chain(operands, encode(Instruction.AND))
            case Or(operands=operands):
                return self._chain(operands, encode(Instruction.OR))
            case _:
                assert_never(condition)

    def _chain(self, operands: tuple[Condition, ...], joint: bytes) -> bytes:
        first, *others = map(self._code, operands)
        return first + b"".join(other + joint for other in others)

    def _push(self, number: Value) -> bytes:
        if not isinstance(number, Number):
            return self._code(number)
        index = self._indices.get(number.value)
        if index is None:
            index = self._indices[number.value] = len(self._numbers)
            self._numbers.append(number.value)
        return encode(Instruction.PUSH, index)
