"""The command calibrate: a tool or a frame from a table of measured poses. mm and deg in and out."""

from __future__ import annotations

import csv
from argparse import Namespace
from typing import TYPE_CHECKING

from viapoint.cli.failures import Refusal, UsageError
from viapoint.cli.kinematics import pose_of, robot_named, units_of
from viapoint.cli.output import fixed, print_json

if TYPE_CHECKING:
    from pathlib import Path

    from viapoint.calibration import ToolCalibration
    from viapoint.runtime.records import Floats

DECIMALS = 3  # a micrometre


def calibrate(chosen: Namespace) -> int:
    from viapoint.calibration import CalibrationError

    if chosen.what == "tool" and (chosen.xxy or chosen.tool is not None):
        raise UsageError("--xxy and --tool belong to a frame")
    X = _poses(chosen)
    try:
        return _tool(X, chosen) if chosen.what == "tool" else _frame(X, chosen)
    except CalibrationError as error:
        raise Refusal(f"{chosen.file}: {error}") from error


def _tool(X: Floats, chosen: Namespace) -> int:
    from viapoint.calibration import calibrate_tool
    from viapoint.language.units import MM

    found: ToolCalibration = calibrate_tool(X)
    xyz, point, off, sure = (
        [_tidy(value) for value in (each / MM).tolist()]
        for each in (found.xyz, found.point, found.residuals, found.uncertainty)
    )
    if chosen.format == "json":
        print_json({"xyz": xyz, "point": point, "residuals_mm": off, "uncertainty_mm": sure})
        return 0
    print(f"xyz = {_list(xyz)}  # mm, the tool's point in the flange frame")
    print(f"point touched: {_list(point)}")
    print(f"uncertainty: {_list(sure)} mm")
    print(f"off the point touched, pose by pose: {_list(off)} mm, rms {fixed(found.rms / MM, DECIMALS)} mm")
    return 0


def _frame(X: Floats, chosen: Namespace) -> int:
    from viapoint.calibration import calibrate_frame
    from viapoint.language.units import DEG, MM
    from viapoint.runtime.rotations import matrix_to_abc

    tool = pose_of(chosen.tool or [0.0] * 6)
    frame = calibrate_frame((X @ tool)[:, :3, 3], two_on_x=chosen.xxy)
    xyz = [_tidy(value) for value in (frame[:3, 3] / MM).tolist()]
    abc = [_tidy(value) for value in (matrix_to_abc(frame[:3, :3]) / DEG).tolist()]
    if chosen.format == "json":
        print_json({"xyz": xyz, "abc": abc})
        return 0
    print(f"xyz = {_list(xyz)}  # mm, in the frame of the poses")
    print(f"abc = {_list(abc)}  # deg")
    return 0


def _poses(chosen: Namespace) -> Floats:
    """(n, 4, 4) of the rows. Raises Refusal with the row that is wrong."""
    import numpy as np

    rows = _rows(chosen.file)
    robot = None if chosen.robot is None else robot_named(chosen.robot)
    wanted = [robot.joint_count] if robot is not None else [6, 3] if chosen.what == "frame" else [6]
    for number, row in rows:
        if len(row) not in wanted:
            kind = "joints" if robot is not None else "numbers"
            needs = " or ".join(str(each) for each in wanted)
            raise Refusal(f"{chosen.file}, row {number}: {len(row)} {kind}, {needs} are needed")
    if robot is not None:
        return robot.fk(np.array([row for _, row in rows]).reshape(-1, robot.joint_count) * units_of(robot))
    if not rows:
        return np.zeros((0, 4, 4))
    if any(len(row) == 3 for _, row in rows) and chosen.tool is not None:
        raise UsageError("with --tool every row needs its orientation: x,y,z,a,b,c")
    return np.array([pose_of([*row, 0.0, 0.0, 0.0][:6]) for _, row in rows])


def _rows(path: Path) -> list[tuple[int, list[float]]]:
    """Numbers of every row, with the row's number; a first row of names is left out."""
    import math

    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8"
        raise Refusal(f"cannot read {path}: {reason}") from error
    result: list[tuple[int, list[float]]] = []
    for number, cells in enumerate(csv.reader(text.splitlines()), start=1):
        given = [cell.strip() for cell in cells]
        if not any(given) or given[0].startswith("#"):
            continue
        try:
            values = [float(cell) for cell in given]
        except ValueError:
            if not result and all(cell[:1].isalpha() for cell in given):
                continue
            raise Refusal(f"{path}, row {number}: `{','.join(given)}` are no numbers") from None
        if not all(math.isfinite(value) for value in values):
            raise Refusal(f"{path}, row {number}: a number is not finite")
        result.append((number, values))
    return result


def _list(values: list[float]) -> str:
    return f"[{', '.join(fixed(value, DECIMALS) for value in values)}]"


def _tidy(value: float) -> float:
    return round(value, 6) + 0.0
