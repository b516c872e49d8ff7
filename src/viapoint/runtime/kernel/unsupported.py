"""Settings of a cell that are understood but cannot be run yet: refused, not ignored."""

from __future__ import annotations

from collections.abc import Iterator

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.failure import PlanningError


def refusal(cell: Cell) -> PlanningError | None:
    """Why this cell cannot be run, naming the first key that asks for something not there yet."""
    key = next(_unsupported(cell), None)
    if key is None:
        return None
    return PlanningError("E392", f"{key} cannot be run yet", 0, "take the key out of the file")


def _unsupported(cell: Cell) -> Iterator[str]:
    if cell.drives.kind != "ideal":
        yield f'drives.kind = "{cell.drives.kind}"'
    if any(axis.carries_robot for axis in cell.auxiliary_axes.values()):
        for zone in cell.zones:
            if zone.frame != 0:  # it stands while the base moves; zones are looked at from the base
                yield f"zone {zone.name} in frame {zone.frame}, with an axis that carries the robot,"
