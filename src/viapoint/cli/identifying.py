"""The command identify: the dynamic parameters of an arm from a recording or a table of measurements."""

from __future__ import annotations

import csv
from argparse import Namespace
from typing import TYPE_CHECKING

from viapoint.cli.failures import Refusal, UsageError
from viapoint.cli.kinematics import robot_named, units_of
from viapoint.cli.loading import cells_from
from viapoint.cli.output import print_json, print_table

if TYPE_CHECKING:
    from pathlib import Path

    from viapoint.identification import DynamicsIdentification, MotionSamples
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.records import Floats
    from viapoint.runtime.robots import Robot

TABLE = ".csv"
STEPS_ALIKE = 1e-3  # of a step; time stamps of a table are rounded
LEAST_SHARE = 1e-9  # in a combination: rounding


def identify(chosen: Namespace) -> int:
    import numpy as np

    from viapoint.identification import IdentificationError, identify_dynamics
    from viapoint.runtime.robots.dynamics import STANDARD_GRAVITY

    if (chosen.robot is None) == (chosen.cell is None):
        raise UsageError("say which robot moved: --robot R, or --cell CELL")
    cells = () if chosen.cell is None else cells_from(chosen.cell)
    first = _samples(chosen.file, chosen.robot, cells)
    down = np.array([0.0, 0.0, -STANDARD_GRAVITY])
    robot, cell, samples = first
    try:
        gravity = down if cell is None else cell.X_world_base[:3, :3].T @ down
        found = identify_dynamics(robot, samples, gravity=gravity)
    except IdentificationError as error:
        raise Refusal(f"{chosen.file}: {error}") from error
    against = None
    if chosen.against is not None:
        try:
            against = found.left(_samples(chosen.against, chosen.robot, cells)[2])
        except IdentificationError as error:
            raise Refusal(f"{chosen.against}: {error}") from error
    if chosen.format == "json":
        print_json(_as_object(robot, found, against))
    else:
        _print(robot, found, against)
    return 0


def _samples(
    path: Path, name: str | None, cells: tuple[Cell, ...]
) -> tuple[Robot, Cell | None, MotionSamples]:
    from viapoint.cli.recordings import recording_from
    from viapoint.identification import IdentificationError, MotionSamples

    if path.suffix.lower() == TABLE:
        robot, cell = _mover(path, name, cells, None)
        return robot, cell, _table(path, robot)
    recording = recording_from(path)
    robot, cell = _mover(path, name, cells, recording.info.robot)
    if recording.info.robot != robot.name:
        raise Refusal(f"{path} is of the robot {recording.info.robot}, not of {robot.name}")
    try:
        return robot, cell, MotionSamples.of(recording, cell)
    except IdentificationError as error:
        raise Refusal(f"{path}: {error}") from error


def _mover(
    path: Path, name: str | None, cells: tuple[Cell, ...], recorded: str | None
) -> tuple[Robot, Cell | None]:
    """The robot that moved; of a cell of several the only one of the model recorded."""
    if name is not None:
        return robot_named(name), None
    if len(cells) > 1:
        cells = tuple(cell for cell in cells if cell.robot.name == recorded)
    if len(cells) != 1:
        raise UsageError(f"the cell does not say which of its robots {path} is of: use --robot")
    return cells[0].robot, cells[0]


