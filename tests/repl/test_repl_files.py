"""What the prompt writes: points, pictures, recordings."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from repl_sittings import FILES, Sitting

import viapoint as via


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
