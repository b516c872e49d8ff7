"""The report of a run as plain data: what `viapoint run --format json` prints. No printing here."""

from __future__ import annotations

from typing import Any

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel import AuxiliaryAxes, ratios
from viapoint.runtime.records import Event
from viapoint.runtime.rotations import matrix_to_abc
from viapoint.session import Session

_RATIO_DIGITS = 6
_TIME_DIGITS = 9


def run_report(session: Session, diagnostics: list[dict[str, Any]]) -> dict[str, Any]:
    """One object for the whole run; `diagnostics` as rendered for JSON, compile-time ones first."""
    kernel, cell = session.kernel, session.cell
    return {
        "status": session.status.value,
        "duration_s": round(kernel.tick * cell.tick, _TIME_DIGITS),
        "ticks": kernel.tick,
        "statements": kernel.statements,
        "realtime_factor": round(session.realtime_factor, 1),
        "final": _final(session),
        "limits": limits_report(session),
        "deviation": deviation_report(session),
        "diagnostics": diagnostics,
        "events": [event_data(event) for event in in_time_order(session.events)],
    }


def in_time_order(events: list[Event]) -> list[Event]:
    """Events sorted by their time; those of one tick stay in the order in which they happened."""
    return sorted(events, key=lambda event: event.tick)


def event_data(event: Event) -> dict[str, Any]:
    """An event as the contract writes it."""
    data = {k: _rounded(v) for k, v in event.data.items()}
    return {
        "t": round(event.t, _TIME_DIGITS),
        "line": event.line,
        "kind": event.kind,
        "robot": event.robot,
        **data,
    }


def limits_report(session: Session) -> dict[str, Any]:
    """Peak ÷ limit: a list per joint, one number each for the path, a list per auxiliary axis."""
    kernel, cell = session.kernel, session.cell
    joints, path = cell.robot.limits, cell.path_limits
    n = cell.robot.joint_count
    speed, acceleration, jerk = kernel.telemetry.peaks
    result: dict[str, Any] = {
        "joint_speed": ratios(speed[:n], joints.speed),
        "joint_acceleration": ratios(acceleration[:n], joints.acceleration),
        "joint_jerk": ratios(jerk[:n], joints.jerk),
        "path_speed": max(speed[-2] / path.speed, speed[-1] / path.angular_speed),
        "path_acceleration": max(
            acceleration[-2] / path.acceleration, acceleration[-1] / path.angular_acceleration
        ),
        "path_jerk": max(jerk[-2] / path.jerk, jerk[-1] / path.angular_jerk),
        "programmed_speed": kernel.telemetry.programmed_speed_ratio,
    }
    if cell.auxiliary_axes:
        limits = AuxiliaryAxes.of(cell).limits
        result["auxiliary_speed"] = ratios(speed[n:-2], limits.speed)
        result["auxiliary_acceleration"] = ratios(acceleration[n:-2], limits.acceleration)
        result["auxiliary_jerk"] = ratios(jerk[n:-2], limits.jerk)
    return {
        key: [round(v, _RATIO_DIGITS) for v in value]
        if isinstance(value, list)
        else round(float(value), _RATIO_DIGITS)
        for key, value in result.items()
    }


def deviation_report(session: Session) -> dict[str, Any]:
    """How far set points were from the path at most, by filter and corrections: mm of TCP, deg of joints."""
    feed = session.kernel.outlet.feed
    joints = joints_in_degrees(session.cell, feed.joint_deviation)
    return {
        "tcp_mm": round(feed.deviation / MM, _TIME_DIGITS),
        "joints_deg": [round(float(v), _TIME_DIGITS) for v in joints],
    }


def _final(session: Session) -> dict[str, Any]:
    kernel, cell = session.kernel, session.cell
    q = kernel.telemetry.joints
    X = cell.robot.fk(q) @ cell.tools[kernel.tool].X_flange_tool
    position = X[:3, 3] / MM
    abc = matrix_to_abc(X[:3, :3]) / DEG
    return {
        "joints_deg": [round(float(v), 9) + 0.0 for v in joints_in_degrees(cell, q)],
        "tcp": {name: round(float(v), 9) + 0.0 for name, v in zip("xyzabc", [*position, *abc], strict=True)},
        "auxiliary": [
            round(float(v), 9) + 0.0 for v in kernel.telemetry.auxiliary / AuxiliaryAxes.of(cell).units
        ],
    }


def joints_in_degrees(cell: Cell, q: np.ndarray) -> np.ndarray:
    """Joints (n,) in deg, mm for slides."""
    return np.asarray(q / np.where(cell.robot.prismatic, MM, DEG))


def _rounded(value: Any) -> Any:
    return round(value, _TIME_DIGITS) + 0.0 if isinstance(value, float) else value
