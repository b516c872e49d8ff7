"""Calibration at the prompt: a tool, or a frame, from points taught where the robot touched something."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from viapoint.calibration import CalibrationError, calibrate_frame, calibrate_tool
from viapoint.interactive import Interactive
from viapoint.language.units import MM
from viapoint.repl import cellfile, show, values
from viapoint.repl.console import Complaint, Console
from viapoint.runtime.cell import Frame, Point, Tool
from viapoint.runtime.kernel import AuxiliaryAxes
from viapoint.runtime.records import Floats
from viapoint.runtime.rotations import invert_pose

TWO_ON_X: Final = "xxy"
"""The points of a frame are two on X and one on Y, instead of origin, X and X-Y plane."""


def calibrate(console: Console, words: list[str]) -> None:
    """`tool N P…`, `frame N P P P [xxy]`, or `save [FILE]`."""
    kind = words[0].lower() if words else ""
    if kind == "save" and len(words) <= 2:
        _save(console, Path(words[1]) if len(words) > 1 else None)
        return
    if kind not in ("tool", "frame") or len(words) < 3 or not words[1].isdecimal() or int(words[1]) == 0:
        raise Complaint(
            "write `:calibrate tool 1 P10 P11 P12 P13`, `:calibrate frame 1 P10 P11 P12`, or `save`"
        )
    console.require_free()
    two_on_x = kind == "frame" and words[-1].lower() == TWO_ON_X
    points = [_point(console.session, word) for word in words[2 : len(words) - two_on_x]]
    try:
        if kind == "tool":
            _tool(console, int(words[1]), points)
        else:
            _frame(console, int(words[1]), points, two_on_x)
    except CalibrationError as error:
        raise Complaint(str(error)) from None
    console.calibrated.add((kind, int(words[1])))


def _point(session: Interactive, word: str) -> Point:
    number = values.index(word, "P")
    if number not in session.points:
        raise Complaint(f"there is no point P{number}: `:teach P{number} joints`")
    return session.points[number]


def _flange(session: Interactive, point: Point) -> Floats:
    """X_base_flange of a point in joints, with the base where it is at E = 0."""
    assert point.joints is not None, "asked before"
    X: Floats = session.cell.robot.fk(point.joints)
    carrier = AuxiliaryAxes.of(session.cell).carrier
    if carrier is not None and carrier < len(point.auxiliary):
        X[0, 3] += point.auxiliary[carrier]
    return X


def _tool(console: Console, index: int, points: list[Point]) -> None:
    session = console.session
    for point in points:
        if point.joints is None:
            what = f"P{point.index} is a pose, and of what tool is not known"
            raise Complaint(f"{what}: `:teach P{point.index} joints` there")
    found = calibrate_tool([_flange(session, point) for point in points])
    zero = np.zeros(3)
    old = session.cell.tools.get(index) or Tool(
        index=index, name=None, X_flange_tool=np.eye(4), mass=0.0, com=zero, inertia=zero, capsule=None
    )
    X_flange_tool = old.X_flange_tool.copy()
    X_flange_tool[:3, 3] = found.xyz
    session.equip(tools=[replace(old, X_flange_tool=X_flange_tool)])
    console.say(f"T{index} {show.pose_text(X_flange_tool)}")
    off = ", ".join(f"P{p.index} {show.figure(r / MM)}" for p, r in zip(points, found.residuals, strict=True))
    console.say(f"off the point touched: {off}, rms {show.figure(found.rms / MM)} mm")
    spread = " ".join(show.figure(each / MM) for each in found.uncertainty)
    console.say(f"uncertain by {spread} mm in X Y Z")


def _frame(console: Console, index: int, points: list[Point], two_on_x: bool) -> None:
    session = console.session
    if len(points) != 3:
        raise Complaint(f"a frame takes three points, {len(points)} are given")
    X_flange_tool = session.cell.tools[session.kernel.tool].X_flange_tool
    X_base_zero = session.cell.frames[0].X_base_frame
    touched = [
        X_base_zero @ point.pose if point.pose is not None else _flange(session, point) @ X_flange_tool
        for point in points
    ]
    X = calibrate_frame(np.array([each[:3, 3] for each in touched]), two_on_x=two_on_x)
    old = session.cell.frames.get(index) or Frame(index=index, name=None, X_base_frame=X, live=False)
    session.equip(frames=[replace(old, X_base_frame=X)])
    console.say(f"Z{index} {show.pose_text(invert_pose(X_base_zero) @ X)}")


def _save(console: Console, path: Path | None) -> None:
    """Into the cell's file, or another one."""
    session = console.session
    if not console.calibrated:
        raise Complaint("nothing was calibrated")
    if path is None:
        if not Path(session.cell.source.name).exists():
            raise Complaint("the cell has no file: name one, `:calibrate save cell.toml`")
        path = Path(session.cell.source.name)
    try:
        cellfile.update(path, session.cell, sorted(console.calibrated))
    except OSError as error:
        raise Complaint(f"cannot write {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise Complaint(f"{path} is not a cell file: {error}") from error
    letters = {"tool": "T", "frame": "Z"}
    said = ", ".join(f"{letters[kind]}{index}" for kind, index in sorted(console.calibrated))
    console.calibrated.clear()
    console.say(f"{path}: {said}")
