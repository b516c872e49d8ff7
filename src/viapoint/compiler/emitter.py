"""Bytecode as it is written: the code, and the numbers and texts that it refers to."""

from __future__ import annotations

import struct
from array import array

from viapoint.vm.instructions import Instruction, packer

_WORD = struct.Struct("<I")
_PACKERS = {instruction: packer(instruction) for instruction in Instruction}


class Emitter:
    """Appends instructions."""

    def __init__(self) -> None:
        self._code = bytearray()
        self._numbers: array[float] = array("d")
        self._texts: dict[str, int] = {}

    def _emit(self, instruction: Instruction, *operands: int) -> None:
        """Append an instruction."""
        self._code += _PACKERS[instruction](instruction.spec.code, *operands)

    def _patch(self, operand: int, address: int) -> None:
        """Put an address where an operand stands."""
        _WORD.pack_into(self._code, operand, address)

    def _text(self, text: str) -> int:
        """The index of a text, each kept once."""
        return self._texts.setdefault(text, len(self._texts))

    def _number(self, value: float) -> int:
        """The index of a number, put behind the others."""
        self._numbers.append(value)
        return len(self._numbers) - 1
