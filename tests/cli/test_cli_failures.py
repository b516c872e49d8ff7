"""What cannot be run is told before the robot moves: which code, where, and what to do; no tick passes."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
from cli_runs import RunCli

HOME = [-52.125, 19.267, 25.819, 0.0, 44.914, -52.125]
"""deg: X=1050 Y=−1350 Z=1500, tool down."""

RANGES = (
    "[limits.joints]\n"
    "range_deg = [[-90, 90], [-90, 150], [-210, {}], [-350, 350], [-130, 130], [-350, 350]]\n"
)
POST = (
    '[[zones]]\nname = "post"\nkind = "forbidden"\ncorner_1 = [1000, -100, 0]\ncorner_2 = [1100, 100, 1600]\n'
)


@dataclass(frozen=True)
class Refusal:
    """A program in a cell, and what must be said of it: code, line, and words of the message."""

    program: str
    cell: str
    code: str
    line: int
    words: str
    home: str = str(HOME)


PROGRAMS = {
    "out of reach in the middle of a line": Refusal(
        "ML Y=1350 F500\n", RANGES.format(50), "E303", 1, "J3 would leave its range -210…50 deg after "
    ),
    "too far at the end of a line": Refusal("ML X=9000 F500\n", "", "E302", 1, ""),
    "a zone between two good points": Refusal(
        "ML Y=1350 F500\n", POST, "E330", 1, "link 6 enters the forbidden zone post after "
    ),
    "a joint move into the robot itself": Refusal(
        "MJ J2=-80 J3=25 F50\n", "", "E332", 1, "link 3 runs into link 1 of the robot itself after "
    ),
    "the tool leaning too far": Refusal(
        "MJ J5=90 F50\n",
        "[orientation_cone]\naxis = [0, 0, -1]\nhalf_angle_deg = 30\n",
        "E333",
        1,
        "the X axis of the tool leaves its cone after ",
    ),
    "a round edge out of reach": Refusal(
        "ML X=1500 Y=0 R800 F500\nML X=1050 Y=1350\n",
        RANGES.format(42.7),
        "E303",
        1,
        "J3 would leave its range",
    ),
}

CELLS = {
    "a path limit of zero": Refusal("HOME\n", "[limits.path]\nspeed_mm_s = 0\n", "E275", 5, "speed_mm_s"),
    "a joint limit of zero": Refusal(
        "HOME\n", "[limits.joints]\njerk_deg_s3 = [1, 1, 0, 1, 1, 1]\n", "E275", 5, "jerk_deg_s3[2]"
    ),
    "NaN in a joint limit": Refusal("HOME\n", RANGES.format("nan"), "E275", 5, "range_deg[2][1]"),
    "NaN in a tool": Refusal(
        "HOME\n", "[[tools]]\nindex = 1\nxyz = [0, nan, 0]\n", "E275", 6, "tools[0].xyz[1]"
    ),
    "NaN in a point": Refusal(
        "HOME\n", "[points]\nP1 = { j = [0, 0, nan, 0, 0, 0] }\n", "E275", 5, "points.P1.j[2]"
    ),
    "NaN in a zone": Refusal("HOME\n", POST.replace("1600", "nan"), "E275", 8, "zones[0].corner_2[2]"),
    "NaN in the pose at home": Refusal("HOME\n", "", "E275", 3, "robot.home[2]", home="[0, 0, nan, 0, 0, 0]"),
    "infinity in a frame": Refusal(
        "HOME\n", "[[frames]]\nindex = 1\nxyz = [inf, 0, 0]\n", "E275", 6, "frames[0].xyz[0]"
    ),
}


def written(case: Refusal, folder: Path) -> tuple[str, str, str, str]:
    """The command for a case, its files written to a folder."""
    cell, program = folder / "cell.toml", folder / "program.via"
    cell.write_text(f'[robot]\nmodel = "frigeni6"\nhome = {case.home}\n{case.cell}')
    program.write_text(case.program)
    return "run", str(program), "--cell", str(cell)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_motion_that_cannot_be_run_is_not_begun(name: str, cli: RunCli, tmp_path: Path) -> None:
    case = PROGRAMS[name]
    command = written(case, tmp_path)
    told = cli(*command)
    assert told.code == 1
    assert f"error[{case.code}]: " in told.err
    assert f"program.via:{case.line}:1" in told.err
    assert case.words in told.err
    report = json.loads(cli(*command, "--format", "json").out)
    assert (report["status"], report["ticks"], report["statements"]) == ("error", 0, 0)
    assert report["final"]["joints_deg"] == pytest.approx(HOME, abs=1e-9)
    (error,) = [event for event in report["events"] if event["kind"] == "error"]
    assert (error["code"], error["line"], error["t"]) == (case.code, case.line, 0.0)
    (diagnostic,) = report["diagnostics"]
    assert (diagnostic["code"], diagnostic["line"]) == (case.code, case.line)


@pytest.mark.parametrize("name", CELLS)
def test_a_cell_that_cannot_be_used_starts_nothing(name: str, cli: RunCli, tmp_path: Path) -> None:
    case = CELLS[name]
    command = written(case, tmp_path)
    told = cli(*command)
    assert told.code == 1
    assert f"error[{case.code}]: " in told.err
    assert f"cell.toml:{case.line}" in told.err
    assert case.words in told.err
    report = json.loads(cli(*command, "--format", "json").out)
    assert (report["status"], report["ticks"], report["final"]) == ("error", 0, None)
    assert [(d["code"], d["line"]) for d in report["diagnostics"]] == [(case.code, case.line)]


def test_a_motion_that_cannot_be_run_is_not_begun_after_those_that_can(cli: RunCli, tmp_path: Path) -> None:
    """The robot stands at the end of the last good motion, and stays there."""
    case = Refusal("ML Y=-1300 F500\nSET DO1\nML Y=1350\nSET DO2\n", POST, "E330", 3, "")
    report = json.loads(cli(*written(case, tmp_path), "--format", "json").out)
    blocks = [event for event in report["events"] if event["kind"] == "block"]
    assert [block["line"] for block in blocks] == [1]
    assert [event["line"] for event in report["events"] if event["kind"] == "output"] == [2]
    assert report["final"]["tcp"]["y"] == pytest.approx(-1300.0, abs=1e-5)
    assert report["duration_s"] == blocks[0]["t_end"]
