"""Vector functions of one variable as chains of Chebyshev polynomials of fixed degree. Pure arithmetic.

A *cell* is an interval [start, end] with one polynomial per axis, interpolated at the
Chebyshev–Lobatto points, so that neighbouring cells agree at their common end to rounding.
Interpolation converges geometrically for the smooth functions that occur between the
junctions of a path; the trailing coefficients measure the error that is left. The functions here are the
numpy twin of `_axes`.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from viapoint.runtime.core import chosen
from viapoint.runtime.kernel.growing import GrowingRows
from viapoint.runtime.records import Floats, Ints

DEGREE: Final = 11
"""12 nodes a cell: the best trade of cell count against evaluation cost for arm kinematics."""

TRAILING: Final = 2
"""Coefficients looked at to judge convergence; two, since odd or even ones may vanish by symmetry."""


ROUNDING: Final = 4e-15
"""Coefficients of second degree and higher below this are rounding of values of a few rad; as zeros, they
let what is straight be seen as straight."""

_CORE: Final = "kernel._axes"

_ORDERS: Final = 4
"""A function and the derivatives that the time law asks for."""


def _lobatto(degree: int) -> Floats:
    return -np.cos(np.pi * np.arange(degree + 1) / degree)


def _interpolation_matrix(degree: int) -> Floats:
    """Values at the Lobatto points to Chebyshev coefficients (a discrete cosine transform, type I)."""
    k = np.arange(degree + 1)
    matrix = 2.0 / degree * np.cos(np.pi * np.outer(k, degree - k) / degree)
    matrix[:, [0, -1]] *= 0.5
    matrix[[0, -1], :] *= 0.5
    return matrix


def _integration_matrix(degree: int) -> Floats:
    """Values at the Lobatto points to the integral from −1 up to each of them, on [−1, 1]."""
    nodes = _lobatto(degree)
    columns = []
    for coefficients_of_value in _interpolation_matrix(degree).T:
        integral = np.polynomial.chebyshev.chebint(coefficients_of_value, lbnd=-1.0)
        columns.append(np.polynomial.chebyshev.chebval(nodes, integral))
    return np.stack(columns, axis=1)


NODES: Final = 0.5 * (_lobatto(DEGREE) + 1.0)
"""Interpolation points in a cell, 0 … 1, ends included."""

TO_COEFFICIENTS: Final = _interpolation_matrix(DEGREE)
INTEGRATE: Final = _integration_matrix(DEGREE)


def coefficients(values: Floats) -> Floats:
    """Chebyshev coefficients (C, D+1, m) of functions given at `NODES`: (C, D+1, m)."""
    if (core := chosen(_CORE)) is not None:
        return np.asarray(core.coefficients(np.ascontiguousarray(values), True))
    result = unrounded_coefficients(values)
    curved = result[:, 2:]
    curved[np.abs(curved) < ROUNDING] = 0.0
    return result


def unrounded_coefficients(values: Floats) -> Floats:
    """As `coefficients`, of values that may be tiny."""
    if (core := chosen(_CORE)) is not None:
        return np.asarray(core.coefficients(np.ascontiguousarray(values), False))
    return _weighed(TO_COEFFICIENTS, values)


def integrals(rates: Floats, widths: Floats) -> Floats:
    """Integrals (C, D+1, m) from each cell's start up to its `NODES`, of functions given there."""
    if (core := chosen(_CORE)) is not None:
        return np.asarray(core.integrals(np.ascontiguousarray(rates), widths))
    return _weighed(INTEGRATE, rates) * (0.5 * widths)[:, None, None]


def _weighed(weights: Floats, values: Floats) -> Floats:
    """Sums (C, K, m) of values (C, N, m) with weights (K, N), in the order of the compiled module's."""
    result = weights[:, 0, None] * values[:, None, 0]
    for n in range(1, values.shape[1]):
        result += weights[:, n, None] * values[:, None, n]
    return np.asarray(result)


def derive(coeffs: Floats, widths: Floats, table: Floats) -> None:
    """Fill in the `table` (C, 4, D+1, m): coefficients (C, D+1, m) of functions and, behind them, of their
    first three derivatives.
    """
    if (core := chosen(_CORE)) is not None:
        core.derive(np.ascontiguousarray(coeffs), widths, table)
        return
    table[:, 0] = coeffs
    scale = (2.0 / widths)[:, None, None]
    for order in range(1, _ORDERS):
        low, high = table[:, order - 1], table[:, order]
        high[:, DEGREE] = 0.0
        high[:, DEGREE - 1] = 2.0 * DEGREE * low[:, DEGREE]
        for k in range(DEGREE - 1, 0, -1):
            high[:, k - 1] = 2.0 * k * low[:, k] + high[:, k + 1]
        high[:, 0] *= 0.5
        high *= scale


