"""Programs for the tests of the virtual machine, assembled by hand or compiled from text."""

from __future__ import annotations

from array import array

from viapoint.compiler import CellNames, compile_source
from viapoint.language.source import Source
from viapoint.vm import Program
from viapoint.vm.instructions import Instruction, encode
from viapoint.vm.program import Label, SpanMap

CELL = CellNames(
    points=range(100),
    tools=range(10),
    frames=range(10),
    conveyors=range(10),
    inputs=range(1, 33),
    outputs=range(1, 33),
    joints=6,
    auxiliary=range(1, 10),
    analog_inputs=range(1, 9),
    analog_outputs=range(1, 9),
    variables={"count": False, "ready": True},
)


def assemble(
    *code: tuple[Instruction, *tuple[int, ...]],
    numbers: tuple[float, ...] = (),
    shapes: tuple[str, ...] = (),
    texts: tuple[str, ...] = ("why",),
    labels: tuple[Label, ...] = (),
) -> Program:
    """A program of these instructions; all of it is line 1."""
    return Program(
        name="hand.via",
        code=b"".join(encode(instruction, *operands) for instruction, *operands in code),
        numbers=array("d", numbers),
        shapes=shapes,
        texts=texts,
        labels=labels,
        spans=SpanMap(array("I", [0]), array("I", [1]), array("I", [1]), array("I", [2])),
        source_hash=bytes(32),
    )


def compiled(text: str) -> Program:
    """The program of a text without errors."""
    result = compile_source(Source("part.via", text), CELL)
    assert result.program is not None, result.diagnostics
    return result.program
