"""Program files: round trip, and that no bytes make the machine crash, hang or misbehave."""

from __future__ import annotations

import random
import struct
import zlib
from dataclasses import replace

import pytest
from vm_programs import assemble, compiled

from viapoint.language.catalogue import CATALOGUE
from viapoint.vm import (
    Program,
    ProgramFileError,
    ScriptedWorld,
    disassemble,
    load,
    run_canonical,
    save,
    verify,
)
from viapoint.vm.instructions import Instruction as I
from viapoint.vm.program import Label, Span

TEXT = """\
HOME F300
A: ML X=1 Y=-2.5 Z=3 R10
MC P2 Q5 T1 Z1 H-90
IF DI3 AND NOT (DO1 OR M2) OR 1 < 2
SUB CUT 3
ELSEIF 2 >= 1
MJ J1=10 E1=5
ELSE
WAIT DI 4
ENDIF
GOTO A 2
TANG 1 H5
TRK 1
MS P1
TRK 0
WAIT 0.5
ON DI3 AND NOT AI1 > 2 SUB CUT
OFF CUT
ON ERROR SUB FAULT
END
CUT: SET DO 1
M 5
T 2
AT D-20 PULSE DO 2 0.5
AT 50% SET AO 1 = 2.5
ML P2 UNTIL DI3 OR AI1 > 2 CAPTURE P4
IF FOUND
SYNC
ENDIF
WAIT DI4 AND NOT AO1 < 0 TIMEOUT 2 GOTO OUT
WAIT DI4 OR DO1
LET $count = 5
LET $ready = DI3 OR $count > AI1
AT 50% INC $count 2
ML P1
WAIT $ready AND TRUE
IF AHEAD DI3
ENDIF
OUT:
END
FAULT:
IF ERRNO > 310
RETRY
ENDIF
RESUME NEXT
STOP
END
"""


def test_round_trip() -> None:
    program = compiled(TEXT)
    data = save(program)
    assert load(data) == program
    assert save(load(data)) == data == save(compiled(TEXT)), "the same program gives the same bytes"


def test_without_its_source() -> None:
    program = replace(compiled(TEXT), source_text=None)
    again = load(save(program))
    assert again == program
    assert again.source_lines() == []
    assert "ML X=1" not in disassemble(again)


def test_places_are_those_of_the_source() -> None:
    program = compiled("// comment\n  ML P1 F100 // far\nA: ML P2\n")
    assert program.spans.at(0) == Span(2, 3, 13)
    assert program.spans.at(14) == Span(3, 4, 9)
    assert [program.line_at(address) for address in (0, 8, 9, 14, 23)] == [2, 2, 3, 3, 3]


def _refused(data: bytes) -> str:
    with pytest.raises(ProgramFileError) as caught:
        load(data)
    assert caught.value.code in CATALOGUE
    return caught.value.code


@pytest.mark.parametrize("code", [code for code in CATALOGUE if code.startswith("E25")])
def test_examples_of_the_catalogue_are_refused_with_their_code(code: str) -> None:
    for example in CATALOGUE[code].examples:
        assert example.data is not None
        assert _refused(example.data) == code


def test_every_truncation_is_refused() -> None:
    data = save(compiled(TEXT))
    for size in range(len(data)):
        assert _refused(data[:size]) in ("E250", "E252")


def _bad(code: str, program: Program) -> None:
    with pytest.raises(ProgramFileError) as caught:
        verify(program)
    assert caught.value.code == code, caught.value


def test_jumps_lead_to_instructions() -> None:
    _bad("E255", assemble((I.JUMP, 1), (I.END,)))
    _bad("E255", assemble((I.CALL, 99, 1), (I.END,)))
    verify(assemble((I.JUMP, 5), (I.END,)))


def test_labels_stand_where_they_say() -> None:
    label = (Label("A", 0),)
    verify(assemble((I.LABEL, 0), (I.END,), labels=label))
    _bad("E255", assemble((I.END,), labels=label))
    _bad("E255", assemble((I.LABEL, 0), (I.LABEL, 0), (I.END,), labels=label))
    _bad("E255", assemble((I.LABEL, 1), (I.END,), labels=label))


