"""Runs through the command line: the JSON contract, recordings, export, plot, diff, refusals, Ctrl-C."""

from __future__ import annotations

import csv
import io
import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from viapoint.runtime.recording import load_recording

FILES = Path(__file__).parent / "files"
PART = ("part.via", "--cell", "cell.toml", "--scenario", "scenario.toml")

REPORT_KEYS = [
    "status", "duration_s", "ticks", "statements", "realtime_factor", "final", "limits",
    "deviation", "diagnostics", "events",
]  # fmt: skip
LIMIT_KEYS = [
    "joint_speed", "joint_acceleration", "joint_jerk",
    "path_speed", "path_acceleration", "path_jerk", "programmed_speed",
]  # fmt: skip
EVENT_KEYS = {
    "block": {"t_end", "command", "length_mm", "s0_mm", "limited_by"},
    "output": {"signal", "value", "s_mm"},
    "input_read": {"signal", "value", "s_mm", "ahead"},
    "m": {"index", "action"},
    "wait": {"t_end", "reason"},
    "tool": {"index"},
    "track": {"index", "action"},
    "tangent": set(),
    "message": {"text"},
    "override": {"value"},
    "error": {"code", "message"},
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """One recorded run of part.via with its JSON report."""
    path = tmp_path_factory.mktemp("recorded") / "part.mcap"
    command = [sys.executable, "-m", "viapoint", "run", *PART, "--record", str(path), "--format", "json"]
    done = subprocess.run(command, cwd=FILES, capture_output=True, text=True, timeout=120, check=True)
    return path, json.loads(done.stdout)


def test_report_is_as_the_contract_says(recorded) -> None:
    _, report = recorded
    assert list(report) == REPORT_KEYS
    assert report["status"] == "finished"
    assert list(report["final"]) == ["joints_deg", "tcp", "auxiliary"]
    assert list(report["final"]["tcp"]) == ["x", "y", "z", "a", "b", "c"]
    assert list(report["limits"]) == LIMIT_KEYS
    assert report["duration_s"] == pytest.approx(report["ticks"] * 0.001)
    for event in report["events"]:
        keys = set(event) - {"t", "line", "kind", "robot"}
        assert keys == EVENT_KEYS[event["kind"]], event
    times = [event["t"] for event in report["events"]]
    assert times == sorted(times)
    assert {event["kind"] for event in report["events"]} >= {"block", "output", "input_read", "wait"}
    assert [d["code"] for d in report["diagnostics"]] == ["W504"]


def test_recording_does_not_depend_on_where_it_goes(recorded, cli, tmp_path: Path) -> None:
    path, _ = recorded
    assert cli("run", *PART, "--record", tmp_path / "other.mcap").code == 0
    assert (tmp_path / "other.mcap").read_bytes() == path.read_bytes()


def test_recording_holds_the_run(recorded) -> None:
    path, report = recorded
    recording = load_recording(path)
    assert recording.problem is None
    assert recording.result == {
        "status": "finished",
        "ticks": str(report["ticks"]),
        "duration_s": repr(report["duration_s"]),
    }
    assert recording.info.program_source == (FILES / "part.via").read_text()
    assert recording.info.cell_text == (FILES / "cell.toml").read_text()
    assert recording.info.scenario_text == (FILES / "scenario.toml").read_text()
    assert recording.info.seed == 3
    assert recording.info.command_line == "viapoint run part.via --cell cell.toml --scenario scenario.toml"
    assert len(recording.events) == len(report["events"])


def test_export_has_a_row_for_every_tick_and_ends_where_the_run_did(recorded, cli) -> None:
    path, report = recorded
    outcome = cli("export", path, "-o", "-")
    rows = list(csv.DictReader(io.StringIO(outcome.out)))
    assert len(rows) == report["ticks"] + 1
    assert float(rows[0]["t"]) == 0.0
    assert float(rows[-1]["t"]) == report["duration_s"]
    joints = [float(rows[-1][f"j{i}"]) for i in range(1, 7)]
    np.testing.assert_allclose(joints, report["final"]["joints_deg"], atol=1e-8)
    pose = [float(rows[-1][name]) for name in "xyzabc"]
    np.testing.assert_allclose(pose, list(report["final"]["tcp"].values()), atol=1e-6)


def test_limits_of_the_report_follow_from_the_export(recorded, cli) -> None:
    path, report = recorded
    rows = list(csv.DictReader(io.StringIO(cli("export", path, "-o", "-").out)))
    joints = np.array([[float(row[f"j{i}"]) for i in range(1, 7)] for row in rows])
    speed = np.abs(np.diff(joints, axis=0)).max(axis=0) / 0.001
    np.testing.assert_allclose(
        speed / [110, 110, 110, 200, 200, 300], report["limits"]["joint_speed"], atol=1e-5
    )


def test_export_writes_a_file(recorded, cli, tmp_path: Path) -> None:
    path, report = recorded
    outcome = cli("export", path, "-o", tmp_path / "new" / "part.csv")
    assert outcome.code == 0
    assert outcome.err == f"table: {tmp_path}/new/part.csv, {report['ticks'] + 1} rows\n"
    assert (tmp_path / "new" / "part.csv").read_text().count("\n") == report["ticks"] + 2


def test_plot_from_recording_and_from_program_are_one_picture(recorded, cli, tmp_path: Path) -> None:
    path, _ = recorded
    assert cli("plot", path, "-o", tmp_path / "a.png").code == 0
    assert cli("plot", *PART, "-o", tmp_path / "b.png").code == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_diff_of_a_recording_with_itself(recorded, cli) -> None:
    path, report = recorded
    outcome = cli("diff", path, path)
    assert outcome.code == 0
    assert outcome.out.startswith(f"events: the same ({len(report['events'])})\npath:   the same (")
    found = json.loads(cli("diff", path, path, "--format", "json").out)
    assert found["same"] is True
    assert all(one["seconds_a"] == one["seconds_b"] for one in found["statements"])


def test_diff_with_a_slower_run(recorded, cli, tmp_path: Path) -> None:
    path, _ = recorded
    cli("run", *PART, "--override", "50", "--record", tmp_path / "slow.mcap")
    found = json.loads(cli("diff", path, tmp_path / "slow.mcap", "--format", "json").out)
    assert found["path"] is None
    assert found["duration_s"]["b"] > 1.3 * found["duration_s"]["a"]
    assert found["event"] is not None


def test_text_report_has_a_row_per_statement_and_the_events(cli) -> None:
    outcome = cli("run", *PART)
    assert outcome.code == 0
    lines = outcome.out.splitlines()
    assert re.match(
        r"line +statement +start s +time s +length mm +mean mm/s +peak mm/s +limited by", lines[0]
    )
    assert sum(" ML P2 R20 " in line for line in lines) == 2
    assert any(re.match(r" *\d+\.\d{3} +5 +output +DO1 on at \d+\.\d\d mm", line) for line in lines)
    assert re.match(r"part\.via: finished after \d\.\d{3} s, \d+ ticks, \d+ statements", lines[-1])
    assert "\x1b" not in outcome.out


def test_compiled_program_runs_the_same(recorded, cli, tmp_path: Path) -> None:
    _, report = recorded
    cli("compile", "part.via", "--cell", "cell.toml", "-o", tmp_path / "part.viac")
    again = json.loads(cli("run", tmp_path / "part.viac", *PART[1:], "--format", "json").out)
    for key in ("events", "final", "ticks", "limits", "statements"):
        assert again[key] == report[key]


def test_stopped_by_max_time(cli) -> None:
    outcome = cli("run", "endless.via", "--cell", "cell.toml", "--max-time", "0.75", "--format", "json")
    report = json.loads(outcome.out)
    assert (outcome.code, report["status"], report["duration_s"]) == (0, "stopped", 0.75)


def test_stopped_by_cycles(cli) -> None:
    outcome = cli("run", "endless.via", "--cell", "cell.toml", "--cycles", "1", "--format", "json")
    report = json.loads(outcome.out)
    assert (outcome.code, report["status"]) == (0, "stopped")
    assert [event["line"] for event in report["events"] if event["kind"] == "block"] == [1, 3, 4, 5]


@pytest.mark.parametrize(("file", "code", "line"), [("far.via", "E302", 2), ("stuck.via", "E410", 2)])
def test_failed_runs_name_code_and_line(file: str, code: str, line: int, cli) -> None:
    outcome = cli("run", file, "--cell", "cell.toml", "--format", "json")
    report = json.loads(outcome.out)
    assert (outcome.code, report["status"]) == (1, "error")
    last = report["diagnostics"][-1]
    assert (last["code"], last["line"], last["severity"]) == (code, line, "error")
    assert report["events"][-1]["kind"] == "error"
    assert report["events"][-1]["code"] == code
    assert code in cli("run", file, "--cell", "cell.toml").err


def test_check_with_a_cell_finds_what_cannot_be_reached(cli) -> None:
    outcome = cli("check", "far.via", "--cell", "cell.toml", "--format", "json")
    assert outcome.code == 1
    (found,) = json.loads(outcome.out)["diagnostics"]
    assert (found["code"], found["line"], found["column"], found["end_column"]) == ("E302", 2, 1, 11)


def test_blends_of_check(cli) -> None:
    report = json.loads(cli("check", "round.via", "--cell", "cell.toml", "--format", "json").out)
    rows = {(row["line"], row["next_line"]): row for row in report["blends"]}
    assert set(rows) == {(1, 3), (3, 4), (4, 5), (5, 3), (5, None)}
    assert rows[3, 4] == {
        "line": 3, "next_line": 4, "asked_mm": 20.0, "effective_mm": 20.0,
        "stop": False, "forced_by_line": None, "reason": "rounded by R",
    }  # fmt: skip
    assert rows[1, 3]["asked_mm"] is None
    assert rows[1, 3]["stop"] is True


def test_check_with_a_cell_looks_into_both_branches(cli) -> None:
    report = json.loads(cli("check", "part.via", "--cell", "cell.toml", "--format", "json").out)
    passed = {(row["line"], row["next_line"]): row["forced_by_line"] for row in report["blends"]}
    assert {(4, None): 6, (7, None): 10}.items() <= passed.items()


def test_program_that_does_not_compile_is_still_one_object(cli) -> None:
    outcome = cli("run", "wrong.via", "--format", "json")
    report = json.loads(outcome.out)
    assert outcome.code == 1
    assert list(report) == REPORT_KEYS
    assert report["status"] == "error"
    assert "E201" in [d["code"] for d in report["diagnostics"]]


@pytest.mark.parametrize(
    "words", [["run", "part.via"], ["check", "part.via"], ["plot", "part.via", "-o", "x.png"]]
)
@pytest.mark.parametrize("cell", ["none.toml", "bad_cell.toml", "latin.via", "."])
def test_bad_cells_are_refused(words: list[str], cell: str, cli) -> None:
    outcome = cli(*words, "--cell", cell)
    assert outcome.code == 1
    assert re.search(r"error\[E27\d\]", outcome.err)
    assert outcome.err.rstrip().endswith(f"the cell {cell} cannot be used")


def test_bad_cell_in_json(cli) -> None:
    for command in ("run", "check"):
        outcome = cli(command, "part.via", "--cell", "bad_cell.toml", "--format", "json")
        assert outcome.code == 1
        codes = [d["code"] for d in json.loads(outcome.out)["diagnostics"]]
        assert sorted(codes) == ["E272", "E273", "E274"]


def test_bad_scenario_is_refused(cli) -> None:
    outcome = cli("run", "part.via", "--cell", "cell.toml", "--scenario", "cell.toml")
    assert outcome.code == 1
    assert "error[E29" in outcome.err


@pytest.mark.parametrize("name", ["plot", "export", "diff"])
def test_what_is_no_recording_is_refused(name: str, cli, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(b"\x89MCAP0\r\n")
    output = [] if name == "diff" else ["-o", tmp_path / "out.png"]
    other = [path] if name == "diff" else []
    outcome = cli(name, path, *other, *output)
    assert outcome.code == 1
    assert "was not written by viapoint" in outcome.err


def test_recording_into_nowhere_is_refused(cli) -> None:
    outcome = cli("run", *PART, "--record", "part.via/x.mcap")
    assert outcome.code == 1
    assert outcome.err.startswith("viapoint: cannot write part.via/x.mcap: ")


def test_cut_off_recording_is_exported_with_a_note(recorded, cli, tmp_path: Path) -> None:
    path, report = recorded
    cut = tmp_path / "cut.mcap"
    data = path.read_bytes()
    cut.write_bytes(data[: len(data) * 3 // 4])
    outcome = cli("export", cut, "-o", "-")
    assert outcome.code == 0
    assert 1000 < outcome.out.count("\n") < report["ticks"]
    assert "cut off or damaged" in outcome.err


def test_a_run_in_real_time_says_how_it_kept_its_time(cli) -> None:
    begin = time.monotonic()
    report = json.loads(cli("run", *PART, "--realtime", "--format", "json").out)
    assert time.monotonic() - begin > report["duration_s"]
    assert list(report) == [*REPORT_KEYS, "realtime"]
    kept = report["realtime"]
    assert kept["ticks"] == report["ticks"] + 1
    assert list(kept["late_us"]) == ["p50", "p99", "p99_9", "max"]
    same = json.loads(cli("run", *PART, "--format", "json").out)
    assert same["events"] == report["events"]
    assert same["final"] == report["final"]


def test_a_run_in_real_time_tells_its_punctuality(cli, tmp_path: Path) -> None:
    (tmp_path / "short.via").write_text("MJ J1=2 F100\n")
    said = cli("run", tmp_path / "short.via", "--realtime").out.splitlines()[-1]
    assert re.match(r"real time: \d+ ticks, \d+ deadlines? missed.*; late by \d+ µs \(median\)", said)


@pytest.mark.parametrize("more", [[], ["--realtime"]])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_run_stops_on_the_path(number: int, more: list[str], tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    command = [
        sys.executable, "-m", "viapoint", "run", "endless.via", "--cell", "cell.toml",
        "--record", str(path), "--format", "json", *more,
    ]  # fmt: skip
    process = subprocess.Popen(command, cwd=FILES, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while process.poll() is None and not (path.exists() and path.stat().st_size > 30_000):
        assert time.monotonic() < deadline, "the recording does not grow"
        time.sleep(0.05)
    assert process.poll() is None, process.communicate()
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert err == ""
    report = json.loads(out)
    assert report["status"] == "stopped"
    recording = load_recording(path)
    assert recording.problem is None
    assert recording.result["status"] == "stopped"
    assert len(recording.trace) == report["ticks"] + 1
    assert recording.trace.speed[-1] < 1e-4
    assert max(report["limits"]["joint_acceleration"]) <= 1.0 + 1e-9
    assert ("realtime" in report) == bool(more)


@pytest.mark.parametrize(("file", "code", "line"), [("poll.via", "E302", 8), ("spin.via", "E401", 2)])
def test_check_ends_on_programs_that_do_not(file: str, code: str, line: int, cli) -> None:
    outcome = cli("check", file, "--cell", "cell.toml", "--format", "json")
    errors = [d for d in json.loads(outcome.out)["diagnostics"] if d["severity"] == "error"]
    assert [(d["code"], d["line"]) for d in errors] == [(code, line)]
