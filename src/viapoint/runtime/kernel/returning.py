"""The joint move to a place: back to where a robot left its path, or to where it begins. No state."""

from __future__ import annotations

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.records import Floats
from viapoint.vm.ports import Motion, MotionKind, Speed, Target


def joint_move(cell: Cell, q: Floats, e: Floats, *, line: int, tool: int, speed: Speed | None) -> Motion:
    """To joints q (n,) and auxiliary axes e (k,), where it ends at rest."""
    axes = AuxiliaryAxes.of(cell)
    joints = q / np.where(cell.robot.prismatic, MM, DEG)
    numbers = [axis.number for axis in axes.axes]
    return Motion(
        line=line,
        kind=MotionKind.JOINT,
        target=Target(
            joints=tuple(enumerate(joints.tolist(), start=1)),
            auxiliary=tuple(zip(numbers, (e / axes.units).tolist(), strict=True)),
        ),
        speed=speed,
        tool=tool,
        round_edge=0.0,
    )
