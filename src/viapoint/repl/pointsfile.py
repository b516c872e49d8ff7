"""Taught points written to a file of points, with what else stands in it, comments too, left as it is."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from viapoint.language.units import DEG, MM
from viapoint.repl.show import coordinates

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell, Point
    from viapoint.runtime.records import Floats

_DIGITS: Final = 6
"""Decimals of mm and deg in the file: a nanometre."""


def update(path: Path, points: Iterable[Point], units: Floats, cell: Cell) -> None:
    """Put `points` into the file, which is made if there is none. Raises OSError, ValueError.

    `units` (n,) are what a joint's mm or deg is in m or rad.
    """
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    text = path.read_text(encoding="utf-8") if path.exists() else ""
    try:
        document = tomlkit.parse(text)
    except TOMLKitError as error:
        raise ValueError(str(error)) from None
    for point in points:
        table = tomlkit.inline_table()
        table.update(_values(point, units, cell))
        document[f"P{point.index}"] = table
    path.write_text(tomlkit.dumps(document), encoding="utf-8")


def _values(point: Point, units: Floats, cell: Cell) -> dict[str, Any]:
    values: dict[str, Any] = {} if point.name is None else {"name": point.name}
    if point.joints is not None:
        values["j"] = [tidy(v) for v in (point.joints / units).tolist()]
    else:
        assert point.pose is not None, "a point is taught as a pose or as joints"
        values |= {name: tidy(v) for name, v in zip("xyzabc", coordinates(point.pose), strict=True)}
    if point.auxiliary:
        axes = [cell.auxiliary_axes[number] for number in sorted(cell.auxiliary_axes)]
        pairs = zip(axes, point.auxiliary, strict=True)
        values["e"] = [tidy(value / (MM if axis.prismatic else DEG)) for axis, value in pairs]
    return values


def tidy(value: float) -> float | int:
    """Rounded, and a whole number where it is one."""
    rounded = round(value, _DIGITS) + 0.0
    return int(rounded) if rounded.is_integer() else rounded
