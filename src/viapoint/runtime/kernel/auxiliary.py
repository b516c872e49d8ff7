"""The auxiliary axes of a cell as the kernel counts them: in the order of their numbers, arrays (k,).

Values, limits and names; how the axes move with the path is geometry's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import AuxiliaryAxis, Cell, Point
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import JointLimits
from viapoint.vm.ports import Target


@dataclass(frozen=True)
class AuxiliaryAxes:
    """The axes E_i of a cell; with none of them every array is empty."""

    axes: tuple[AuxiliaryAxis, ...] = ()

    @classmethod
    def of(cls, cell: Cell) -> AuxiliaryAxes:
        """Those of a cell."""
        return cls(tuple(cell.auxiliary_axes[number] for number in sorted(cell.auxiliary_axes)))

    def __len__(self) -> int:
        return len(self.axes)

    @cached_property
    def carrier(self) -> int | None:
        """Index of the axis that carries the robot along X of its base; None where it stands."""
        return next((k for k, axis in enumerate(self.axes) if axis.carries_robot), None)

    @property
    def start(self) -> Floats:
        """Where the axes stand when a program begins: zero, or the end of their range next to it."""
        return np.array([min(max(axis.start, axis.lower), axis.upper) for axis in self.axes])

    @cached_property
    def units(self) -> Floats:
        """What the language's unit of each axis is: 1 mm in m, 1 deg in rad."""
        return np.array([MM if axis.prismatic else DEG for axis in self.axes])

    @cached_property
    def limits(self) -> JointLimits:
        """Of all axes, m or rad and s."""
        columns = ("lower", "upper", "speed", "acceleration", "jerk")
        return JointLimits(**{name: np.array([getattr(a, name) for a in self.axes]) for name in columns})

    def name(self, index: int) -> str:
        """As the language says it."""
        return f"E{self.axes[index].number}"

    def target(self, e: Floats, target: Target, point: Point | None, line: int) -> Floats:
        """Where a motion from e (k,) takes the axes: to the point's values, and to those of the statement.

        What neither gives stays. Raises PlanningError for an axis the cell lacks, and outside its range.
        """
        if not self.axes and not target.auxiliary:
            return e
        result, units = e.copy(), self.units
        if point is not None:
            result[: len(point.auxiliary)] = point.auxiliary
        numbers = [axis.number for axis in self.axes]
        for number, value in target.auxiliary:
            if number not in numbers:
                raise PlanningError("E316", f"the cell has no auxiliary axis E{number}", line)
            index = numbers.index(number)
            result[index] = value * units[index]
        inside = self.limits.contain(result)
        if not inside.all():
            raise self.out_of_range(int(np.argmin(inside)), float(result[np.argmin(inside)]), line)
        return result

    def out_of_range(self, index: int, value: float, line: int) -> PlanningError:
        """The failure of an axis that would stand at `value`."""
        axis, unit = self.axes[index], self.units[index]
        name = "mm" if axis.prismatic else "deg"
        return PlanningError(
            "E307",
            f"{self.name(index)} = {value / unit:.1f} {name} is outside its range "
            f"{axis.lower / unit:g}…{axis.upper / unit:g} {name}",
            line,
            f"correct the value, or the range of {self.name(index)} in the cell",
        )


NO_AXES: Final = AuxiliaryAxes()
"""Of a cell without auxiliary axes, or of a path of the robot alone."""