def _table(path: Path, robot: Robot) -> MotionSamples:
    """The columns t (s), j1… (deg or mm) and tj1… (N·m or N) of a table, as `export` writes them."""
    import numpy as np

    from viapoint.identification import MotionSamples

    numbers = range(1, robot.joint_count + 1)
    wanted = ["t", *(f"j{i}" for i in numbers), *(f"tj{i}" for i in numbers)]
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not UTF-8"
        raise Refusal(f"cannot read {path}: {reason}") from error
    head = [cell.strip() for cell in next(csv.reader(lines), [])]
    if missing := [name for name in wanted if name not in head]:
        raise Refusal(f"{path} has no column {', '.join(missing)}: `export` writes such tables")
    places, rows = [head.index(name) for name in wanted], []
    for number, cells in enumerate(csv.reader(lines[1:]), start=2):
        if len(cells) != len(head):
            raise Refusal(f"{path}, row {number}: {len(cells)} cells under {len(head)} names")
        try:
            rows.append([float(cells[place]) for place in places])
        except ValueError:
            raise Refusal(f"{path}, row {number}: what should be a number is none") from None
    values: Floats = np.array(rows).reshape(-1, len(wanted))
    steps = np.diff(values[:, 0])
    tick = float(np.median(steps)) if len(steps) else 1.0
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        raise Refusal(f"{path}, row {int(np.argmin(finite)) + 2}: not a finite number")
    if not tick > 0.0 or (np.abs(steps - tick) > STEPS_ALIKE * tick).any():
        raise Refusal(f"{path}: t does not rise by equal steps, from which speeds could be found")
    n = robot.joint_count
    return MotionSamples.differenced(values[:, 1 : n + 1] * units_of(robot), values[:, n + 1 :], tick)


def _made_of(found: DynamicsIdentification, k: int) -> dict[str, float]:
    return {
        name: round(share, 9)
        for name, share in zip(found.parameters, found.grouping[k].tolist(), strict=True)
        if abs(share) > LEAST_SHARE
    }


def _unit(name: str, robot: Robot) -> str:
    kind, slides = name.rstrip("0123456789"), bool(robot.prismatic[int(name.lstrip("ImxyzacFv")) - 1])
    if kind in ("Ia", "Fc", "Fv"):
        return {"Ia": ("kg·m²", "kg"), "Fc": ("N·m", "N"), "Fv": ("N·m·s/rad", "N·s/m")}[kind][slides]
    return "kg" if kind == "m" else "kg·m" if kind[0] == "m" else "kg·m²"


def _as_object(robot: Robot, found: DynamicsIdentification, against: Floats | None) -> dict[str, object]:
    def number(value: float) -> float | None:
        return value if value == value else None

    parameters = [
        {
            "name": name,
            "value": float(found.values[k]),
            "deviation": float(found.uncertainty[k]),
            "unit": _unit(name, robot),
            "made_of": _made_of(found, k),
        }
        for k, name in enumerate(found.names)
    ]
    columns = {"torque": found.sizes, "left": found.residuals}
    columns |= {} if against is None else {"left_against": against}
    joints = [
        {name: number(float(column[i])) for name, column in columns.items()} for i in range(robot.joint_count)
    ]
    return {
        "equations": found.equations,
        "condition": found.condition,
        "parameters": parameters,
        "joints": joints,
    }


def _print(robot: Robot, found: DynamicsIdentification, against: Floats | None) -> None:
    print(f"{len(found.names)} parameters from {found.equations} equations, condition {found.condition:.1f}")
    print()
    rows = []
    for k, name in enumerate(found.names):
        parts = [
            f"{'-' if share < 0.0 else '+'} {'' if abs(share) == 1.0 else f'{abs(share):.4g}·'}{part}"
            for part, share in _made_of(found, k).items()
        ]
        made = " ".join(parts).removeprefix("+ ") if len(parts) > 1 else ""
        value, deviation = found.values[k] + 0.0, found.uncertainty[k]
        rows.append([name, f"{value:.5g}", f"{deviation:.2g}", _unit(name, robot), made])
    print_table(("parameter", "value", "deviation", "unit", "made of"), rows, "<>><<")
    print()
    head = ["joint", "torques", "left"] + ([] if against is None else ["left against"])
    columns = [found.sizes, found.residuals] + ([] if against is None else [against])
    rows = [
        [f"J{i + 1}", *("–" if column[i] != column[i] else f"{column[i]:.3g}" for column in columns)]
        for i in range(robot.joint_count)
    ]
    print_table(head, rows, "<" + ">" * len(columns))
