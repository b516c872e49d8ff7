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


def _chain(pin: Any, robot: Robot) -> tuple[Any, Floats]:
    """The joints of a robot without bodies, and a point of each axis (n, 3), all joints at 0 in the base."""
    model: Any = pin.Model()
    q = np.zeros(robot.joint_count)
    X, J = robot.fk(q), robot.jacobian(q)
    points = np.zeros((robot.joint_count, 3))
    origin, parent = np.zeros(3), 0
    for i in range(robot.joint_count):
        axis, moved = J[3:, i], J[:3, i]
        if robot.prismatic[i]:
            point, joint = origin, pin.JointModelPrismaticUnaligned(moved)
        else:  # the point of the axis that is nearest to the flange
            point, joint = X[:3, 3] - np.cross(moved, axis), pin.JointModelRevoluteUnaligned(axis)
        place = pin.SE3(np.eye(3), point - origin)
        parent = model.addJoint(parent, joint, place, f"J{i + 1}")
        points[i] = origin = point
    return model, points


class Dynamics:
    """A robot whose masses are known, with a load. `gravity` (3,) m/s² is that of the base."""

    def __init__(self, robot: Robot, load: Load | None, gravity: Floats) -> None:
        masses = robot.masses
        assert masses is not None, "asked only where masses are known"
        import pinocchio as pin

        self._pin: Any = pin
        self._gravity = gravity
        self._model, points = _chain(pin, robot)
        for i, point in enumerate(points):
            body = pin.Inertia(float(masses.mass[i]), masses.com[i] - point, masses.inertia[i])
            self._model.appendBodyToJoint(i + 1, body, pin.SE3.Identity())
        if load is not None and load.mass > 0.0:
            X = robot.fk(np.zeros(robot.joint_count))
            R = X[:3, :3]
            body = pin.Inertia(load.mass, X[:3, 3] + R @ load.com - points[-1], R @ load.inertia @ R.T)
            self._model.appendBodyToJoint(robot.joint_count, body, pin.SE3.Identity())
        self._data: Any = self._model.createData()

    def torques(self, q: Floats, speed: Floats, second: Floats, base: Floats) -> Floats:
        """(N, n) N·m (N at slides) at joints, speeds, accelerations (N, n); `base` (N, 3) accelerates."""
        result = np.empty_like(q)
        rnea, model, data = self._pin.rnea, self._model, self._data
        for row in range(len(q)):
            model.gravity.linear = self._gravity - base[row]
            result[row] = rnea(model, data, q[row], speed[row], second[row])
        return result


class Regressor:
    """What the parameters of an arm's links are multiplied by in its torques, which are linear in them.

    They are ten per link: its mass, first moments x y z, and inertia xx xy yy xz yz zz about a point of its
    axis, the nearest to the flange; with all joints at 0, along the axes of the base. No masses are needed.
    """

    def __init__(self, robot: Robot, gravity: Floats) -> None:
        import pinocchio as pin

        self._pin: Any = pin
        self._gravity = gravity
        self._model, _ = _chain(pin, robot)
        self._data: Any = self._model.createData()

    def rows(self, q: Floats, speed: Floats, second: Floats, base: Floats) -> Floats:
        """(N, n, 10 n) at joints, speeds, accelerations (N, n); `base` (N, 3) m/s² accelerates."""
        n = q.shape[1]
        result = np.empty((len(q), n, 10 * n))
        regressor, model, data = self._pin.computeJointTorqueRegressor, self._model, self._data
        for row in range(len(q)):
            model.gravity.linear = self._gravity - base[row]
            result[row] = regressor(model, data, q[row], speed[row], second[row])
        return result
