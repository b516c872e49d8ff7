"""Arrays that grow at the end and are forgotten from the start."""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.runtime.records import Floats

_FIRST_CAPACITY: Final = 64


class GrowingRows:
    """Rows of one array; adding and dropping take constant time, amortised."""

    def __init__(self, *shape: int) -> None:
        self._array = np.empty((_FIRST_CAPACITY, *shape))
        self._first = self._end = 0

    @property
    def rows(self) -> Floats:
        """The rows there are; a view."""
        return self._array[self._first : self._end]

    def append(self, rows: Floats) -> None:
        """Add rows at the end."""
        self.room(len(rows))[:] = rows

    def room(self, count: int) -> Floats:
        """So many more rows at the end, to be filled in: a view."""
        if self._end + count > len(self._array):
            kept = self.rows
            grown = np.empty((2 * (len(kept) + count), *kept.shape[1:]))
            grown[: len(kept)] = kept
            self._array, self._first, self._end = grown, 0, len(kept)
        self._end += count
        return self._array[self._end - count : self._end]

    def drop(self, count: int) -> None:
        """Drop rows at the start."""
        self._first += count
