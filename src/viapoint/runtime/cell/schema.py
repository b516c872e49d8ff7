"""Schema of cell files, in the file's units (mm, deg, s). Imported only where one is read.

Shapes, types and domains of single values stand here; what depends on several of them (numbers of
joints, references, duplicates) is checked in `build.py`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from viapoint.runtime.tables import Count, Finite, Frame, Index, NotNegative, Positive, Range, Table, Vector

Joints = list[Finite]
PositiveJoints = list[Positive]


def _listed(value: object) -> object:
    """One value that stands for all joints, as a list of one."""
    return value if isinstance(value, list) else [value]


PerJoint = Annotated[list[Finite], BeforeValidator(_listed)]
PositivePerJoint = Annotated[list[Positive], BeforeValidator(_listed)]


class RobotSection(Table):
    model: str
    zero_frame: Frame = Field(default_factory=Frame)
    home: Joints | None = None


class DefaultSpeed(Table):
    path_mm_s: Positive = 100.0
    joint_deg_s: Positive = 20.0


class Filter(Table):
    ticks: Count = 0
    sigma: Positive = 0.4


class Controller(Table):
    tick_s: Annotated[float, Field(ge=1e-4, le=1e-2, allow_inf_nan=False)] = 0.001
    lookahead: Annotated[int, Field(ge=1, le=1_000_000)] = 1024
    default_speed: DefaultSpeed = Field(default_factory=DefaultSpeed)
    profile: Literal["s-curve", "sinusoidal", "bezier"] = "s-curve"
    path_tolerance_mm: NotNegative = 0.02
    filter: Filter = Field(default_factory=Filter)
    emergency_deceleration_factor: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 2.0
    tracking_reserve: Annotated[float, Field(ge=0.0, lt=1.0, allow_inf_nan=False)] = 0.1
    mm_per_deg: Positive = 10.0


class PathSection(Table):
    speed_mm_s: Positive = 2000.0
    acceleration_mm_s2: Positive = 10000.0
    deceleration_mm_s2: Positive | None = None
    jerk_mm_s3: Positive | None = None
    angular_speed_deg_s: Positive = 360.0
    angular_acceleration_deg_s2: Positive = 1800.0
    angular_jerk_deg_s3: Positive | None = None


class JointSection(Table):
    range_deg: list[Range] | None = None
    speed_deg_s: PositiveJoints | None = None
    acceleration_deg_s2: PositiveJoints | None = None
    jerk_deg_s3: PositiveJoints | None = None
    torque_nm: PositiveJoints | None = None


class Limits(Table):
    path: PathSection = Field(default_factory=PathSection)
    joints: JointSection = Field(default_factory=JointSection)


class ToolCapsule(Table):
    to: Vector
    radius: Positive


class ToolSection(Frame):
    index: Index
    name: str | None = None
    mass_kg: NotNegative = 0.0
    com: Vector = Field(default=[0.0, 0.0, 0.0])
    inertia_kg_m2: Annotated[list[NotNegative], Field(min_length=3, max_length=3)] = Field(
        default=[0.0, 0.0, 0.0]
    )
    capsule: ToolCapsule | None = None


class FrameSection(Frame):
    index: Index
    name: str | None = None
    live: bool = False


class PointSection(Table):
    """In path space (x … c) or in joint space (j)."""

    name: str | None = None
    x: Finite | None = None
    y: Finite | None = None
    z: Finite | None = None
    a: Finite | None = None
    b: Finite | None = None
    c: Finite | None = None
    j: Joints | None = None
    e: Joints = Field(default=[])
    live: bool = False


class IoSection(Table):
    digital_inputs: Annotated[int, Field(ge=0, le=65536)] = 32
    digital_outputs: Annotated[int, Field(ge=0, le=65536)] = 32
    analog_inputs: Annotated[int, Field(ge=0, le=65536)] = 8
    analog_outputs: Annotated[int, Field(ge=0, le=65536)] = 8
    names: dict[str, str] = Field(default={})
    process_outputs: list[str] = Field(default=[])


class Parts(Table):
    trigger_mm: Finite = 0.0
    window_mm: Range
    pitch_mm: Positive
    taught_mm: Finite | None = None


class BeltSection(Table):
    """What one robot of several makes of a conveyor's parts."""

    index: Index
    window_mm: Range
    taught_mm: Finite | None = None


class ConveyorSection(Frame):
    index: Index
    name: str | None = None
    counts_per_mm: Positive
    max_lag_mm: Positive = 1.0
    parts: Parts | None = None


class ZoneSection(Table):
    name: str
    kind: Literal["safe", "forbidden", "exclusive"]
    frame: Count = 0
    corner_1: Vector
    corner_2: Vector
    priority: int = 0


class Body(Table):
    radius_mm: list[NotNegative]


class Cone(Table):
    axis: Vector
    half_angle_deg: Annotated[float, Field(gt=0.0, le=180.0, allow_inf_nan=False)]


class AuxiliaryAxisSection(Table):
    kind: Literal["linear", "rotary"]
    carries_robot: bool = False
    range: Range
    speed: Positive
    acceleration: Positive
    jerk: Positive | None = None


class DrivesSection(Table):
    """One value per joint, or one for all."""

    kind: Literal["ideal", "servo", "dynamic"] = "ideal"
    gear: PositivePerJoint | None = None
    direction: Annotated[list[Literal[1, -1]], BeforeValidator(_listed)] = Field(default=[1])
    homing_offset_deg: PerJoint = Field(default=[0.0])
    coupling: dict[str, Finite] = Field(default={})
    encoder_counts: Annotated[list[Index], BeforeValidator(_listed)] | None = None
    following_error_deg: PositivePerJoint = Field(default=[1.0])
    in_position_deg: PositivePerJoint = Field(default=[0.01])


class CellFile(Table):
    robot: RobotSection
    controller: Controller = Field(default_factory=Controller)
    limits: Limits = Field(default_factory=Limits)
    tools: list[ToolSection] = Field(default=[])
    frames: list[FrameSection] = Field(default=[])
    points: dict[str, PointSection] = Field(default={})
    io: IoSection = Field(default_factory=IoSection)
    m_functions: dict[str, Literal["sync", "async"]] = Field(default={})
    variables: dict[str, Any] = Field(default={})
    conveyors: list[ConveyorSection] = Field(default=[])
    zones: list[ZoneSection] = Field(default=[])
    body: Body | None = None
    orientation_cone: Cone | None = None
    auxiliary_axes: dict[str, AuxiliaryAxisSection] = Field(default={})
    drives: DrivesSection = Field(default_factory=DrivesSection)


class MemberFile(CellFile):
    """The tables of one robot of several, together with those that all share."""

    name: str | None = None
    program: str | None = None
    priority: int = 0
    belts: list[BeltSection] = Field(default=[])
