"""What a recording says about its run besides the ticks: program, cell, axes and their limits. Data only."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

REVOLUTE, PRISMATIC = "revolute", "prismatic"


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """One joint, or auxiliary axis, with its limits, rad or m and their derivatives in s."""

    name: str
    kind: str  # REVOLUTE or PRISMATIC
    lower: float
    upper: float
    speed: float
    acceleration: float
    jerk: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RunInfo:
    """Everything a recording states before its first tick."""

    program_name: str
    program_source: str
    cell_name: str = ""
    cell_text: str = ""
    scenario_text: str | None = None
    robot: str = ""
    tick_s: float
    axes: tuple[Axis, ...]
    auxiliary: tuple[Axis, ...] = ()
    path_speed: float = 0.0  # m/s, limit of the TCP; 0: not stated
    seed: int = 0
    command_line: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)

    def to_metadata(self) -> dict[str, str]:
        """As MCAP metadata: text values only; the texts of program, cell and scenario are attachments."""
        return {
            "program": self.program_name,
            "cell": self.cell_name,
            "robot": self.robot,
            "tick_s": repr(self.tick_s),
            "path_speed": repr(self.path_speed),
            "seed": str(self.seed),
            "command_line": self.command_line,
            "axes": json.dumps([_plain(axis) for axis in self.axes]),
            "auxiliary": json.dumps([_plain(axis) for axis in self.auxiliary]),
            "versions": json.dumps(dict(self.versions), sort_keys=True),
        }

    @staticmethod
    def from_metadata(entries: Mapping[str, str], texts: Mapping[str, str | None]) -> RunInfo:
        """The inverse of `to_metadata`; raises KeyError, TypeError or ValueError on anything else."""
        axes: list[dict[str, Any]] = json.loads(entries["axes"])
        auxiliary: list[dict[str, Any]] = json.loads(entries.get("auxiliary", "[]"))
        return RunInfo(
            program_name=entries["program"],
            program_source=texts.get("program") or "",
            cell_name=entries["cell"],
            cell_text=texts.get("cell") or "",
            scenario_text=texts.get("scenario"),
            robot=entries["robot"],
            tick_s=float(entries["tick_s"]),
            axes=tuple(Axis(**axis) for axis in axes),
            auxiliary=tuple(Axis(**axis) for axis in auxiliary),
            path_speed=float(entries["path_speed"]),
            seed=int(entries["seed"]),
            command_line=entries["command_line"],
            versions=json.loads(entries["versions"]),
        )


_AXIS_FIELDS = tuple(each.name for each in fields(Axis))


def _plain(axis: Axis) -> dict[str, str | float]:
    return {name: getattr(axis, name) for name in _AXIS_FIELDS}


class Skeleton(Protocol):
    """The robot as the scene draws it: `Robot.link_points`."""

    def __call__(self, joints: Floats, /) -> Floats:
        """(N, n) joints in rad or m → (N, k, 3) m: the wire frame from base to flange, in the base frame."""
        ...
