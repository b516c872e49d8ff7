"""The table: as many rows as ticks, the header as promised, no digit lost that a derivative would show."""

from __future__ import annotations

import csv
import dataclasses
import io

import numpy as np

from viapoint.runtime.recording.export import write_csv

HEADER = ["t", "line", "s_mm", "speed_mm_s", "j1", "j2", "j3", "j4", "j5", "j6", "x", "y", "z", "a", "b", "c"]


def table(run, window=None) -> tuple[int, list[list[str]]]:
    out = io.StringIO()
    count = write_csv(window or run.window, run.info.axes, out)
    return count, list(csv.reader(io.StringIO(out.getvalue())))


def test_one_row_per_tick_from_zero(run) -> None:
    count, rows = table(run)
    assert rows[0] == HEADER
    assert count == len(rows) - 1 == 2501
    assert rows[1][:2] == ["0.0", "2"]
    assert [float(row[0]) for row in rows[1:]] == [tick / 1000 for tick in range(2501)]


def test_units_are_millimetres_and_degrees(run) -> None:
    _, rows = table(run)
    values = np.array(rows[1:], dtype=float)
    np.testing.assert_allclose(values[:, 4:10], np.rad2deg(run.window.joints), rtol=0, atol=1e-11)
    np.testing.assert_allclose(values[:, 10:13], run.window.position * 1000, rtol=0, atol=1e-11)
    assert "-0.0" not in {cell for row in rows for cell in row}


def test_jerk_computed_from_the_table_is_as_good_as_from_the_arrays(run) -> None:
    _, rows = table(run)
    joints = np.array(rows[1:], dtype=float)[:, 4:10]
    jerk = np.diff(joints, n=3, axis=0) * 1e9
    exact = np.rad2deg(np.diff(run.window.joints, n=3, axis=0) * 1e9)
    np.testing.assert_allclose(jerk, exact, rtol=0, atol=0.1)


def test_actual_joints_only_where_drives_run(run) -> None:
    lagging = dataclasses.replace(run.window, actual=run.window.joints * 0.999)
    _, rows = table(run, lagging)
    assert rows[0] == HEADER + [f"aj{i}" for i in range(1, 7)]
    np.testing.assert_allclose(float(rows[-1][16]), np.rad2deg(lagging.actual[-1, 0]))
