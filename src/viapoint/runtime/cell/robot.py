"""The robot of a cell: which it is, its limits, home position, auxiliary axes and drives."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell.checking import Checker, joint_units
from viapoint.runtime.cell.model import AuxiliaryAxis, Drives, Floats, PathLimits
from viapoint.runtime.documents import Fault, Key
from viapoint.runtime.robots import JointLimits, Robot, RobotError, load_robot
from viapoint.runtime.robots.library import JERK_PER_ACCELERATION, coupling_matrix, coupling_pair

if TYPE_CHECKING:
    from viapoint.runtime.cell.schema import (
        AuxiliaryAxisSection,
        CellFile,
        DrivesSection,
        JointSection,
        PathSection,
    )

_AXIS = re.compile(r"E([1-9])")


def build_robot(check: Checker, file: CellFile) -> Robot | None:
    """The robot under the cell's limits; None, with faults, where there is no such robot."""
    robot = _load(check, file.robot.model)
    if robot is None:
        return None
    if file.body is not None:
        radius = file.body.radius_mm
        robot = replace(robot, body_radius=check.per_joint(("body", "radius_mm"), radius, robot) * MM)
    if file.drives.coupling:
        robot = replace(robot, coupling=_coupling(check, file.drives.coupling, robot))
    return robot.with_limits(_limits(check, file.limits.joints, robot))


def _load(check: Checker, model: str) -> Robot | None:
    is_path = "/" in model or model.endswith((".toml", ".urdf"))
    try:
        return load_robot(Path(check.document.name).parent / model if is_path else model)
    except RobotError as error:
        for each in error.diagnostics:
            if each.file is None:  # no such robot: what is wrong stands in the cell
                check.fault(Fault.REFERENCE, ("robot", "model"), each.message, each.hint)
            else:
                check.found.append((Fault.UNREADABLE, ("robot", "model"), each))
    return None


def _limits(check: Checker, section: JointSection, robot: Robot) -> JointLimits:
    """The robot's own limits where the cell gives none."""
    limits, units = robot.limits, joint_units(robot)
    key: Key = ("limits", "joints")
    lower, upper = limits.lower, limits.upper
    if section.range_deg is not None:
        low = check.per_joint((*key, "range_deg"), [low for low, _ in section.range_deg], robot) * units
        if len(section.range_deg) == robot.joint_count:
            lower, upper = low, np.array([high for _, high in section.range_deg]) * units
        for i in np.flatnonzero(lower >= upper).tolist():
            check.fault(Fault.CONTRADICTION, (*key, "range_deg", i), f"the range of J{i + 1} is empty")
    given = {
        "speed_deg_s": limits.speed,
        "acceleration_deg_s2": limits.acceleration,
        "jerk_deg_s3": limits.jerk,
    }
    for name in given:
        values = getattr(section, name)
        if values is not None:
            given[name] = check.per_joint((*key, name), values, robot) * units
    speed, acceleration, jerk = given.values()
    return JointLimits(lower, upper, speed, acceleration, jerk)


def path_limits(section: PathSection) -> PathLimits:
    """Deceleration defaults to acceleration, jerk to ten times it."""
    acceleration, turning = section.acceleration_mm_s2, section.angular_acceleration_deg_s2
    deceleration, jerk, twisting = section.deceleration_mm_s2, section.jerk_mm_s3, section.angular_jerk_deg_s3
    return PathLimits(
        speed=section.speed_mm_s * MM,
        acceleration=acceleration * MM,
        deceleration=(acceleration if deceleration is None else deceleration) * MM,
        jerk=(JERK_PER_ACCELERATION * acceleration if jerk is None else jerk) * MM,
        angular_speed=section.angular_speed_deg_s * DEG,
        angular_acceleration=turning * DEG,
        angular_jerk=(JERK_PER_ACCELERATION * turning if twisting is None else twisting) * DEG,
    )


def build_home(check: Checker, file: CellFile, robot: Robot) -> Floats:
    """(n,) zero of every joint, unless the cell says otherwise."""
    home = file.robot.home
    return check.joints(("robot", "home"), [0.0] * robot.joint_count if home is None else home, robot)


def _coupling(check: Checker, coefficients: dict[str, float], robot: Robot) -> Floats:
    good: dict[str, float] = {}
    for key, coefficient in coefficients.items():
        pair = coupling_pair(key, robot.joint_count)
        if pair is None or pair[0] == pair[1]:
            path: Key = ("drives", "coupling", key)
            check.fault(
                Fault.UNKNOWN_KEY,
                path,
                f"unknown key drives.coupling.{key}",
                "write J4_J5 for what J4 adds to J5",
            )
        else:
            good[key] = coefficient
    return coupling_matrix(good, robot.joint_count)


def build_drives(check: Checker, file: CellFile, robot: Robot) -> Drives:
    """Per joint; what is left out stays None for auto-tuning."""
    section: DrivesSection = file.drives

    def values(name: str, unit: Floats | float = 1.0) -> Floats | None:
        given = getattr(section, name)
        return None if given is None else check.per_joint(("drives", name), given, robot, one=True) * unit

    def needed(name: str, unit: Floats | float = 1.0) -> Floats:
        return check.per_joint(("drives", name), getattr(section, name), robot, one=True) * unit

    torque = file.limits.joints.torque_nm
    units = joint_units(robot)
    return Drives(
        kind=section.kind,
        gear=values("gear"),
        direction=needed("direction"),
        homing_offset=needed("homing_offset_deg", units),
        encoder_counts=values("encoder_counts"),
        following_error=needed("following_error_deg", units),
        in_position=needed("in_position_deg", units),
        torque=None if torque is None else check.per_joint(("limits", "joints", "torque_nm"), torque, robot),
    )


def build_auxiliary(check: Checker, file: CellFile) -> dict[int, AuxiliaryAxis]:
    """By number: E1 is 1."""
    axes: dict[int, AuxiliaryAxis] = {}
    for name, section in file.auxiliary_axes.items():
        found = _AXIS.fullmatch(name)
        key: Key = ("auxiliary_axes", name)
        if found is None:
            check.fault(
                Fault.UNKNOWN_KEY, key, f"unknown key auxiliary_axes.{name}", "auxiliary axes are E1 … E9"
            )
            continue
        if section.range[0] >= section.range[1]:
            check.fault(Fault.CONTRADICTION, (*key, "range"), f"the range of {name} is empty")
        if section.carries_robot and section.kind != "linear":
            check.fault(
                Fault.CONTRADICTION, (*key, "carries_robot"), f"{name} is not linear: it cannot carry"
            )
        elif section.carries_robot and any(axis.carries_robot for axis in axes.values()):
            check.fault(Fault.CONTRADICTION, (*key, "carries_robot"), "only one axis can carry the robot")
        axes[int(found[1])] = _auxiliary_axis(int(found[1]), section)
    return axes


def _auxiliary_axis(number: int, section: AuxiliaryAxisSection) -> AuxiliaryAxis:
    unit = MM if section.kind == "linear" else DEG
    jerk = JERK_PER_ACCELERATION * section.acceleration if section.jerk is None else section.jerk
    return AuxiliaryAxis(
        number=number,
        prismatic=section.kind == "linear",
        carries_robot=section.carries_robot,
        lower=section.range[0] * unit,
        upper=section.range[1] * unit,
        speed=section.speed * unit,
        acceleration=section.acceleration * unit,
        jerk=jerk * unit,
    )
