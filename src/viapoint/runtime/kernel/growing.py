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

    def append(self, rows: Floats) -> Floats:
        """Add rows at the end; where they are now, a view."""
        if self._end + len(rows) > len(self._array):
            kept = self.rows
            grown = np.empty((2 * (len(kept) + len(rows)), *kept.shape[1:]))
            grown[: len(kept)] = kept
            self._array, self._first, self._end = grown, 0, len(kept)
        place = self._array[self._end : self._end + len(rows)]
        place[:] = rows
        self._end += len(rows)
        return place

    def drop(self, count: int) -> None:
        """Drop rows at the start."""
        self._first += count
