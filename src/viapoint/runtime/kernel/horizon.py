"""The stretch of the route that a law covers, forward or back, as the time law wants it: an `AxisCurve`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viapoint.runtime.kernel.route import Route
from viapoint.runtime.records import Floats


@dataclass(frozen=True, slots=True)
class Horizon:
    """The limited axes over r = direction · s from r_from to r_to."""

    route: Route
    direction: float
    r_from: float
    r_to: float

    def values(self, r: Floats) -> Floats:
        """(N,) → (N, m)."""
        return self.route.axes.values(self.direction * r)

    def derivatives(self, r: Floats) -> tuple[Floats, Floats, Floats]:
        """First, second and third derivatives, each (N, m)."""
        first, second, third = self.route.axes.derivatives(self.before_end(self.direction * r))
        return self.direction * first, second, self.direction * third

    def speed_bound(self, r: Floats) -> Floats:
        """Programmed bound (N,) on the rate of r."""
        return self.route.speed_bound(self.before_end(self.direction * r))

    def before_end(self, s: Floats) -> Floats:
        """s (N,) with the far end, if it is a stop that another motion follows, seen from this side of it."""
        end = max(self.direction * self.r_from, self.direction * self.r_to)
        return np.where(s == end, np.nextafter(end, -np.inf), s)

    @property
    def breaks(self) -> Floats:
        """Ascending places inside where higher derivatives or the programmed speed may jump."""
        s_from, s_to = sorted((self.direction * self.r_from, self.direction * self.r_to))
        return np.sort(self.direction * self.route.programmed.breaks(s_from, s_to))
