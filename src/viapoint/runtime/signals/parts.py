"""The parts on the belts of a cell: which of them have been taken, by whichever robot. No time, no places.

Parts of a belt are numbered from 0 in the order in which they pass its trigger.
"""

from __future__ import annotations


class PartQueues:
    """One queue per belt, for all robots of a cell."""

    def __init__(self) -> None:
        self._taken: dict[int, set[int]] = {}
        self._below: dict[int, int] = {}  # parts before this one are all taken, and not in the set

    def take(self, belt: int, part: int) -> None:
        """Somebody has taken a part: nobody else will."""
        taken, below = self._taken.setdefault(belt, set()), self._below.get(belt, 0)
        taken.add(part)
        while below in taken:
            taken.discard(below)
            below += 1
        self._below[belt] = below

    def next_free(self, belt: int, part: int) -> int:
        """The first part from `part` on that nobody has taken."""
        taken = self._taken.get(belt, ())
        part = max(part, self._below.get(belt, 0))
        while part in taken:
            part += 1
        return part
