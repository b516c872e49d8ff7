"""The validated cell: a robot and what stands around it. Frozen, SI and radians; read by everyone.

Poses are given in the robot's base, however the file gives them.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, unique
from pathlib import Path
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from viapoint.language.source import Source
from viapoint.language.tree import name_key
from viapoint.runtime.robots import Robot

Floats = npt.NDArray[np.float64]


@unique
class SignalKind(Enum):
    """The four kinds of signals by their code in the language, and variables, which are kept beside them."""

    DIGITAL_INPUT = "DI"
    DIGITAL_OUTPUT = "DO"
    ANALOG_INPUT = "AI"
    ANALOG_OUTPUT = "AO"
    VARIABLE = "$"

    __hash__ = object.__hash__
    """Each is there once: quicker than by its name, and signals are keys everywhere."""


@dataclass(frozen=True, slots=True)
class Signal:
    """One signal of the cell, or a variable: by its number in the order of the cell, and its name."""

    kind: SignalKind
    index: int
    name: str = field(default="", compare=False)  # of a variable, without its $

    def __str__(self) -> str:
        return f"{self.kind.value}{self.name or self.index}"


DIGITAL: Final = frozenset({SignalKind.DIGITAL_INPUT, SignalKind.DIGITAL_OUTPUT})
_SIGNAL: Final = re.compile(r"(DI|DO|AI|AO)([0-9]{1,9})", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Io:
    """How many signals there are (numbered from 1), their names, and the outputs held off in a dry run.

    `variables` are those shared with the application, with the values they have at first.
    """

    counts: Mapping[SignalKind, int]
    names: Mapping[str, Signal]
    process_outputs: frozenset[int]
    variables: Mapping[str, bool | float] = field(default_factory=dict)

    def find(self, text: str) -> Signal | None:
        """`DI3`, `$count`, or a name of the cell; None where the text is none of them.

        A signal that is found by its code need not exist.
        """
        named = self.names.get(text)
        if named is not None:
            return named
        if text.startswith("$"):
            return self.variable(text[1:])
        found = _SIGNAL.fullmatch(text)
        return None if found is None else Signal(SignalKind(found[1].upper()), int(found[2]))

    def variable(self, name: str) -> Signal | None:
        """A variable by its name, whatever the case."""
        for index, each in enumerate(self.variables, start=1):
            if name_key(each) == name_key(name):
                return Signal(SignalKind.VARIABLE, index, each)
        return None

    def of_kind(self, kind: SignalKind) -> Iterator[Signal]:
        """All signals of a kind, by their number."""
        if kind is SignalKind.VARIABLE:
            return (Signal(kind, i, name) for i, name in enumerate(self.variables, start=1))
        return (Signal(kind, i) for i in range(1, self.counts[kind] + 1))

    def exists(self, signal: Signal) -> bool:
        """Whether the cell has it."""
        count = len(self.variables) if signal.kind is SignalKind.VARIABLE else self.counts[signal.kind]
        return 1 <= signal.index <= count

    def at_first(self, signal: Signal) -> bool | float:
        """The value a signal or variable has before anyone writes it."""
        if signal.kind is SignalKind.VARIABLE:
            return self.variables[signal.name]
        return False if signal.kind in DIGITAL else 0.0

    def is_switch(self, signal: Signal) -> bool:
        """Whether it is true or false; otherwise it is a number."""
        return isinstance(self.at_first(signal), bool)

    @property
    def digital_inputs(self) -> int:
        """How many digital inputs there are."""
        return self.counts[SignalKind.DIGITAL_INPUT]

    @property
    def digital_outputs(self) -> int:
        """How many digital outputs there are."""
        return self.counts[SignalKind.DIGITAL_OUTPUT]

    @property
    def analog_inputs(self) -> int:
        """How many analog inputs there are."""
        return self.counts[SignalKind.ANALOG_INPUT]

    @property
    def analog_outputs(self) -> int:
        """How many analog outputs there are."""
        return self.counts[SignalKind.ANALOG_OUTPUT]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Point:
    """A taught point: `pose` X_frame_tcp (4, 4) in the frame of the command, or `joints` (n,)."""

    index: int
    name: str | None
    pose: Floats | None
    joints: Floats | None
    auxiliary: tuple[float, ...] = ()  # E1, E2 … in m or rad
    live: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Capsule:
    """From the flange's origin to `to` (3,) m, in the flange; radius in m."""

    to: Floats
    radius: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tool:
    """A tool: mass in kg, centre of mass (3,) m and principal inertia (3,) kg·m² in the flange frame."""

    index: int
    name: str | None
    X_flange_tool: Floats
    mass: float
    com: Floats
    inertia: Floats
    capsule: Capsule | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """A frame for points. `live`: the application may move it while a program runs."""

    index: int
    name: str | None
    X_base_frame: Floats
    live: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PathLimits:
    """Of the TCP along its path, in m and s, and of its orientation, in rad and s."""

    speed: float
    acceleration: float
    deceleration: float
    jerk: float
    angular_speed: float
    angular_acceleration: float
    angular_jerk: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DefaultSpeed:
    """What a motion runs at when no speed was ever programmed: `path` m/s, `joint` rad/s."""

    path: float
    joint: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Filter:
    """The joint-space filter behind the inverse kinematics; 0 ticks: none."""

    ticks: int
    sigma: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PartQueue:
    """Parts on a belt, m along it: where they are seen, may be worked on, and how far apart they come."""

    trigger: float
    window: tuple[float, float]
    pitch: float
    taught: float
    """Where a part is for which points are taught: how far the part has come from there displaces them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Conveyor:
    """A belt that travels along X of its frame."""

    index: int
    name: str | None
    X_base_belt: Floats
    counts_per_metre: float
    max_lag: float  # m
    parts: PartQueue | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Zone:
    """A cuboid in a frame, by two opposite corners (3,) m."""

    name: str
    kind: Literal["safe", "forbidden", "exclusive"]
    frame: int
    lower: Floats
    upper: Floats
    priority: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OrientationCone:
    """The tool's X axis must stay within `half_angle` (rad) of `axis` (3,), a unit vector in the base."""

    axis: Floats
    half_angle: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AuxiliaryAxis:
    """An axis E_i beside the robot's joints, in m or rad and s."""

    number: int
    prismatic: bool
    carries_robot: bool
    lower: float
    upper: float
    speed: float
    acceleration: float
    jerk: float
    start: float = 0.0  # where it stands when a program begins; outside the range: the end next to it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drives:
    """Per joint (n,), rad; None where auto-tuning decides."""

    kind: Literal["ideal", "servo", "dynamic"]
    gear: Floats | None
    direction: Floats
    homing_offset: Floats
    encoder_counts: Floats | None
    following_error: Floats
    in_position: Floats
    torque: Floats | None  # N·m


