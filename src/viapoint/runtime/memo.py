"""What was computed once of the same numbers is not computed again: a program that repeats its motions, as
most do, plans them once.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Final, Generic, TypeVar

V = TypeVar("V")

_KEPT: Final = 128
"""Results remembered: the motions of a long cycle."""


class Memo(Generic[V]):
    """Results of one pure function by what they depend on; those asked for last are kept."""

    def __init__(self, kept: int = _KEPT) -> None:
        self._results: OrderedDict[Hashable, V] = OrderedDict()
        self._kept = kept

    def get(self, key: Hashable, compute: Callable[[], V]) -> V:
        """The result remembered for `key`, or that of `compute`; what raises is not remembered."""
        result = self.find(key)
        return self.keep(key, compute()) if result is None else result

    def find(self, key: Hashable) -> V | None:
        """The result remembered for `key`, if any."""
        result = self._results.get(key)
        if result is not None:
            self._results.move_to_end(key)
        return result

    def keep(self, key: Hashable, result: V) -> V:
        """Remember the result."""
        self._results[key] = result
        if len(self._results) > self._kept:
            self._results.popitem(last=False)
        return result
