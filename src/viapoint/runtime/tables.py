"""Building blocks of the schemas of TOML files. Import it where a file is checked: pydantic loads slowly."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class Table(BaseModel):
    """A table of a file: unknown keys refused, no conversion of types (an integer is a number)."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


_FARTHEST = 1e9
"""As in programs: no coordinate is larger, and arithmetic with it stays exact enough."""
_LARGEST = 1e15
"""Limits so large that nothing else than the tick limits the motion; far beyond, arithmetic overflows."""

Finite = Annotated[float, Field(ge=-_FARTHEST, le=_FARTHEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, le=_LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, le=_LARGEST, allow_inf_nan=False)]
Index = Annotated[int, Field(ge=1)]
Count = Annotated[int, Field(ge=0)]
Vector = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Range = Annotated[list[Finite], Field(min_length=2, max_length=2)]
Breakpoint = Annotated[list[Finite], Field(min_length=2, max_length=2)]


class Frame(Table):
    """Position in mm and orientation in deg."""

    xyz: Vector = Field(default=[0.0, 0.0, 0.0])
    abc: Vector = Field(default=[0.0, 0.0, 0.0])
