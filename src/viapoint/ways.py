"""Following a program without running it: answers for what it asks, so that every way can be taken."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from viapoint.language.commands import MAX_NUMBER
from viapoint.vm import Machine
from viapoint.vm.conditions import Condition, Reading
from viapoint.vm.ports import AwaitCondition, AwaitInput, Suspension

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell

MOST_READS: Final = 10
"""Reads between two places to stand at of which both answers are followed."""

Script = tuple[bool, ...]


class Read(NamedTuple):
    """What was asked in a line, and what was answered."""

    line: int
    what: str
    value: bool


class Answers:
    """WorldPort: a script of answers, and no beyond its end; a wait is satisfied when it is asked again."""

    def __init__(self, cell: Cell, script: Script = ()) -> None:
        self._cell = cell
        self._script = script
        self._granted: bool | None = None
        self.given: list[Read] = []
        self.alternatives: list[Script] = []
        """Scripts of the other ways from here."""

    def grant(self, *, holds: bool) -> None:
        """The read answered last was a wait's: it is asked again, and satisfied; there is no other way.

        Unless the wait is over: then it is not (`holds`), and having been satisfied is the other way.
        """
        self._granted = holds
        if holds:
            self.alternatives = [each for each in self.alternatives if len(each) < len(self.given)]

    def read(self, reading: Reading, *, line: int, ahead: bool) -> float:
        """WorldPort: a number is very high where the answer is yes, very low where it is no."""
        answer = self._read(line, str(reading))
        return answer if reading.is_switch else MAX_NUMBER if answer else -MAX_NUMBER

    def holds(self, condition: Condition, *, line: int) -> bool:
        """WorldPort."""
        return self._read(line, condition.text)

    def live_place(
        self, points: tuple[int | None, ...], frame: int, *, line: int, arrived: bool
    ) -> str | None:
        return self._cell.live_place(points, frame)

    def found(self) -> bool:
        """WorldPort: of a search, which stands in no line of its own."""
        return self._read(0, "FOUND")

    def m_is_synchronous(self, index: int) -> bool:
        """WorldPort."""
        return self._cell.m_functions.get(index, True)

    def _read(self, line: int, what: str) -> bool:
        if self._granted is not None:
            granted, self._granted = self._granted, None
            self.given[-1] = self.given[-1]._replace(value=granted)
            return granted
        asked = len(self.given)
        answer = asked < len(self._script) and self._script[asked]
        if len(self._script) <= asked < MOST_READS:
            self.alternatives.append((*(each.value for each in self.given), True))
        self.given.append(Read(line, what, answer))
        return answer


def run_on(machine: Machine, world: Answers) -> Suspension:
    """Let a machine run until it stands before something else than a wait, which is satisfied, or over."""
    outcome = machine.run()
    while isinstance(outcome, AwaitInput | AwaitCondition):
        limited = isinstance(outcome, AwaitCondition) and outcome.seconds is not None
        world.grant(holds=not limited)
        outcome = machine.run()
    return outcome
