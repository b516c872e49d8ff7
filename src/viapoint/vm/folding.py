"""Folds what goes round in a list: of a part that is repeated in a row, three rounds stand for all.

For whoever looks at a program's calls without running them. Nested loops fold from the inside out.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Final

_ROUNDS: Final = 3
"""Rounds kept: the first, which is come to from elsewhere; one for all between; the last, which is left."""


@dataclass(frozen=True, slots=True)
class Folded:
    """Positions kept, how often each stands for itself, and what makes the folding good.

    For every pair of `proofs` (indices into `kept`) what follows from one element must follow from the other.
    """

    kept: tuple[int, ...]
    weights: tuple[int, ...]
    proofs: tuple[tuple[int, int], ...]


def fold(items: Sequence[Hashable]) -> Folded:
    """Fold a list. Equal items are taken for the same."""
    folder = _Folder()
    names: dict[Hashable, int] = {}
    for position, item in enumerate(items):
        folder.add(position, names.setdefault(item, len(names)))
    return Folded(tuple(folder.kept), tuple(folder.weights), tuple(sorted(folder.proofs)))


class _Folder:
    def __init__(self) -> None:
        self.kept: list[int] = []
        self.weights: list[int] = []
        self.proofs: set[tuple[int, int]] = set()
        self._names: list[int] = []
        self._last: dict[int, int] = {}  # where a name stands last

    def add(self, position: int, name: int) -> None:
        before = self._last.get(name)
        self._last[name] = len(self._names)
        self._names.append(name)
        self.kept.append(position)
        self.weights.append(1)
        if before is not None:
            self._fold(len(self._names) - 1 - before)

    def _fold(self, period: int) -> None:
        """Take the last round out if it is one too many; the second one then stands for it too."""
        names, count = self._names, len(self._names)
        first = count - (_ROUNDS + 1) * period
        if first < 0 or names[first : count - period] != names[first + period :]:
            return
        for k in range(period):
            self.weights[first + period + k] += self.weights[count - period + k]
            self._last[names[count - period + k]] -= period
        del names[count - period :], self.kept[count - period :], self.weights[count - period :]
        self.proofs = {each for each in self.proofs if each[1] < count - period}
        self.proofs.add((first + period - 1, first + 2 * period - 1))
