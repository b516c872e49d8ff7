"""The circular motion buffer: one slot per statement's effect, three indices that never overtake.

Interpreter, planner and generator each own an index; interpreter ≥ planner ≥ generator. A slot is
free again when the generator has passed it (F ch. 9, main controller).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from viapoint.vm.ports import Call, Dwell

WIDEST: Final = 1024
"""Slots to which a buffer is widened at most: a corner is a stop if what follows it lies further ahead."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One call in the buffer, numbered from the start of the run."""

    number: int
    call: Call


class MotionBuffer:
    """`capacity` slots used round and round; the three indices count entries since the start of the run.

    The capacity is how far the interpreter may be ahead. It decides when the robot learns of its path, not
    what the path is: where it does not reach to the next corner, the buffer is widened (up to `WIDEST`).
    """

    def __init__(self, capacity: int) -> None:
        self._slots: list[Entry | None] = [None] * capacity
        self.interpreter = 0
        self.planner = 0
        self.generator = 0

    @property
    def fill(self) -> int:
        """Entries between generator and interpreter."""
        return self.interpreter - self.generator

    @property
    def full(self) -> bool:
        return self.fill == len(self._slots)

    def widen(self) -> bool:
        """One slot more, to know what follows the last motion; False where there are enough."""
        if len(self._slots) >= WIDEST:
            return False
        kept = [entry for entry in self._slots if entry is not None]
        self._slots = [None] * (len(self._slots) + 1)
        for entry in kept:
            self._slots[entry.number % len(self._slots)] = entry
        return True

    def put(self, call: Call) -> bool:
        """Interpreter: append `call`; False when there is no free slot."""
        if self.full:
            return False
        self._slots[self.interpreter % len(self._slots)] = Entry(self.interpreter, call)
        self.interpreter += 1
        return True

    def to_plan(self) -> Entry | None:
        """Planner: the next entry to plan, if the interpreter has put one."""
        return self._get(self.planner) if self.planner < self.interpreter else None

    def planned(self) -> None:
        """Planner: done with the entry of `to_plan`."""
        self.planner += 1

    def to_execute(self) -> Entry | None:
        """Generator: the entry to be executed next, if it has been planned."""
        return self._get(self.generator) if self.generator < self.planner else None

    def plan_again(self) -> None:
        """Planner: begin anew with what is to be executed next."""
        self.planner = self.generator

    def skip(self, line: int) -> None:
        """Of what is not executed yet the first entry of a line, or else of all, becomes a stop."""
        waiting = [self._get(number) for number in range(self.generator, self.interpreter)]
        entry = next((each for each in waiting if each.call.line == line), waiting[0])
        stop = Dwell(line=entry.call.line, seconds=0.0)
        self._slots[entry.number % len(self._slots)] = Entry(entry.number, stop)

    def planned_entries(self) -> Iterator[Entry]:
        """Those planned and not executed, in order."""
        return map(self._get, range(self.generator, self.planner))

    def executed(self) -> None:
        """Generator: the path has passed the entry; its slot is free."""
        self._slots[self.generator % len(self._slots)] = None
        self.generator += 1

    def _get(self, number: int) -> Entry:
        entry = self._slots[number % len(self._slots)]
        assert entry is not None, "indices of the motion buffer have crossed"
        return entry
