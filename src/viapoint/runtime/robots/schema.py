"""Schema of robot files, in mm and deg. Imported only where one is read."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from viapoint.runtime.tables import Finite, Frame, NotNegative, Positive, Range, Table

Six = Annotated[list[Positive], Field(min_length=6, max_length=6)]


class Parameters(Table):
    """Mechanical parameters of the family (F fig. 3-6)."""

    a1z: Finite
    a2x: Finite
    a2z: Finite
    a3z: Positive
    a4x: Finite
    a4z: Finite
    a5x: Finite
    a6x: Finite


class Joints(Table):
    """What every joint may do. `sense` is −1 where a joint counts against the family's sense."""

    sense: Annotated[list[Literal[1, -1]], Field(min_length=6, max_length=6)] | None = None
    range_deg: Annotated[list[Range], Field(min_length=6, max_length=6)]
    speed_deg_s: Six
    acceleration_deg_s2: Six | None = None
    jerk_deg_s3: Six | None = None


Vector3 = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Inertia = Annotated[list[Finite], Field(min_length=6, max_length=6)]


class Body(Table):
    """Radii of the capsules along the links, masses of base and links, and how the links' are spread.

    Centres of mass and inertias (xx yy zz xy xz yz, about them) with all joints at 0, in the base.
    """

    radius_mm: Annotated[list[NotNegative], Field(min_length=6, max_length=6)] | None = None
    mass_kg: Annotated[list[NotNegative], Field(min_length=7, max_length=7)] | None = None
    com_mm: Annotated[list[Vector3], Field(min_length=6, max_length=6)] | None = None
    inertia_kg_m2: Annotated[list[Inertia], Field(min_length=6, max_length=6)] | None = None


class RobotFile(Table):
    """A robot of the anthropomorphic family."""

    name: str
    family: Literal["anthropomorphic"]
    source: str = ""
    parameters_mm: Parameters
    joints: Joints
    flange: Frame = Field(default_factory=Frame)
    coupling: dict[str, Finite] = Field(default_factory=dict)
    body: Body = Field(default_factory=Body)
