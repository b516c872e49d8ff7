"""The decision report: every place where a program reads the outside world."""

from __future__ import annotations

from dataclasses import dataclass

from viapoint.compiler.cell_checks import live_places
from viapoint.compiler.cell_names import CellNames
from viapoint.compiler.conditions import name_of, reads_of
from viapoint.language import tree


@dataclass(frozen=True, slots=True)
class Decision:
    """One place: its line, what is read there in order (DI3, $count), and whether the path stops for it.

    What is `watched` is looked at from there on, in every tick.
    """

    line: int
    reads: tuple[str, ...]
    barrier: bool
    watched: bool = False


def decision_report(program: tree.Program, cell: CellNames | None = None) -> tuple[Decision, ...]:
    """All decisions of a program in the order of its lines.

    A synchronous M is one: it waits for its flag's reset. Without a cell every M is synchronous.
    """
    asynchronous = cell.asynchronous if cell is not None else ()
    found = []
    for statement in program.statements:
        barrier, watched = True, False
        match statement:
            case tree.If(condition=condition, ahead=ahead) | tree.ElseIf(condition=condition, ahead=ahead):
                reads, barrier = _reads(condition), not ahead
            case tree.WaitFor(condition=condition) | tree.Until(condition=condition):
                reads = _reads(condition)
            case tree.Let(value=value) | tree.Inc(by=value):
                reads = _reads(value)
            case tree.On(condition=condition):
                reads, barrier, watched = _reads(condition), False, True
            case tree.Motion() if cell is not None:
                reads = live_places(statement, cell)
            case tree.WaitInput(input=index):
                reads = (f"DI{index}",)
            case tree.MFunction(function=index) if index not in asynchronous:
                reads = (f"M{index}",)
            case _:
                continue
        if reads:
            found.append(Decision(statement.line, reads, barrier, watched))
    return tuple(found)


def _reads(value: tree.Value) -> tuple[str, ...]:
    return tuple(dict.fromkeys(map(name_of, reads_of(value))))
