"""A condition as data: what somebody else than the machine can ask again and again.

It is made from the condition's own instructions, so that it means the same there as here.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from viapoint.vm.instructions import Decoded, Instruction, Operand

NUMBER: Final = "$"
"""Kind of a variable that is a number."""

BOOLEAN: Final = "$?"
"""Kind of a variable that is true or false."""

READINGS = {
    Instruction.READ_INPUT: "DI",
    Instruction.READ_OUTPUT: "DO",
    Instruction.READ_M: "M",
    Instruction.READ_ANALOG_INPUT: "AI",
    Instruction.READ_ANALOG_OUTPUT: "AO",
    Instruction.READ_NUMBER: NUMBER,
    Instruction.READ_BOOLEAN: BOOLEAN,
}
"""The instructions that read the outside world, and what of it."""

BINARY: dict[Instruction, Callable[[float, float], bool]] = {
    Instruction.AND: lambda left, right: bool(left and right),
    Instruction.OR: lambda left, right: bool(left or right),
    Instruction.EQUAL: operator.eq,
    Instruction.NOT_EQUAL: operator.ne,
    Instruction.LESS: operator.lt,
    Instruction.LESS_EQUAL: operator.le,
    Instruction.GREATER: operator.gt,
    Instruction.GREATER_EQUAL: operator.ge,
}
"""What joins the two values on top of the stack."""

IN_A_CONDITION = frozenset({*READINGS, *BINARY, Instruction.PUSH, Instruction.PUSH_BOOLEAN, Instruction.NOT})
"""All instructions a condition is made of."""


class Reading(NamedTuple):
    """A signal of the outside world by kind (DI, DO, M, AI, AO) and number, or a variable by its name."""

    kind: str
    number: int
    name: str = ""

    @property
    def is_switch(self) -> bool:
        """Whether it is true or false; otherwise it is a number."""
        return self.kind not in _NUMBERS

    def __str__(self) -> str:
        return f"${self.name}" if self.name else f"{self.kind}{self.number}"


_NUMBERS: Final = frozenset({"AI", "AO", NUMBER})


def reading_of(instruction: Instruction, operand: int, texts: Sequence[str]) -> Reading:
    """What an instruction of `READINGS` reads."""
    kind = READINGS[instruction]
    return Reading(kind, 0, texts[operand]) if kind in (NUMBER, BOOLEAN) else Reading(kind, operand)


Read = Callable[[Reading], float]


@dataclass(frozen=True, slots=True)
class Condition:
    """Steps in the order of a stack machine: a number, a signal, or the instruction that joins values."""

    text: str
    steps: tuple[float | Reading | Instruction, ...]

    @property
    def readings(self) -> tuple[Reading, ...]:
        """What it reads, each once, in order."""
        return tuple(dict.fromkeys(step for step in self.steps if isinstance(step, Reading)))

    def holds(self, read: Read) -> bool:
        """Whether it is true; each signal is read once by `read`, in order."""
        values = {reading: read(reading) for reading in self.readings}
        stack: list[float] = []
        for step in self.steps:
            if isinstance(step, Reading):
                stack.append(values[step])
            elif not isinstance(step, Instruction):
                stack.append(step)
            elif step is Instruction.NOT:
                stack.append(not stack.pop())
            else:
                right = stack.pop()
                stack.append(BINARY[step](stack.pop(), right))
        return bool(stack.pop())


def condition_of(
    code: Iterable[Decoded], numbers: Sequence[float], texts: Sequence[str], text: str
) -> Condition:
    """The condition that instructions of `IN_A_CONDITION` compute."""
    steps: list[float | Reading | Instruction] = []
    for one in code:
        if one.instruction in READINGS:
            steps.append(reading_of(one.instruction, one.operands[0], texts))
        elif one.instruction is Instruction.PUSH:
            steps.append(numbers[one.operand(Operand.NUMBER)])
        elif one.instruction is Instruction.PUSH_BOOLEAN:
            steps.append(bool(one.operand(Operand.FLAG)))
        else:
            steps.append(one.instruction)
    return Condition(text, tuple(steps))
