"""Robots from their files: those shipped with viapoint by name, others by path."""

from __future__ import annotations

import difflib
import re
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from viapoint.language.diagnostics import Diagnostic
from viapoint.language.units import DEG, MM
from viapoint.runtime.documents import (
    CELL_CODES,
    Document,
    DocumentError,
    Fault,
    check,
    parse_document,
    read_document,
)
from viapoint.runtime.robots.anthropomorphic import SphericalWristArm
from viapoint.runtime.robots.dynamics import LinkMasses
from viapoint.runtime.robots.model import Floats, JointLimits, Robot
from viapoint.runtime.rotations import abc_to_matrix

if TYPE_CHECKING:
    from viapoint.runtime.robots.schema import Body, Joints, RobotFile

# What a robot file that is silent means: acceleration reaches the speed limit in 1/4 s, jerk reaches the
# acceleration in 1/10 s.
ACCELERATION_PER_SPEED = 4.0
JERK_PER_ACCELERATION = 10.0
_ROUNDED = 1e-9
"""kg·m². An inertia that misses being one by less was rounded."""


class RobotError(DocumentError):
    """A robot that is unknown or whose file is wrong; `diagnostics` holds every reason."""


def robot_names() -> tuple[str, ...]:
    """Names of the robots shipped with viapoint."""
    return tuple(
        sorted(file.name.removesuffix(".toml") for file in _shipped() if file.name.endswith(".toml"))
    )


def _shipped() -> list[resources.abc.Traversable]:
    return list(resources.files("viapoint.stdlib").joinpath("robots").iterdir())


def load_robot(name_or_path: str | Path) -> Robot:
    """The robot of that name, or of that file (anything with a slash or ending in .toml).

    Raises RobotError with all diagnostics.
    """
    text = str(name_or_path)
    if text.endswith(".toml") or "/" in text:
        try:
            return _build(read_document(Path(text), CELL_CODES))
        except RobotError:
            raise
        except DocumentError as error:
            raise RobotError(error.diagnostics) from None
    return _load_shipped(text)


@cache
def _load_shipped(name: str) -> Robot:
    names = robot_names()
    if name not in names:
        near = difflib.get_close_matches(name, names, n=1)
        hint = (
            f"did you mean `{near[0]}`?"
            if near
            else f"known: {', '.join(names)}, or the path of a .toml file"
        )
        raise RobotError(
            [Diagnostic(code=CELL_CODES[Fault.REFERENCE], message=f"unknown robot {name}", hint=hint)]
        )
    file = resources.files("viapoint.stdlib").joinpath("robots", f"{name}.toml")
    return _build(parse_document(f"{name}.toml", file.read_text(encoding="utf-8"), CELL_CODES))


def _build(document: Document) -> Robot:
    """Check a robot file and make its robot. Raises RobotError."""
    from viapoint.runtime.robots.schema import RobotFile

    checked = check(document, RobotFile)
    model, faults = checked.model, list(checked.faults)
    if model is not None:
        faults += _range_faults(document, model) + _coupling_faults(document, model)
        faults += _mass_faults(document, model)
    if model is None or faults:
        raise RobotError(faults)
    lengths = {key: value * MM for key, value in model.parameters_mm.model_dump().items()}
    radius = model.body.radius_mm
    return Robot(
        name=model.name,
        family=model.family,
        kinematics=SphericalWristArm(
            **lengths,
            sign=np.array(model.joints.sense or [1] * 6, dtype=np.float64),
            R_flange=np.round(abc_to_matrix(np.array(model.flange.abc) * DEG), 15),
        ),
        limits=_limits(model.joints),
        prismatic=np.zeros(6, dtype=np.bool_),
        coupling=coupling_matrix(model.coupling, 6),
        body_radius=None if radius is None else np.array(radius) * MM,
        masses=_masses(model.body),
    )


