"""Being told where the axes stand: a run begins there; everything else about it is as if it stood there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import viapoint as via

PROGRAM = "ML X=1500 Y=200 Z=1500 F300 R30\nML Y=-100\nWAIT 0.05\n"
THERE = {"J1": 20.0, "J2": 10.0, "J3": 25.0, "J5": 40.0}
CELL = """
[robot]
model = "frigeni6"
home = [5, 0, 0, 0, 30, 0]
[auxiliary_axes.E1]
kind = "linear"
carries_robot = true
range = [-100, 2000]
speed = 800
acceleration = 3000
[auxiliary_axes.E2]
kind = "rotary"
range = [-180, 180]
speed = 90
acceleration = 400
[[zones]]
name = "post"
kind = "forbidden"
corner_1 = [-200, 1200, 0]
corner_2 = [300, 2200, 3000]
"""


def load(tmp_path: Path, text: str = CELL) -> via.Cell:
    (tmp_path / "cell.toml").write_text(text)
    return via.load_cell(tmp_path / "cell.toml")


def sent(session: via.Session) -> tuple[np.ndarray, list[tuple[object, ...]]]:
    windows = list(session.run())
    assert session.status is via.Status.FINISHED
    rows = np.concatenate([np.concatenate((w.joints, w.auxiliary), axis=1) for w in windows])
    return rows, [(e.tick, e.kind, e.line) for e in session.events if e.kind != "reference"]


@pytest.mark.parametrize("window", [1, 1024])
def test_a_run_is_that_of_a_cell_whose_home_is_there(window: int) -> None:
    cell = via.default_cell()
    program = via.compile_text(PROGRAM, cell=cell)
    home = np.radians([THERE.get(f"J{i}", 0.0) for i in range(1, 7)])
    q = np.asarray(cell.home).copy()
    q[[0, 1, 2, 4]] = home[[0, 1, 2, 4]]
    told = via.Session(cell, program, window=window)
    assert told.reference(THERE) is None
    rows, events = sent(told)
    expected, same = sent(via.Session(replace(cell, home=tuple(q.tolist())), program, window=1024))
    np.testing.assert_array_equal(rows, expected)
    assert events == same
    first = told.events[0]
    assert (first.kind, first.tick, dict(first.data)) == ("reference", 0, THERE)


def test_axes_that_are_not_named_stay_and_auxiliary_axes_are_set_too(tmp_path: Path) -> None:
    cell = load(tmp_path)
    session = via.Session(cell, via.compile_text("MJ J6=10\n", cell=cell))
    assert session.reference({"E1": 750.0, "E2": -90}) is None
    assert session.reference({"J4": 12.5}) is None
    rows, _ = sent(session)
    start = [5.0, 0.0, 0.0, 12.5, 30.0, 0.0]
    np.testing.assert_allclose(rows[0], [*np.radians(start), 0.75, np.radians(-90.0)], atol=1e-15)
    np.testing.assert_allclose(rows[-1, 5:], [np.radians(10.0), 0.75, np.radians(-90.0)], atol=1e-12)


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ({"J2": 500.0}, "J2 = 500.0 deg is outside its range"),
        ({"E1": 2100.0}, "E1 = 2100.0 mm is outside its range -100…2000 mm"),
        ({"E2": -181}, "E2 = -181.0 deg is outside its range"),
        ({"J1": 90.0, "J2": 20.0}, "post"),
    ],
)
def test_where_it_cannot_stand_is_refused_and_nothing_happens(
    tmp_path: Path, axes: dict[str, float], words: str
) -> None:
    cell = load(tmp_path)
    program = via.compile_text("MJ J6=10\n", cell=cell)
    session = via.Session(cell, program)
    refused = session.reference(axes)
    assert refused is not None
    assert words in refused
    np.testing.assert_array_equal(sent(session)[0], sent(via.Session(cell, program))[0])
    assert all(event.kind != "reference" for event in session.events)


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        ({}, "name the axes"),
        ({"J7": 1.0}, "no axis J7: it has J1, J2, J3, J4, J5, J6, E1, E2"),
        ({"J1": 1.0, "J2": float("nan")}, "J2 = nan is no finite number"),
        ({"E1": float("inf")}, "E1 = inf"),
        ({"J1": 10**400}, "J1 = "),
        ({"J1": True}, "J1 = True"),
    ],
)
def test_what_names_no_place(tmp_path: Path, axes: dict[str, float], words: str) -> None:
    cell = load(tmp_path)
    session = via.Interactive(cell)
    before = session.kernel
    with pytest.raises(ValueError, match=words):
        session.reference(axes)
    assert session.kernel is before


def test_between_programs_it_goes_on_from_there() -> None:
    cell = via.default_cell()
    session = via.Interactive(cell)
    session.take_on(via.compile_text("T 1\nMJ P5 F60\n", cell=cell))
    list(session.run(most=100))
    assert session.reference(THERE) == "<text> is moving"
    list(session.run())
    tick, length = session.kernel.tick, len(session.events)
    assert session.reference(THERE) is None
    assert (session.kernel.tick, session.kernel.tool, len(session.events)) == (tick, 1, length + 1)
    assert session.step_back() is None
    assert session.kernel.state.value == "halted"  # there is nothing behind it any more
    session.take_on(via.compile_text("MJ J6=30 F90\n", cell=cell))
    rows = np.concatenate([window.joints for window in session.run()])
    assert session.status is via.Status.FINISHED
    np.testing.assert_allclose(rows[0, :5], np.radians([20.0, 10.0, 25.0, rows[0, 3], 40.0]), atol=1e-12)
    steps = np.abs(np.diff(rows, axis=0)) / cell.tick
    assert (steps <= cell.robot.limits.speed * (1.0 + 1e-9)).all()


def test_after_an_error_and_after_a_jog() -> None:
    cell = via.default_cell()
    session = via.Interactive(cell)
    session.take_on(via.compile_text("ML X=99999 F10\n", cell=cell))
    list(session.run())
    assert session.status is via.Status.ERROR
    assert session.reference({"J1": 10.0}) is None
    assert session.hold(via.HeldJog("J1", 1, via.JogSpace.JOINT, seconds=0.1)) is None
    assert session.reference({"J1": 0.0}) == "the robot is being jogged"
    list(session.run())
    assert session.reference({"J1": 3.0}) is None
    assert np.degrees(session.kernel.telemetry.joints[0]) == pytest.approx(3.0)


def test_a_start_from_a_line_goes_there_from_where_the_robot_stands() -> None:
    cell = via.default_cell()
    program = via.compile_text("MJ P5 F60\nML P1 F300\nML P2\n", cell=cell)
    session = via.Session(cell, program, first_line=2)
    assert session.reference({"J1": 40.0}) is None
    rows, _ = sent(session)
    assert np.degrees(rows[0, 0]) == pytest.approx(40.0)
    expected, _ = sent(via.Session(cell, program, first_line=2))
    np.testing.assert_allclose(rows[-1], expected[-1], atol=1e-9)


def test_the_command_line_begins_there_and_the_recording_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from viapoint.cli import main

    monkeypatch.chdir(tmp_path)
    load(tmp_path)
    Path("part.via").write_text("MJ J6=10\n")
    line = ["run", "part.via", "--cell", "cell.toml", "--record", "out.mcap"]
    assert main([*line, "--reference", "J1=20,e1=-50.5"]) == 0
    recording = via.load_recording(Path("out.mcap"))
    assert recording.info.command_line.endswith("--reference J1=20.0,E1=-50.5")
    np.testing.assert_allclose(recording.trace.joints[0, [0, 4]], np.radians([20.0, 30.0]), atol=1e-15)
    assert recording.trace.auxiliary[0, 0] == pytest.approx(-0.0505)
    assert dict(recording.events_of("reference")[0].data) == {"J1": 20.0, "E1": -50.5}
    for given, code, words in (
        ("J9=1", 2, "no axis J9"),
        ("J1=1,J1=2", 2, "each axis once"),
        ("J1", 2, "each axis once"),
        ("J1=nan", 2, "is not a number"),
        ("J1=90,J2=20", 1, "cannot stand there"),
    ):
        capsys.readouterr()
        assert main(["run", "part.via", "--cell", "cell.toml", "--reference", given]) == code
        assert words in capsys.readouterr().err
