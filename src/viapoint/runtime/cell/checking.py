"""Collects what is wrong with a cell file while it is built, and the checks its sections share."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence
from typing import Protocol, TypeVar

import numpy as np

from viapoint.language.diagnostics import Diagnostic
from viapoint.language.lexical import is_keyword
from viapoint.language.tree import name_key
from viapoint.language.units import DEG, MM
from viapoint.runtime.cell.model import Floats
from viapoint.runtime.documents import Document, Fault, Key
from viapoint.runtime.robots import Robot

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_CODE_AND_NUMBER = re.compile(r"[A-Za-z]{1,2}[0-9]+")  # P1, DI3: what the language already reads otherwise


# What a check of one section takes from another: without that other one it would say nonsense.
_DEPENDS = {
    ("zones", Fault.REFERENCE): "frames",
    ("io", Fault.REFERENCE): "io",
    ("robot", Fault.CONTRADICTION): "limits",
    ("points", Fault.CONTRADICTION): "limits",
    ("points", Fault.LENGTH): "auxiliary_axes",
}


def _stands(fault: Fault, key: Key, dropped: Collection[Key]) -> bool:
    if fault is Fault.MISSING_KEY:
        return not any(key[:-1] == other[:-1] for other in dropped)
    needed = _DEPENDS.get((str(key[0]), fault))
    return not any(other and other[0] == needed for other in dropped)


class Indexed(Protocol):
    """A section with an index and perhaps a name."""

    @property
    def index(self) -> int: ...
    @property
    def name(self) -> str | None: ...


Section = TypeVar("Section", bound=Indexed)
Built = TypeVar("Built")


class Checker:
    """The faults of one document."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.found: list[tuple[Fault, Key, Diagnostic]] = []

    def fault(self, fault: Fault, key: Key, message: str, hint: str | None = None) -> None:
        """Note a fault at a key."""
        self.found.append((fault, key, self.document.fault(fault, key, message, hint)))

    def faults(self, dropped: Collection[Key]) -> list[Diagnostic]:
        """What was found, without what is only so because faulty parts of the file were left out."""
        return [diagnostic for fault, key, diagnostic in self.found if _stands(fault, key, dropped)]

    def per_joint(self, key: Key, values: Sequence[float], robot: Robot, *, one: bool = False) -> Floats:
        """Values, one per joint (or, with `one`, one for all), as (n,); a wrong length is a fault."""
        n = robot.joint_count
        if one and len(values) == 1:
            return np.full(n, float(values[0]))
        if len(values) != n:
            name = ".".join(str(part) for part in key)
            self.fault(
                Fault.LENGTH,
                key,
                f"{name} must be {n} values, one per joint of {robot.name}, not {len(values)}",
            )
            return np.resize(np.array(values or [1.0], dtype=np.float64), n)
        return np.array(values, dtype=np.float64)

    def joints(self, key: Key, values: Sequence[float], robot: Robot) -> Floats:
        """Joint positions in deg or mm → (n,) rad or m, which must lie in the joint ranges."""
        q = self.per_joint(key, values, robot) * joint_units(robot)
        if len(values) == robot.joint_count:
            self._check_range(key, q, robot)
        return q

    def _check_range(self, key: Key, q: Floats, robot: Robot) -> None:
        units = joint_units(robot)
        for i in np.flatnonzero(~robot.limits.contain(q)).tolist():
            low, high = robot.limits.lower[i] / units[i], robot.limits.upper[i] / units[i]
            self.fault(
                Fault.CONTRADICTION,
                (*key, i),
                f"J{i + 1} = {q[i] / units[i]:g} is outside its range {low:g} … {high:g}",
            )

    def indexed(
        self, key: str, sections: Sequence[Section], build: Callable[[Key, Section], Built]
    ) -> dict[int, Built]:
        """Sections by index, each built; an index or a name given twice is a fault."""
        built: dict[int, Built] = {}
        names: dict[str, int] = {}
        for i, section in enumerate(sections):
            here: Key = (key, i)
            if section.index in built:
                self.fault(Fault.DUPLICATE, (*here, "index"), f"{key}: index {section.index} is used twice")
            built.setdefault(section.index, build(here, section))
            self.unique_name((*here, "name"), section.name, section.index, names)
        return built

    def unique_name(self, key: Key, name: str | None, index: int, names: dict[str, int]) -> None:
        """A name must be one of the language, and belong to one index; `names` collects them."""
        if name is None:
            return
        self.check_name(key, name)
        if names.setdefault(name_key(name), index) != index:
            other = names[name_key(name)]
            self.fault(Fault.DUPLICATE, key, f"the name {name} is used twice, by {other} and {index}")

    def check_name(self, key: Key, name: str) -> None:
        """A name is a letter, then letters, digits and _, and not a code followed by digits."""
        if not _NAME.fullmatch(name) or _CODE_AND_NUMBER.fullmatch(name):
            self.fault(
                Fault.DOMAIN,
                key,
                f"{name!r} cannot be a name",
                "a letter, then letters, digits or _; not a code and a number such as P1",
            )

    def check_word(self, key: Key, name: str | None, codes: Collection[str] = ()) -> None:
        """What a program calls by its name must not be a word of the language, nor one of the codes."""
        if name is not None and (is_keyword(name) or name.upper() in codes):
            meant = "a parameter without its value" if name.upper() in codes else "a word of the language"
            self.fault(Fault.DOMAIN, key, f"{name!r} cannot be a name: a program reads it as {meant}")


def joint_units(robot: Robot) -> Floats:
    """(n,) rad per deg, or m per mm."""
    return np.where(robot.prismatic, MM, DEG)
