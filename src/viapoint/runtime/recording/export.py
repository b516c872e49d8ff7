"""A recording as a table: one row per tick, mm and deg, for spreadsheets and pandas."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TextIO

import numpy as np

from viapoint.language.units import DEG, MM

from ..records import Window
from ..rotations import matrix_to_abc, quaternion_to_matrix
from .info import PRISMATIC, Axis, Floats

ROWS_AT_ONCE = 4096
# Decimals kept. A third difference at 1 ms raises a rounding error by 1e9; with eleven decimals the
# jerk computed from the table is still good to 0.1 deg/s³. The last digits of mm ÷ m are noise anyway.
DECIMALS = 11


def axis_units(axes: tuple[Axis, ...]) -> Floats:
    """(n,) what to divide each axis by: 1 deg in rad, or 1 mm in m."""
    return np.array([MM if axis.kind == PRISMATIC else DEG for axis in axes])


def csv_header(axes: tuple[Axis, ...], auxiliary: tuple[Axis, ...], *, actual: bool, torque: bool) -> str:
    others = [axis.name.lower() for axis in auxiliary]
    joints = [f"j{i + 1}" for i in range(len(axes))]
    driven = [f"aj{i + 1}" for i in range(len(axes))] if actual else []
    turned = [f"tj{i + 1}" for i in range(len(axes))] if torque else []
    return ",".join(["t", "line", "s_mm", "speed_mm_s", *joints, *others, *"xyzabc", *driven, *turned])


def csv_rows(
    trace: Window, axes: tuple[Axis, ...], auxiliary: tuple[Axis, ...], *, actual: bool
) -> Iterator[str]:
    """One line of text per tick, without its line end; TCP in the base frame with the active tool."""
    units, other_units = axis_units(axes), axis_units(auxiliary)
    for start in range(0, len(trace), ROWS_AT_ONCE):
        part = slice(start, start + ROWS_AT_ONCE)
        abc = matrix_to_abc(quaternion_to_matrix(trace.quaternion[part])) / DEG
        columns = [
            trace.s[part, None] / MM,
            trace.speed[part, None] / MM,
            trace.joints[part] / units,
            trace.auxiliary[part] / other_units,
            trace.position[part] / MM,
            abc,
        ]
        if actual:
            columns.append(trace.actual[part] / units)
        columns.append(trace.torque[part])
        values = np.round(np.concatenate(columns, axis=1), DECIMALS) + 0.0  # + 0.0: no "-0.0"
        times, lines = trace.time[part].round(DECIMALS).tolist(), trace.line[part].tolist()
        for time, line, row in zip(times, lines, values.tolist(), strict=True):
            yield f"{time!r},{line},{','.join(map(repr, row))}"


def write_csv(trace: Window, axes: tuple[Axis, ...], out: TextIO, auxiliary: tuple[Axis, ...] = ()) -> int:
    """Write the table with its header; the number of rows. Actual joints only where drives differ."""
    actual = not np.array_equal(trace.actual, trace.joints)
    torque = trace.torque.shape[1] > 0
    out.write(csv_header(axes, auxiliary, actual=actual, torque=torque) + "\n")
    rows = 0
    for row in csv_rows(trace, axes, auxiliary, actual=actual):
        out.write(row + "\n")
        rows += 1
    return rows
