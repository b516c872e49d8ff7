"""The parameters of a motion statement as the bytecode names them, and the call they make.

A shape is written as the parameters' keys separated by blanks: "P F R", "X= Y= Z= FC", "J1= J2= F". Which
motion takes which, and what values they may have, is the language's table of commands; nothing here
repeats it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Final, TypeVar

from viapoint.language.commands import COORDINATES, MAX_AXIS, MOTION_BY_WORD, Form, MotionCommand, Parameter
from viapoint.vm.instructions import MOTIONS, Instruction
from viapoint.vm.ports import MotionKind, Speed, SpeedKind, Target

KINDS: Final = MappingProxyType(
    {
        Instruction.LINE: MotionKind.LINE,
        Instruction.JOINT: MotionKind.JOINT,
        Instruction.CIRCLE: MotionKind.CIRCLE,
        Instruction.SPLINE: MotionKind.SPLINE,
        Instruction.HOME: MotionKind.HOME,
    }
)
assert set(KINDS) == set(MOTIONS)

INSTRUCTION_BY_WORD: Final = MappingProxyType({kind.value: one for one, kind in KINDS.items()})
"""The instruction of a motion by its word in the language."""

_AXIS = re.compile(r"([JE])([1-9][0-9]*)=")

_SPEEDS: Final = {kind.value: kind for kind in SpeedKind}


class ShapeError(ValueError):
    """A list of parameters that no motion statement can have."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A list of parameters: their keys in order, and for each its row in the table of the motion.

    `places` says where in the values a parameter stands; `coordinates`, `via`, `joints` and `auxiliary`
    are lists of an axis and its place, in the order of the axes.
    """

    keys: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    places: Mapping[str, int]
    coordinates: tuple[tuple[str, int], ...]
    via: tuple[tuple[str, int], ...]
    joints: tuple[tuple[int, int], ...]
    auxiliary: tuple[tuple[int, int], ...]
    speed: tuple[SpeedKind, int] | None


@lru_cache(maxsize=1024)
def parse_shape(instruction: Instruction, text: str) -> Shape:
    """Read a shape as stored for a motion; raises ShapeError unless a statement can have it."""
    command = MOTION_BY_WORD[KINDS[instruction].value]
    keys = tuple(text.split(" ")) if text else ()
    if len(set(keys)) != len(keys):
        raise ShapeError("a parameter is given twice")
    rows = tuple(_parameter(command, key) for key in keys)
    present = {row.key for row in rows}
    for row in rows:
        if present & set(row.excludes):
            raise ShapeError(f"{row.key} stands beside a parameter that it excludes")
    for need in command.needs:
        if not present & set(need.any_of) and not (need.all_of and present.issuperset(need.all_of)):
            raise ShapeError(f"{command.word} is given no {need.name}")
    places = {key: place for place, key in enumerate(keys)}
    return Shape(
        keys,
        rows,
        places,
        _coordinates(places, ""),
        _coordinates(places, "Q"),
        _axes(places, "J"),
        _axes(places, "E"),
        next(((kind, places[key]) for key, kind in _SPEEDS.items() if key in places), None),
    )


def _coordinates(places: dict[str, int], prefix: str) -> tuple[tuple[str, int], ...]:
    keys = ((key[:-1], prefix + key) for key in COORDINATES)
    return tuple((axis, places[key]) for axis, key in keys if key in places)


def _axes(places: dict[str, int], letter: str) -> tuple[tuple[int, int], ...]:
    found = ((_AXIS.fullmatch(key), place) for key, place in places.items())
    return tuple(sorted((int(axis[2]), place) for axis, place in found if axis and axis[1] == letter))


def _parameter(command: MotionCommand, key: str) -> Parameter:
    axis = _AXIS.fullmatch(key)
    wanted = axis[1] if axis else key
    for row in command.parameters:
        if row.key == wanted and (row.form is Form.NUMBERED) == (axis is not None):
            if axis and int(axis[2]) > MAX_AXIS:
                break
            return row
    raise ShapeError(f"{command.word} has no parameter {key!r}")


@dataclass(frozen=True, slots=True)
class MotionWords:
    """What a motion statement says by itself, before the modal state of its place is added."""

    kind: MotionKind
    target: Target
    via: Target | None
    speed: Speed | None
    frame: int
    tool: int | None
    angle: float | None
    round_edge: float | None

    @property
    def points(self) -> tuple[int | None, ...]:
        """The points of the cell that it names."""
        return self.target.point, None if self.via is None else self.via.point


_Axis = TypeVar("_Axis")


def _index(shape: Shape, values: Sequence[float], key: str) -> int | None:
    place = shape.places.get(key)
    return None if place is None else int(values[place])


def _number(shape: Shape, values: Sequence[float], key: str) -> float | None:
    place = shape.places.get(key)
    return None if place is None else values[place]


def _pick(axes: tuple[tuple[_Axis, int], ...], values: Sequence[float]) -> tuple[tuple[_Axis, float], ...]:
    return tuple([(axis, values[place]) for axis, place in axes])


def motion_words(instruction: Instruction, shape: Shape, values: Sequence[float]) -> MotionWords:
    """Join a shape and its numbers."""
    via = None
    if instruction is Instruction.CIRCLE:
        via = Target(_index(shape, values, "Q"), _pick(shape.via, values))
    return MotionWords(
        KINDS[instruction],
        Target(
            _index(shape, values, "P"),
            _pick(shape.coordinates, values),
            _pick(shape.joints, values),
            _pick(shape.auxiliary, values),
        ),
        via,
        None if shape.speed is None else Speed(shape.speed[0], values[shape.speed[1]]),
        _index(shape, values, "Z") or 0,
        _index(shape, values, "T"),
        _number(shape, values, "H"),
        _number(shape, values, "R"),
    )
