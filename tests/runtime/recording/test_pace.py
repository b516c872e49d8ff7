"""The speed along the path: its bounds bound it, and what holds it back is what the set points show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viapoint.runtime.cell import Cell, parse_cell
from viapoint.runtime.kernel import AuxiliaryAxes
from viapoint.runtime.pictures import draw_run
from viapoint.runtime.pictures.pace import NOTHING, Pace
from viapoint.runtime.recording import REVOLUTE, Axis, Recorder, RunInfo, join, load_recording
from viapoint.runtime.records import Event, Window
from viapoint.session import Session, compile_text

CELL = '[robot]\nmodel = "frigeni6"\n'
SINGULAR = "MJ J4=5 J5=5 F100\nML Z=2200 F300\n"
MIXED = """MJ J5=40 J1=10 F80
ML Z=2200 F300 R40
ML Y=-200 FC700 R40
ML A=60 B=70 FA40
WAIT 0.2
MJ J1=-30 F200
ML X=1500 Y=-200 Z=2100 A=0 B=60 C=0 F800
MC X=1500 Y=200 QX=1600 QY=0 QZ=2100 F500 R30
HOME F50
"""


def info_of(cell: Cell, program: str) -> RunInfo:
    limits = cell.robot.limits
    columns = ("lower", "upper", "speed", "acceleration", "jerk")
    axes = tuple(
        Axis(name=f"J{i + 1}", kind=REVOLUTE, **{name: float(getattr(limits, name)[i]) for name in columns})
        for i in range(cell.robot.joint_count)
    )
    return RunInfo(program_name="part.via", program_source=program, tick_s=cell.tick, axes=axes)


def run(text: str, override: float = 1.0) -> tuple[RunInfo, Window, list[Event]]:
    cell = parse_cell(CELL)
    assert len(AuxiliaryAxes.of(cell)) == 0
    session = Session(cell, compile_text(text, cell=cell), override=override)
    paces: list[Event] = []
    session.kernel.execution.blocks.paced = paces.append
    windows = list(session.run())
    assert session.failure is None
    return info_of(cell, text), join(windows), sorted([*session.events, *paces], key=lambda each: each.tick)


@pytest.mark.parametrize("override", [1.0, 0.4])
def test_no_tick_is_faster_than_its_bounds(override: float) -> None:
    pace = Pace.of(*run(MIXED, override))
    for bound in (pace.programmed, pace.axes):
        known = np.isfinite(bound)
        assert known.sum() > 1000
        assert np.all(pace.speed[known] <= bound[known] * (1.0 + 1e-3) + 1e-3)


def test_where_the_programmed_speed_holds_it_is_reached() -> None:
    pace = Pace.of(*run(MIXED))
    held = (pace.limiter == pace.names.index("programmed speed")) & np.isfinite(pace.programmed)
    assert held.sum() > 1000
    assert np.median(pace.speed[held] / pace.programmed[held]) > 0.99


def test_every_moving_tick_has_a_name() -> None:
    info, trace, events = run(MIXED)
    pace = Pace.of(info, trace, events)
    moving = np.abs(np.diff(trace.joints, axis=0, prepend=trace.joints[:1])).max(axis=1) > 1e-6
    assert np.mean(pace.limiter[moving] == pace.names.index(NOTHING)) < 0.05
    for event in events:
        if event.kind == "pace":
            seconds = [float(part.rpartition(" ")[2]) for part in str(event.data["limits"]).split(", ")]
            assert sum(seconds) == pytest.approx(event.data["t_end"] - event.t, abs=1e-4)


def test_a_dip_is_that_of_the_joint_that_turns() -> None:
    info, trace, events = run(SINGULAR)
    pace = Pace.of(info, trace, events)
    middle = (pace.s > 80.0) & (pace.s < 400.0)
    slowest = int(np.argmin(np.where(middle, pace.speed, np.inf)))
    assert pace.names[pace.limiter[slowest]] == "J4"
    assert pace.axes[slowest] == pytest.approx(pace.speed[slowest], rel=0.01)
    assert pace.programmed[slowest] == pytest.approx(300.0, rel=1e-6)


def test_blocks_end_where_their_lines_do() -> None:
    info, trace, events = run(MIXED)
    pace = Pace.of(info, trace, events)
    assert list(pace.lines) == [1, 2, 3, 4, 6, 7, 8, 9]
    for end, line in zip(pace.ends, pace.lines, strict=True):
        last = int(np.flatnonzero(trace.line == line)[-1])
        assert pace.s[last] == pytest.approx(end, abs=1.0)


def test_a_recording_draws_what_the_run_does(tmp_path: Path) -> None:
    info, trace, events = run(SINGULAR)
    with Recorder(tmp_path / "run.mcap", info) as recorder:
        for event in events:
            recorder.event(event)
        recorder.window(trace)
    recorded = load_recording(tmp_path / "run.mcap")
    mine, read = (Pace.of(i, t, e) for i, t, e in (
        (info, trace, events), (recorded.info, recorded.trace, recorded.paces)))  # fmt: skip
    np.testing.assert_array_equal(mine.limiter, read.limiter)
    np.testing.assert_allclose(mine.programmed, read.programmed)
    draw_run(recorded.info, recorded.trace, [*recorded.events, *recorded.paces], tmp_path / "run.svg")
    text = (tmp_path / "run.svg").read_text()
    for label in ("what holds it back", "programmed speed", "J4  ", "path  s  [mm]"):
        assert label in text
