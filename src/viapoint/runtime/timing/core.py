"""Which numerics do the work: the compiled core if it was built, else its numpy twin of the same face.

The environment variable VIAPOINT_CORE chooses: `python`, `compiled` (an error if it was not built), or
`auto`, the default. Both give the same laws to rounding.
"""

from __future__ import annotations

import importlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing import solver, ticks
from viapoint.runtime.timing.limits import AxisLimits
from viapoint.runtime.timing.rows import Problem

VARIABLE: Final = "VIAPOINT_CORE"


@dataclass(frozen=True, slots=True)
class Numerics:
    """The functions that the compiled core replaces; documented at their twins in `solver` and `ticks`."""

    name: str
    improve: Callable[[Problem, Floats, solver.State, float, int], Floats]
    positions: Callable[[Floats, Floats, Floats, float, int, int, float], Floats]
    ratios: Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]]


TWIN: Final = Numerics("python", solver.improve, ticks.positions, ticks.ratios)


@cache
def compiled() -> Numerics | None:
    """The compiled core; None if it was not built."""
    try:
        core = importlib.import_module("viapoint.runtime.timing._core")
    except ImportError:
        return None
    return Numerics("compiled", core.improve, core.positions, _contiguous(core.ratios))


def _contiguous(
    ratios: Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]],
) -> Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]]:
    return lambda q, limits, tick: ratios(np.ascontiguousarray(q), limits, tick)


def chosen() -> Numerics:
    """What VIAPOINT_CORE asks for. Raises ValueError for a word it does not know, or a core not built."""
    asked = os.environ.get(VARIABLE, "auto")
    if asked not in ("auto", "python", "compiled"):
        raise ValueError(f"{VARIABLE} must be auto, python or compiled, not {asked!r}")
    core = None if asked == "python" else compiled()
    if core is None and asked == "compiled":
        raise ValueError(f"{VARIABLE} asks for the compiled core, which was not built")
    return core or TWIN
