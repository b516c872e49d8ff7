"""The curve to be timed, as the time law sees it: m axes as smooth functions of one parameter.

Geometry and inverse kinematics stand behind this face; the time law never sees a pose.
"""

from __future__ import annotations

from typing import Final, Protocol

from viapoint.runtime.records import Floats

INSET: Final = 1e-6
"""Part of a stretch by which one-sided limits at its ends are read."""


class AxisCurve(Protocol):
    """m axes (joints rad or m, TCP length m, TCP angle rad, ...) over the path parameter s.

    Twice continuously differentiable in s; the third derivative may jump at `breaks`.
    """

    @property
    def breaks(self) -> Floats:
        """(k,) ascending parameters where higher derivatives, or the speed bound, may jump."""
        ...

    def values(self, s: Floats, /) -> Floats:
        """Axis values (N, m) at s (N,)."""
        ...

    def derivatives(self, s: Floats, /) -> tuple[Floats, Floats, Floats]:
        """First, second and third derivatives with respect to s, each (N, m)."""
        ...
