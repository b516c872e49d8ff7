"""Schema of scenario files, in the file's units. Imported only where one is read."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from viapoint.runtime.tables import Breakpoint, Count, Index, NotNegative, Positive, Table

Breakpoints = Annotated[list[Breakpoint], Field(min_length=1)]


class AtSection(Table):
    t_s: NotNegative
    set: dict[str, Any]


class WhenSection(Table):
    """`signal` or `m` is the cause; `set`, `reset_m` or both the answer."""

    signal: str | None = None
    becomes: bool | float = True
    m: Count | None = None
    robots: list[Index] = Field(default=[1])
    after_s: NotNegative = 0.0
    set: dict[str, Any] = Field(default={})
    reset_m: Count | None = None


class ConveyorSection(Table):
    index: Index
    speed_mm_s: Breakpoints
    noise_counts: NotNegative = 0.0


class CorrectionSection(Table):
    frame: Literal["base", "frame", "tool"]
    x_mm: Breakpoints | None = None
    y_mm: Breakpoints | None = None
    z_mm: Breakpoints | None = None
    max_rate_mm_s: Positive


class ScenarioFile(Table):
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    at: list[AtSection] = Field(default=[])
    when: list[WhenSection] = Field(default=[])
    conveyor: list[ConveyorSection] = Field(default=[])
    correction: list[CorrectionSection] = Field(default=[])
