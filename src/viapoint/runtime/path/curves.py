"""Curves of a point: straight line, arc, Bézier, in any dimension (a position, or a vector of joints).

A curve is a function of its own parameter w in 0 … `length`; orientation is another module's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viapoint.runtime.path.bezier import bezier, hermite_controls
from viapoint.runtime.path.moves import Floats

Derivatives = tuple[Floats, Floats, Floats]


@dataclass(frozen=True, slots=True)
class Straight:
    """p(w) = origin + w·velocity: F 5-1, 5-17 with w in place of t."""

    origin: Floats  # (d,)
    velocity: Floats  # (d,) dp/dw
    length: float

    def points(self, w: Floats) -> Floats:
        """(N,) → (N, d)."""
        return self.origin + w[:, None] * self.velocity

    def velocities(self, w: Floats) -> Floats:
        """(N,) → (N, d) dp/dw."""
        return np.broadcast_to(self.velocity, (len(w), len(self.velocity)))

    def derivatives(self, w: float) -> Derivatives:
        """p, dp/dw, d²p/dw² at one w, each (d,)."""
        return self.origin + w * self.velocity, self.velocity, np.zeros_like(self.velocity)

    def accelerations(self, w: Floats) -> Floats:
        """(N,) → (N, d) d²p/dw²."""
        return np.zeros((len(w), len(self.velocity)))


@dataclass(frozen=True, slots=True)
class Arc:
    """p(w) = C + r·cos(w/r)·U + r·sin(w/r)·V (F 5-18): w is arc length, any number of turns."""

    center: Floats  # (3,)
    radius: float
    u: Floats  # (3,) unit, from the centre to the start
    v: Floats  # (3,) unit, along the motion at the start
    length: float

    def points(self, w: Floats) -> Floats:
        """(N,) → (N, 3)."""
        a = w / self.radius
        return (
            self.center
            + (self.radius * np.cos(a))[:, None] * self.u
            + (self.radius * np.sin(a))[:, None] * self.v
        )

    def velocities(self, w: Floats) -> Floats:
        """(N,) → (N, 3) unit tangents."""
        a = w / self.radius
        tangents: Floats = np.cos(a)[:, None] * self.v - np.sin(a)[:, None] * self.u
        return tangents

    def accelerations(self, w: Floats) -> Floats:
        """(N,) → (N, 3) d²p/dw², 1/m."""
        return (self.center - self.points(w)) / (self.radius * self.radius)

    def derivatives(self, w: float) -> Derivatives:
        """p, dp/dw, d²p/dw² at one w."""
        at = np.array([w])
        return self.points(at)[0], self.velocities(at)[0], self.accelerations(at)[0]


@dataclass(frozen=True, slots=True)
class Bezier:
    """A Bézier curve of any degree, its natural parameter stretched: w = t·length."""

    controls: Floats  # (degree + 1, d)
    length: float

    def points(self, w: Floats) -> Floats:
        """(N,) → (N, d)."""
        return bezier(self.controls, w / self.length)[0]

    def velocities(self, w: Floats) -> Floats:
        """(N,) → (N, d) dp/dw."""
        return bezier(self.controls, w / self.length)[1] / self.length

    def accelerations(self, w: Floats) -> Floats:
        """(N,) → (N, d) d²p/dw²."""
        return bezier(self.controls, w / self.length)[2] / (self.length * self.length)

    def derivatives(self, w: float) -> Derivatives:
        """p, dp/dw, d²p/dw² at one w."""
        p, p1, p2 = bezier(self.controls, np.array([w / self.length]))
        return p[0], p1[0] / self.length, p2[0] / (self.length * self.length)


Curve = Straight | Arc | Bezier
Profile = Straight | Bezier


def joining(left: Derivatives, right: Derivatives, length: float) -> Bezier:
    """The Bézier of lowest degree that takes over value, first and second derivative at both ends."""
    return Bezier(hermite_controls(left, right, length), length)
