"""What the compiler is told of a cell: which indices exist, and nothing about what they mean."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True, kw_only=True)
class CellNames:
    """The indices a program may use in a cell; a collection per kind (a `range` does).

    `joint_points` are those of `points` that were taught in joint space. `joints` is the number of
    joints, `auxiliary` the numbers of the auxiliary axes. `asynchronous` are the M functions that the
    cell declares so; every other one is synchronous. `point_names` gives the index of a named point,
    `signal_names` what a named signal is: DI3, AO1. `variables` are the shared ones: True where one is true
    or false, False where it is a number.
    """

    points: Collection[int]
    joint_points: Collection[int] = ()
    tools: Collection[int]
    frames: Collection[int]
    conveyors: Collection[int]
    inputs: Collection[int]
    outputs: Collection[int]
    joints: int
    auxiliary: Collection[int] = ()
    asynchronous: Collection[int] = ()
    analog_inputs: Collection[int] = ()
    analog_outputs: Collection[int] = ()
    live_points: Collection[int] = ()
    live_frames: Collection[int] = ()
    point_names: Mapping[str, int] = field(default_factory=dict)
    signal_names: Mapping[str, str] = field(default_factory=dict)
    variables: Mapping[str, bool] = field(default_factory=dict)