def test_counted_jumps_go_back_to_their_own_label() -> None:
    label = (Label("A", 0),)
    verify(assemble((I.LABEL, 0), (I.REPEAT, 0, 5, 2), (I.END,), labels=label))
    _bad("E255", assemble((I.LABEL, 0), (I.REPEAT, 0, 0, 2), (I.END,), labels=label))
    later = (Label("A", 13),)
    _bad("E255", assemble((I.REPEAT, 0, 18, 2), (I.LABEL, 0), (I.END,), labels=later))
    _bad("E256", assemble((I.LABEL, 0), (I.REPEAT, 0, 5, 0), (I.END,), labels=label))


@pytest.mark.parametrize(
    ("shape", "number", "motion"),
    [
        ("P F", (1.5, 1.0), I.LINE),
        ("P F", (1.0, 0.0), I.LINE),
        ("P F", (1.0, float("nan")), I.LINE),
        ("P F", (1.0, float("inf")), I.LINE),
        ("P R", (1.0, -1.0), I.LINE),
        ("P P", (1.0, 1.0), I.LINE),
        ("P X=", (1.0, 1.0), I.LINE),
        ("P Q", (1.0, 1.0), I.LINE),
        ("P J1=", (1.0, 1.0), I.LINE),
        ("P J33=", (1.0, 1.0), I.JOINT),
        ("P Z", (1.0, 70_000.0), I.LINE),
        ("P", (1.0,), I.CIRCLE),
        ("P", (1.0,), I.HOME),
        ("F", (1.0,), I.SPLINE),
        ("", (), I.LINE),
        ("P  F", (1.0, 1.0), I.LINE),
        ("P F", (1.0,), I.LINE),
    ],
)
def test_motions_hold_what_a_statement_can_say(shape: str, number: tuple[float, ...], motion: I) -> None:
    _bad("E256", assemble((motion, 0, 0), (I.END,), numbers=number, shapes=(shape,)))


def test_numbers_are_those_of_the_language() -> None:
    _bad("E256", assemble((I.DWELL, 0), (I.END,), numbers=(-1.0,)))
    _bad("E256", assemble((I.DWELL, 0), (I.END,), numbers=(float("nan"),)))
    _bad("E256", assemble((I.TANGENT, 2, 0), (I.END,), numbers=(0.0,)))
    _bad("E256", assemble((I.SET_OUTPUT, 2**31, 1), (I.END,)))
    verify(assemble((I.TANGENT, 1, 0), (I.END,), numbers=(-45.0,)))


def test_the_stack_is_one_on_every_way() -> None:
    _bad("E257", assemble((I.AND,), (I.END,)))
    _bad("E257", assemble((I.PUSH, 0), (I.NOT,), (I.END,), numbers=(1.0,)))
    _bad("E257", assemble((I.PUSH, 0), (I.END,), numbers=(1.0,)))
    _bad("E257", assemble((I.READ_INPUT, 1, 1), (I.JUMP, 0), numbers=()))
    _bad("E257", assemble((I.PUSH, 0), (I.JUMP, 0), numbers=(1.0,)))


def test_no_read_escapes_its_barrier() -> None:
    branch = ((I.READ_INPUT, 1, 0), (I.JUMP_IF_FALSE, 0), (I.END,))
    verify(assemble((I.BARRIER, 0), *branch))
    _bad("E257", assemble(*branch))
    _bad("E257", assemble((I.BARRIER, 0), (I.SET_OUTPUT, 1, 1), *branch))
    verify(assemble((I.READ_INPUT, 1, 1), (I.JUMP_IF_FALSE, 11), (I.END,)))
    _bad("E257", assemble((I.AWAIT_INPUT, 1), (I.END,)))
    around = assemble(  # the second read is reached with and without having arrived
        (I.BARRIER, 0), (I.READ_INPUT, 1, 0), (I.JUMP_IF_FALSE, 22), (I.SET_OUTPUT, 1, 1),
        (I.READ_INPUT, 1, 0), (I.JUMP_IF_FALSE, 33), (I.END,),
    )  # fmt: skip
    _bad("E257", around)


