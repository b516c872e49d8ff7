"""The check that every loaded program passes before the machine runs it.

What it proves: every instruction decodes and every operand is in range; jumps lead to instructions; the
stack has one shape at each address and is empty between statements; no read of the outside world escapes
its barrier; execution cannot run off the end. The machine relies on all of it and checks none of it again.
"""

from __future__ import annotations

from collections import deque
from operator import lt
from typing import assert_never

from viapoint.language.commands import MAX_INDEX, MAX_TIMES, NOT_NEGATIVE, POSITIVE, REAL
from viapoint.language.lexical import NAME_PATTERN
from viapoint.vm.conditions import IN_A_CONDITION
from viapoint.vm.container import unpack
from viapoint.vm.instructions import (
    MOTIONS,
    PATH_ACTIONS,
    SIZES,
    Decoded,
    DecodeError,
    Instruction,
    Operand,
    Place,
    decode_all,
    decode_between,
)
from viapoint.vm.ports import Decision, Origin
from viapoint.vm.program import Program
from viapoint.vm.refusal import ProgramFileError
from viapoint.vm.shapes import ShapeError, parse_shape

STACK_LIMIT = 256
"""Depth of the stack: far above what a condition of one line needs."""

LINE_LIMIT = 2**31 - 1
"""Largest line or column number in a span."""

_NUMBER_DOMAINS = {
    Instruction.DWELL: NOT_NEGATIVE,
    Instruction.AWAIT_FOR: NOT_NEGATIVE,
    Instruction.AT: NOT_NEGATIVE,
    Instruction.PULSE: POSITIVE,
}
"""Domain of an instruction's number where it is not any number."""


def load(data: bytes) -> Program:
    """Read and verify a program file; raises ProgramFileError with a code of the catalogue."""
    program = unpack(data)
    verify(program)
    return program


def verify(program: Program) -> None:
    """Raise ProgramFileError (E253 to E258) unless the machine can run `program` safely."""
    try:
        decoded = decode_all(program.code)
    except DecodeError as error:
        raise ProgramFileError("E254", str(error)) from None
    if not decoded:
        raise ProgramFileError("E258", "the program has no instructions")
    if decoded[-1].instruction.spec.falls_through:
        raise ProgramFileError("E258", "execution can run off the end of the code")
    by_address = {one.address: one for one in decoded}
    _check_spans(program)
    _check_labels(program, by_address)
    for one in decoded:
        _check_operands(program, one, by_address)
    _follow(decoded, by_address)


def _check_spans(program: Program) -> None:
    spans = program.spans
    addresses = spans.addresses
    if any(map(lt, addresses[1:], addresses)):
        raise ProgramFileError("E253", "the span map is not in ascending order")
    if addresses and (addresses[0] != 0 or addresses[-1] > len(program.code)):
        raise ProgramFileError("E253", "the span map does not cover the code")
    for values in (spans.lines, spans.columns, spans.end_columns):
        if values and not (min(values) >= 1 and max(values) <= LINE_LIMIT):
            raise ProgramFileError("E253", "the span map holds an impossible line or column")


def _check_labels(program: Program, by_address: dict[int, Decoded]) -> None:
    for index, label in enumerate(program.labels):
        target = by_address.get(label.address)
        if target is None or target.instruction is not Instruction.LABEL or target.operands != (index,):
            raise ProgramFileError("E255", f"label {label.name!r} does not stand where it says")


def _check_operands(program: Program, one: Decoded, by_address: dict[int, Decoded]) -> None:
    for kind, value in zip(one.instruction.spec.operands, one.operands, strict=True):
        if not _in_range(program, kind, value, by_address):
            code = "E255" if kind in (Operand.TARGET, Operand.LABEL, Operand.HANDLER) else "E256"
            raise ProgramFileError(code, _at(one, f"{kind.word} {value} is out of range"))
    if one.instruction in MOTIONS:
        _check_motion(program, one)
    elif Operand.NUMBER in one.instruction.spec.operands:
        _check_number(program, one)
    elif one.instruction is Instruction.LABEL:
        if program.labels[one.operands[0]].address != one.address:
            raise ProgramFileError("E255", _at(one, "a label stands in two places"))
    elif one.instruction is Instruction.REPEAT:
        _check_repeat(program, one)
    if one.instruction in (Instruction.AWAIT, Instruction.AWAIT_FOR, Instruction.UNTIL, Instruction.ON):
        _check_condition(program, one)
        target = by_address[one.operand(Operand.TARGET)]
        if one.instruction is Instruction.UNTIL and target.instruction not in MOTIONS:
            raise ProgramFileError("E257", _at(one, "no motion stands behind it"))
    elif one.instruction is Instruction.AT:
        following = by_address.get(one.following)
        if following is None or following.instruction not in PATH_ACTIONS:
            raise ProgramFileError("E257", _at(one, "no action of the path stands behind it"))


