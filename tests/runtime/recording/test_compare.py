"""Comparing recordings: equal runs, a slower run, another path, another answer, a statement more."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from viapoint.runtime.recording import Recording, load_recording
from viapoint.runtime.recording.compare import compare


def recorded(run, path: Path) -> Recording:
    run.record(path)
    return load_recording(path)


def test_equal_runs_differ_nowhere(run, tmp_path: Path) -> None:
    a = recorded(run, tmp_path / "a.mcap")
    result = compare(a, a)
    assert result.same
    assert [(s.text, s.line_a, s.line_b) for s in result.statements] == [
        ("ML X=1 F100", 2, 2),
        ("MC P1 P2", 5, 5),
    ]
    assert all(s.seconds_a == s.seconds_b for s in result.statements)


def test_a_slower_run_has_the_same_path(make_run, tmp_path: Path) -> None:
    a = recorded(make_run(2500), tmp_path / "a.mcap")
    b = recorded(make_run(5000), tmp_path / "b.mcap")
    result = compare(a, b)
    assert result.path is None
    assert result.event is not None
    assert (result.event.index, result.event.a.line) == (0, 2)
    assert result.seconds_b == pytest.approx(2 * result.seconds_a)
    assert result.statements[0].seconds_b == pytest.approx(2 * result.statements[0].seconds_a)


def test_a_moved_path_is_found_with_its_line(run, tmp_path: Path) -> None:
    position = run.window.position.copy()
    bump = np.clip((run.window.s - 1.2) / 0.2, 0, 1)
    position[:, 2] += 0.01 * np.sin(np.pi * bump) ** 2
    other = dataclasses.replace(run, window=dataclasses.replace(run.window, position=position))
    result = compare(recorded(run, tmp_path / "a.mcap"), recorded(other, tmp_path / "b.mcap"))
    assert result.event is None
    assert result.path is not None
    assert result.path.line_a == result.path.line_b == 5
    assert result.path.s_mm == pytest.approx(1200, abs=20)
    assert result.path.largest_mm == pytest.approx(10, rel=1e-3)


def test_another_answer_of_an_input_is_the_first_difference(run, tmp_path: Path) -> None:
    events = list(run.events)
    events[2] = dataclasses.replace(events[2], data={**events[2].data, "value": True})
    other = dataclasses.replace(run, events=tuple(events))
    result = compare(recorded(run, tmp_path / "a.mcap"), recorded(other, tmp_path / "b.mcap"))
    assert result.event is not None
    assert (result.event.a.line, result.event.a.kind) == (4, "input_read")
    assert (result.event.a.data["value"], result.event.b.data["value"]) == (False, True)


def test_a_statement_that_one_run_lacks_is_listed(run, tmp_path: Path) -> None:
    other = dataclasses.replace(run, events=run.events[:3] + run.events[4:])
    result = compare(recorded(run, tmp_path / "a.mcap"), recorded(other, tmp_path / "b.mcap"))
    assert [(s.text, s.line_a, s.line_b) for s in result.statements][-1] == ("MC P1 P2", 5, None)
    assert result.event is not None
    assert result.event.b.kind == "message"


def test_a_changed_statement_stands_in_one_row(run, tmp_path: Path) -> None:
    info = dataclasses.replace(run.info, program_source=run.info.program_source.replace("F100", "F300"))
    other = dataclasses.replace(run, info=info)
    result = compare(recorded(run, tmp_path / "a.mcap"), recorded(other, tmp_path / "b.mcap"))
    assert [s.text for s in result.statements] == ["ML X=1 F100 → ML X=1 F300", "MC P1 P2"]


def test_statements_are_matched_when_lines_have_moved(run, tmp_path: Path) -> None:
    info = dataclasses.replace(run.info, program_source="// new first line\n" + run.info.program_source)
    events = tuple(dataclasses.replace(event, line=event.line + 1) for event in run.events)
    other = dataclasses.replace(run, info=info, events=events)
    result = compare(recorded(run, tmp_path / "a.mcap"), recorded(other, tmp_path / "b.mcap"))
    assert [(s.line_a, s.line_b) for s in result.statements] == [(2, 3), (5, 6)]
