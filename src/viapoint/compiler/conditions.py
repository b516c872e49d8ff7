"""Lowers conditions to stack code. Equal conditions are lowered once."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import assert_never

from viapoint.language.tree import And, Compare, Condition, Not, Number, Or, Signal
from viapoint.vm.instructions import Instruction, encode

_READS = {"DI": Instruction.READ_INPUT, "DO": Instruction.READ_OUTPUT, "M": Instruction.READ_M}

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
            case Signal():
                found.append(node)
            case Compare():
                pass
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
        case Signal(kind=kind, number=number):
            return f"{kind}{number}"
        case Compare(operator=operator, left=left, right=right):
            return f"{left.value:.12g} {operator} {right.value:.12g}"
        case Not(operand=operand):
            return f"NOT {text_of(operand, inner=True)}"
        case And(operands=operands):
            text = " AND ".join(text_of(each, inner=True) for each in operands)
        case Or(operands=operands):
            text = " OR ".join(text_of(each, inner=True) for each in operands)
        case _:
            assert_never(condition)
    return f"({text})" if inner else text


class ConditionLowering:
    """Lowers conditions against one program's numbers."""

    def __init__(self, numbers: array[float]) -> None:
        self._numbers = numbers
        self._known: dict[Condition, LoweredCondition] = {}
        self._indices: dict[float, int] = {}

    def lower(self, condition: Condition) -> LoweredCondition:
        """The code of `condition`, whose depth the parser has bounded."""
        known = self._known.get(condition)
        if known is None:
            code = self._code(condition)
            known = LoweredCondition(code, signals_of(condition), text_of(condition))
            self._known[condition] = known
        return known

    def _code(self, condition: Condition) -> bytes:
        match condition:
            case Signal(kind=kind, number=number):
                return encode(_READS[kind], number, 0)
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

    def _push(self, number: Number) -> bytes:
        index = self._indices.get(number.value)
        if index is None:
            index = self._indices[number.value] = len(self._numbers)
            self._numbers.append(number.value)
        return encode(Instruction.PUSH, index)
