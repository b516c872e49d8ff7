"""What a recording or a picture says about its run besides the ticks, from the cell and the program."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel import AuxiliaryAxes
from viapoint.runtime.recording import PRISMATIC, REVOLUTE, Axis, RunInfo
from viapoint.runtime.robots import JointLimits
from viapoint.runtime.signals import Scenario
from viapoint.session import Loaded


def run_info(
    cell: Cell,
    program: Loaded,
    command_line: str,
    versions: Mapping[str, str],
    scenario: Scenario | None = None,
) -> RunInfo:
    """Names without their folders, so that the same run is told alike wherever it was made."""
    others = AuxiliaryAxes.of(cell)
    joints = enumerate(cell.robot.prismatic.tolist())
    return RunInfo(
        program_name=Path(program.source.name).name,
        program_source=program.source.text,
        cell_name=Path(cell.source.name).name,
        cell_text=cell.source.text,
        scenario_text=None if scenario is None else scenario.source.text,
        robot=cell.robot.name,
        tick_s=cell.tick,
        axes=tuple(_axis(f"J{i + 1}", prismatic, cell.robot.limits, i) for i, prismatic in joints),
        auxiliary=tuple(
            _axis(others.name(i), other.prismatic, others.limits, i) for i, other in enumerate(others.axes)
        ),
        path_speed=cell.path_limits.speed,
        seed=0 if scenario is None else scenario.seed,
        command_line=command_line,
        versions=versions,
    )


def _axis(name: str, prismatic: bool, limits: JointLimits, i: int) -> Axis:
    return Axis(
        name=name,
        kind=PRISMATIC if prismatic else REVOLUTE,
        lower=float(limits.lower[i]),
        upper=float(limits.upper[i]),
        speed=float(limits.speed[i]),
        acceleration=float(limits.acceleration[i]),
        jerk=float(limits.jerk[i]),
    )
