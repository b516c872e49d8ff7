"""The shortest time in which a point can run a zigzag at all, whatever curve it takes at the corners.

Not only the time law but the curve itself is free here: a point with its acceleration and jerk bounded as
vectors passes from the middle of one leg to the middle of the next. It is on the leg and along it in the
middle, cuts the corner by at most the deviation, and never leaves the leg to the outside. No round edge, of
whatever shape, can be quicker under these bounds. A direct transcription solved by ipopt: exact for a jerk
that is constant in each of the intervals. Needs the extra `bench`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

INTERVALS = 120
"""Of constant jerk in half a passage; with 60 of them the time differs by 5e-5."""

SOLVER = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": 3000}


@dataclass(frozen=True)
class Zigzag:
    """Legs of `leg` mm that turn by `angle` degrees, left and right in turn, with corners cut by `deviation`
    mm, within `speed` mm/s, `acceleration` mm/s² and `jerk` mm/s³ as vectors.
    """

    legs: int
    leg: float
    angle: float
    deviation: float
    speed: float
    acceleration: float
    jerk: float

    def least(self) -> float:
        """Least time (s) from rest to rest. Raises RuntimeError where the solver fails.

        By symmetry the passages are twice the way from the middle of a leg to the middle of its corner; the
        first and the last leg are run from and to rest.
        """
        corners = self.legs - 1
        return 2.0 * self._to_corner(from_rest=True) + 2.0 * (corners - 1) * self._to_corner(from_rest=False)

    def _to_corner(self, *, from_rest: bool) -> float:
        """Least time (s) to the middle of the first corner. Lengths in mm, times in units of 10 ms."""
        import casadi as ca

        unit = 0.01
        speed, acceleration, jerk = (
            self.speed * unit,
            self.acceleration * unit**2,
            self.jerk * unit**3,
        )
        opti = ca.Opti()
        x, u, duration = opti.variable(6, INTERVALS + 1), opti.variable(2, INTERVALS), opti.variable()
        opti.minimize(duration)
        opti.subject_to(duration >= 1.0)
        step = duration / INTERVALS
        for k in range(INTERVALS):
            opti.subject_to(x[:, k + 1] == _after(ca, x[:, k], u[:, k], step))
            opti.subject_to(ca.sumsqr(u[:, k]) <= jerk**2)
        for k in range(INTERVALS + 1):
            opti.subject_to(ca.sumsqr(x[2:4, k]) <= speed**2)
            opti.subject_to(ca.sumsqr(x[4:6, k]) <= acceleration**2)
            opti.subject_to(opti.bounded(0.0, x[1, k], self.deviation))
        far = self.leg if from_rest else self.leg / 2.0
        opti.subject_to(x[:2, 0] == ca.DM([-far, 0.0]))
        opti.subject_to(x[4:, 0] == 0)
        opti.subject_to(x[2:4, 0] == 0 if from_rest else x[3, 0] == 0)
        self._in_the_corner(ca, opti, x[:, INTERVALS])
        cruise = 1.5
        opti.set_initial(duration, 1.2 * far / cruise)
        for k in range(INTERVALS + 1):
            share = k / INTERVALS
            begun = min(1.0, 4.0 * share) if from_rest else 1.0
            opti.set_initial(x[:, k], [-far * (1.0 - share), 0.5 * share, cruise * begun, 0.0, 0.0, 0.0])
        opti.solver("ipopt", SOLVER)
        return float(opti.solve().value(duration)) * unit

    def _in_the_corner(self, ca: Any, opti: Any, state: Any) -> None:
        """Half way: on the bisector, across it, accelerated along it."""
        half = math.radians(self.angle) / 2.0
        across, along = ca.DM([math.cos(half), math.sin(half)]), ca.DM([-math.sin(half), math.cos(half)])
        opti.subject_to(ca.dot(across, state[:2]) == 0)
        opti.subject_to(opti.bounded(0.0, ca.dot(along, state[:2]), self.deviation))
        opti.subject_to(ca.dot(along, state[2:4]) == 0)
        opti.subject_to(ca.dot(across, state[4:]) == 0)


def _after(ca: Any, state: Any, jerk: Any, step: Any) -> Any:
    """Position, velocity and acceleration after `step` of a constant jerk."""
    position, velocity, acceleration = state[:2], state[2:4], state[4:]
    return ca.vertcat(
        position + step * velocity + step**2 / 2.0 * acceleration + step**3 / 6.0 * jerk,
        velocity + step * acceleration + step**2 / 2.0 * jerk,
        acceleration + step * jerk,
    )
