"""The torques that move an arm: inverse dynamics of its links and of what it carries (F ch. 8).

Links are rigid; friction, gears and motors are not in it. The sums are pinocchio's (recursive Newton–Euler).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from viapoint.runtime.robots.model import Floats

if TYPE_CHECKING:
    from viapoint.runtime.robots.model import Robot

STANDARD_GRAVITY: Final = 9.80665
"""m/s²."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkMasses:
    """Masses of the links that joints move, seen with all joints at 0 in the base.

    `mass` (n,) kg, `com` (n, 3) m, `inertia` (n, 3, 3) kg·m² about the centre of mass.
    """

    mass: Floats
    com: Floats
    inertia: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """What the flange carries: kg, centre of mass (3,) m and inertia (3, 3) kg·m² about it, in the flange."""

    mass: float
    com: Floats
    inertia: Floats


class Dynamics:
    """A robot whose masses are known, with a load. `gravity` (3,) m/s² is that of the base."""

    def __init__(self, robot: Robot, load: Load | None, gravity: Floats) -> None:
        assert robot.masses is not None, "asked only where masses are known"
        import pinocchio as pin

        self._pin: Any = pin
        self._gravity = gravity
        self._model: Any = pin.Model()
        q = np.zeros(robot.joint_count)
        X, J = robot.fk(q), robot.jacobian(q)
        origin = np.zeros(3)
        parent = 0
        for i in range(robot.joint_count):
            axis, moved = J[3:, i], J[:3, i]
            if robot.prismatic[i]:
                point, joint = origin, pin.JointModelPrismaticUnaligned(moved)
            else:  # the point of the axis that is nearest to the flange
                point, joint = X[:3, 3] - np.cross(moved, axis), pin.JointModelRevoluteUnaligned(axis)
            place = pin.SE3(np.eye(3), point - origin)
            parent = self._model.addJoint(parent, joint, place, f"J{i + 1}")
            masses = robot.masses
            body = pin.Inertia(float(masses.mass[i]), masses.com[i] - point, masses.inertia[i])
            self._model.appendBodyToJoint(parent, body, pin.SE3.Identity())
            origin = point
        if load is not None and load.mass > 0.0:
            R = X[:3, :3]
            body = pin.Inertia(load.mass, X[:3, 3] + R @ load.com - origin, R @ load.inertia @ R.T)
            self._model.appendBodyToJoint(parent, body, pin.SE3.Identity())
        self._data: Any = self._model.createData()

    def torques(self, q: Floats, speed: Floats, second: Floats, base: Floats) -> Floats:
        """(N, n) N·m (N at slides) at joints, speeds, accelerations (N, n); `base` (N, 3) accelerates."""
        result = np.empty_like(q)
        rnea, model, data = self._pin.rnea, self._model, self._data
        for row in range(len(q)):
            model.gravity.linear = self._gravity - base[row]
            result[row] = rnea(model, data, q[row], speed[row], second[row])
        return result
