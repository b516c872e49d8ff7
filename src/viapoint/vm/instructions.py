"""The instruction set: one table from which encoder, decoder, verifier, disassembler and docs derive.

An instruction is one byte of code followed by its operands, little-endian, at fixed widths. The machine
is a stack machine for conditions only; between statements the stack is empty. This module says what an
instruction is; what it does is `machine.py`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, unique
from typing import NamedTuple


@unique
class Operand(Enum):
    """What an operand refers to: (word, struct format, meaning)."""

    NUMBER = ("number", "I", "index into the numbers")
    NUMBERS = ("numbers", "I", "index of the first of a shape's numbers")
    SHAPE = ("shape", "I", "index into the shapes: which parameters a motion was given")
    TEXT = ("text", "I", "index into the texts")
    LABEL = ("label", "I", "index into the labels")
    TARGET = ("target", "I", "address of an instruction")
    COUNT = ("count", "I", "how many times, from 1")
    INPUT = ("input", "I", "digital input")
    OUTPUT = ("output", "I", "digital output")
    ANALOG_INPUT = ("analog input", "I", "analog input")
    ANALOG_OUTPUT = ("analog output", "I", "analog output")
    M = ("m", "I", "M function")
    TOOL = ("tool", "I", "tool, 0: none")
    CONVEYOR = ("conveyor", "I", "conveyor, 0: none")
    FLAG = ("flag", "B", "0 or 1")
    HANDLER = ("handler", "I", "address of the label of a subroutine that interrupts")
    ORIGIN = (
        "origin",
        "B",
        "a place counts in mm from the start (0), mm before the end (1), s before the end (2), % (3)",
    )
    DECISION = ("decision", "B", "what becomes of the error: stop (0), retry (1), resume next (2)")
    VARIABLE = ("variable", "I", "index into the texts: the name of a variable")
    KEPT = ("kept", "I", "point that keeps the pose, counted from 1; 0: none")
    AHEAD = ("ahead", "B", "1: read when interpreted; 0: read behind a barrier")

    def __init__(self, word: str, format: str, meaning: str) -> None:
        self.word = word
        self.format = format
        self.meaning = meaning


@unique
class Place(Enum):
    """How an instruction stands to the path; the verifier follows it, so that no read escapes its barrier."""

    ANYWHERE = "neither needs nor disturbs"
    ARRIVES = "the path has arrived here afterwards"
    READS = "only where the path has arrived, unless it reads ahead"
    LEAVES = "hands something to the path, or may come from elsewhere"


@dataclass(frozen=True, slots=True)
class Spec:
    """One row of the table. `pops` and `pushes` are strings of B (boolean) and N (number)."""

    code: int
    operands: tuple[Operand, ...]
    pops: str
    pushes: str
    place: Place
    falls_through: bool
    doc: str


def _row(
    code: int,
    doc: str,
    *operands: Operand,
    pops: str = "",
    pushes: str = "",
    place: Place = Place.ANYWHERE,
    falls_through: bool = True,
) -> Spec:
    return Spec(code, operands, pops, pushes, place, falls_through, doc)


_O = Operand
_LEAVES = Place.LEAVES
_READS = Place.READS


@unique
class Instruction(Enum):
    """The instruction set."""

    END = _row(
        0x00, "Return from the subroutine; outside any, the program is over.",
        place=_LEAVES, falls_through=False,
    )  # fmt: skip
    LABEL = _row(
        0x01, "A label: the counted GOTO back to it starts afresh.", _O.LABEL, place=_LEAVES
    )  # fmt: skip
    JUMP = _row(0x02, "Go on at the target.", _O.TARGET, falls_through=False)
    JUMP_IF_FALSE = _row(0x03, "Go on at the target if the condition is false.", _O.TARGET, pops="B")
    REPEAT = _row(
        0x04, "Counted GOTO: jump behind the label until the body has run `count` times in all.",
        _O.LABEL, _O.TARGET, _O.COUNT,
    )  # fmt: skip
    CALL = _row(
        0x05, "Run the subroutine at the target `count` times.", _O.TARGET, _O.COUNT, place=_LEAVES
    )  # fmt: skip

    LINE = _row(0x10, "ML: move on a straight line.", _O.SHAPE, _O.NUMBERS, place=_LEAVES)
    JOINT = _row(0x11, "MJ: move the joints.", _O.SHAPE, _O.NUMBERS, place=_LEAVES)
    CIRCLE = _row(0x12, "MC: move on a circle.", _O.SHAPE, _O.NUMBERS, place=_LEAVES)
    SPLINE = _row(0x13, "MS: move on a spline.", _O.SHAPE, _O.NUMBERS, place=_LEAVES)
    HOME = _row(0x14, "HOME: move the joints home.", _O.SHAPE, _O.NUMBERS, place=_LEAVES)

    SET_OUTPUT = _row(0x20, "SET DO (1) or RESET DO (0).", _O.OUTPUT, _O.FLAG, place=_LEAVES)
    SELECT_TOOL = _row(0x21, "T: change the active tool.", _O.TOOL, place=_LEAVES)
    TRACK = _row(0x22, "TRK: follow a conveyor, or none.", _O.CONVEYOR, place=_LEAVES)
    TANGENT = _row(
        0x23, "TANG: keep the tool along the path, turned by the number (deg), or no longer.",
        _O.FLAG, _O.NUMBER, place=_LEAVES,
    )  # fmt: skip
    DWELL = _row(0x24, "WAIT: stop for the number of seconds.", _O.NUMBER, place=_LEAVES)
    RAISE_M = _row(
        0x25, "M: raise the flag; if the cell says synchronous, stop and wait for its reset.",
        _O.M, place=_LEAVES,
    )  # fmt: skip

    SET_LEVEL = _row(
        0x26, "SET AO: the analog output becomes the number.", _O.ANALOG_OUTPUT, _O.NUMBER, place=_LEAVES
    )  # fmt: skip
    PULSE = _row(
        0x27, "PULSE: the output on, and off after the number of seconds.",
        _O.OUTPUT, _O.NUMBER, place=_LEAVES,
    )  # fmt: skip
    AT = _row(
        0x28, "AT: what the next instruction does happens at this place of the next motion.",
        _O.ORIGIN, _O.NUMBER,
    )  # fmt: skip

    UNTIL = _row(
        0x29, "UNTIL: the motion at the target ends when the condition from here to there is true.",
        _O.TARGET, _O.TEXT, _O.KEPT, falls_through=False,
    )  # fmt: skip

    LET_NUMBER = _row(
        0x2A, "LET: the variable becomes the number.", _O.VARIABLE, pops="N", place=_LEAVES
    )  # fmt: skip
    LET_BOOLEAN = _row(
        0x2B, "LET: the variable becomes true or false.", _O.VARIABLE, pops="B", place=_LEAVES
    )  # fmt: skip
    INCREMENT = _row(
        0x2C, "INC: the number is added to the variable.", _O.VARIABLE, pops="N", place=_LEAVES
    )  # fmt: skip

    ON = _row(
        0x2D, "ON: from here on the subroutine of the label runs when the condition from here to the target "
        "turns true.",
        _O.TARGET, _O.TEXT, _O.HANDLER, place=_LEAVES, falls_through=False,
    )  # fmt: skip
    OFF = _row(
        0x2E, "OFF: from here on the subroutine of the label interrupts no longer.", _O.HANDLER, place=_LEAVES
    )  # fmt: skip

    ON_ERROR = _row(
        0x2F, "ON ERROR: from here on the subroutine of the label runs when an error would end the run.",
        _O.HANDLER, place=_LEAVES,
    )  # fmt: skip
    DECIDE = _row(
        0x06, "RETRY, RESUME NEXT, STOP: the subroutine that handles an error is over with this decision.",
        _O.DECISION, place=_LEAVES, falls_through=False,
    )  # fmt: skip

    BARRIER = _row(
        0x30, "Stop the path here and wait until it has arrived; the text says why.",
        _O.TEXT, place=Place.ARRIVES,
    )  # fmt: skip
    AWAIT_INPUT = _row(0x31, "WAIT DI: wait until the input is true.", _O.INPUT, place=_READS)
    READ_INPUT = _row(0x32, "Read DI.", _O.INPUT, _O.AHEAD, pushes="B", place=_READS)
    READ_OUTPUT = _row(0x33, "Read DO.", _O.OUTPUT, _O.AHEAD, pushes="B", place=_READS)
    READ_M = _row(0x34, "Read the flag of an M function.", _O.M, _O.AHEAD, pushes="B", place=_READS)

    READ_ANALOG_INPUT = _row(
        0x35, "Read AI.", _O.ANALOG_INPUT, _O.AHEAD, pushes="N", place=_READS
    )  # fmt: skip
    READ_ANALOG_OUTPUT = _row(
        0x36, "Read AO.", _O.ANALOG_OUTPUT, _O.AHEAD, pushes="N", place=_READS
    )  # fmt: skip
    AWAIT = _row(
        0x37, "WAIT: wait until the condition from here to the target is true, then go on at the target.",
        _O.TARGET, _O.TEXT, place=_READS, falls_through=False,
    )  # fmt: skip
    AWAIT_FOR = _row(
        0x38, "The same, but not longer than the number of seconds; leaves whether it came true.",
        _O.TARGET, _O.TEXT, _O.NUMBER, pushes="B", place=_READS, falls_through=False,
    )  # fmt: skip

    READ_NUMBER = _row(
        0x3A, "Read a variable that is a number.", _O.VARIABLE, _O.AHEAD, pushes="N", place=_READS
    )  # fmt: skip
    READ_BOOLEAN = _row(
        0x3B, "Read a variable that is true or false.", _O.VARIABLE, _O.AHEAD, pushes="B", place=_READS
    )  # fmt: skip

    READ_FOUND = _row(0x39, "Whether the last search has found.", pushes="B")
    READ_ERROR = _row(0x3C, "The number of the error that is handled, 0: of none.", pushes="N")

    PUSH = _row(0x40, "The number.", _O.NUMBER, pushes="N")
    PUSH_BOOLEAN = _row(0x4A, "True (1) or false (0).", _O.FLAG, pushes="B")
    NOT = _row(0x41, "Logical not.", pops="B", pushes="B")
    AND = _row(0x42, "Logical and of both; both have been read.", pops="BB", pushes="B")
    OR = _row(0x43, "Logical or of both; both have been read.", pops="BB", pushes="B")
    EQUAL = _row(0x44, "=", pops="NN", pushes="B")
    NOT_EQUAL = _row(0x45, "<>", pops="NN", pushes="B")
    LESS = _row(0x46, "<", pops="NN", pushes="B")
    LESS_EQUAL = _row(0x47, "<=", pops="NN", pushes="B")
    GREATER = _row(0x48, ">", pops="NN", pushes="B")
    GREATER_EQUAL = _row(0x49, ">=", pops="NN", pushes="B")

    @property
    def spec(self) -> Spec:
        """The row of the table."""
        return self.value

    @property
    def word(self) -> str:
        """The name in a disassembly."""
        return self.name.lower()


PATH_ACTIONS = frozenset(
    {
        Instruction.SET_OUTPUT,
        Instruction.SET_LEVEL,
        Instruction.PULSE,
        Instruction.RAISE_M,
        Instruction.LET_NUMBER,
        Instruction.LET_BOOLEAN,
        Instruction.INCREMENT,
    }
)
"""What may stand behind AT."""

MOTIONS = (Instruction.LINE, Instruction.JOINT, Instruction.CIRCLE, Instruction.SPLINE, Instruction.HOME)

BY_CODE: dict[int, Instruction] = {one.spec.code: one for one in Instruction}

LAYOUTS: dict[Instruction, struct.Struct] = {
    one: struct.Struct("<B" + "".join(operand.format for operand in one.spec.operands)) for one in Instruction
}

SIZES: dict[Instruction, int] = {one: layout.size for one, layout in LAYOUTS.items()}


class Decoded(NamedTuple):
    """One instruction at its address, its operands in the order of the table."""

    address: int
    instruction: Instruction
    operands: tuple[int, ...]

    @property
    def following(self) -> int:
        """Address of the instruction behind it."""
        return self.address + SIZES[self.instruction]

    def operand(self, kind: Operand) -> int:
        """Value of the operand of `kind`."""
        return self.operands[self.instruction.spec.operands.index(kind)]


class DecodeError(ValueError):
    """No instruction at this address: an unknown code, or the code ends in the middle of one."""


def encode(instruction: Instruction, *operands: int) -> bytes:
    """The bytes of one instruction; raises struct.error for an operand out of its width."""
    return LAYOUTS[instruction].pack(instruction.spec.code, *operands)


def packer(instruction: Instruction) -> Callable[..., bytes]:
    """`pack(code, *operands)` of one instruction with nothing in between, for the compiler's hot paths."""
    return LAYOUTS[instruction].pack