def _in_range(program: Program, kind: Operand, value: int, by_address: dict[int, Decoded]) -> bool:
    match kind:
        case Operand.NUMBER:
            return value < len(program.numbers)
        case Operand.NUMBERS:
            return value <= len(program.numbers)
        case Operand.SHAPE:
            return value < len(program.shapes)
        case Operand.TEXT:
            return value < len(program.texts)
        case Operand.VARIABLE:
            return value < len(program.texts) and NAME_PATTERN.fullmatch(program.texts[value]) is not None
        case Operand.LABEL:
            return value < len(program.labels)
        case Operand.TARGET:
            return value in by_address
        case Operand.HANDLER:
            label = by_address.get(value)
            return label is not None and label.instruction is Instruction.LABEL
        case Operand.COUNT:
            return 1 <= value <= MAX_TIMES
        case Operand.INPUT | Operand.OUTPUT | Operand.M | Operand.TOOL | Operand.CONVEYOR:
            return value <= MAX_INDEX
        case Operand.ANALOG_INPUT | Operand.ANALOG_OUTPUT:
            return value <= MAX_INDEX
        case Operand.KEPT:
            return value <= MAX_INDEX + 1
        case Operand.ORIGIN:
            return value < len(Origin)
        case Operand.DECISION:
            return value < len(Decision)
        case Operand.FLAG | Operand.AHEAD:
            return value <= 1
        case _:
            assert_never(kind)


def _check_condition(program: Program, one: Decoded) -> None:
    """The code from a wait to its target is one condition and nothing else."""
    stack = ""
    for each in decode_between(program.code, one.following, one.operand(Operand.TARGET)):
        if each.instruction not in IN_A_CONDITION:
            raise ProgramFileError("E257", _at(each, "it does not belong into a condition"))
        stack = _apply(each, stack)
    if stack != "B":
        raise ProgramFileError("E257", _at(one, "what it waits for is no condition"))


def _check_motion(program: Program, one: Decoded) -> None:
    number, base = one.operands
    try:
        shape = parse_shape(one.instruction, program.shapes[number])
    except ShapeError as error:
        raise ProgramFileError("E256", _at(one, str(error))) from None
    values = program.numbers[base : base + len(shape.keys)]
    if len(values) < len(shape.keys):
        raise ProgramFileError("E256", _at(one, "its numbers are out of range"))
    for row, value in zip(shape.parameters, values, strict=True):
        if not row.domain.holds(value):
            raise ProgramFileError("E256", _at(one, f"{row.shown} is {value}, not {row.domain.text}"))


def _check_number(program: Program, one: Decoded) -> None:
    value = program.numbers[one.operand(Operand.NUMBER)]
    domain = _NUMBER_DOMAINS.get(one.instruction, REAL)
    if not domain.holds(value):
        raise ProgramFileError("E256", _at(one, f"its number is {value}, not {domain.text}"))


def _check_repeat(program: Program, one: Decoded) -> None:
    """A counted jump goes back, to right behind the label that its counter belongs to."""
    label = program.labels[one.operands[0]]
    target = one.operands[1]
    if target != label.address + SIZES[Instruction.LABEL] or target > one.address:
        raise ProgramFileError("E255", _at(one, "a counted jump does not lead back to its label"))


def _follow(decoded: list[Decoded], by_address: dict[int, Decoded]) -> None:
    """Walk every path once with the stack's types and whether the path has arrived; both must hold."""
    states: dict[int, tuple[str, bool]] = {0: ("", False)}
    waiting = deque([0])
    while waiting:
        one = by_address[waiting.popleft()]
        stack, arrived = states[one.address]
        after = _apply(one, stack), _arrived_after(one, arrived)
        for successor in _successors(one):
            known = states.get(successor)
            if known is None:
                states[successor] = after
            elif known[0] != after[0]:
                raise ProgramFileError("E257", _at(one, "the stack differs between two ways to one place"))
            elif known[1] and not after[1]:
                states[successor] = (known[0], False)
            else:
                continue
            waiting.append(successor)


def _successors(one: Decoded) -> list[int]:
    spec = one.instruction.spec
    found = [one.operand(kind) for kind in (Operand.TARGET, Operand.HANDLER) if kind in spec.operands]
    if spec.falls_through:
        found.append(one.following)
    return found


def _apply(one: Decoded, stack: str) -> str:
    spec = one.instruction.spec
    kept = len(stack) - len(spec.pops)
    if kept < 0 or stack[kept:] != spec.pops:
        raise ProgramFileError("E257", _at(one, "the stack does not hold what the instruction takes"))
    after = stack[:kept] + spec.pushes
    if len(after) > STACK_LIMIT:
        raise ProgramFileError("E257", _at(one, "the stack grows too deep"))
    if spec.place in (Place.LEAVES, Place.ARRIVES) and after:
        raise ProgramFileError("E257", _at(one, "the stack is not empty between statements"))
    return after


def _arrived_after(one: Decoded, arrived: bool) -> bool:
    spec = one.instruction.spec
    match spec.place:
        case Place.ANYWHERE:
            return arrived
        case Place.ARRIVES:
            return True
        case Place.LEAVES:
            return False
        case Place.READS:
            ahead = Operand.AHEAD in spec.operands and one.operand(Operand.AHEAD) == 1
            if not arrived and not ahead:
                raise ProgramFileError("E257", _at(one, "a read of the outside world without its barrier"))
            return arrived
        case _:
            assert_never(spec.place)


def _at(one: Decoded, text: str) -> str:
    return f"{one.instruction.word} at address {one.address}: {text}"
