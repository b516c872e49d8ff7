"""The instruction table, and that everything derived from it fits it."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viapoint.language.commands import MOTIONS as COMMANDS
from viapoint.vm.instructions import (
    BY_CODE,
    MOTIONS,
    SIZES,
    DecodeError,
    Instruction,
    Operand,
    decode,
    decode_all,
    encode,
)
from viapoint.vm.machine import HANDLERS
from viapoint.vm.shapes import KINDS


@st.composite
def instructions(draw: st.DrawFn) -> tuple[Instruction, tuple[int, ...]]:
    instruction = draw(st.sampled_from(Instruction))
    widths = {"B": 255, "I": 2**32 - 1}
    operands = (draw(st.integers(0, widths[operand.format])) for operand in instruction.spec.operands)
    return instruction, tuple(operands)


@settings(max_examples=50, deadline=None)
@given(st.lists(instructions(), max_size=8))
def test_decode_gives_what_was_encoded(program: list[tuple[Instruction, tuple[int, ...]]]) -> None:
    code = b"".join(encode(instruction, *operands) for instruction, operands in program)
    decoded = decode_all(code)
    assert [(one.instruction, one.operands) for one in decoded] == program
    assert b"".join(encode(one.instruction, *one.operands) for one in decoded) == code


@settings(max_examples=50, deadline=None)
@given(st.binary(max_size=40))
def test_what_decodes_encodes_to_itself(code: bytes) -> None:
    try:
        decoded = decode_all(code)
    except DecodeError:
        return
    assert b"".join(encode(one.instruction, *one.operands) for one in decoded) == code


def test_codes_are_unique_and_bytes() -> None:
    assert len(BY_CODE) == len(Instruction)
    assert all(0 <= code <= 255 for code in BY_CODE)


def test_the_machine_has_a_handler_for_every_instruction_and_no_other() -> None:
    assert set(HANDLERS) == set(Instruction)


def test_stack_pictures_name_known_types() -> None:
    for one in Instruction:
        assert re.fullmatch("[BN]*", one.spec.pops + one.spec.pushes), one


def test_every_operand_kind_is_used() -> None:
    assert {operand for one in Instruction for operand in one.spec.operands} == set(Operand)


def test_motions_are_those_of_the_language_and_laid_out_alike() -> None:
    assert {KINDS[one].value for one in MOTIONS} == {command.word for command in COMMANDS}
    assert len({(one.spec.operands, SIZES[one]) for one in MOTIONS}) == 1


@pytest.mark.parametrize("code", [b"\xff", encode(Instruction.JUMP, 0)[:-1]])
def test_what_is_no_instruction_is_refused(code: bytes) -> None:
    with pytest.raises(DecodeError):
        decode(code, 0)


@pytest.mark.parametrize("address", [-1, 1])
def test_an_address_outside_is_refused(address: int) -> None:
    with pytest.raises(DecodeError, match="outside"):
        decode(encode(Instruction.END), address)
