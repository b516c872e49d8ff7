"""A finished stretch of path by its travel: a bound on how far the robot moves, and the joints on the way."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from viapoint.runtime import core
from viapoint.runtime.records import Floats, Ints

_COARSEST: Final = 1e-3
"""m of travel between the places that may be looked at. What is in between is missed by half of it."""

_MOST_PLACES: Final = 1_000_000
"""Places in a stretch: a kilometre of travel. Only tools beyond any reach come that far in one motion."""


def grid(travel: float, thinnest: float) -> Floats:
    """Places (N,), m of travel, at which a motion may have to be looked at, the last one at its end.

    `thinnest` is the radius of the robot's thinnest capsule: nothing thinner can hide between two of them.
    """
    spacing = min(_COARSEST, thinnest) if thinnest > 0.0 else _COARSEST
    count = int(min(max(np.ceil(travel / spacing), 1), _MOST_PLACES))
    if travel <= 0.0:
        return np.zeros(1)
    places = np.arange(1.0, count + 1.0)
    places *= travel / count
    places[-1] = travel
    return places


def paces(coeffs: Floats, pace: Floats) -> tuple[Floats, Floats]:
    """Rates (C,) of travel over −1 … 1 in cells (C, D+1, m), joints first, and travel (C + 1,) at their ends.

    No polynomial is steeper than Σ k²·|cₖ|, since |Tₖ'| ≤ k² there.
    """
    steepest = np.arange(coeffs.shape[1], dtype=np.float64) ** 2
    with np.errstate(over="ignore", invalid="ignore"):  # a tool of astronomic length is refused
        rates = np.einsum("k,ckn->cn", steepest, np.abs(coeffs[:, :, : len(pace)])) @ pace
        return rates, np.concatenate(([0.0], np.cumsum(2.0 * rates)))


class Course:
    """A stretch as its cells: widths (C,), Chebyshev coefficients (C, D+1, m), joints first."""

    def __init__(self, widths: Floats, coeffs: Floats, pace: Floats) -> None:
        self._n = len(pace)
        self._widths = widths
        self._coeffs = coeffs
        module = core.chosen("workspace._core")
        made: tuple[Floats, Floats] = (module.paces if module is not None else paces)(coeffs, pace)
        self._rates, self._ends = made
        self.length = float(self._ends[-1])
        """m of travel in all."""
        self.travel = np.zeros(1)
        """(N,) m of travel at the places that may be looked at."""

    def divide(self, thinnest: float) -> None:
        """Choose the places, for a robot whose thinnest capsule has that radius."""
        self.travel = grid(self.length, thinnest)

    def joints(self, rows: Ints) -> Floats:
        """Joints (K, n) at places (K,)."""
        return self._values(self.travel[rows])[:, : self._n]

    def march(self, rules: Any, room: float) -> Any:
        """From look to look, by the compiled rules."""
        return rules.along_course(self.travel, room, self._ends, self._rates, self._coeffs)

    def lengths(self, row: int) -> tuple[float, float]:
        """TCP length from the start of the stretch to a place, and of the whole stretch; m."""
        values = self._values(np.array([0.0, self.travel[row], self.length]))[:, -2]
        return float(values[1] - values[0]), float(values[2] - values[0])

    def share(self, row: int) -> float:
        """Where a place is in the path parameter of the stretch, 0 … 1."""
        cell, x = self._cells(self.travel[row : row + 1])
        ends = np.cumsum(self._widths)
        at = ends[cell] - 0.5 * (1.0 - x) * self._widths[cell]
        return float(at[0] / ends[-1])

    def _cells(self, travel: Floats) -> tuple[Ints, Floats]:
        cell = np.clip(np.searchsorted(self._ends, travel, side="right") - 1, 0, len(self._rates) - 1)
        rates = self._rates[cell]
        x = (travel - self._ends[cell]) / np.where(rates > 0.0, rates, 1.0) - 1.0
        return cell, np.clip(x, -1.0, 1.0)

    def _values(self, travel: Floats) -> Floats:
        cell, x = self._cells(travel)
        basis = np.polynomial.chebyshev.chebvander(x, self._coeffs.shape[1] - 1)
        values: Floats = np.einsum("rk,rkm->rm", basis, self._coeffs[cell])
        return values
