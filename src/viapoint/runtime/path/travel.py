"""Cumulative lengths along a curve: TCP arc length (m) and angle turned (rad) as functions of w.

Exact where the speed |dp/dw| is constant; elsewhere a table, interpolated by quintics, so that the result
is twice continuously differentiable wherever the speed is smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from viapoint.runtime.path.moves import Floats

# Agreement asked between table and quadrature half-way between its nodes, relative to the whole length:
# a tenth of what is promised (1e-6).
TABLE_ACCURACY = 1e-7
# Nodes of a table, doubled until it is accurate. A speed that touches zero has a kink there and never gets
# there; at the upper bound the error of such a kink is below 1e-6 of the length.
FIRST_PANELS, MOST_PANELS = 8, 512
# Newton steps of an inverse look-up; each doubles the digits, starting from a tenth of a panel or better.
_NEWTON_STEPS = 5

_GAUSS_AT, _GAUSS_WEIGHTS = (
    (np.polynomial.legendre.leggauss(5)[0] + 1.0) / 2.0,
    np.polynomial.legendre.leggauss(5)[1] / 2.0,
)

SpeedAt = Callable[[Floats], tuple[Floats, Floats]]  # w (N,) → speed and its derivative by w, (N,) each


@dataclass(frozen=True, slots=True)
class EvenTravel:
    """travel(w) = rate·w."""

    rate: float

    def at(self, w: Floats) -> Floats:
        """(N,) → (N,) travelled from w = 0."""
        return self.rate * w

    def upto(self, w: float) -> float:
        """Travelled from w = 0."""
        return self.rate * w

    def rates(self, w: Floats) -> Floats:
        """(N,) → (N,) d travel/dw."""
        return np.full_like(w, self.rate)

    def where(self, travelled: float) -> float:
        """The w at which so much has been travelled; rate must not be zero."""
        return travelled / self.rate


@dataclass(frozen=True, slots=True)
class TableTravel:
    """Quintic Hermite interpolation of travel, speed and its derivative at even nodes."""

    step: float
    travel: Floats  # (M + 1,)
    speed: Floats  # (M + 1,)
    speed_change: Floats  # (M + 1,)

    def at(self, w: Floats) -> Floats:
        """(N,) → (N,) travelled from w = 0."""
        k, t = self._locate(w)
        c0, c1, c2, c3, c4, c5 = self._monomials(k)
        return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))

    def upto(self, w: float) -> float:
        """Travelled from w = 0."""
        x = w / self.step
        k = min(max(int(x), 0), len(self.travel) - 2)
        c0, c1, c2, c3, c4, c5 = self._monomials_of(k)
        t = x - k
        return c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))

    def rates(self, w: Floats) -> Floats:
        """(N,) → (N,) d travel/dw."""
        k, t = self._locate(w)
        _, c1, c2, c3, c4, c5 = self._monomials(k)
        return (c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))) / self.step

    def where(self, travelled: float) -> float:
        """The w at which so much has been travelled."""
        k = min(max(int(np.searchsorted(self.travel, travelled)) - 1, 0), len(self.travel) - 2)
        c0, c1, c2, c3, c4, c5 = self._monomials_of(k)
        rise = float(self.travel[k + 1]) - c0
        t = (travelled - c0) / rise if rise > 0.0 else 0.0
        for _ in range(_NEWTON_STEPS):
            value = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
            slope = c1 + t * (2.0 * c2 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))
            t = min(max(t - (value - travelled) / max(slope, TABLE_ACCURACY * rise), 0.0), 1.0)
        return self.step * (k + t)

    def _locate(self, w: Floats) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], Floats]:
        x = w / self.step
        k = np.clip(x.astype(np.int64), 0, len(self.travel) - 2)
        return k, x - k

    def _monomials(self, k: np.ndarray[tuple[int], np.dtype[np.int64]]) -> tuple[Floats, ...]:
        k1 = k + 1
        at = (self.travel[k], self.travel[k1], self.speed[k], self.speed[k1])
        result: tuple[Floats, ...] = _quintic(self.step, *at, self.speed_change[k], self.speed_change[k1])
        return result

    def _monomials_of(self, k: int) -> tuple[float, ...]:
        s, v, a = (each[k : k + 2].tolist() for each in (self.travel, self.speed, self.speed_change))
        result: tuple[float, ...] = _quintic(self.step, *s, *v, *a)
        return result


def _quintic(h: float, s0: Any, s1: Any, speed0: Any, speed1: Any, change0: Any, change1: Any) -> Any:
    """Coefficients over one step h between travels, speeds and their changes; of floats as of arrays."""
    v0, v1 = h * speed0, h * speed1
    a0, a1 = 0.5 * h * h * change0, 0.5 * h * h * change1
    rise = s1 - s0
    d0, d1, d2 = rise - v0 - a0, v1 - v0 - 2.0 * a0, a1 - a0
    return (
        s0,
        v0,
        a0,
        10.0 * d0 - 4.0 * d1 + d2,
        -15.0 * d0 + 7.0 * d1 - 2.0 * d2,
        6.0 * d0 - 3.0 * d1 + d2,
    )


Travel = EvenTravel | TableTravel


def tabulate(speed_at: SpeedAt, length: float) -> TableTravel:
    """The travel over 0 … length of a speed given as a function."""
    panels = FIRST_PANELS
    while True:
        table = _table(speed_at, length, panels)
        if panels >= MOST_PANELS or _error(table, speed_at) <= TABLE_ACCURACY * table.travel[-1]:
            return table
        panels *= 2


def tabulate_nodes(speed: Floats, speed_change: Floats, step: float) -> TableTravel:
    """The travel of a speed known at even nodes only: trapezia with the end correction of Euler–Maclaurin."""
    rises = 0.5 * step * (speed[:-1] + speed[1:]) + step**2 / 12.0 * (speed_change[:-1] - speed_change[1:])
    return TableTravel(step, np.concatenate(([0.0], np.cumsum(rises))), speed, speed_change)


def _table(speed_at: SpeedAt, length: float, panels: int) -> TableTravel:
    step = length / panels
    speed, change = speed_at(step * np.arange(panels + 1.0))
    inner, _ = speed_at((step * (np.arange(panels)[:, None] + _GAUSS_AT)).ravel())
    rises = step * (inner.reshape(panels, -1) @ _GAUSS_WEIGHTS)
    return TableTravel(step, np.concatenate(([0.0], np.cumsum(rises))), speed, change)


def _error(table: TableTravel, speed_at: SpeedAt) -> float:
    """Largest difference from quadrature over the first half of a panel."""
    panels = len(table.travel) - 1
    nodes = table.step * np.arange(float(panels))
    inner, _ = speed_at((nodes[:, None] + 0.5 * table.step * _GAUSS_AT).ravel())
    halves = 0.5 * table.step * (inner.reshape(panels, -1) @ _GAUSS_WEIGHTS)
    return float(np.abs(table.at(nodes + 0.5 * table.step) - table.travel[:-1] - halves).max())
