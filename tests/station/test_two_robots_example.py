"""The example of two robots, as its page says to run it: the whole report, and the same in any window."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from viapoint.cli import main
from viapoint.runtime.recording import load_recording

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
(STATION,) = tomllib.loads((EXAMPLES / "manifest.toml").read_text())["station"]
COMMAND = ["run", "--cell", STATION["cell"], "--scenario", STATION["scenario"]]


def report(capsys: pytest.CaptureFixture[str], *options: str) -> dict[str, Any]:
    assert main([*COMMAND, *options, "--format", "json"]) == 0
    done: dict[str, Any] = json.loads(capsys.readouterr().out)
    for robot in done["robots"]:
        assert robot.pop("realtime_factor") > 0.0
    return done


def rounded(value: Any) -> Any:
    match value:
        case dict():
            return {key: rounded(each) for key, each in value.items()}
        case list():
            return [rounded(each) for each in value]
        case float():
            return round(value, 3) + 0.0
        case _:
            return value


def test_report(
    check_golden: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(EXAMPLES)
    done = report(capsys)
    check_golden("station/two_robots.json", json.dumps(rounded(done), indent=1, ensure_ascii=False))
    for robot in done["robots"]:
        assert max(robot["limits"]["joint_jerk"]) <= 1.05
        assert max(robot["limits"]["joint_acceleration"]) <= 1.0 + 1e-9


def test_windows_change_nothing(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(EXAMPLES)
    assert rounded(report(capsys, "--window", "100")) == rounded(report(capsys))


def test_every_robot_has_a_recording_with_its_path(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(EXAMPLES)
    report(capsys, "--record", str(tmp_path / "out.mcap"))
    for name in ("left", "right"):
        recording = load_recording(tmp_path / f"out.{name}.mcap")
        assert recording.info.program_name == f"{name}.via"
        blocks = [event for event in recording.events if event.kind == "block"]
        assert len(recording.paces) == len(blocks) > 0, "what holds back every motion"


@pytest.mark.parametrize("option", [["--from", "2"], ["--to", "2"], ["--realtime"], ["--await-client"]])
def test_options_of_one_robot_are_refused(
    option: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(EXAMPLES)
    assert main([*COMMAND, *option]) == 2
    assert f"{option[0]} " in capsys.readouterr().err