def test_variables_are_written_from_the_stack_and_read_behind_barriers() -> None:
    shared = ("why", "count", "not a name")
    value = (I.PUSH, 0)

    def bad(code: str, *instructions: tuple[I, *tuple[int, ...]]) -> None:
        _bad(code, assemble(*instructions, (I.END,), numbers=(2.0,), texts=shared))

    verify(assemble(value, (I.INCREMENT, 1), (I.END,), numbers=(2.0,), texts=shared))
    verify(assemble(value, (I.AT, 0, 0), (I.LET_NUMBER, 1), (I.END,), numbers=(2.0,), texts=shared))
    verify(assemble((I.BARRIER, 0), (I.READ_NUMBER, 1, 0), (I.LET_NUMBER, 1), (I.END,), texts=shared))
    bad("E256", value, (I.INCREMENT, 3))
    bad("E256", value, (I.INCREMENT, 2))  # what is no name
    bad("E257", (I.INCREMENT, 1))
    bad("E257", value, (I.LET_BOOLEAN, 1))
    bad("E257", (I.PUSH_BOOLEAN, 1), (I.LET_NUMBER, 1))
    bad("E256", (I.PUSH_BOOLEAN, 2), (I.LET_BOOLEAN, 1))
    bad("E257", (I.READ_NUMBER, 1, 0), (I.LET_NUMBER, 1))
    bad("E257", (I.BARRIER, 0), (I.READ_BOOLEAN, 1, 0), (I.LET_NUMBER, 1))
    bad("E257", value, (I.BARRIER, 0), (I.INCREMENT, 1))


def test_conditions_that_are_waited_for_are_conditions() -> None:
    wait = (I.AWAIT, 20, 0)
    good = assemble((I.BARRIER, 0), wait, (I.READ_INPUT, 1, 0), (I.END,))
    verify(good)
    _bad("E257", assemble((I.BARRIER, 0), (I.AWAIT, 14, 0), (I.END,)))  # none
    _bad("E257", assemble((I.BARRIER, 0), (I.AWAIT, 19, 0), (I.PUSH, 0), (I.END,), numbers=(1.0,)))
    _bad("E257", assemble((I.BARRIER, 0), (I.AWAIT, 20, 0), (I.SET_OUTPUT, 1, 1), (I.END,)))
    _bad("E257", assemble((I.AWAIT, 15, 0), (I.READ_INPUT, 1, 0), (I.END,)))  # without its barrier
    _bad("E257", assemble((I.BARRIER, 0), (I.AWAIT, 0, 0), (I.READ_INPUT, 1, 0), (I.END,)))  # backwards
    limited = ((I.BARRIER, 0), (I.AWAIT_FOR, 24, 0, 0), (I.READ_INPUT, 1, 0))
    verify(assemble(*limited, (I.JUMP_IF_FALSE, 29), (I.END,), numbers=(1.0,)))
    _bad("E257", assemble(*limited, (I.END,), numbers=(1.0,)))  # its answer is left on the stack
    _bad("E256", assemble(*limited, (I.JUMP_IF_FALSE, 29), (I.END,), numbers=(-1.0,)))


def test_what_belongs_to_a_motion_stands_before_it() -> None:
    verify(assemble((I.AT, 0, 0), (I.SET_OUTPUT, 1, 1), (I.END,), numbers=(20.0,)))
    _bad("E257", assemble((I.AT, 0, 0), (I.END,), numbers=(20.0,)))
    _bad("E257", assemble((I.AT, 0, 0), (I.SELECT_TOOL, 1), (I.END,), numbers=(20.0,)))
    _bad("E256", assemble((I.AT, 4, 0), (I.SET_OUTPUT, 1, 1), (I.END,), numbers=(20.0,)))
    _bad("E256", assemble((I.AT, 0, 0), (I.SET_OUTPUT, 1, 1), (I.END,), numbers=(-20.0,)))
    search = ((I.UNTIL, 19, 0, 0), (I.READ_INPUT, 1, 0))
    verify(assemble(*search, (I.HOME, 0, 0), (I.END,), shapes=("",)))
    _bad("E257", assemble(*search, (I.END,)))


