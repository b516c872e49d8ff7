"""Vector functions of one variable as chains of Chebyshev polynomials of fixed degree. Pure arithmetic.

A *cell* is an interval [start, end] with one polynomial per axis, interpolated at the
Chebyshev–Lobatto points, so that neighbouring cells agree at their common end to rounding.
Interpolation converges geometrically for the smooth functions that occur between the
junctions of a path; the trailing coefficients measure the error that is left.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.runtime.records import Floats, Ints

DEGREE: Final = 11
"""12 nodes a cell: the best trade of cell count against evaluation cost for arm kinematics."""

_TRAILING: Final = 2
"""Coefficients looked at to judge convergence; two, since odd or even ones may vanish by symmetry."""


_ROUNDING: Final = 4e-15
"""Coefficients of second degree and higher below this are rounding of values of a few rad; as zeros, they
let what is straight be seen as straight."""


def _lobatto(degree: int) -> Floats:
    return -np.cos(np.pi * np.arange(degree + 1) / degree)


def _interpolation_matrix(degree: int) -> Floats:
    """Values at the Lobatto points to Chebyshev coefficients (a discrete cosine transform, type I)."""
    k = np.arange(degree + 1)
    matrix = 2.0 / degree * np.cos(np.pi * np.outer(k, degree - k) / degree)
    matrix[:, [0, -1]] *= 0.5
    matrix[[0, -1], :] *= 0.5
    return matrix


def _derivative_matrix(degree: int) -> Floats:
    """Chebyshev coefficients of f to those of f' on [-1, 1]."""
    matrix = np.zeros((degree + 1, degree + 1))
    for column in range(degree + 1):
        unit = np.zeros(degree + 1)
        unit[column] = 1.0
        derivative = np.polynomial.chebyshev.chebder(unit)
        matrix[: len(derivative), column] = derivative if column else 0.0
    return matrix


NODES: Final = 0.5 * (_lobatto(DEGREE) + 1.0)
"""Interpolation points in a cell, 0 … 1, ends included."""

_TO_COEFFICIENTS: Final = _interpolation_matrix(DEGREE)
_DERIVE: Final = _derivative_matrix(DEGREE)


def coefficients(values: Floats) -> Floats:
    """Chebyshev coefficients (C, D+1, m) of functions given at `NODES`: (C, D+1, m)."""
    result: Floats = np.einsum("kn,cnm->ckm", _TO_COEFFICIENTS, values, optimize=False)
    curved = result[:, 2:]
    curved[np.abs(curved) < _ROUNDING] = 0.0
    return result


def residual(coeffs: Floats) -> Floats:
    """Estimated interpolation error per cell and axis, (C, m): the size of the trailing coefficients."""
    tail: Floats = np.abs(coeffs[:, -_TRAILING:, :]).max(axis=1)
    return tail


class Cells:
    """A function R → R^m on consecutive cells; grows at the end, may be forgotten from the start."""

    def __init__(self, axes: int) -> None:
        self._axes = axes
        self._starts = np.empty(0)
        self._widths = np.empty(0)
        self._orders = [np.empty((DEGREE + 1, 0, axes)) for _ in range(4)]
        self._fresh: list[tuple[Floats, Floats, Floats]] = []

    def append(self, starts: Floats, widths: Floats, coeffs: Floats) -> None:
        """Add cells at the end: starts (C,), widths (C,), coefficients (C, D+1, m)."""
        self._fresh.append((starts, widths, coeffs))

    def forget(self, s: float) -> None:
        """Drop the cells that end before s."""
        self._settle()
        keep = max(0, int(np.searchsorted(self._starts, s, side="right")) - 1)
        if keep:
            self._starts, self._widths = self._starts[keep:], self._widths[keep:]
            self._orders = [np.ascontiguousarray(c[:, keep:]) for c in self._orders]

    def evaluate(self, s: Floats, orders: tuple[int, ...] = (0,)) -> list[Floats]:
        """Derivatives of the asked orders (0 … 3) at s (N,), each (N, m); Clenshaw's recurrence."""
        self._settle()
        cell = np.clip(np.searchsorted(self._starts, s, side="right") - 1, 0, len(self._starts) - 1)
        x = np.clip(2.0 * (s - self._starts[cell]) / self._widths[cell] - 1.0, -1.0, 1.0)[:, None]
        return [_clenshaw(self._orders[k], cell, x) for k in orders]

    def _settle(self) -> None:
        """Take appended cells over in one go: growing arrays piece by piece would cost n²."""
        if not self._fresh:
            return
        starts, widths, coeffs = (np.concatenate([f[k] for f in self._fresh]) for k in range(3))
        self._fresh = []
        self._starts = np.concatenate((self._starts, starts))
        self._widths = np.concatenate((self._widths, widths))
        order = coeffs.transpose(1, 0, 2)
        scale = (2.0 / widths)[None, :, None]
        for k in range(4):
            self._orders[k] = np.concatenate((self._orders[k], order), axis=1)
            order = np.tensordot(_DERIVE, order, axes=(1, 0)) * scale


def _clenshaw(coeffs: Floats, cell: Ints, x: Floats) -> Floats:
    twice = 2.0 * x
    upper = coeffs[DEGREE][cell]
    lower = np.zeros_like(upper)
    for k in range(DEGREE - 1, 0, -1):
        upper, lower = coeffs[k][cell] + twice * upper - lower, upper
    result: Floats = coeffs[0][cell] + x * upper - lower
    return result
