"""Moves by hand from where a robot stands: of an axis, or of the TCP along base, frame or tool. Pure.

A jog by an increment is a statement of the language, so that limits, reach and zones hold for it as for any
other. A jog that is held is a demand on the kernel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, unique
from typing import Final, Protocol

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel import AuxiliaryAxes, Demand, Kernel
from viapoint.runtime.records import Floats
from viapoint.runtime.rotations import invert_pose, matrix_to_abc, rotation_vector_to_matrix

SPEEDS: Final = {"J": 20.0, "E": 20.0, "XYZ": 50.0, "ABC": 10.0}
"""F where none is said: deg/s, deg/s, mm/s, deg/s; a tenth or less of what robots can."""

COORDINATES: Final = "XYZABC"


@unique
class JogSpace(Enum):
    """Along whose axes a jog goes."""

    BASE = "base"
    FRAME = "frame"
    TOOL = "tool"
    JOINT = "joint"  # and auxiliary axes


@dataclass(frozen=True, slots=True)
class Jog:
    """An increment `by` (mm or deg) of an axis of a space, at a speed (mm/s or deg/s; None: of `SPEEDS`).

    Axes are X Y Z (mm) and A B C (deg about X Y Z), or J1… and E1… in joint space. `frame` is
    one of the cell's.
    """

    axis: str
    by: float
    space: JogSpace = JogSpace.BASE
    frame: int = 0
    speed: float | None = None


@dataclass(frozen=True, slots=True)
class HeldJog:
    """On along an axis of a space for as long as it is held, at a speed (mm/s or deg/s; None: of `SPEEDS`).

    `direction` is 1 or −1. `seconds` of the robot's time after which it is let go; None: when it is let go.
    Axes as in `Jog`.
    """

    axis: str
    direction: int
    space: JogSpace = JogSpace.BASE
    frame: int = 0
    speed: float | None = None
    seconds: float | None = None


class JogError(ValueError):
    """A jog of something the robot has not, or by no number."""


class Standing(Protocol):
    """A robot that stands somewhere."""

    cell: Cell
    kernel: Kernel

    @property
    def pose(self) -> Floats:
        """X_base_tcp (4, 4)."""

    def frame(self, index: int) -> Floats:
        """X_base_frame (4, 4). Raises KeyError."""


def statement(robot: Standing, jog: Jog) -> str:
    """The motion from where the robot stands. Raises JogError."""
    if not math.isfinite(jog.by):
        raise JogError(f"an increment of {jog.by!r} is not a number in mm or deg")
    _require(robot, jog)
    return _axis_move(robot, jog) if jog.space is JogSpace.JOINT else _line(robot, jog)


def demand(robot: Standing, held: HeldJog) -> Demand:
    """What the kernel is asked for while a jog is held. Raises JogError."""
    if held.direction not in (1, -1):
        raise JogError(f"a direction of {held.direction!r} is neither 1 nor -1")
    if held.seconds is not None and not (math.isfinite(held.seconds) and held.seconds > 0.0):
        raise JogError(f"a jog cannot be held for {held.seconds!r} s")
    _require(robot, held)
    sign = "+" if held.direction > 0 else "-"
    if held.space is JogSpace.JOINT:
        return _axis_demand(robot, held, f"{held.axis}{sign}")
    k = COORDINATES.index(held.axis)
    rates = np.zeros(6)
    speed = SPEEDS["ABC" if k >= 3 else "XYZ"] if held.speed is None else held.speed
    rates[k] = held.direction * speed * (DEG if k >= 3 else MM)
    space = f"frame {held.frame}" if held.space is JogSpace.FRAME else held.space.value
    R = None if held.space is JogSpace.TOOL else _axes(robot, held, robot.pose)
    return Demand(f"{space} {held.axis}{sign}", rates, R=R)


def _axis_demand(robot: Standing, held: HeldJog, name: str) -> Demand:
    prismatic, others = robot.cell.robot.prismatic, AuxiliaryAxes.of(robot.cell)
    units = np.append(np.where(prismatic, MM, DEG), others.units)
    names = [f"J{i + 1}" for i in range(len(prismatic))] + [others.name(k) for k in range(len(others))]
    if held.axis not in names:
        raise _no_axis(held.axis, len(prismatic))
    k = names.index(held.axis)
    rates = np.zeros(len(names))
    speed = SPEEDS[held.axis[0]] if held.speed is None else held.speed
    rates[k] = held.direction * speed * units[k]
    return Demand(name, rates, of_joints=True)


def _no_axis(axis: str, joints: int) -> JogError:
    if axis.startswith("E"):
        return JogError(f"the cell has no axis {axis}")
    return JogError(f"the robot has no {axis}: its last joint is J{joints}")


def _require(robot: Standing, jog: Jog | HeldJog) -> None:
    """Raises JogError where speed, axis or frame are none."""
    if jog.speed is not None and not (math.isfinite(jog.speed) and jog.speed > 0.0):
        raise JogError(f"a speed of {jog.speed!r} is not above 0")
    if jog.space is JogSpace.JOINT:
        return
    if len(jog.axis) != 1 or jog.axis not in COORDINATES:
        raise JogError(f"the {jog.space.value} has no axis {jog.axis}: X, Y, Z, A, B or C")
    if jog.space is JogSpace.FRAME and jog.frame not in robot.cell.frames:
        known = ", ".join(str(each) for each in sorted(robot.cell.frames))
        raise JogError(f"`{jog.frame}` is no frame of the cell: {known}")


def _axis_move(robot: Standing, jog: Jog) -> str:
    joints = robot.kernel.telemetry.joints / np.where(robot.cell.robot.prismatic, MM, DEG)
    axes = AuxiliaryAxes.of(robot.cell)
    own = {f"J{i + 1}": value for i, value in enumerate(joints.tolist())}
    carried = robot.kernel.telemetry.auxiliary / axes.units
    others = {axes.name(k): float(carried[k]) for k in range(len(axes))}
    if jog.axis in own:
        return f"MJ {jog.axis}={_exact(own[jog.axis] + jog.by)} {_speed(jog, 'J')}\n"
    if jog.axis in others:
        goal = _exact(others[jog.axis] + jog.by)
        return f"MJ J1={_exact(own['J1'])} {jog.axis}={goal} {_speed(jog, 'E')}\n"
    raise _no_axis(jog.axis, len(own))


def _line(robot: Standing, jog: Jog) -> str:
    k = COORDINATES.index(jog.axis)
    turns = k >= 3
    X_base_tcp = robot.pose
    direction = _axes(robot, jog, X_base_tcp)[:, k % 3]
    target = X_base_tcp.copy()
    if turns:
        target[:3, :3] = rotation_vector_to_matrix(direction * jog.by * DEG) @ X_base_tcp[:3, :3]
    else:
        target[:3, 3] += direction * (jog.by * MM)
    X_frame_target = invert_pose(robot.frame(0)) @ target
    there = (X_frame_target[:3, 3] / MM).tolist()
    if turns:
        there += (matrix_to_abc(X_frame_target[:3, :3]) / DEG).tolist()
    where = " ".join(f"{name}={_exact(v)}" for name, v in zip(COORDINATES, there, strict=False))
    return f"ML {where} {_speed(jog, 'ABC' if turns else 'XYZ')}\n"


def _axes(robot: Standing, jog: Jog | HeldJog, X_base_tcp: Floats) -> Floats:
    """R_base_space (3, 3)."""
    if jog.space is JogSpace.TOOL:
        return np.asarray(X_base_tcp[:3, :3])
    return np.asarray(robot.frame(jog.frame)[:3, :3]) if jog.space is JogSpace.FRAME else np.eye(3)


def _speed(jog: Jog, kind: str) -> str:
    return f"F{_exact(jog.speed or SPEEDS[kind]).rstrip('0').rstrip('.')}"


def _exact(value: float) -> str:
    """A number as a statement can hold it, to a millionth of a micrometre."""
    return f"{value:.9f}"
