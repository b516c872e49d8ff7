"""The numerics of the time law that have a compiled module: that one, or their numpy twins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Final

from viapoint.runtime import core
from viapoint.runtime.records import Bools, Floats, Ints
from viapoint.runtime.timing import (
    knots,
    law,
    programmed,
    rooms,
    rows,
    samples,
    selection,
    solver,
    spline,
    ticks,
    tighten,
)
from viapoint.runtime.timing.law import Knots
from viapoint.runtime.timing.limits import AxisLimits
from viapoint.runtime.timing.rows import AxisRows, Problem, Rows, Tightening
from viapoint.runtime.timing.spline import Spline


@dataclass(frozen=True, slots=True)
class Numerics:
    """The functions that compiled modules replace, documented at their twins."""

    name: str
    improve: Callable[[Problem, Floats, solver.State, float, int], Floats]
    fresh: Callable[[Problem, Floats], solver.State]
    lift: Callable[[Problem, Floats, solver.State], None]
    positions: Callable[[Floats, Floats, Floats, float, int, int, float], Floats]
    ratios: Callable[[Floats, AxisLimits, float], tuple[Floats, Floats, Floats]]
    touched: Callable[[Floats, Floats, Floats, float, float], Floats]
    trace: Callable[[Spline, Floats, float], Knots]
    hermite: Callable[[Floats, Floats, Floats, Floats], tuple[Floats, Floats]]
    axis_rows: Callable[..., AxisRows]
    sides: Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]
    bounds: Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]
    tightened: Callable[[Rows, Tightening, Floats], Problem]
    cut: Callable[[Problem, selection.Selection], Problem]
    usage: Callable[[Problem, Floats], tuple[Floats, Floats]]
    allowed: Callable[[Floats, Floats, Floats], Floats]
    room: Callable[[Floats, Floats], Floats]
    ceilings: Callable[..., tuple[Floats, Floats, int]]
    first_samples: Callable[[Floats], Floats]
    dips: Callable[[Floats, Floats, Floats, float], tuple[Floats, Ints]]
    merged: Callable[[Floats, Floats, Ints], Floats]
    even: Callable[[Floats, Floats], Floats | None]
    rooms: Callable[[Floats, Floats, Floats, Floats], samples.Rooms]
    scanned: Callable[..., tuple[Floats, Floats, Floats, tuple[float, float, float]]]
    timed: Callable[..., tuple[Floats, Floats, Bools]]
    place: Callable[[Floats, Floats, Bools, Floats, float, float], Floats]
    make: Callable[[Floats, float, float], Spline]
    guess: Callable[[Floats, Floats, Floats, float], Floats]
    insides: Callable[[Floats, bool], Floats]
    asked: Callable[[Floats, Floats, float, float, Floats], tuple[Floats, Ints]]
    on_pieces: Callable[[Floats, Ints, int, bool], tuple[Floats, int]]
    edges: Callable[[Floats, Floats, Floats], Floats]


TWIN: Final = Numerics(
    "python",
    improve=solver.improve,
    fresh=solver.fresh,
    lift=solver.lift,
    positions=ticks.positions,
    ratios=ticks.ratios,
    touched=tighten.touched,
    trace=spline.trace,
    hermite=law.hermite,
    axis_rows=rows.axis_rows,
    sides=rows.sides,
    bounds=rows.bounds,
    tightened=rows.tightened,
    cut=selection.cut,
    usage=selection.usage,
    allowed=programmed.allowed,
    room=rooms.room,
    ceilings=rooms.ceilings,
    first_samples=samples.first_samples,
    dips=samples.dips,
    merged=samples.merged,
    even=samples.even,
    rooms=samples.rooms,
    scanned=samples.scanned,
    timed=samples.timed,
    place=knots.place,
    make=spline.make,
    guess=knots.guess,
    insides=knots.insides,
    asked=programmed.asked,
    on_pieces=programmed.on_pieces,
    edges=programmed.edges,
)

_MODULES: Final = ("timing._core", "timing._rows", "timing._laws", "timing._samples", "timing._knots")


def chosen() -> Numerics:
    """Those that VIAPOINT_CORE asks for. Raises ValueError as `runtime.core.chosen`."""
    return _chosen(core.asked)


@cache
def _chosen(asked: str) -> Numerics:
    """Those that are chosen while VIAPOINT_CORE asks for that."""
    modules = [core.chosen(name) for name in _MODULES]
    return TWIN if None in modules else _compiled(*modules)


@cache
def _compiled(
    solving: ModuleType, rowing: ModuleType, lawing: ModuleType, sampling: ModuleType, knotting: ModuleType
) -> Numerics:
    return Numerics(
        "compiled",
        improve=solving.improve,
        fresh=lawing.fresh,
        lift=lawing.lift,
        positions=solving.positions,
        ratios=solving.ratios,
        touched=lawing.touched,
        trace=lawing.trace,
        hermite=lawing.hermite,
        axis_rows=rowing.axis_rows,
        sides=lawing.sides,
        bounds=lawing.bounds,
        tightened=rowing.tightened,
        cut=lawing.cut,
        usage=rowing.usage,
        allowed=rowing.allowed,
        room=rowing.room,
        ceilings=lawing.ceilings,
        first_samples=sampling.first_samples,
        dips=sampling.dips,
        merged=sampling.merged,
        even=sampling.even,
        rooms=sampling.rooms,
        scanned=sampling.scanned,
        timed=sampling.timed,
        place=knotting.place,
        make=knotting.make,
        guess=knotting.guess,
        insides=knotting.insides,
        asked=knotting.asked,
        on_pieces=knotting.on_pieces,
        edges=knotting.edges,
    )
