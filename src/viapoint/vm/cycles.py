"""Finds the loop that a program's cycles are counted by. Looks at the code, runs nothing."""

from __future__ import annotations

from viapoint.vm.instructions import Decoded, Instruction, Operand, decode_all
from viapoint.vm.program import Program


def main_loop(program: Program) -> int | None:
    """Address of the GOTO without a count that closes the main program's endless loop.

    Of the jumps back in the main program that lie in no wider one, the last: loops that poll or retry lie
    inside it or before it. None without such a jump.
    """
    by_address = {one.address: one for one in decode_all(program.code)}
    back = [
        (one.operand(Operand.TARGET), one.address)
        for one in _main_program(by_address)
        if one.instruction is Instruction.JUMP and one.operand(Operand.TARGET) <= one.address
    ]
    last: tuple[int, int] | None = None
    for target, address in sorted(back, key=lambda jump: (jump[1], -jump[0])):
        if last is None or target > last[1] or target <= last[0]:
            last = target, address
    return last[1] if last is not None else None


def _main_program(by_address: dict[int, Decoded]) -> list[Decoded]:
    """The instructions that can run outside every subroutine."""
    seen = {0}
    waiting = [0]
    while waiting:
        one = by_address[waiting.pop()]
        spec = one.instruction.spec
        following = [one.following] if spec.falls_through else []
        if Operand.TARGET in spec.operands and one.instruction is not Instruction.CALL:
            following.append(one.operand(Operand.TARGET))
        fresh = [address for address in following if address not in seen]
        seen.update(fresh)
        waiting += fresh
    return [by_address[address] for address in seen]
