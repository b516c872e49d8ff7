"""The examples of several robots, as their page says to run them: whole reports, the same in any window."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from viapoint.cli import main
from viapoint.runtime.recording import load_recording

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STATIONS = tomllib.loads((EXAMPLES / "manifest.toml").read_text())["station"]
Station = dict[str, Any]


def command(station: Station) -> list[str]:
    return ["run", "--cell", station["cell"], "--scenario", station["scenario"]]


def name_of(station: Station) -> str:
    return Path(station["cell"]).parent.name


def report(station: Station, capsys: pytest.CaptureFixture[str], *options: str) -> dict[str, Any]:
    assert main([*command(station), *options, "--format", "json"]) == 0
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


@pytest.mark.parametrize("station", STATIONS, ids=name_of)
def test_report(
    station: Station,
    check_golden: Any,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """How long a belt is chased shows the last digit of its encoder: there the order of events is golden."""
    monkeypatch.chdir(EXAMPLES)
    done = report(station, capsys)
    golden = rounded(done)
    if "shared_belt" in station["cell"]:
        assert done["status"] == "finished"
        keys = ("robot", "line", "kind", "action", "part", "signal", "value")
        events = sorted(done["events"], key=lambda event: event["robot"])
        golden = [{key: e[key] for key in keys if key in e} for e in events]
        assert max(e["lag_mm"] for e in done["events"] if "lag_mm" in e) < 0.1
    check_golden(f"station/{name_of(station)}.json", json.dumps(golden, indent=1, ensure_ascii=False))
    for robot in done["robots"]:
        assert max(robot["limits"]["joint_jerk"]) <= 1.05
        assert max(robot["limits"]["joint_acceleration"]) <= 1.0 + 1e-9


@pytest.mark.parametrize("station", STATIONS, ids=name_of)
def test_windows_change_nothing(
    station: Station, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(EXAMPLES)
    short, long = (report(station, capsys, "--max-time", "8", "--window", w) for w in ("100", "1024"))
    assert rounded(short) == rounded(long)


def test_every_robot_has_a_recording_with_its_path(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(EXAMPLES)
    report(STATIONS[0], capsys, "--record", str(tmp_path / "out.mcap"))
    for name in ("left", "right"):
        recording = load_recording(tmp_path / f"out.{name}.mcap")
        assert recording.info.program_name == f"{name}.via"
        blocks = [event for event in recording.events if event.kind == "block"]
        assert len(recording.paces) == len(blocks) > 0, "what holds back every motion"


@pytest.mark.parametrize(
    "option", [["--from", "2"], ["--to", "2"], ["--reference", "J1=2"], ["--realtime"], ["--await-client"]]
)
def test_options_of_one_robot_are_refused(
    option: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(EXAMPLES)
    assert main([*command(STATIONS[0]), *option]) == 2
    assert f"{option[0]} " in capsys.readouterr().err
