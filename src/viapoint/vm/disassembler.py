"""Bytecode as text, the source lines between. Derived from the instruction table: it knows no instruction."""

from __future__ import annotations

from collections.abc import Iterator

from viapoint.vm.instructions import MOTIONS, Decoded, Operand, decode_all
from viapoint.vm.program import Program
from viapoint.vm.shapes import parse_shape


def disassemble(program: Program) -> str:
    """The whole program; raises DecodeError for code that is not made of instructions.

    A line is address, instruction, operands as stored, and behind a semicolon what they refer to. Source
    lines stand above their first instruction where the program carries its text.
    """
    return "\n".join(_lines(program)) + "\n"


def _lines(program: Program) -> Iterator[str]:
    source = program.source_lines()
    yield f"; {program.name}, source {program.source_hash.hex()[:16]}"
    shown = 0
    for one in decode_all(program.code):
        line = program.line_at(one.address)
        if line != shown:
            text = f" {source[line - 1].strip()}" if line <= len(source) else ""
            yield f"{line:4d} |{text}"
            shown = line
        yield _instruction(program, one)


def _instruction(program: Program, one: Decoded) -> str:
    words = [f"{one.address:6d}  {one.instruction.word:<14}", *map(str, one.operands)]
    text = " ".join(words)
    meaning = _meaning(program, one)
    return f"{text:<38} ; {meaning}" if meaning else text.rstrip()


def _meaning(program: Program, one: Decoded) -> str:
    if one.instruction in MOTIONS:
        return _motion(program, one)
    pairs = zip(one.instruction.spec.operands, one.operands, strict=True)
    return ", ".join(filter(None, (_operand(program, kind, value) for kind, value in pairs)))


def _motion(program: Program, one: Decoded) -> str:
    number, base = one.operands
    shape = parse_shape(one.instruction, program.shapes[number])
    values = program.numbers[base : base + len(shape.keys)]
    return " ".join(f"{key}{value:.12g}" for key, value in zip(shape.keys, values, strict=True))


def _operand(program: Program, kind: Operand, value: int) -> str:
    """What an operand refers to, where it refers to something."""
    match kind:
        case Operand.NUMBER:
            return f"{program.numbers[value]:.12g}"
        case Operand.TEXT:
            return program.texts[value]
        case Operand.VARIABLE:
            return f"${program.texts[value]}"
        case Operand.LABEL:
            return program.labels[value].name
        case Operand.TARGET | Operand.HANDLER:
            return f"line {program.line_at(value)}"
        case _:
            return ""
