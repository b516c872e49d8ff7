"""Moves by an increment, as statements: of a joint, or of the TCP along the axes of base, frame or tool."""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.interactive import Interactive
from viapoint.language.units import DEG, MM
from viapoint.repl import show, values
from viapoint.repl.console import Complaint
from viapoint.report import joints_in_degrees
from viapoint.runtime.kernel import AuxiliaryAxes
from viapoint.runtime.rotations import invert_pose, rotation_vector_to_matrix

SPEEDS: Final = {"J": 20.0, "E": 20.0, "XYZ": 50.0, "ABC": 10.0}
"""F where none is said: deg/s, deg/s, mm/s, deg/s; a tenth or less of what robots can."""


def statement(session: Interactive, words: list[str]) -> str:
    """`[base|tool|frame N] AXIS BY [at F]` as a motion from where the robot stands. Raises Complaint."""
    words, space = list(words), "base"
    if words and words[0].lower() in ("base", "tool", "frame"):
        space = words.pop(0).lower()
    frame = _frame(session, words) if space == "frame" else 0
    speed = None
    if len(words) > 2 and words[-2].lower() == "at":
        speed = values.positive(words[-1], "a speed")
        del words[-2:]
    if len(words) != 2:
        raise Complaint("say which axis and by how much: `:jog J2 -10`, `:jog tool Z 50`")
    axis, by = words[0].upper(), values.number(words[1], "an increment in mm or deg")
    if axis[:1] in ("J", "E") and axis[1:].isdecimal():
        if space != "base":
            raise Complaint(f"{axis} belongs to the robot, not to the {space}")
        return _axis_move(session, axis, by, speed)
    if axis not in tuple(show.COORDINATES):
        raise Complaint(f"`{words[0]}` is no axis: J1…, E1…, X, Y, Z, A, B or C")
    return _line(session, space, frame, axis, by, speed)


def _frame(session: Interactive, words: list[str]) -> int:
    word = words.pop(0) if words else ""
    index = int(word) if word.isdecimal() else -1
    if index not in session.cell.frames:
        known = ", ".join(str(each) for each in sorted(session.cell.frames))
        raise Complaint(f"`{word}` is no frame of the cell: {known}")
    return index


def _axis_move(session: Interactive, axis: str, by: float, speed: float | None) -> str:
    number = int(axis[1:])
    joints = joints_in_degrees(session.cell, session.kernel.telemetry.joints)
    given = f"F{speed or SPEEDS[axis[0]]:g}"
    if axis[0] == "J":
        if not 1 <= number <= len(joints):
            raise Complaint(f"the robot has no {axis}: its last joint is J{len(joints)}")
        return f"MJ {axis}={_exact(joints[number - 1] + by)} {given}\n"
    axes = AuxiliaryAxes.of(session.cell)
    names = [axes.name(k) for k in range(len(axes))]
    if axis not in names:
        raise Complaint(f"the cell has no axis {axis}")
    here = session.kernel.telemetry.auxiliary / axes.units
    return f"MJ J1={_exact(joints[0])} {axis}={_exact(here[names.index(axis)] + by)} {given}\n"


def _line(session: Interactive, space: str, frame: int, axis: str, by: float, speed: float | None) -> str:
    k = "XYZABC".index(axis)
    turns = k >= 3
    X_base_tcp = session.pose
    R = {"base": np.eye(3), "tool": X_base_tcp[:3, :3], "frame": session.frame(frame)[:3, :3]}[space]
    direction = R[:, k % 3]
    target = X_base_tcp.copy()
    if turns:
        target[:3, :3] = rotation_vector_to_matrix(direction * by * DEG) @ X_base_tcp[:3, :3]
    else:
        target[:3, 3] += direction * (by * MM)
    values_there = show.coordinates(invert_pose(session.frame(0)) @ target)
    names = show.COORDINATES if turns else show.COORDINATES[:3]
    where = " ".join(f"{name}={_exact(v)}" for name, v in zip(names, values_there, strict=False))
    return f"ML {where} F{speed or SPEEDS['ABC' if turns else 'XYZ']:g}\n"


def _exact(value: float) -> str:
    """A number as a statement can hold it, to a millionth of a micrometre."""
    return f"{value:.9f}"
