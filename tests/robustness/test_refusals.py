"""What cannot be run is refused with a code and a line, after everything before it has been done."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from session_runs import ROUNDING, Run, cell, cell_text, run
from viapoint.runtime.cell import CellError, parse_cell
from viapoint.session import Session, compile_file, compile_text
from viapoint.vm import save

BEFORE = "MJ P1 F90\nML Y=-100 F500 R30\nSET DO1\nML X=1600\n"


def assert_done_before(done: Run) -> None:
    """The statements of BEFORE were executed, and the robot stands at their end."""
    assert [e.line for e in done.events("block")] == [1, 2, 4]
    assert [e.line for e in done.events("output")] == [3]
    assert np.abs(done.column("position")[-1] - [1.6, -0.1, 1.5]).max() < 1e-9
    assert done.column("speed")[-1] < 1e-3
    assert not done.over_limits()


@pytest.mark.parametrize(
    ("statement", "codes"),
    [
        ("ML X=9000", {"E302"}),
        ("MJ X=9000", {"E301"}),
        ("MS X=9000", {"E302"}),
        ("ML X=-1600 Y=0", {"E302", "E303", "E304"}),
        ("MJ J2=151", {"E303"}),
        ("MJ J4=-350.001", {"E303"}),
        ("ML A=0 B=-60 C=0", {"E302", "E303"}),
        ("MC X=1700 QX=1650 QY=-100 QZ=1500", {"E306"}),
        ("MC X=1600 QX=1650 QY=-50 QZ=1500", {"E306"}),
        ("MC X=1700 QX=1600 QY=-100 QZ=1500", {"E306"}),
    ],
)
def test_a_motion_that_cannot_be_run(statement: str, codes: set[str]) -> None:
    done = run(f"{BEFORE}{statement} R50\nHOME\n")
    assert (done.status, done.failed_line) == ("error", 5)
    assert done.code in codes
    assert_done_before(done)


def test_a_circle_through_one_point() -> None:
    """Start, Q and target are the same numbers to the last bit."""
    done = run("MJ P1 F90\nML P2\nML P3\nMC P3 Q3\n")
    assert (done.status, done.code, done.failed_line) == ("error", "E306", 4)


def test_reach_lost_in_the_middle_of_a_line() -> None:
    """Both ends can be reached; between them the wrist would come too close to the shoulder."""
    ends = "MJ X=500 Y=-900 Z=1086 A=0 B=90 C=0 F90\n"
    assert run(f"{ends}MJ Y=900\n").status == "finished"
    done = run(f"{ends}ML Y=900 F500\n")
    assert (done.status, done.failed_line) == ("error", 2)
    assert done.code in ("E302", "E303")
    assert np.abs(done.column("position")[-1] - [0.5, -0.9, 1.086]).max() < 1e-9


@pytest.mark.parametrize(
    ("statement", "code"),
    [
        ("ML P20", "E310"),
        ("MJ P20", "E310"),
        ("MC P2 Q20", "E310"),
        ("ML P2 Z5", "E312"),
        ("ML P2 T5", "E313"),
        ("T 5", "E313"),
        ("SET DO 30", "E314"),
        ("IF DI30\nENDIF", "E411"),
        ("WAIT DI 30", "E411"),
    ],
)
def test_a_compiled_program_on_a_cell_that_lacks_something(tmp_path: Path, statement: str, code: str) -> None:
    file = tmp_path / "program.viac"
    file.write_bytes(save(compile_text(f"{BEFORE}{statement}\n").program))
    smaller = cell(more="[io]\ndigital_inputs = 8\ndigital_outputs = 8\n")
    session = Session(smaller, compile_file(file))
    done = Run(session, tuple(session.run()))
    assert (done.code, done.failed_line) == (code, 5)
    assert_done_before(done)


@pytest.mark.parametrize("where", ["P1", "end"])
def test_the_first_failure_is_the_one_told(where: str) -> None:
    done = run(f"{BEFORE}ML X=9000\nMC X=1 QX=1 QY=1 QZ=1\nL: GOTO L\n")
    assert (done.code, done.failed_line) == ("E302", 5)


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("MJ P1 F90\nL: GOTO L\n", "E401", 2),
        ("MJ P1 F90\nL: SET DO1\nRESET DO1\nGOTO L\n", "E401", None),
        ("MJ P1 F90\nL: T 1\nT 2\nGOTO L\n", "E401", None),
        ("MJ P1 F90\nS: SUB S\nEND\n", "E402", 2),
        ("MJ P1 F90\nL: ML P1\nGOTO L\n", "E412", 2),
        ("MJ P1 F90\nL: ML P1\nMJ P1\nSET DO1\nGOTO L\n", "E412", None),
    ],
)
def test_a_program_that_goes_round_without_time_is_stopped(text: str, code: str, line: int | None) -> None:
    done = run(text)
    assert done.code == code
    assert line in (None, done.failed_line)
    assert done.events("block")[0].line == 1


@pytest.mark.parametrize("text", ["MJ P1 F90\nL: GOTO L\n", "MJ P1 F90\nML Y=-290\nL: ML Y=-290\nGOTO L\n"])
def test_it_is_stopped_whatever_the_look_ahead(text: str) -> None:
    done = run(text, cell(controller="lookahead = 2"))
    assert done.code in ("E401", "E412")
    assert done.events("block")[0].line == 1


@pytest.mark.parametrize(
    "text", ["", "\n\n", "// nothing\n", "END\n", "// x\nEND\nMJ P1\n", "L:\n", "SUB S\nEND\nS: END\n"]
)
def test_a_program_that_does_nothing(text: str) -> None:
    done = run(text)
    assert done.status == "finished"
    assert done.session.kernel.tick == 0
    assert not done.over_limits(jerk=ROUNDING)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "-1.0", "0.0"])
@pytest.mark.parametrize("key", ["speed_mm_s", "acceleration_mm_s2", "jerk_mm_s3", "angular_speed_deg_s"])
def test_limits_that_are_no_limits_are_refused(key: str, value: str) -> None:
    with pytest.raises(CellError) as refused:
        parse_cell(cell_text(limits=f"{key} = {value}"))
    assert all(d.code.startswith("E27") and d.line for d in refused.value.diagnostics)


@pytest.mark.parametrize(
    "setting", ["lookahead = 0", "tick_s = 0.0", "tick_s = nan", "tick_s = 1.0", "tick_s = 1e-9"]
)
def test_controller_settings_that_cannot_be_are_refused(setting: str) -> None:
    with pytest.raises(CellError):
        parse_cell(cell_text(controller=setting))
