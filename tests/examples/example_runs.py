"""Runs of the examples, once each, with all that came out of them; what the tests beside this look at."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt

from viapoint.report import run_report
from viapoint.runtime.cell import Cell, load_cell
from viapoint.runtime.kernel.buffer import MotionBuffer
from viapoint.runtime.signals import load_scenario
from viapoint.session import Session, compile_file
from viapoint.vm.ports import Call, Motion

Floats = npt.NDArray[np.float64]
EXAMPLES = Path(__file__).parents[2] / "examples"


@dataclass(frozen=True)
class Example:
    """An entry of examples/manifest.toml; file names count from the folder examples."""

    program: str
    cell: str
    status: str
    scenario: str | None = None
    cycles: int | None = None
    error: tuple[str, int] | None = None

    @property
    def name(self) -> str:
        """Short and unique: the program's file name."""
        return Path(self.program).stem

    @property
    def options(self) -> list[str]:
        """Of `viapoint run`."""
        words = ["--cell", self.cell]
        words += [] if self.scenario is None else ["--scenario", self.scenario]
        return words + ([] if self.cycles is None else ["--cycles", str(self.cycles)])


def _entry(table: dict[str, Any]) -> Example:
    error = table.pop("error", None)
    return Example(**table, error=None if error is None else (error["code"], error["line"]))


_TABLES = tomllib.loads((EXAMPLES / "manifest.toml").read_text())
MANIFEST = tuple(_entry(t) for t in _TABLES["example"])
STATIONS: tuple[dict[str, Any], ...] = tuple(_TABLES["station"])
"""Cells of several robots, with their programs and scenarios."""


@dataclass(frozen=True)
class Run:
    """A run that is over: its session, the calls its program made in order, and its set points.

    What subroutines do that interrupt the program is not among the calls.
    """

    session: Session
    calls: tuple[Call, ...]
    ticks: npt.NDArray[np.int64]
    joints: Floats
    """(N, 6) rad, one row a tick from tick 0 on."""

    @property
    def cell(self) -> Cell:
        return self.session.cell

    @property
    def report(self) -> dict[str, Any]:
        return run_report(self.session, [])

    @property
    def events(self) -> list[tuple[Any, ...]]:
        """As they can be compared: numbers apart."""
        return [(e.tick, e.line, e.kind, dict(e.data)) for e in self.session.events]

    def interrupts(self) -> list[tuple[int, int]]:
        """Ticks in which subroutines that interrupt began, and in which the robot was back."""
        told = [
            e.tick for e in self.session.events if e.kind == "interrupt" and e.data["action"] != "triggered"
        ]
        return list(zip(told[::2], told[1::2], strict=True))

    def motions(self) -> dict[int, Motion]:
        """By their number in the motion buffer."""
        return {number: call for number, call in enumerate(self.calls) if isinstance(call, Motion)}


@cache
def run(example: Example, *, window: int = 1024, max_time: float | None = None) -> Run:
    """Run it in this process; windows of so many ticks."""
    return run_program(EXAMPLES / example.program, example, window=window, max_time=max_time)


def run_program(path: Path, example: Example, *, window: int = 1024, max_time: float | None = None) -> Run:
    """Run the program at `path` with the cell, scenario and options of `example`."""
    cell = load_cell(EXAMPLES / example.cell)
    scenario = None if example.scenario is None else load_scenario(EXAMPLES / example.scenario, cell)
    program = compile_file(path, cell)
    session = Session(
        cell, program, scenario=scenario, window=window, max_time=max_time, cycles=example.cycles
    )
    calls: list[Call] = []
    put, own = MotionBuffer.put, session.kernel.dialogue

    def recorded(buffer: MotionBuffer, call: Call) -> bool:
        accepted = put(buffer, call)
        if accepted and session.kernel.dialogue is own:
            calls.append(call)
        return accepted

    with patch.object(MotionBuffer, "put", recorded):
        windows = list(session.run())
    ticks = np.concatenate([np.arange(len(w)) + w.first_tick for w in windows])
    return Run(session, tuple(calls), ticks, np.concatenate([w.joints for w in windows]))
