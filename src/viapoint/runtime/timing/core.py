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
from viapoint.runtime.timing import solver, ticks
from viapoint.runtime.timing.limits import AxisLimits
from viapoint.runtime.timing.rows import Problem


@dataclass(frozen=True, slots=True)
class Numerics:
    """The functions that the compiled module replaces; documented at their twins in `solver` and `ticks`."""

    name: str
    improve: Callable[[Problem, Floats, solver.State, float, int], Floats]
    positions: Callable[[Floats, Floats, Floats, float, int, int, float], Floats]
    ratios: Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]]


TWIN: Final = Numerics("python", solver.improve, ticks.positions, ticks.ratios)


def chosen() -> Numerics:
    """Those that VIAPOINT_CORE asks for. Raises ValueError as `runtime.core.chosen`."""
    module = core.chosen("timing._core")
    return TWIN if module is None else _compiled(module)


@cache
def _compiled(module: ModuleType) -> Numerics:
    return Numerics("compiled", module.improve, module.positions, _contiguous(module.ratios))


def _contiguous(
    ratios: Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]],
) -> Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]]:
    return lambda q, limits, tick: ratios(np.ascontiguousarray(q), limits, tick)
