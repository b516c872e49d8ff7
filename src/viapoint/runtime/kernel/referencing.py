"""Where the axes stand, as their encoders read: values by the names of axes, in deg and mm."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.breaks import Start


def referenced(cell: Cell, here: Start, axes: Mapping[str, float]) -> Start:
    """`here` with the named axes (J1…, E1…) at other values, deg or mm; the others stay.

    Raises ValueError for no axis at all, one that the robot has not, and a value that is no finite number.
    """
    others = AuxiliaryAxes.of(cell)
    robot = cell.robot
    units = {f"J{i + 1}": MM if robot.prismatic[i] else DEG for i in range(robot.joint_count)}
    units |= {others.name(k): float(unit) for k, unit in enumerate(others.units)}
    if not axes:
        raise ValueError(f"name the axes and where they stand: {', '.join(units)}")
    values = dict(zip(units, np.concatenate((here.joints, here.auxiliary)).tolist(), strict=True))
    for name, value in axes.items():
        if name not in units:
            raise ValueError(f"the robot has no axis {name}: it has {', '.join(units)}")
        if isinstance(value, bool) or not abs(value) <= sys.float_info.max:
            raise ValueError(f"{name} = {value} is no finite number")
        values[name] = float(value) * units[name]
    every = np.array(list(values.values()))
    return replace(here, joints=every[: robot.joint_count], auxiliary=every[robot.joint_count :])


def out_of_range(cell: Cell, there: Start) -> str | None:
    """Which axis would stand outside its range; None if none would."""
    others, robot = AuxiliaryAxes.of(cell), cell.robot
    for i in np.flatnonzero(~robot.limits.contain(there.joints)):
        unit, name = (MM, "mm") if robot.prismatic[i] else (DEG, "deg")
        low, high = robot.limits.lower[i] / unit, robot.limits.upper[i] / unit
        value = there.joints[i] / unit
        return f"J{i + 1} = {value:.1f} {name} is outside its range {low:g}…{high:g} {name}"
    for k in np.flatnonzero(~others.limits.contain(there.auxiliary)) if len(others) else ():
        return others.out_of_range(int(k), float(there.auxiliary[k]), 0).message
    return None
