"""Calibrated tools and frames written into a cell file; what else stands in it, comments too, stays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from viapoint.repl.pointsfile import tidy
from viapoint.repl.show import coordinates
from viapoint.runtime.cell import CellError, parse_cells
from viapoint.runtime.rotations import invert_pose

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.records import Floats

_ROBOTS: Final = "robots"


def update(path: Path, cell: Cell, what: Iterable[tuple[str, int]]) -> None:
    """Put tools and frames, ("tool" or "frame", index), into a cell file. Raises OSError, ValueError.

    Of a tool the TCP, of a frame all of its pose. Of several robots it is the one that `cell` is of.
    """
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    try:
        document = tomlkit.parse(path.read_text(encoding="utf-8"))
    except (TOMLKitError, UnicodeDecodeError) as error:
        raise ValueError(str(error)) from None
    for kind, index in what:
        table = _table(document, cell.number - 1, f"{kind}s", index)
        for key, value in _values(cell, kind, index).items():
            table[key] = value
    text = tomlkit.dumps(document)
    try:
        parse_cells(text, str(path))
    except CellError as error:
        raise ValueError(error.diagnostics[0].message) from None
    path.write_text(text, encoding="utf-8")


def _table(document: Any, robot: int, key: str, index: int) -> Any:
    """The table of an index: where the file has it, or a new one."""
    import tomlkit

    robots = document.get(_ROBOTS, [])
    places = [robots[robot], document] if robot < len(robots) else [document]
    for place in places:
        for table in place.get(key, []):
            if table.get("index") == index:
                return table
    place = places[0] if key == "tools" else document
    table = tomlkit.table()
    table["index"] = index
    if key not in place:
        place[key] = tomlkit.aot()
    place[key].append(table)
    return place[key][-1]


def _values(cell: Cell, kind: str, index: int) -> Mapping[str, list[float | int]]:
    if kind == "tool":
        return {"xyz": _rounded(cell.tools[index].X_flange_tool)[:3]}
    X_zero_frame = invert_pose(cell.frames[0].X_base_frame) @ cell.frames[index].X_base_frame
    return {"xyz": _rounded(X_zero_frame)[:3], "abc": _rounded(X_zero_frame)[3:]}


def _rounded(X: Floats) -> list[float | int]:
    return [tidy(value) for value in coordinates(X)]