@dataclass(frozen=True, slots=True, kw_only=True)
class CellIndex:
    """What a program may refer to, as indices and names: what the compiler is told of a cell."""

    points: Collection[int]
    joint_points: Collection[int]
    point_names: Mapping[str, int]
    tools: Collection[int]
    frames: Collection[int]
    conveyors: Collection[int]
    digital_inputs: int
    digital_outputs: int
    analog_inputs: int
    analog_outputs: int
    signal_names: Mapping[str, str]
    joints: int
    auxiliary: Collection[int]
    asynchronous: Collection[int]
    variables: Mapping[str, bool]  # whether one is true or false, not a number


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class Cell:
    """A robot with its limits, where it stands, what it carries, points, signals and surroundings."""

    robot: Robot
    home: Floats  # (n,)
    X_world_base: Floats
    tick: float  # s
    lookahead: int
    default_speed: DefaultSpeed
    profile: Literal["s-curve", "sinusoidal", "bezier"]
    path_tolerance: float  # m
    filter: Filter
    emergency_deceleration_factor: float
    tracking_reserve: float
    mm_per_deg: float
    path_limits: PathLimits
    points: Mapping[int, Point]
    tools: Mapping[int, Tool]  # 0: none, identity
    frames: Mapping[int, Frame]  # 0: the base, or with a zero frame the world
    io: Io
    m_functions: Mapping[int, bool]  # declared ones: True where synchronous; every other one is
    conveyors: Mapping[int, Conveyor]
    zones: tuple[Zone, ...]
    orientation_cone: OrientationCone | None
    auxiliary_axes: Mapping[int, AuxiliaryAxis]
    drives: Drives
    source: Source
    points_source: Source | None = None  # the file of points, where they have their own
    number: int = 1  # of the robot in the cell
    robot_name: str | None = None  # where the cell gives it one
    program: Path | None = None  # what this robot runs, where the cell says so
    priority: int = 0  # at exclusive zones; the higher goes first

    def live_place(self, points: Sequence[int | None], frame: int) -> str | None:
        """The first of points (None: not given) and a frame that may change while a program runs."""
        live = [f"P{n}" for n in points if n is not None and n in self.points and self.points[n].live]
        if frame in self.frames and self.frames[frame].live:
            live.append(f"Z{frame}")
        return live[0] if live else None

    @property
    def variables(self) -> Mapping[str, bool | float]:
        """Those shared with the application, with the values they have at first."""
        return self.io.variables

    def names(self) -> CellIndex:
        """What a program may refer to."""
        return CellIndex(
            points=frozenset(self.points),
            joint_points=frozenset(i for i, point in self.points.items() if point.joints is not None),
            point_names={point.name: i for i, point in self.points.items() if point.name is not None},
            tools=frozenset(self.tools),
            frames=frozenset(self.frames),
            conveyors=frozenset(self.conveyors),
            digital_inputs=self.io.digital_inputs,
            digital_outputs=self.io.digital_outputs,
            analog_inputs=self.io.analog_inputs,
            analog_outputs=self.io.analog_outputs,
            signal_names={name: str(signal) for name, signal in self.io.names.items()},
            joints=self.robot.joint_count,
            auxiliary=frozenset(self.auxiliary_axes),
            asynchronous=frozenset(i for i, synchronous in self.m_functions.items() if not synchronous),
            variables={name: isinstance(value, bool) for name, value in self.variables.items()},
        )