def _masses(body: Body) -> LinkMasses | None:
    """Of the links, where all that inverse dynamics needs is given."""
    if body.mass_kg is None or body.com_mm is None or body.inertia_kg_m2 is None:
        return None
    return LinkMasses(
        mass=np.array(body.mass_kg[1:]),
        com=np.array(body.com_mm) * MM,
        inertia=np.array([_inertia(each) for each in body.inertia_kg_m2]),
    )


def _inertia(given: list[float]) -> Floats:
    """xx yy zz xy xz yz → (3, 3)."""
    xx, yy, zz, xy, xz, yz = given
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _mass_faults(document: Document, model: RobotFile) -> list[Diagnostic]:
    body, faults = model.body, []
    if (body.com_mm is None) != (body.inertia_kg_m2 is None):
        given = "com_mm" if body.com_mm is not None else "inertia_kg_m2"
        missing = "inertia_kg_m2" if body.com_mm is not None else "com_mm"
        message = f"body.{given} is given, body.{missing} is not"
        faults.append(document.fault(Fault.CONTRADICTION, ("body", given), message, "torques need both"))
    elif body.com_mm is not None and body.mass_kg is None:
        message = "body.com_mm is given, body.mass_kg is not"
        faults.append(document.fault(Fault.CONTRADICTION, ("body", "com_mm"), message, "torques need both"))
    for i, given_inertia in enumerate(body.inertia_kg_m2 or []):
        principal = np.linalg.eigvalsh(_inertia(given_inertia))
        if principal[0] < -_ROUNDED or principal[2] > principal[0] + principal[1] + _ROUNDED:
            faults.append(
                document.fault(
                    Fault.CONTRADICTION,
                    ("body", "inertia_kg_m2", i),
                    f"no body has the inertia of link {i + 1}",
                    "give xx, yy, zz, xy, xz, yz about the centre of mass",
                )
            )
    return faults


def _limits(joints: Joints) -> JointLimits:
    ranges = np.array(joints.range_deg) * DEG
    speed = np.array(joints.speed_deg_s) * DEG
    acceleration = (
        speed * ACCELERATION_PER_SPEED
        if joints.acceleration_deg_s2 is None
        else np.array(joints.acceleration_deg_s2) * DEG
    )
    jerk = (
        acceleration * JERK_PER_ACCELERATION
        if joints.jerk_deg_s3 is None
        else np.array(joints.jerk_deg_s3) * DEG
    )
    return JointLimits(ranges[:, 0], ranges[:, 1], speed, acceleration, jerk)


def _range_faults(document: Document, model: RobotFile) -> list[Diagnostic]:
    return [
        document.fault(
            Fault.CONTRADICTION,
            ("joints", "range_deg", i),
            f"the range of J{i + 1} is empty: {low:g} … {high:g}",
        )
        for i, (low, high) in enumerate(model.joints.range_deg)
        if low >= high
    ]


_COUPLING = re.compile(r"J([1-9])_J([1-9])")


def _coupling_faults(document: Document, model: RobotFile) -> list[Diagnostic]:
    return [
        document.fault(
            Fault.UNKNOWN_KEY,
            ("coupling", key),
            f"unknown key coupling.{key}",
            "write J4_J5 for what J4 adds to J5",
        )
        for key in model.coupling
        if (pair := coupling_pair(key, 6)) is None or pair[0] == pair[1]
    ]


def coupling_pair(key: str, joints: int) -> tuple[int, int] | None:
    """`J4_J5` → (3, 4), the moving and the affected joint from 0; None where it names no two joints."""
    found = _COUPLING.fullmatch(key)
    if found is None or max(int(found[1]), int(found[2])) > joints:
        return None
    return int(found[1]) - 1, int(found[2]) - 1


def coupling_matrix(coefficients: dict[str, float], joints: int) -> Floats:
    """(n, n) with joints = matrix · motors: J4_J5 = c adds c·J4 to J5 (F 3-16)."""
    matrix = np.eye(joints)
    for key, coefficient in coefficients.items():
        pair = coupling_pair(key, joints)
        if pair is None:
            raise ValueError(f"{key} does not name two joints")
        matrix[pair[1], pair[0]] = coefficient
    return matrix
