"""The instructions of a program, decoded when they are first reached and kept for the next pass."""

from __future__ import annotations

from typing import NamedTuple

from viapoint.vm.conditions import Condition, condition_of
from viapoint.vm.instructions import MOTIONS, Decoded, Instruction, Operand, decode, decode_between
from viapoint.vm.program import Program
from viapoint.vm.shapes import MotionWords, motion_words, parse_shape

KEPT_STEPS = 20_000
"""Prepared instructions kept for the next pass: any loop's worth, some 10 MB; then they start afresh."""

_WAITS = frozenset({Instruction.AWAIT, Instruction.AWAIT_FOR, Instruction.UNTIL, Instruction.ON})


class Step(NamedTuple):
    """A decoded instruction, ready to run; `words` of a motion, `condition` of a wait."""

    instruction: Instruction
    operands: tuple[int, ...]
    address: int
    following: int
    line: int
    words: MotionWords | None
    condition: Condition | None


class Steps:
    """The steps of one program by address."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._known: dict[int, Step] = {}

    def at(self, address: int) -> Step:
        """The instruction at an address, which is one of the program's."""
        return self._known.get(address) or self._prepare(address)

    def _prepare(self, address: int) -> Step:
        decoded = decode(self._program.code, address)
        one, line = decoded.instruction, self._program.line_at(address)
        words = self._words(decoded) if one in MOTIONS else None
        condition = self._condition(decoded) if one in _WAITS else None
        step = Step(one, decoded.operands, address, decoded.following, line, words, condition)
        if len(self._known) >= KEPT_STEPS:
            self._known.clear()
        self._known[address] = step
        return step

    def _words(self, decoded: Decoded) -> MotionWords:
        number, base = decoded.operands
        shape = parse_shape(decoded.instruction, self._program.shapes[number])
        values = self._program.numbers[base : base + len(shape.keys)]
        return motion_words(decoded.instruction, shape, values)

    def _condition(self, decoded: Decoded) -> Condition:
        """What a wait waits for: the code between it and its target."""
        program, target = self._program, decoded.operand(Operand.TARGET)
        code = decode_between(program.code, decoded.following, target)
        text = program.texts[decoded.operand(Operand.TEXT)]
        return condition_of(code, program.numbers, program.texts, text)
