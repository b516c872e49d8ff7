"""A leg of the route: what a law from rest covers, measured from where it begins.

Legs that come again, as in a loop, are the same numbers wherever they lie on the route; so is their law.
"""

from __future__ import annotations

from functools import cached_property
from typing import Final

import numpy as np

from viapoint.runtime.kernel.chebyshev import Tables, evaluate
from viapoint.runtime.kernel.speeds import rate_bounds
from viapoint.runtime.records import Floats, Ints

_LENGTHS: Final = 4
"""Columns of lengths, the last of the cells."""


class Leg:
    """The limited axes of whole cells of the route as functions of r, 0 … length; an `AxisCurve`.

    `widths` (C,) and derivatives' `table` (C, 4, D+1, m) are those of the cells, `first_cells` (B,) numbers
    the cells with which the pieces of path begin, `rules` (B, 6) are the pieces' programmed speeds. The last
    four columns are lengths: they are counted from the begin.
    """

    def __init__(self, widths: Floats, table: Floats, first_cells: Ints, rules: Floats) -> None:
        self._widths, self._table, self._first_cells, self._rules = widths, table, first_cells, rules
        coeffs = table[:, 0].copy()
        coeffs[:, 0, -_LENGTHS:] = 0.0
        self.key = (widths.tobytes(), coeffs.tobytes(), first_cells.tobytes(), rules.tobytes())
        """Equal for legs that are the same."""

    @cached_property
    def _cells(self) -> Tables:
        """Made when they are asked for: of a leg whose law is known the key is enough."""
        starts = np.concatenate(([0.0], np.cumsum(self._widths)[:-1]))
        return Tables(starts, self._widths, _from_zero(self._table))

    @cached_property
    def _begins(self) -> Floats:
        return self._cells.starts[self._first_cells]

    @property
    def breaks(self) -> Floats:
        """Places inside where a piece of path begins."""
        return self._begins[1:]

    @cached_property
    def length(self) -> float:
        """m."""
        return float(self._cells.starts[-1] + self._widths[-1])

    def values(self, r: Floats) -> Floats:
        """(N,) → (N, m - 2)."""
        return self._evaluate(r, (0,))[0]

    def derivatives(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """First, second and third derivatives, each (N, m - 2)."""
        first, second, third = self._evaluate(r, (1, 2, 3))
        return first, second, third

    def speed_bound(self, r: Floats) -> Floats:
        """Programmed bound (N,) on the rate of r."""
        return rate_bounds(self._cells, r, self._begins, self._rules)

    def _evaluate(self, r: Floats, orders: tuple[int, ...]) -> list[Floats]:
        return evaluate(self._cells, r, orders, (0, self._cells.table.shape[-1] - 2))


def _from_zero(table: Floats) -> Floats:
    """Cells whose last four columns go on from each other, from 0 on."""
    result = table.copy()
    lengths = result[:, 0, :, -_LENGTHS:]
    lengths[:, 0] = 0.0
    signs = (-1.0) ** np.arange(lengths.shape[1])
    at_start = (signs[:, None] * lengths).sum(axis=1)
    rise = lengths.sum(axis=1) - at_start
    lengths[:, 0] = np.concatenate((np.zeros((1, rise.shape[1])), np.cumsum(rise, axis=0)[:-1])) - at_start
    return result
