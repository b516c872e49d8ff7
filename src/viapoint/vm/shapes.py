"""The parameters of a motion statement as the bytecode names them, and the call they make.

A shape is written as the parameters' codes separated by blanks: "P F R", "X Y Z A B C FC", "J1 J2 F".
Which parameters which motion takes is one table here; that it equals the language's is a test.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, unique
from functools import lru_cache

from viapoint.vm.instructions import INDEX_LIMIT, MOTIONS, Instruction
from viapoint.vm.ports import MotionKind, Speed, SpeedKind, Target


@unique
class Domain(Enum):
    """What values a parameter may have."""

    ANY = "any finite number"
    INDEX = "a whole number from 0"
    POSITIVE = "a number above 0"
    NOT_NEGATIVE = "a number from 0"

    def holds(self, value: float) -> bool:
        """Whether `value` belongs to the domain; NaN and infinity never do."""
        if not math.isfinite(value):
            return False
        match self:
            case Domain.ANY:
                return True
            case Domain.INDEX:
                return value == int(value) and 0 <= value <= INDEX_LIMIT
            case Domain.POSITIVE:
                return value > 0
            case Domain.NOT_NEGATIVE:
                return value >= 0


COORDINATES = ("X", "Y", "Z", "A", "B", "C")
"""Coordinates of a target; a shape writes them with `=`, so that `Z` stays the frame."""

_DOMAINS: dict[str, Domain] = {
    "P": Domain.INDEX,
    "Q": Domain.INDEX,
    "F": Domain.POSITIVE,
    "FC": Domain.POSITIVE,
    "FA": Domain.POSITIVE,
    "Z": Domain.INDEX,
    "T": Domain.INDEX,
    "H": Domain.ANY,
    "R": Domain.NOT_NEGATIVE,
    **{f"{axis}=": Domain.ANY for axis in COORDINATES},
    **{f"Q{axis}=": Domain.ANY for axis in COORDINATES},
}

_AXIS = re.compile(r"([JE])([1-9][0-9]?)=")

_SPEEDS = {"F": SpeedKind.GENERIC, "FC": SpeedKind.LINEAR, "FA": SpeedKind.ANGULAR}

_TARGET = frozenset({"P", *(f"{axis}=" for axis in COORDINATES)})
_VIA = frozenset({"Q", *(f"Q{axis}=" for axis in COORDINATES)})
_COMMON = frozenset({*_SPEEDS, "Z", "T", "E"})

PARAMETERS: dict[Instruction, frozenset[str]] = {
    Instruction.LINE: _TARGET | _COMMON | {"R"},
    Instruction.JOINT: _TARGET | _COMMON | {"R", "J"},
    Instruction.CIRCLE: _TARGET | _VIA | _COMMON | {"H", "R"},
    Instruction.SPLINE: _TARGET | _COMMON,
    Instruction.HOME: frozenset(_SPEEDS),
}
"""Parameters each motion takes; J and E stand for all of their axes."""

KINDS: dict[Instruction, MotionKind] = {
    Instruction.LINE: MotionKind.LINE,
    Instruction.JOINT: MotionKind.JOINT,
    Instruction.CIRCLE: MotionKind.CIRCLE,
    Instruction.SPLINE: MotionKind.SPLINE,
    Instruction.HOME: MotionKind.HOME,
}
assert set(KINDS) == set(MOTIONS) == set(PARAMETERS)


class ShapeError(ValueError):
    """A list of parameters that no motion statement can have."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A list of parameters, split by what becomes of them; entries are (name or index, position)."""

    codes: tuple[str, ...]
    domains: tuple[Domain, ...]
    axes: frozenset[str]  # the codes with J1=, E2= … reduced to J, E

    def check(self, instruction: Instruction) -> None:
        """Raise ShapeError unless `instruction` takes these parameters and has all that it needs."""
        for stranger in sorted(self.axes - PARAMETERS[instruction]):
            raise ShapeError(f"{KINDS[instruction].value} has no parameter {stranger}")
        if len(self.axes & _SPEEDS.keys()) > 1:
            raise ShapeError("more than one speed")
        if "P" in self.axes and any(f"{axis}=" in self.axes for axis in COORDINATES):
            raise ShapeError("both a point and coordinates")
        if instruction is not Instruction.HOME and not self.axes & (_TARGET | {"J", "E"}):
            raise ShapeError("no target")
        if instruction is Instruction.CIRCLE:
            if "Q" in self.axes and len(self.axes & _VIA) > 1:
                raise ShapeError("both a point and coordinates on the circle")
            if not self.axes & _VIA:
                raise ShapeError("no point on the circle")


@lru_cache(maxsize=1024)
def parse_shape(text: str) -> Shape:
    """Split a shape as stored; raises ShapeError for an unknown or repeated parameter."""
    codes = tuple(text.split(" ")) if text else ()
    if len(set(codes)) != len(codes):
        raise ShapeError(f"parameter given twice in the shape {text!r}")
    domains = []
    axes = set()
    for code in codes:
        axis = _AXIS.fullmatch(code)
        if axis is None and code not in _DOMAINS:
            raise ShapeError(f"unknown parameter in the shape {text!r}")
        domains.append(Domain.ANY if axis else _DOMAINS[code])
        axes.add(axis[1] if axis else code)
    return Shape(codes, tuple(domains), frozenset(axes))


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


def _index(words: dict[str, float], code: str) -> int | None:
    value = words.get(code)
    return None if value is None else int(value)


def _coordinates(words: dict[str, float], prefix: str) -> tuple[tuple[str, float], ...]:
    return tuple((axis, words[f"{prefix}{axis}="]) for axis in COORDINATES if f"{prefix}{axis}=" in words)


def _axes(words: dict[str, float], letter: str) -> tuple[tuple[int, float], ...]:
    found = ((_AXIS.fullmatch(code), value) for code, value in words.items())
    return tuple(sorted((int(axis[2]), value) for axis, value in found if axis and axis[1] == letter))


def motion_words(instruction: Instruction, shape: Shape, values: Sequence[float]) -> MotionWords:
    """Join a shape and its numbers."""
    words = dict(zip(shape.codes, values, strict=True))
    target = Target(_index(words, "P"), _coordinates(words, ""), _axes(words, "J"), _axes(words, "E"))
    via = None
    if instruction is Instruction.CIRCLE:
        via = Target(_index(words, "Q"), _coordinates(words, "Q"))
    speed = next((Speed(kind, words[code]) for code, kind in _SPEEDS.items() if code in words), None)
    return MotionWords(
        KINDS[instruction],
        target,
        via,
        speed,
        _index(words, "Z") or 0,
        _index(words, "T"),
        words.get("H"),
        words.get("R"),
    )
