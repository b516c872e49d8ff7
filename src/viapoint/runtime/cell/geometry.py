"""Places of a cell: points, tools, frames, belts, zones. Units converted, poses brought into the base."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from viapoint.language.commands import BARE_CODES
from viapoint.language.units import DEG, MM
from viapoint.runtime.cell.checking import Checker
from viapoint.runtime.cell.model import (
    AuxiliaryAxis,
    Capsule,
    Conveyor,
    Floats,
    Frame,
    OrientationCone,
    PartQueue,
    Point,
    Tool,
    Zone,
)
from viapoint.runtime.documents import Fault, Key
from viapoint.runtime.robots import Robot
from viapoint.runtime.rotations import pose_from_xyzabc

if TYPE_CHECKING:
    from viapoint.runtime import tables
    from viapoint.runtime.cell import schema

_POINT = re.compile(r"P(0|[1-9][0-9]{0,8})")
_COORDINATES = ("x", "y", "z", "a", "b", "c")
# A cone's axis shorter than this has no direction; it is given as numbers of the size of 1.
_NO_DIRECTION = 1e-9


def frame_pose(frame: tables.Frame) -> Floats:
    """(4, 4) of a frame given in mm and deg."""
    return pose_from_xyzabc(np.array(frame.xyz) * MM, np.array(frame.abc) * DEG)


def build_points(
    check: Checker, sections: dict[str, schema.PointSection], robot: Robot, axes: dict[int, AuxiliaryAxis]
) -> dict[int, Point]:
    """Points by index."""
    points: dict[int, Point] = {}
    names: dict[str, int] = {}
    for key, section in sections.items():
        here: Key = ("points", key)
        found = _POINT.fullmatch(key)
        if found is None:
            hint = f'keys are P0, P1, P2 …; write `P1 = {{ name = "{key}", …`, with a number that is free'
            check.fault(Fault.UNKNOWN_KEY, here, f"unknown key points.{key}", hint)
            continue
        index = int(found[1])
        points[index] = Point(
            index=index,
            name=section.name,
            pose=_point_pose(check, here, section),
            joints=None if section.j is None else check.joints((*here, "j"), section.j, robot),
            auxiliary=_point_auxiliary(check, here, section, axes),
            live=section.live,
        )
        check.unique_name((*here, "name"), section.name, index, names)
        check.check_word((*here, "name"), section.name, BARE_CODES)
    return points


def _point_pose(check: Checker, key: Key, section: schema.PointSection) -> Floats | None:
    values = [getattr(section, name) for name in _COORDINATES]
    missing = [name for name, value in zip(_COORDINATES, values, strict=True) if value is None]
    if section.j is not None:
        if len(missing) < len(values):
            check.fault(
                Fault.CONTRADICTION,
                key,
                f"{key[-1]} has both joints j and coordinates",
                "give one of the two",
            )
        return None
    for name in missing:
        check.fault(Fault.MISSING_KEY, (*key, name), f"the key {name} of {key[-1]} is missing")
    if missing:
        return None
    return pose_from_xyzabc(np.array(values[:3]) * MM, np.array(values[3:]) * DEG)


def _point_auxiliary(
    check: Checker, key: Key, section: schema.PointSection, axes: dict[int, AuxiliaryAxis]
) -> tuple[float, ...]:
    if len(section.e) > len(axes):
        check.fault(
            Fault.LENGTH,
            (*key, "e"),
            f"{key[-1]} gives {len(section.e)} auxiliary axes, the cell has {len(axes)}",
        )
        return ()
    ordered = [axes[number] for number in sorted(axes)]
    return tuple(
        value * (MM if axis.prismatic else DEG) for value, axis in zip(section.e, ordered, strict=False)
    )


def build_tool(_key: Key, section: schema.ToolSection) -> Tool:
    """One tool."""
    capsule = section.capsule
    return Tool(
        index=section.index,
        name=section.name,
        X_flange_tool=frame_pose(section),
        mass=section.mass_kg,
        com=np.array(section.com) * MM,
        inertia=np.array(section.inertia_kg_m2),
        capsule=None
        if capsule is None
        else Capsule(to=np.array(capsule.to) * MM, radius=capsule.radius * MM),
    )


def no_tool() -> Tool:
    """Tool 0: the bare flange."""
    zero = np.zeros(3)
    return Tool(index=0, name=None, X_flange_tool=np.eye(4), mass=0.0, com=zero, inertia=zero, capsule=None)


def build_frame(section: schema.FrameSection, X_base_zero: Floats) -> Frame:
    """One frame; it is given in frame 0."""
    X_base_frame = X_base_zero @ frame_pose(section)
    return Frame(index=section.index, name=section.name, X_base_frame=X_base_frame, live=section.live)


def build_conveyor(
    check: Checker, key: Key, section: schema.ConveyorSection, X_base_zero: Floats
) -> Conveyor:
    """One belt; its frame is given in frame 0."""
    parts = section.parts
    if parts is not None and parts.window_mm[0] >= parts.window_mm[1]:
        check.fault(Fault.CONTRADICTION, (*key, "parts", "window_mm"), "the window for parts is empty")
    return Conveyor(
        index=section.index,
        name=section.name,
        X_base_belt=X_base_zero @ frame_pose(section),
        counts_per_metre=section.counts_per_mm / MM,
        max_lag=section.max_lag_mm * MM,
        parts=None
        if parts is None
        else PartQueue(
            trigger=parts.trigger_mm * MM,
            window=(parts.window_mm[0] * MM, parts.window_mm[1] * MM),
            pitch=parts.pitch_mm * MM,
            taught=(parts.trigger_mm if parts.taught_mm is None else parts.taught_mm) * MM,
        ),
    )


def build_zones(check: Checker, file: schema.CellFile, frames: Any) -> tuple[Zone, ...]:
    """Zones, their corners sorted."""
    zones: list[Zone] = []
    names: set[str] = set()
    for i, section in enumerate(file.zones):
        key: Key = ("zones", i)
        corners = np.array([section.corner_1, section.corner_2]) * MM
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        if section.name in names:
            check.fault(Fault.DUPLICATE, (*key, "name"), f"two zones have the name {section.name}")
        if section.frame not in frames:
            check.fault(
                Fault.REFERENCE, (*key, "frame"), f"zone {section.name}: there is no frame {section.frame}"
            )
        if (lower == upper).any():
            check.fault(
                Fault.CONTRADICTION, (*key, "corner_2"), f"zone {section.name} is flat: it has no volume"
            )
        names.add(section.name)
        zones.append(
            Zone(
                name=section.name,
                kind=section.kind,
                frame=section.frame,
                lower=lower,
                upper=upper,
                priority=section.priority,
            )
        )
    return tuple(zones)


def build_cone(check: Checker, section: schema.Cone | None) -> OrientationCone | None:
    """The cone with its axis made a unit vector."""
    if section is None:
        return None
    axis = np.array(section.axis)
    length = float(np.linalg.norm(axis))
    if length < _NO_DIRECTION:
        check.fault(Fault.DOMAIN, ("orientation_cone", "axis"), "orientation_cone.axis must not be zero")
        return None
    return OrientationCone(axis=axis / length, half_angle=section.half_angle_deg * DEG)
