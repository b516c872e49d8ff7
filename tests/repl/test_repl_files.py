"""What the prompt writes: points, pictures, recordings."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from repl_sittings import FILES, Sitting

import viapoint as via
from viapoint.repl import Console
from viapoint.runtime.cell import Cell


def via_console(cell: Cell, said: list[str]) -> Console:
    return Console(cell, said.append)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sitting: Sitting) -> Sitting:
    """A sitting on a copy of the test files."""
    for path in FILES.iterdir():
        shutil.copy(path, tmp_path)
    monkeypatch.chdir(tmp_path)
    return sitting


def test_taught_points_go_into_the_file_of_points(here: Sitting, tmp_path: Path) -> None:
    shutil.copy(FILES / "points.toml", tmp_path / "mine.toml")
    here.enter("MJ P1 F60", "T 1", ":teach P1", ":jog Z 12.3456", ":teach P3", ":teach P8 joints as rest")
    assert "mine.toml: P1, P3, P8" in here.enter(":points save mine.toml")
    text = (tmp_path / "mine.toml").read_text(encoding="utf-8")
    assert text.startswith("# taught on the first day\n")
    assert "# above the table" in text
    assert "P4 = { x = 1800, y = -300, z = 1500, a = 0, b = 90, c = 0 }" in text
    cell_text = (FILES / "cell.toml").read_text(encoding="utf-8").replace("points.toml", "mine.toml")
    (tmp_path / "mine_cell.toml").write_text(cell_text, encoding="utf-8")
    cell = via.load_cell(tmp_path / "mine_cell.toml")
    points, known = cell.points, here.console.session.points
    np.testing.assert_allclose(points[3].pose, known[3].pose, atol=1e-9)
    np.testing.assert_allclose(points[8].joints, known[8].joints, atol=1e-7)
    assert points[3].name == "corner"
    assert points[8].name == "rest"


def test_saving_without_a_name_takes_the_cell_s_file(here: Sitting, tmp_path: Path) -> None:
    assert "no point was taught" in here.enter(":points save other.toml")
    here.enter("MJ P1 F60", ":teach P50")
    for path in ("nofolder/points.toml", "part.via"):
        assert "error" in here.enter(f":points save {path}")
    source = here.console.session.cell.points_source
    assert source is not None
    assert Path(source.name).name == "points.toml"


def test_a_picture(here: Sitting, tmp_path: Path) -> None:
    here.enter("MJ P1 F60", "ML P2 F300", ":plot run.png")
    assert (tmp_path / "run.png").stat().st_size > 10_000
    assert "error" in here.enter(":plot run.xyz")
    assert "name one file" in here.enter(":plot")


def test_a_recording(here: Sitting, tmp_path: Path) -> None:
    here.enter("MJ P1 F60", ":record run.mcap", "ML P2 F300", "SET DO1", ":record off", "ML P1")
    recording = via.load_recording(tmp_path / "run.mcap")
    assert recording.problem is None
    assert [event.kind for event in recording.events] == ["block", "output"]
    np.testing.assert_allclose(recording.trace.position[-1], [1.5, 0.3, 1.5], atol=1e-9)
    assert "nothing is being recorded" in here.enter(":record off")
    here.enter(":record left_open.mcap", "ML P2")
    here.console.close()
    assert via.load_recording(tmp_path / "left_open.mcap").problem is None


TOUCHING = [
    line
    for k, abc in enumerate(("A=0 B=90 C=0", "A=20 B=70 C=0", "A=-25 B=80 C=30", "A=10 B=60 C=-20"))
    for line in (f"MJ X=1700 Y=200 Z=900 {abc} F80", f":teach P{10 + k} joints")
]


def test_what_was_calibrated_goes_into_the_cell_file(here: Sitting, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = (FILES / "cell.toml").read_text(encoding="utf-8").replace("index = 1\n", "index = 1  # as built\n")
    path.write_text(text, encoding="utf-8")
    assert "nothing was calibrated" in here.enter(":calibrate save mine.toml")
    here.enter("T 1", *TOUCHING, ":calibrate tool 1 P10 P11 P12 P13", ":calibrate tool 5 P10 P11 P12 P13")
    here.enter(
        "ML X=1600 Y=100 Z=900", ":teach P20", "ML X=1700", ":teach P21", "ML Y=200 Z=950", ":teach P22"
    )
    here.enter(":calibrate frame 1 P20 P21 P22", ":calibrate frame 2 P20 P21 P22")
    assert "mine.toml: Z1, Z2, T1, T5" in here.enter(":calibrate save mine.toml")
    written = path.read_text(encoding="utf-8")
    assert written.count("# as built") == 3
    assert 'name = "torch"' in written
    cell, known = via.load_cell(path), here.console.session.cell
    for index in (1, 5):
        np.testing.assert_allclose(
            cell.tools[index].X_flange_tool, known.tools[index].X_flange_tool, atol=1e-8
        )
    for index in (1, 2):
        np.testing.assert_allclose(
            cell.frames[index].X_base_frame, known.frames[index].X_base_frame, atol=1e-8
        )
    np.testing.assert_allclose(cell.frames[2].X_base_frame[:3, 3], [1.6, 0.1, 0.9], atol=1e-8)
    for wrong in ("part.via", "none.toml", "points.toml"):
        here.enter(":calibrate tool 1 P10 P11 P12 P13")
        before = (tmp_path / wrong).read_bytes() if (tmp_path / wrong).exists() else None
        assert "error: " in here.enter(f":calibrate save {wrong}")
        assert before == ((tmp_path / wrong).read_bytes() if before is not None else None)


def test_of_several_robots_it_is_the_one_that_was_calibrated(here: Sitting, tmp_path: Path) -> None:
    path = tmp_path / "pair.toml"
    robots = (("left", ""), ("right", "robot.zero_frame = { xyz = [3000, 0, 0], abc = [0, 0, 90] }\n"))
    path.write_text(
        "[[tools]]\nindex = 1\nxyz = [100, 0, 0]\n"
        + "".join(f'[[robots]]\nname = "{name}"\nrobot.model = "frigeni6"\n{more}' for name, more in robots),
        encoding="utf-8",
    )
    said: list[str] = []
    console = via_console(via.load_cells(path)[1], said)
    for line in ("T 1", *[each.replace(" F80", " Z0 F80") for each in TOUCHING]):
        console.enter(line.replace("X=1700 Y=200", "X=3100 Y=1700"))
    for line in (":calibrate tool 4 P10 P11 P12 P13", ":teach P20", "ML X=3200", ":teach P21", "ML Y=1600"):
        console.enter(line)
    for line in (":teach P22", ":calibrate frame 6 P20 P21 P22", ":calibrate save"):
        console.enter(line)
    assert said[-1].endswith("pair.toml: Z6, T4")
    left, right = via.load_cells(path)
    assert 4 not in left.tools
    np.testing.assert_allclose(right.tools[4].X_flange_tool[:3, 3], [0.1, 0.0, 0.0], atol=1e-8)
    for cell in (left, right):
        X_world_frame = np.linalg.inv(cell.frames[0].X_base_frame) @ cell.frames[6].X_base_frame
        np.testing.assert_allclose(X_world_frame[:3, 3], [3.1, 1.7, 0.9], atol=1e-8)
