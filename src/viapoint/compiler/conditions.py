"""Lowers conditions to stack code. Equal conditions are lowered once."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import assert_never

from viapoint.language.commands import FOUND
from viapoint.language.tree import And, Comparable, Compare, Condition, Named, Not, Number, Or, Signal
from viapoint.vm.conditions import READINGS
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


@dataclass(frozen=True, slots=True)
class LoweredCondition:
    """Code that leaves the value on the stack, the signals it reads in order, and the text of it."""

    code: bytes
    signals: tuple[Signal, ...]
    text: str

    @property
    def reads(self) -> tuple[str, ...]:
        """What it reads, each once, in order: DI3, DO1, M5."""
        return tuple(dict.fromkeys(f"{signal.kind}{signal.number}" for signal in self.signals))


def signals_of(condition: Condition) -> tuple[Signal, ...]:
    """The signals a condition reads, in the order of reading. Any depth of nesting."""
    found = []
    waiting = [condition]
    while waiting:
        node = waiting.pop()
        match node:
            case Signal(kind=kind):
                if kind != FOUND:  # it is settled where its search has ended, and nothing outside
                    found.append(node)
            case Named():
                pass  # not known which signal it is; that is an error of its own
            case Compare(left=left, right=right):
                found += [each for each in (left, right) if isinstance(each, Signal)]
            case Not(operand=operand):
                waiting.append(operand)
            case And(operands=operands) | Or(operands=operands):
                waiting.extend(reversed(operands))
            case _:
                assert_never(node)
    return tuple(found)


def text_of(condition: Condition, *, inner: bool = False) -> str:
    """The condition as a user writes it, in canonical form."""
    match condition:
        case Signal() | Named():
            return _side(condition)
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
            return kind if kind == FOUND else f"{kind}{number}"
        case Named(name=name):
            return name
        case Number(value=value):
            return f"{value:.12g}"
        case _:
            assert_never(side)


class ConditionLowering:
    """Lowers conditions against one program's numbers."""

    def __init__(self, numbers: array[float]) -> None:
        self._numbers = numbers
        self._known: dict[tuple[Condition, bool], LoweredCondition] = {}
        self._ahead = False
        self._indices: dict[float, int] = {}

    def lower(self, condition: Condition, *, ahead: bool = False) -> LoweredCondition:
        """The code of `condition`, whose depth the parser has bounded."""
        known = self._known.get((condition, ahead))
        if known is None:
            self._ahead = ahead
            code = self._code(condition)
            known = LoweredCondition(code, signals_of(condition), text_of(condition))
            self._known[condition, ahead] = known
        return known

    def _code(self, condition: Condition) -> bytes:
        match condition:
            case Signal(kind=kind) if kind == FOUND:
                return encode(Instruction.READ_FOUND)
            case Signal(kind=kind, number=number):
                return encode(_READS[kind], number, int(self._ahead))
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

    def _push(self, number: Comparable) -> bytes:
        if not isinstance(number, Number):
            return self._code(number)
        index = self._indices.get(number.value)
        if index is None:
            index = self._indices[number.value] = len(self._numbers)
            self._numbers.append(number.value)
        return encode(Instruction.PUSH, index)