def test_interrupts_run_subroutines_of_labels() -> None:
    lost = Label("LOST", 20)
    on = (I.ON, 19, 0, 20), (I.READ_INPUT, 1, 0)
    good = (*on, (I.END,), (I.LABEL, 0), (I.END,))
    verify(assemble(*good, labels=(lost,)))
    verify(assemble(*on, (I.END,), (I.LABEL, 0), (I.OFF, 20), (I.END,), labels=(lost,)))
    _bad("E255", assemble((I.ON, 19, 0, 19), *good[1:], labels=(lost,)))  # no label there
    _bad("E255", assemble((I.ON, 19, 0, 21), *good[1:], labels=(lost,)))  # within an instruction
    _bad("E257", assemble((I.ON, 13, 0, 20), *good[1:], labels=(lost,)))  # no condition
    _bad("E255", assemble((I.OFF, 0), (I.END,)))
    stack = (*on, (I.END,), (I.LABEL, 0), (I.AND,), (I.END,))
    _bad("E257", assemble(*stack, labels=(lost,)))  # its subroutine is followed too
    fault = (I.ON_ERROR, 6), (I.END,), (I.LABEL, 0)
    at = Label("LOST", 6)
    verify(assemble(*fault, (I.DECIDE, 2), labels=(at,)))
    verify(
        assemble(
            *fault,
            (I.READ_ERROR,),
            (I.PUSH, 0),
            (I.LESS,),
            (I.JUMP_IF_FALSE, 5),
            (I.END,),
            labels=(at,),
            numbers=(1.0,),
        )
    )
    _bad("E256", assemble(*fault, (I.DECIDE, 3), labels=(at,)))
    _bad("E257", assemble(*fault, (I.READ_ERROR,), (I.DECIDE, 1), labels=(at,)))
    asks = (*on, (I.END,), (I.LABEL, 0), (I.READ_INPUT, 1, 0), (I.JUMP_IF_FALSE, 19), (I.END,))
    _bad("E257", assemble(*asks, labels=(lost,)))  # nor may it read without its barrier


def test_execution_ends() -> None:
    _bad("E258", assemble((I.END,), (I.SELECT_TOOL, 1)))
    _bad("E258", assemble())
    verify(assemble((I.JUMP, 0)))


def _survives(data: bytes) -> bool:
    """Whether the file is accepted; then it must run, end or be cut off, and disassemble."""
    try:
        program = load(data)
    except ProgramFileError as refusal:
        return CATALOGUE[refusal.code] is None
    world = ScriptedWorld({3: [False, True], 4: [False, False, True]}, frozenset({2}))
    assert run_canonical(program, world, call_limit=300)
    assert disassemble(program)
    return True


def test_damaged_files_are_refused() -> None:
    data = save(compiled(TEXT))
    rng = random.Random(1)
    for _ in range(2000):
        mangled = bytearray(data)
        mangled[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        assert not _survives(bytes(mangled))


@pytest.mark.parametrize("seed", range(8))
def test_files_mangled_with_a_right_checksum_are_refused_or_harmless(seed: int) -> None:
    """Bytes flipped, replaced, swapped, cut out or doubled, then the checksum put right."""
    data = save(replace(compiled(TEXT), source_text=None))
    rng = random.Random(seed)
    accepted = 0
    for _ in range(500):
        body = bytearray(data[:-4])
        for _ in range(rng.choice((1, 1, 1, 2, 5))):
            _mangle(body, rng)
        accepted += _survives(bytes(body) + struct.pack("<I", zlib.crc32(body)))
    assert accepted, "none was accepted: the test does not reach the machine"


def _mangle(body: bytearray, rng: random.Random) -> None:
    at = rng.randrange(len(body))
    match rng.randrange(5):
        case 0:
            body[at] ^= 1 << rng.randrange(8)
        case 1:
            body[at] = rng.choice((0, 1, 2, 255, rng.randrange(256)))
        case 2:
            other = rng.randrange(len(body))
            body[at], body[other] = body[other], body[at]
        case 3:
            del body[at : at + rng.choice((1, 4, 9))]
        case _:
            body[at:at] = body[at : at + rng.choice((1, 4, 9))]


@pytest.mark.parametrize("seed", range(8))
def test_random_instructions_are_refused_or_harmless(seed: int) -> None:
    """Whole instructions with likely operands: gets further into the verifier than flipped bits."""
    rng = random.Random(seed)
    numbers = (1.0, 2.0, 0.5, 100.0)
    accepted = 0
    for _ in range(400):
        code = [_instruction(rng) for _ in range(rng.randrange(1, 7))]
        program = assemble(
            (I.LABEL, 0), *code, (I.END,), numbers=numbers, shapes=("P", "", "P F"), labels=(Label("A", 0),)
        )
        accepted += _survives(save(program))
    assert accepted


def _instruction(rng: random.Random) -> tuple[I, *tuple[int, ...]]:
    instruction = rng.choice(list(I))
    likely = (0, 0, 1, 1, 2, 5, 6, 10, 14)
    return instruction, *(rng.choice(likely) for _ in instruction.spec.operands)
