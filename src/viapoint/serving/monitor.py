"""The monitor: what a client is told of a tick, in mm, deg, s and percent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.report import joints_in_degrees
from viapoint.runtime.kernel import AuxiliaryAxes
from viapoint.runtime.records import Floats, Window
from viapoint.runtime.rotations import matrix_to_abc, quaternion_to_matrix
from viapoint.session import Session

_DIGITS = 6
"""Decimals of mm and deg: a nanometre."""


def monitors(session: Session, window: Window, rows: Sequence[int]) -> list[dict[str, Any]]:
    """Of the ticks in some rows of a window; state, tool, signals and flags are those of its end."""
    kernel, cell = session.kernel, session.cell
    common = {
        "robot": cell.number,
        "state": kernel.state.value,
        "tool": kernel.tool,
        "signals": {str(signal): value for signal, value in session.signals.at_work()},
        "m": sorted(session.flags),
    }
    at = np.asarray(rows, dtype=np.int64)
    abc = matrix_to_abc(quaternion_to_matrix(window.quaternion[at])) / DEG
    places = _tidy(np.concatenate((window.position[at] / MM, abc), axis=1))
    joints = _tidy(joints_in_degrees(cell, window.joints[at]))
    auxiliary = _tidy(window.auxiliary[at] / AuxiliaryAxes.of(cell).units)
    torques = _tidy(window.torque[at])
    speeds, overrides = _tidy(window.speed[at] / MM), _tidy(window.override[at] * 100.0)
    return [
        {
            "t": round(float(window.time[row]), 9),
            "tick": window.first_tick + row,
            "line": int(window.line[row]),
            "interpreter_line": int(window.interpreter_line[row]),
            "speed_mm_s": speeds[k],
            "override": overrides[k],
            "buffer": int(window.buffer_fill[row]),
            "joints_deg": joints[k],
            "auxiliary": auxiliary[k],
            "tcp": dict(zip("xyzabc", places[k], strict=True)),
        }
        | ({"torque_nm": torques[k]} if torques[k] else {})
        | common
        for k, row in enumerate(rows)
    ]


def _tidy(values: Floats) -> list[Any]:
    """Rounded, without minus before zero."""
    result: list[Any] = (np.round(values, _DIGITS) + 0.0).tolist()
    return result
