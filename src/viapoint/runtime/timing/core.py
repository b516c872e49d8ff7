"""The numerics of the time law that have a compiled module: that one, or their numpy twins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Final

import numpy as np

from viapoint.runtime import core
from viapoint.runtime.records import Floats
from viapoint.runtime.timing import programmed, rooms, rows, selection, solver, ticks
from viapoint.runtime.timing.limits import AxisLimits
from viapoint.runtime.timing.rows import AxisRows, Problem, Rows, Tightening


@dataclass(frozen=True, slots=True)
class Numerics:
    """The functions that compiled modules replace, documented at their twins: `solver`, `ticks`, `rows`,
    `selection`, `programmed` and `rooms`."""

    name: str
    improve: Callable[[Problem, Floats, solver.State, float, int], Floats]
    positions: Callable[[Floats, Floats, Floats, float, int, int, float], Floats]
    ratios: Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]]
    axis_rows: Callable[..., AxisRows]
    tightened: Callable[[Rows, Tightening, Floats], Problem]
    usage: Callable[[Problem, Floats], tuple[Floats, Floats]]
    allowed: Callable[[Floats, Floats, Floats], Floats]
    room: Callable[[Floats, Floats], Floats]


TWIN: Final = Numerics(
    "python",
    solver.improve,
    ticks.positions,
    ticks.ratios,
    rows.axis_rows,
    rows.tightened,
    selection.usage,
    programmed.allowed,
    rooms.room,
)


def chosen() -> Numerics:
    """Those that VIAPOINT_CORE asks for. Raises ValueError as `runtime.core.chosen`."""
    modules = core.chosen("timing._core"), core.chosen("timing._rows")
    return TWIN if modules[0] is None or modules[1] is None else _compiled(modules[0], modules[1])


@cache
def _compiled(module: ModuleType, rows_module: ModuleType) -> Numerics:
    return Numerics(
        "compiled",
        module.improve,
        module.positions,
        _contiguous(module.ratios),
        rows_module.axis_rows,
        rows_module.tightened,
        rows_module.usage,
        rows_module.allowed,
        rows_module.room,
    )


def _contiguous(
    ratios: Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]],
) -> Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]]:
    return lambda q, limits, tick: ratios(np.ascontiguousarray(q), limits, tick)
