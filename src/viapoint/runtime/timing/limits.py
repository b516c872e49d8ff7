"""Limits of the axes and the programmed speed; their validation. Not here: what they do to x = ṡ²."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.errors import TimingError

SpeedBound = Callable[[Floats], Floats]
"""Programmed-speed bound (N,) on ṡ at s (N,); inf: none. Jumps at the curve's breaks only."""


@dataclass(frozen=True, slots=True)
class AxisLimits:
    """Limits (m,) of the axes in their own units per s, s², s³; inf: none.

    `deceleration` bounds an axis's acceleration against its motion; None: the same as `acceleration`.
    Raises TimingError for shapes that differ and for limits that are not positive.
    """

    speed: Floats
    acceleration: Floats
    jerk: Floats
    deceleration: Floats | None = None

    def __post_init__(self) -> None:
        for name, value in self._fields():
            if value.shape != self.speed.shape or value.ndim != 1:
                raise TimingError(f"the {name} limits have shape {value.shape}, not {self.speed.shape}")
            if not np.all(value > 0.0):
                raise TimingError(f"the {name} limits must be positive numbers or inf")

    def _fields(self) -> list[tuple[str, Floats]]:
        fields = [("speed", self.speed), ("acceleration", self.acceleration), ("jerk", self.jerk)]
        return fields if self.deceleration is None else [*fields, ("deceleration", self.deceleration)]

    @property
    def braking(self) -> Floats:
        """Acceleration limit (m,) against the motion of each axis."""
        return self.acceleration if self.deceleration is None else self.deceleration

    def scaled(self, acceleration: float, jerk: float) -> AxisLimits:
        """The same speeds, with accelerations and decelerations, and jerks, so many times as large."""
        return replace(
            self,
            acceleration=self.acceleration * acceleration,
            jerk=self.jerk * jerk,
            deceleration=self.braking * acceleration,
        )

    @property
    def gentlest(self) -> Floats:
        """The smaller of acceleration and deceleration limit, (m,)."""
        return np.minimum(self.acceleration, self.braking)
