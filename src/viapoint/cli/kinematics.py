"""Commands about robots alone: fk, ik, robots. mm and deg in and out."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from viapoint.cli.failures import Refusal, UsageError
from viapoint.cli.output import fixed, print_json, print_table

if TYPE_CHECKING:
    import numpy as np

    from viapoint.runtime.robots import Robot

DECIMALS = 4  # a tenth of a micrometre, and of a millidegree
JSON_DECIMALS = 11  # digits behind this are rounding noise of mm ÷ m
POSE = ("X", "Y", "Z", "A", "B", "C")


def robot_named(name: str) -> Robot:
    """A robot by its name or file. Raises Refusal."""
    from viapoint.runtime.robots import RobotError, load_robot

    try:
        return load_robot(name)
    except RobotError as error:
        lines = [d.message + (f"; {d.hint}" if d.hint else "") for d in error.diagnostics]
        raise Refusal("\n  ".join(lines)) from error


def units_of(robot: Robot) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """(n,) mm or deg in SI, per joint."""
    import numpy as np

    from viapoint.language.units import DEG, MM

    return np.where(robot.prismatic, MM, DEG)


def pose_of(values: list[float]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """X Y Z A B C in mm and deg → (4, 4)."""
    import numpy as np

    from viapoint.language.units import DEG, MM
    from viapoint.runtime.rotations import pose_from_xyzabc

    return pose_from_xyzabc(np.array(values[:3]) * MM, np.array(values[3:]) * DEG)


def fk(chosen: Namespace) -> int:
    import numpy as np

    from viapoint.language.units import DEG, MM
    from viapoint.runtime.rotations import matrix_to_abc

    robot = robot_named(chosen.robot)
    if len(chosen.joints) != robot.joint_count:
        raise UsageError(f"{robot.name} has {robot.joint_count} joints, {len(chosen.joints)} are given")
    q = np.array(chosen.joints) * units_of(robot)
    X = robot.fk(q)
    if chosen.tool is not None:
        X = X @ pose_of(chosen.tool)
    values = [*(X[:3, 3] / MM).tolist(), *(matrix_to_abc(X[:3, :3]) / DEG).tolist()]
    inside = robot.limits.contain(q)
    outside = [f"J{i + 1}" for i in range(robot.joint_count) if not inside[i]]
    names = robot.configuration_names(int(robot.configuration(q)))
    singular = list(robot.singularity(q).singular)
    if chosen.format == "json":
        rounded = [_tidy(value) for value in values]
        tcp = dict(zip((name.lower() for name in POSE), rounded, strict=True))
        print_json({"tcp": tcp, "configuration": list(names), "outside": outside, "singular": singular})
        return 0
    print("  ".join(f"{name} {fixed(value, DECIMALS)}" for name, value in zip(POSE, values, strict=True)))
    print(f"configuration {' '.join(names)}")
    if singular:
        print(f"singular: {', '.join(singular)}")
    if outside:
        print(f"outside of its range: {', '.join(outside)}")
    return 0


def ik(chosen: Namespace) -> int:
    import numpy as np

    from viapoint.runtime.rotations import invert_pose

    robot = robot_named(chosen.robot)
    X = pose_of(chosen.pose)
    if chosen.tool is not None:
        X = X @ invert_pose(pose_of(chosen.tool))
    units = units_of(robot)
    solutions = robot.solutions(X, reference=np.zeros(robot.joint_count))
    found = [((one.joints / units).tolist(), list(one.names)) for one in solutions]
    if chosen.format == "json":
        print_json(
            {
                "solutions": [
                    {
                        "joints_deg": [_tidy(value) for value in joints],
                        "configuration": names,
                    }
                    for joints, names in found
                ]
            }
        )
        return 0 if found else 1
    if not found:
        raise Refusal(_why_not(robot, X))
    head = [*(f"J{i + 1}" for i in range(robot.joint_count)), "configuration"]
    rows = [[*(fixed(value, DECIMALS) for value in joints), " ".join(names)] for joints, names in found]
    print_table(head, rows, ">" * robot.joint_count + "<")
    return 0


def _why_not(robot: Robot, X: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    """The sentence for a pose without solution: too far, or outside of joint ranges."""
    branches = robot.ik(X)
    if branches.valid.any():
        return f"{robot.name} reaches this pose only outside of its joint ranges"
    return f"{robot.name} does not reach this pose: it is too far away or too near"


def robots(chosen: Namespace) -> int:
    from viapoint.runtime.robots import robot_names

    found = [robot_named(name) for name in robot_names()]
    if chosen.format == "json":
        print_json({"robots": [_described(robot) for robot in found]})
        return 0
    rows = [
        [robot.name, robot.family, str(robot.joint_count), f"{_reach_mm(robot):.0f}", _ranges(robot)]
        for robot in found
    ]
    print_table(("robot", "family", "axes", "reach mm", "joint ranges"), rows, "<<>><")
    return 0


def _described(robot: Robot) -> dict[str, object]:
    units = units_of(robot)
    limits = robot.limits
    columns = {
        "speed": limits.speed,
        "acceleration": limits.acceleration,
        "jerk": limits.jerk,
    }
    lower, upper = (limits.lower / units).tolist(), (limits.upper / units).tolist()
    return {
        "name": robot.name,
        "family": robot.family,
        "axes": robot.joint_count,
        "range": [[_tidy(a), _tidy(b)] for a, b in zip(lower, upper, strict=True)],
        **{name: [_tidy(value) for value in (values / units).tolist()] for name, values in columns.items()},
    }


def _tidy(value: float) -> float:
    """Without the rounding noise of the units."""
    return round(value, JSON_DECIMALS) + 0.0


def _reach_mm(robot: Robot) -> float:
    """Length of the wire frame from the shoulder on: an upper bound of how far the flange gets."""
    import numpy as np

    from viapoint.language.units import MM

    points = robot.link_points(np.zeros(robot.joint_count))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1)
    return float(steps[1:].sum()) / MM


def _ranges(robot: Robot) -> str:
    units = units_of(robot)
    lower, upper = (robot.limits.lower / units).tolist(), (robot.limits.upper / units).tolist()
    return "  ".join(f"{_tidy(a):g}…{_tidy(b):g}" for a, b in zip(lower, upper, strict=True))
