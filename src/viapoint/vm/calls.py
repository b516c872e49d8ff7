"""The calls that instructions make by themselves, whatever the state of the machine."""

from __future__ import annotations

from collections.abc import Callable

from viapoint.vm.instructions import Instruction
from viapoint.vm.ports import (
    Barrier,
    Call,
    Dwell,
    Pulse,
    RaiseM,
    SetLevel,
    SetOutput,
    Tangent,
    Track,
    WorldPort,
)
from viapoint.vm.program import Program

_Maker = Callable[[Program, WorldPort, int, tuple[int, ...]], Call]


def _set_output(program: Program, world: WorldPort, line: int, operands: tuple[int, ...]) -> Call:
    return SetOutput(line=line, index=operands[0], value=bool(operands[1]))


def _set_level(program: Program, world: WorldPort, line: int, operands: tuple[int, ...]) -> Call:
    return SetLevel(line=line, index=operands[0], value=program.numbers[operands[1]])


def _pulse(program: Program, world: WorldPort, line: int, operands: tuple[int, ...]) -> Call:
    return Pulse(line=line, index=operands[0], seconds=program.numbers[operands[1]])


def _track(program: Program, world: WorldPort, line: int, operands: tuple[int, ...]) -> Call:
    return Track(line=line, conveyor=operands[0])


def _tangent(program: Program, world: WorldPort, line: int, operands: tuple[int, ...]) -> Call:
    return Tangent(line=line, on=bool(operands[0]), offset=program.numbers[operands[1]])


def _dwell(program: Program, world: WorldPort, line: int, operands: tuple[int, ...]) -> Call:
    return Dwell(line=line, seconds=program.numbers[operands[0]])


def _raise_m(program: Program, world: WorldPort, line: int, operands: tuple[int, ...]) -> Call:
    return RaiseM(line=line, index=operands[0], synchronous=world.m_is_synchronous(operands[0]))


def _barrier(program: Program, world: WorldPort, line: int, operands: tuple[int, ...]) -> Call:
    return Barrier(line=line, reason=program.texts[operands[0]])


CALLS: dict[Instruction, _Maker] = {
    Instruction.SET_OUTPUT: _set_output,
    Instruction.SET_LEVEL: _set_level,
    Instruction.PULSE: _pulse,
    Instruction.TRACK: _track,
    Instruction.TANGENT: _tangent,
    Instruction.DWELL: _dwell,
    Instruction.RAISE_M: _raise_m,
    Instruction.BARRIER: _barrier,
}
"""By instruction, what makes its call of program, world, line and operands."""
