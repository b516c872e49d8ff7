"""A leg of the route: what a law from rest covers, measured from where it begins.

Legs that come again, as in a loop, are the same numbers wherever they lie on the route; so is their law.
"""

from __future__ import annotations

import numpy as np

from viapoint.runtime.kernel import chebyshev
from viapoint.runtime.kernel.speeds import rate_bounds
from viapoint.runtime.records import Floats, Ints


class Leg:
    """The limited axes of whole cells of the route as functions of r, 0 … length; an `AxisCurve`.

    `widths` (C,) and derivatives' `table` (C, 4, D+1, m) are those of the cells, `first_cells` (B,) numbers
    the cells with which the pieces of path begin, `rules` (B, 6) are the pieces' programmed speeds. The last
    four columns are lengths: they are counted from the begin.
    """

    def __init__(self, widths: Floats, table: Floats, first_cells: Ints, rules: Floats) -> None:
        ends = np.cumsum(widths)
        self._starts = np.concatenate(([0.0], ends[:-1]))
        self._widths, self._table, self._rules = widths, _from_zero(table), rules
        self._bounds_at = self._starts[first_cells]
        self.length = float(ends[-1])
        self.breaks = self._bounds_at[1:]
        self.key = (widths.tobytes(), self._table[:, 0].tobytes(), first_cells.tobytes(), rules.tobytes())
        """Equal for legs that are the same."""

    def values(self, r: Floats) -> Floats:
        """(N,) → (N, m - 2)."""
        return self._evaluate(r, (0,), 0, -2)[0]

    def derivatives(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """First, second and third derivatives, each (N, m - 2)."""
        first, second, third = self._evaluate(r, (1, 2, 3), 0, -2)
        return first, second, third

    def speed_bound(self, r: Floats) -> Floats:
        """Programmed bound (N,) on the rate of r."""
        which = np.searchsorted(self._bounds_at[1:], r, side="right")
        return rate_bounds(self._rules, which, self._evaluate(r, (1,), -2, None)[0])

    def _evaluate(self, r: Floats, orders: tuple[int, ...], first: int, last: int | None) -> list[Floats]:
        columns = range(self._table.shape[-1])[first:last]
        return chebyshev.evaluate(
            self._starts, self._widths, self._table, r, orders, (columns.start, columns.stop)
        )


def _from_zero(table: Floats) -> Floats:
    """Cells whose last four columns go on from each other, from 0 on."""
    result = table.copy()
    lengths = result[:, 0, :, -4:]
    lengths[:, 0] = 0.0
    signs = (-1.0) ** np.arange(lengths.shape[1])
    at_start = (signs[:, None] * lengths).sum(axis=1)
    rise = lengths.sum(axis=1) - at_start
    lengths[:, 0] = np.concatenate((np.zeros((1, rise.shape[1])), np.cumsum(rise, axis=0)[:-1])) - at_start
    return result
