"""A path parameter that widens the surroundings of a near miss of a singular pose.

Passing such a pose at a distance d a joint turns by half a turn within a few d. In the path's own length
that may be less than the rounding of s allows to resolve tick by tick. So s runs on faster there,

    ds/dx = 1 + λ·B(x)/√(x² + d²),   B(x) = (1 − x²/W²)⁴ within the width W and 0 beyond,

which is about λ per radian that the joint turns, and 1 with three vanishing derivatives at ±W: the joints
stay as smooth in s as they are in the length. x counts from the place of the miss.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats

_BINOMIALS: Final = (1.0, -4.0, 6.0, -4.0, 1.0)

_SHARE: Final = 0.25
"""λ ÷ W: the speed of s along the path changes over the whole width, not in a part of it."""

_STEPS: Final = 80
"""Newton steps at most, or halvings where they leave the bracket; two to six are needed."""

_SETTLED: Final = 1e-15
"""Relative step below which Newton's method only follows the rounding of its sums, for ever if it may."""


@dataclass(frozen=True, slots=True)
class Warp:
    """The stretched parameter around a miss by `distance` (m), over `width` (m) on either side."""

    distance: float
    width: float

    @property
    def scale(self) -> float:
        """λ, m: about the s in which the joint turns by a radian."""
        return _SHARE * self.width

    def parameter(self, x: Floats) -> Floats:
        """s (N,) from the place of the miss at x (N,)."""
        inside = np.clip(x, -self.width, self.width)
        return self._sum(np.arcsinh(inside / self.distance), inside) + (x - inside)

    def place(self, s: Floats) -> Floats:
        """x (N,) at s (N,): the inverse, to the relative precision of x."""
        d, lam = self.distance, self.scale
        high = np.full_like(s, np.arcsinh(self.width / d))
        low = -high
        outermost = self._sum(high, np.full_like(s, self.width))
        outside = s - np.clip(s, -outermost, outermost)
        s = s - outside
        a = np.clip(s / lam, low, high)
        for _ in range(_STEPS):
            x = d * np.sinh(a)
            over = self._sum(a, x) - s
            low, high = np.where(over > 0.0, low, a), np.where(over > 0.0, a, high)
            newton = a - over / (np.hypot(x, d) + lam * self._bump(x))
            following = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
            settled = (np.abs(following - a) <= _SETTLED * np.abs(a)).all()
            a = following
            if settled:
                break
        result: Floats = d * np.sinh(a) + outside
        return result

    def rate(self, x: Floats) -> Floats:
        """dx/ds (N,) at x (N,)."""
        r = np.hypot(x, self.distance)
        result: Floats = r / (r + self.scale * self._bump(x))
        return result

    def _bump(self, x: Floats) -> Floats:
        result: Floats = np.square(np.square(np.maximum(1.0 - np.square(x / self.width), 0.0)))
        return result

    def _sum(self, a: Floats, x: Floats) -> Floats:
        """s at x = d·sinh a: the integral of B/√ is then one of even powers of sinh, found by recursion."""
        d, x = self.distance / self.width, x / self.width
        r, odd, square = np.hypot(x, d), x, np.square(x)
        power, total = a, _BINOMIALS[0] * a
        for n in range(1, len(_BINOMIALS)):
            power = (odd * r - (2 * n - 1) * d * d * power) / (2 * n)
            total = total + _BINOMIALS[n] * power
            odd = odd * square
        result: Floats = self.width * (x + _SHARE * total)
        return result