def operand_offset(instruction: Instruction, kind: Operand) -> int:
    """Where in the instruction's bytes the operand of `kind` starts."""
    before = instruction.spec.operands[: instruction.spec.operands.index(kind)]
    return struct.calcsize("<B" + "".join(operand.format for operand in before))


def decode(code: bytes, address: int) -> Decoded:
    """The instruction at `address`; raises DecodeError."""
    if not 0 <= address < len(code):
        raise DecodeError(f"address {address} lies outside the code")
    instruction = BY_CODE.get(code[address])
    if instruction is None:
        raise DecodeError(f"unknown instruction code {code[address]:#04x} at address {address}")
    if address + SIZES[instruction] > len(code):
        raise DecodeError(f"the code ends inside the instruction {instruction.word} at address {address}")
    return Decoded(address, instruction, LAYOUTS[instruction].unpack_from(code, address)[1:])


def decode_all(code: bytes) -> list[Decoded]:
    """Every instruction of `code` in order; raises DecodeError."""
    return decode_between(code, 0, len(code))


def decode_between(code: bytes, address: int, end: int) -> list[Decoded]:
    """The instructions from `address` up to `end`; raises DecodeError."""
    decoded = []
    while address < end:
        one = decode(code, address)
        decoded.append(one)
        address = one.following
    return decoded
