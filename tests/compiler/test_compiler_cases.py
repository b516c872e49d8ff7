"""Little programs: the diagnostics they get and the canonical calls they make."""

from __future__ import annotations

from pathlib import Path

import pytest
from compiler_cases import Case, mismatch, read_cases, update_calls

from viapoint.compiler import CellNames, compile_source
from viapoint.language.source import Source
from viapoint.vm import load, save, verify

FOLDER = Path(__file__).parent.parent / "golden" / "compiler" / "cases"
CASES = [case for file in sorted(FOLDER.glob("*.txt")) for case in read_cases(file)]
CELL = CellNames(
    points={1, 2, 3},
    joint_points={3},
    tools={1, 2},
    frames={1},
    conveyors={1},
    inputs=range(1, 17),
    outputs=range(1, 9),
    joints=6,
    auxiliary={1},
    asynchronous={7},
    analog_inputs=range(1, 4),
    analog_outputs=range(1, 3),
    point_names={"pick": 1, "Place": 3},
    signal_names={"gripper": "DO1", "part_present": "DI3", "flow": "AO1", "pressure": "AI2"},
    variables={"count": False, "limit": False, "ready": True},
)


def _compile(case: Case):
    cell = CELL if case.file.stem == "cell" else None
    return compile_source(Source("case.via", case.source), cell)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.id)
def test_diagnostics_are_those_on_the_lines(case: Case) -> None:
    problem = mismatch(case.source, _compile(case).diagnostics)
    assert problem is None, problem


@pytest.mark.parametrize("case", [case for case in CASES if case.runs], ids=lambda case: case.id)
def test_calls_are_those_written(case: Case, request: pytest.FixtureRequest) -> None:
    program = _compile(case).program
    assert program is not None
    verify(program)
    calls = case.run(program)
    if request.config.getoption("--update-goldens"):
        update_calls(case, calls)
    assert "".join(f"{line}\n" for line in calls) == case.sections.get("calls")
    assert case.run(load(save(program))) == calls, "the program file runs differently"
    assert case.run(program, refuse_every=2) == calls, "a full buffer changes the course"
    assert case.run(program, refuse_every=3) == calls, "a full buffer changes the course"


def test_names_are_unique() -> None:
    names = [case.id for case in CASES]
    assert len(set(names)) == len(names)


def test_updating_rewrites_the_calls_of_one_case_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "few.txt"
    file.write_text("--- a\nML P1\n=== calls\nold\n--- b\nML P2\n=== world\nDI1 1\n=== calls\nkept\n")
    update_calls(read_cases(file)[0], ["new", "lines"])
    assert file.read_text() == (
        "--- a\nML P1\n=== calls\nnew\nlines\n--- b\nML P2\n=== world\nDI1 1\n=== calls\nkept\n"
    )