def residual(coeffs: Floats) -> Floats:
    """Estimated interpolation error per cell and axis, (C, m): the size of the trailing coefficients."""
    tail: Floats = np.abs(coeffs[:, -TRAILING:, :]).max(axis=1)
    return tail


class Tables(NamedTuple):
    """Cells: starts (C,), widths (C,) and coefficients (C, 4, D+1, m) as of `derive`."""

    starts: Floats
    widths: Floats
    table: Floats


class Cells:
    """A function R → R^m on consecutive cells; grows at the end, may be forgotten from the start."""

    def __init__(self, axes: int) -> None:
        self._starts, self._widths = GrowingRows(), GrowingRows()
        self._table = GrowingRows(_ORDERS, DEGREE + 1, axes)

    def append(self, starts: Floats, widths: Floats, coeffs: Floats, offsets: Floats | None = None) -> None:
        """Add cells at the end: starts (C,), widths (C,), coefficients (C, D+1, m).

        `offsets` (C, k) are added to what their last k axes are.
        """
        self._starts.append(starts)
        self._widths.append(widths)
        table = self._table.room(len(coeffs))
        derive(coeffs, widths, table)
        if offsets is not None:
            table[:, 0, 0, -offsets.shape[1] :] += offsets

    def forget(self, s: float) -> None:
        """Drop the cells that end before s."""
        count = max(0, int(np.searchsorted(self._starts.rows, s, side="right")) - 1)
        for rows in (self._starts, self._widths, self._table):
            rows.drop(count)

    def evaluate(
        self, s: Floats, orders: tuple[int, ...] = (0,), columns: tuple[int, int] | None = None
    ) -> list[Floats]:
        """Derivatives of the asked orders (0 … 3) at s (N,), each (N, m), or of columns from … to before."""
        return evaluate(self.tables, s, orders, columns or (0, self._table.rows.shape[-1]))

    @property
    def tables(self) -> Tables:
        """All cells; a view."""
        return Tables(self._starts.rows, self._widths.rows, self._table.rows)

    def between(self, s_from: float, s_to: float) -> Tables | None:
        """The cells from s_from to s_to; None if one lies across an end."""
        starts = self._starts.rows
        first, last = np.searchsorted(starts, (s_from, s_to)).tolist()
        ends = last == len(starts) or starts[last] == s_to
        if not ends or first >= last or starts[first] != s_from:
            return None
        return Tables(starts[first:last], self._widths.rows[first:last], self._table.rows[first:last])


def evaluate(cells: Tables, s: Floats, orders: tuple[int, ...], columns: tuple[int, int]) -> list[Floats]:
    """Derivatives of the asked orders at s (N,), each (N, m'), of columns from … to before.

    What lies outside of the cells is clamped to their ends.
    """
    starts, widths, table = cells
    first, last = columns
    if (core := chosen(_CORE)) is not None:
        found: list[Floats] = core.evaluate(*cells, np.ascontiguousarray(s), orders, first, last)
        return found
    cell = np.minimum(np.maximum(np.searchsorted(starts, s, side="right") - 1, 0), len(starts) - 1)
    x = np.minimum(np.maximum(2.0 * (s - starts[cell]) / widths[cell] - 1.0, -1.0), 1.0)
    return _sums(_polynomials(x), [table[:, order, :, first:last] for order in orders], cell)


def _sums(basis: Floats, tables: list[Floats], cell: Ints) -> list[Floats]:
    """Polynomials (D+1, N) times the coefficients (C, D+1, m) of each place's cell (N,): (N, m) a table.

    In the order of the compiled module's sums, and not as matrix products: those round otherwise.
    """
    results = []
    for table in tables:
        total = table[cell, 0]
        for k in range(1, DEGREE + 1):
            total += basis[k, :, None] * table[cell, k]
        results.append(total)
    return results


def _polynomials(x: Floats) -> Floats:
    """Chebyshev polynomials T₀ … T_D at x (N,): (D+1, N), by their recurrence."""
    basis = np.empty((DEGREE + 1, len(x)))
    basis[0], basis[1] = 1.0, x
    twice = 2.0 * x
    for k in range(2, DEGREE + 1):
        np.multiply(twice, basis[k - 1], out=basis[k])
        basis[k] -= basis[k - 2]
    return basis
