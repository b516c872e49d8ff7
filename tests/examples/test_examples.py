"""Every example of the manifest: its whole report, its limits, and what must not change the result."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from example_runs import EXAMPLES, MANIFEST, STATIONS, Example, Run, run, run_program

from viapoint.cli import main
from viapoint.runtime.cell import load_cell
from viapoint.session import compile_file
from viapoint.vm import save

GOLDEN = Path(__file__).parents[1] / "golden" / "examples"
ROUNDING = 1e-9
SAME_SET_POINT = 1e-9
SOME_WINDOW = 100
FIRST_SECONDS = {"contour": 3.1, "pick_and_place": 1.7}
"""Simulated time over which windows of one tick are compared, as they are slow to compute: until the laser
has gone on, until an input has been read. 0.1 s where nothing else is said."""

DECIMALS = {"joints_deg": 6, "limits": 3}
"""Fixed decimals of the golden reports; 4 where nothing else is said, finer than anything one looks at."""

NEAR = {"deburring": {"duration_s": 0.05, "t": 0.05, "t_end": 0.05, "ticks": 50}}
"""What may differ from a golden report, and by how much: products of matrices round otherwise on another
processor, and following the noise of a belt magnifies that until the law behind it takes some ticks more or
less."""

every_example = pytest.mark.parametrize("example", MANIFEST, ids=lambda example: example.name)


def rounded(value: Any, decimals: int = 4) -> Any:
    """Numbers to fixed decimals, so that golden files do not hang on a machine's last digits."""
    match value:
        case dict():
            return {key: rounded(each, DECIMALS.get(key, decimals)) for key, each in value.items()}
        case list():
            return [rounded(each, decimals) for each in value]
        case float():
            return round(value, decimals) + 0.0
        case _:
            return value


def settled(value: Any, golden: Any, near: dict[str, float], key: str = "") -> Any:
    """The value with the golden figures where it is as near to them as allowed."""
    match value, golden:
        case dict(), dict():
            return {k: settled(each, golden.get(k), near, k) for k, each in value.items()}
        case list(), list() if len(value) == len(golden):
            return [settled(each, wanted, near, key) for each, wanted in zip(value, golden, strict=True)]
        case ((int() | float()), (int() | float())) if key in near and abs(value - golden) <= near[key]:
            return golden
        case _:
            return value


@every_example
def test_report_is_the_golden_one(
    example: Example, check_golden: Any, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(EXAMPLES)
    code = main(["run", example.program, *example.options, "--format", "json"])
    report = json.loads(capsys.readouterr().out)
    assert code == (1 if example.status == "error" else 0)
    assert report["status"] == example.status
    errors = [(d["code"], d["line"]) for d in report["diagnostics"] if d["severity"] == "error"]
    assert errors == ([] if example.error is None else [example.error])
    assert report.pop("realtime_factor") >= 0.0
    report = rounded(report)
    if near := NEAR.get(example.name):
        golden = (GOLDEN / f"{example.name}.json").read_text(encoding="utf-8")
        report = settled(report, json.loads(golden), near)
    check_golden(f"examples/{example.name}.json", json.dumps(report, indent=1, ensure_ascii=False))


@every_example
def test_limits_are_kept(example: Example) -> None:
    for name, peak in run(example).report["limits"].items():
        most = 1.05 if name.endswith("jerk") else 1.0
        assert np.max(peak) <= most + ROUNDING, f"{name}: {peak}"


@every_example
def test_limits_of_the_report_are_those_of_the_set_points(example: Example) -> None:
    done = run(example)
    limits, tick = done.cell.robot.limits, done.cell.tick
    still = np.repeat(done.joints[:1], 3, axis=0)
    q = np.concatenate((still, done.joints))
    named = (("speed", limits.speed), ("acceleration", limits.acceleration), ("jerk", limits.jerk))
    for order, (name, limit) in enumerate(named, start=1):
        peak = np.abs(np.diff(q, n=order, axis=0)).max(axis=0) / tick**order / limit
        np.testing.assert_allclose(done.report["limits"][f"joint_{name}"], peak, atol=1e-5, rtol=1e-4)


@every_example
def test_compiled_file_runs_the_same(example: Example, tmp_path: Path) -> None:
    source = run(example)
    path = tmp_path / "program.viac"
    path.write_bytes(
        save(compile_file(EXAMPLES / example.program, load_cell(EXAMPLES / example.cell)).program)
    )
    compiled = run_program(path, example)
    assert_same(source, compiled)
    reports = [source.report, compiled.report]
    for report in reports:
        del report["realtime_factor"]
    assert reports[0] == reports[1]


def assert_same(one: Run, other: Run) -> None:
    assert one.events == other.events
    assert np.array_equal(one.ticks, other.ticks)
    assert np.abs(one.joints - other.joints).max() <= SAME_SET_POINT


@every_example
def test_window_changes_nothing(example: Example) -> None:
    assert_same(run(example), run(example, window=SOME_WINDOW))


@every_example
def test_windows_of_one_tick_change_nothing(example: Example) -> None:
    first = FIRST_SECONDS.get(example.name, 0.1)
    assert_same(run(example, max_time=first), run(example, window=1, max_time=first))


def test_every_program_is_in_the_manifest() -> None:
    there = {str(path.relative_to(EXAMPLES)) for path in EXAMPLES.rglob("*.via")}
    of_stations = {program for station in STATIONS for program in station["programs"]}
    assert there == {example.program for example in MANIFEST} | of_stations


def test_every_file_is_used() -> None:
    named = {name for e in MANIFEST for name in (e.cell, e.scenario) if name is not None}
    named |= {station[key] for station in STATIONS for key in ("cell", "scenario")}
    there = {str(p.relative_to(EXAMPLES)) for p in EXAMPLES.rglob("*.toml")} - {"manifest.toml"}
    assert there == named


def test_joint_references_choose_the_configurations_of_the_book() -> None:
    """F figure 9-5: J1 = -108.7 without a reference, 71.3 with J1=0."""
    done = run(next(example for example in MANIFEST if example.name == "joint_references"))
    ends = [
        round(event.data["t_end"] / done.cell.tick) for event in done.session.events if event.kind == "block"
    ]
    assert np.degrees(done.joints[ends, 0]).round(1).tolist() == [-108.7, 71.3]
