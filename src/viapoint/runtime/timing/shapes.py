"""Shapes of one change of speed: how the acceleration rises and falls in it, for times and lengths of one.

A change by Δv in the time T has the speed v₀ + Δv·σ(u), u = t/T, the acceleration Δv/T·σ′(u) and the
jerk Δv/T²·σ″(u). Both shapes are symmetric about their middle, so the path of a change is T times the mean
of its two speeds. Sinusoidal: F 7-23 … 7-29. Bézier: F 7-30 … 7-39, a cubic whose inner control points
have the speeds of the ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats

Curve = Callable[[Floats], Floats]

_TURN: Final = 2.0 * np.pi


@dataclass(frozen=True, slots=True)
class Shape:
    """σ of a change of speed, its integral and its derivatives, over u in 0 … 1.

    Between `pieces` equal parts of u, quintics through position, speed and acceleration reproduce it.
    """

    name: str
    place: Curve
    speed: Curve
    acceleration: Curve
    jerk: Curve
    peak_acceleration: float
    peak_jerk: float
    pieces: int


SINUSOIDAL: Final = Shape(
    name="sinusoidal",
    place=lambda u: 0.5 * u * u + (np.cos(_TURN * u) - 1.0) / _TURN**2,
    speed=lambda u: u - np.sin(_TURN * u) / _TURN,
    acceleration=lambda u: 1.0 - np.cos(_TURN * u),
    jerk=lambda u: _TURN * np.sin(_TURN * u),
    peak_acceleration=2.0,
    peak_jerk=_TURN,
    pieces=16,
)
"""Acceleration and jerk are continuous; the jerk's own rate is at most 4π²·Δv/T³."""

BEZIER: Final = Shape(
    name="bezier",
    place=lambda u: u * u * u * (1.0 - 0.5 * u),
    speed=lambda u: u * u * (3.0 - 2.0 * u),
    acceleration=lambda u: 6.0 * u * (1.0 - u),
    jerk=lambda u: 6.0 * (1.0 - 2.0 * u),
    peak_acceleration=1.5,
    peak_jerk=6.0,
    pieces=2,
)
"""The acceleration is a parabola; the jerk falls steadily through the change, and jumps at its two ends."""


@dataclass(frozen=True, slots=True)
class Change:
    """A change from speed v_from to v_to within `time`, beginning at s; no change: just held."""

    s: float
    v_from: float
    v_to: float
    time: float

    @property
    def length(self) -> float:
        """Path that it takes."""
        return 0.5 * (self.v_from + self.v_to) * self.time


def quickest(shape: Shape, rise: float, acceleration: float, jerk: float, least: float) -> float:
    """Time of a change by `rise` that keeps to these limits, at least `least`."""
    by_jerk = math.sqrt(shape.peak_jerk * rise / jerk)
    return max(shape.peak_acceleration * rise / acceleration, by_jerk, least)


def knots(shape: Shape, changes: list[Change], s_end: float) -> tuple[Floats, Floats, Floats, Floats]:
    """t (from the first on), s, ṡ and s̈ at the knots of changes that follow one another up to s_end."""
    parts = [_of_change(shape, change) for change in changes]
    starts = np.concatenate(([0.0], np.cumsum([change.time for change in changes])))
    t = np.concatenate([start + part[0] for start, part in zip(starts, parts, strict=False)])
    s, v, a = (np.concatenate([part[k] for part in parts]) for k in (1, 2, 3))
    last = changes[-1].v_to
    return np.append(t, starts[-1]), np.append(s, s_end), np.append(v, last), np.append(a, 0.0)


def _of_change(shape: Shape, change: Change) -> tuple[Floats, Floats, Floats, Floats]:
    """t, s, ṡ and s̈ at the knots of one change, the last one left out."""
    count = 1 if change.v_from == change.v_to else shape.pieces
    u = np.arange(count) / count
    rise = change.v_to - change.v_from
    s = change.s + change.time * (change.v_from * u + rise * shape.place(u))
    v = change.v_from + rise * shape.speed(u)
    a = rise / change.time * shape.acceleration(u)
    a[0] = 0.0
    return change.time * u, s, v, a
