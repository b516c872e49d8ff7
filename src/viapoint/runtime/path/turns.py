"""Curves of an orientation: uniform turn (SLERP) and smooth turns through key orientations.

Each is a function of the same parameter w as the curve of the point beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from viapoint.runtime.path.bezier import bezier, hermite_controls
from viapoint.runtime.path.moves import Floats
from viapoint.runtime.path.rates import (
    exponential,
    norm,
    product,
    rates_of_vectors,
    rotation_from,
    turned,
    vector_of_rates,
)

Derivatives = tuple[Floats, Floats, Floats]

# Angles and rates below this (rad, rad per unit of w) are rounding of a fixed orientation.
STILL = 1e-12


@dataclass(frozen=True, slots=True)
class UniformTurn:
    """q(w) = exp(w·rate)·q0 at a constant rate: F 5-11, but over the full angle."""

    start: Floats  # (4,)
    rate: Floats  # (3,) rad per unit of w, base axes

    def quaternions(self, w: Floats) -> Floats:
        """(N,) → (N, 4)."""
        return turned(w[:, None] * self.rate, self.start)

    def rates(self, w: Floats) -> tuple[Floats, Floats]:
        """(N,) → ω and dω/dw, (N, 3) each, base axes."""
        return np.broadcast_to(self.rate, (len(w), 3)), np.zeros((len(w), 3))

    def derivatives(self, w: float) -> Derivatives:
        """q, ω, dω/dw at one w."""
        return product(exponential(w * self.rate), self.start), self.rate, np.zeros(3)

    def most(self, length: float) -> float:
        """The angle over w of 0 … length."""
        return norm(self.rate) * length


@dataclass(frozen=True, slots=True)
class KeyedTurn:
    """q(w) = exp(φ(w))·q_m on each interval, φ a quintic relative to a middle orientation q_m.

    Between intervals orientation, ω and dω/dw are continuous by the way the quintics are made.
    """

    knots: Floats  # (K + 1,) rising; the first may be negative
    middles: Floats  # (K, 4)
    controls: Floats  # (K, 6, 3) Bernstein form of φ

    def quaternions(self, w: Floats) -> Floats:
        """(N,) → (N, 4)."""
        q = np.empty((len(w), 4))
        for k, chosen in self._intervals(w):
            phi, _, _ = bezier(self.controls[k], self._t(k, w[chosen]))
            q[chosen] = turned(phi, self.middles[k])
        return q

    def rates(self, w: Floats) -> tuple[Floats, Floats]:
        """(N,) → ω and dω/dw, (N, 3) each, base axes."""
        rate, change = np.empty((len(w), 3)), np.empty((len(w), 3))
        for k, chosen in self._intervals(w):
            t, h = self._t(k, w[chosen]), self.knots[k + 1] - self.knots[k]
            phi, phi1, phi2 = bezier(self.controls[k], t)
            rate[chosen], change[chosen] = rates_of_vectors(phi, phi1 / h, phi2 / (h * h))
        return rate, change

    def derivatives(self, w: float) -> Derivatives:
        """q, ω, dω/dw at one w."""
        k = min(max(int(np.searchsorted(self.knots, w, side="right")) - 1, 0), len(self.middles) - 1)
        h = float(self.knots[k + 1] - self.knots[k])
        at = np.array([(w - float(self.knots[k])) / h])
        phi, phi1, phi2 = (each[0] for each in bezier(self.controls[k], at))
        rate, change = rates_of_vectors(phi, phi1 / h, phi2 / (h * h))
        return product(exponential(phi), self.middles[k]), rate, change

    def most(self, length: float) -> float:
        """An angle that is not exceeded over w of 0 … length.

        |ω| = |J(φ)·φ′| ≤ |φ′|, and no curve is longer than its control polygon.
        """
        sides = self.controls[:, 1:] - self.controls[:, :-1]
        return float(np.sqrt(np.square(sides).sum(axis=2)).sum())

    def _t(self, k: int, w: Floats) -> Floats:
        t: Floats = (w - self.knots[k]) / (self.knots[k + 1] - self.knots[k])
        return t

    def _intervals(self, w: Floats) -> Sequence[tuple[int, slice | Floats]]:
        if len(self.middles) == 1:
            return [(0, slice(None))]
        at = np.clip(np.searchsorted(self.knots, w, side="right") - 1, 0, len(self.middles) - 1)
        return [(int(k), at == k) for k in np.unique(at)]


Turn = UniformTurn | KeyedTurn


@dataclass(frozen=True, slots=True)
class Key:
    """An orientation that a turn passes, with its rate and change of rate there."""

    w: float
    quaternion: Floats  # (4,)
    rate: Floats  # (3,) rad per unit of w
    rate_change: Floats  # (3,) rad per unit of w squared
    onwards: Floats | None = None  # (3,) rotation vector to the next key; None at the last

    @property
    def rests(self) -> bool:
        """Neither rate nor change of rate."""
        return norm(self.rate) < STILL and norm(self.rate_change) < STILL


def _is_still(v: Floats) -> bool:
    return bool(np.abs(v).max() < STILL)


def slerp(start: Floats, turn: Floats, length: float) -> UniformTurn:
    """The turn by the rotation vector `turn` at a constant rate over 0 … length."""
    return UniformTurn(start, turn / length)


def turn_about(left: Key, right: Key, middle: Floats) -> Turn:
    """From one key to the other, matching rates and their changes; both within 180° of `middle`."""
    rates = (left.rate, right.rate, left.rate_change, right.rate_change)
    if all(_is_still(v) for v in rates) and _is_still(rotation_from(left.quaternion, right.quaternion)):
        return UniformTurn(middle, np.zeros(3))
    ends = []
    for key in (left, right):
        phi = rotation_from(middle, key.quaternion)
        ends.append((phi, *vector_of_rates(phi, key.rate, key.rate_change)))
    controls = hermite_controls(ends[0], ends[1], right.w - left.w)
    return KeyedTurn(np.array([left.w, right.w]), middle[None], controls[None])


def turn_through(keys: Sequence[Key]) -> Turn:
    """The smooth turn through all keys, from each to the next by its `onwards`."""
    if all(key.rests and (key.onwards is None or norm(key.onwards) < STILL) for key in keys):
        return UniformTurn(keys[0].quaternion, np.zeros(3))
    middles, controls = [], []
    for left, right in pairwise(keys):
        if left.onwards is None:
            raise ValueError("only the last key has nothing onwards")
        half = 0.5 * left.onwards
        middles.append(product(exponential(half), left.quaternion))
        # ±half, and not the logarithm of the ends: beyond 180° that would be another branch.
        ends = [
            (phi, *vector_of_rates(phi, key.rate, key.rate_change))
            for phi, key in ((-half, left), (half, right))
        ]
        controls.append(hermite_controls(ends[0], ends[1], right.w - left.w))
    return KeyedTurn(np.array([key.w for key in keys]), np.array(middles), np.array(controls))
