"""Cells of two robots, and runs of them with everything that happened."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from viapoint.runtime.cell import Cell, parse_cells
from viapoint.runtime.records import Floats
from viapoint.runtime.signals import parse_scenario
from viapoint.session import compile_text
from viapoint.station import Station

FACING = """
[[robots]]
name = "left"
[robots.robot]
model = "frigeni6"
home = [40, 0, 0, 0, 0, 0]
[[robots]]
name = "right"
[robots.robot]
model = "frigeni6"
zero_frame = { xyz = [4200, 0, 0], abc = [0, 0, 180] }
home = [40, 0, 0, 0, 0, 0]
"""
"""Two alike, 4.2 m apart, face to face."""

Happening = tuple[int, int, int, str, tuple[tuple[str, Any], ...]]


@dataclass(frozen=True)
class StationRun:
    """A finished run: the station, joints (ticks + 1, n) per robot, and the events as plain tuples."""

    station: Station
    joints: tuple[Floats, ...]

    @property
    def history(self) -> list[Happening]:
        return [
            (e.tick, e.robot, e.line, e.kind, tuple(_rounded(e.data).items())) for e in self.station.events
        ]

    @property
    def failures(self) -> dict[int, str]:
        return {s.cell.number: f"{f.code} {f.line} {f.message}" for s, f in self.station.failures}

    def ticks_of(self, kind: str, robot: int, **data: Any) -> list[int]:
        """In which ticks a robot had such events."""
        return [
            e.tick
            for e in self.station.events
            if e.kind == kind and e.robot == robot and all(e.data.get(k) == v for k, v in data.items())
        ]


def _rounded(data: Any) -> dict[str, Any]:
    return {k: round(v, 6) if isinstance(v, float) else v for k, v in data.items()}


def cells(text: str = FACING) -> tuple[Cell, ...]:
    return parse_cells(text, "cell.toml")


def run(
    *programs: str, cell: str = FACING, scenario: str | None = None, window: int = 1024, **options: Any
) -> StationRun:
    robots = cells(cell)
    loaded = [
        compile_text(text, f"{k}.via", each)
        for k, (text, each) in enumerate(zip(programs, robots, strict=True))
    ]
    happenings = None if scenario is None else parse_scenario(scenario, robots[0])
    station = Station(robots, loaded, scenario=happenings, window=window, **{"max_time": 60.0, **options})
    parts: list[list[Floats]] = [[] for _ in robots]
    for windows in station.run():
        lengths = {sum(len(window) for window in each) for each in windows}
        assert len(lengths) == 1, "all robots pass the same ticks"
        for part, each in zip(parts, windows, strict=True):
            part += [window.joints for window in each]
    return StationRun(station, tuple(np.concatenate(part) for part in parts))
