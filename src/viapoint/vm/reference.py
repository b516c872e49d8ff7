"""The instruction set as a document, made from the table. Nothing about single instructions is known here."""

from __future__ import annotations

from viapoint.vm.instructions import SIZES, Instruction, Operand, Place

_HEAD = """\
# Instruction set

Made from the table in `viapoint/vm/instructions.py`; `make docs` writes it again.

An instruction is one byte of code and its operands, little-endian. The stack picture shows what an
instruction takes and leaves: B a boolean, N a number. Between statements the stack is empty.
"""


def instruction_reference() -> str:
    """The whole of docs/instructions.md."""
    return "\n".join([_HEAD, *_instructions(), "", *_operands(), "", *_places(), ""])


def _instructions() -> list[str]:
    rows = [
        "| code | instruction | operands | bytes | stack | path | does |",
        "|---|---|---|---|---|---|---|",
    ]
    for one in Instruction:
        spec = one.spec
        operands = " ".join(operand.word for operand in spec.operands) or "–"
        picture = f"{spec.pops or '–'} → {spec.pushes or '–'}" if spec.pops or spec.pushes else "–"
        place = "–" if spec.place is Place.ANYWHERE else spec.place.name.lower()
        cells = (f"{spec.code:#04x}", f"`{one.word}`", operands, str(SIZES[one]), picture, place, spec.doc)
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def _operands() -> list[str]:
    rows = ["## Operands", "", "| operand | bytes | meaning |", "|---|---|---|"]
    sizes = {"B": 1, "I": 4}
    return rows + [f"| {each.word} | {sizes[each.format]} | {each.meaning} |" for each in Operand]


def _places() -> list[str]:
    """How instructions stand to the path, which the verifier follows."""
    rows = ["## Path", "", "| word | meaning |", "|---|---|"]
    return rows + [f"| {each.name.lower()} | {each.value} |" for each in Place]
