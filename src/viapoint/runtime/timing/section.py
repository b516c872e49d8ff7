"""One section made ready for the solver: knots, rows, programmed speeds; and what an extension needs of it.

A section runs from rest, or from a state in motion, to rest. Not here: the loop around the solver.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing import knots as knotting
from viapoint.runtime.timing import programmed
from viapoint.runtime.timing import rows as limiting
from viapoint.runtime.timing.core import chosen
from viapoint.runtime.timing.curve import INSET, AxisCurve
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.estimate import Estimate
from viapoint.runtime.timing.limits import AxisLimits, SpeedBound
from viapoint.runtime.timing.rows import Rows, Tightening
from viapoint.runtime.timing.spline import Spline

_START_SHARE: Final = 0.7
"""Part of the estimated speed the solver starts from, squared below: inside most limits."""

_JERK_COUNTS: Final = 2.0
"""Differences of accelerations within ±a never exceed 2a per tick: a jerk limit above needs no row."""

_STOP_SHARE: Final = 0.25
"""Longest first piece in motion, as part of v²/|a|: its coefficient must stay positive."""

_BRAKING_SHARE: Final = 0.6
"""Part of the estimated speed below which a plan is taken to brake for its old end."""

_TOO_FAST: Final = 1.3
"""Part of the estimated speed above which a plan does not brake for a nearer end."""

_NEXT_WIDTH: Final = 0.6
"""First new knot after kept ones, in widths of the last kept piece."""

_RESUME_SHARE: Final = 0.9
_RESUME_LEAST: Final = 0.3
"""Start of a resumed solve: a little below the old plan, so that its limits are met with room."""

_LOOSER_ACCELERATION: Final = 1.001
_LOOSER_JERK: Final = 1.01
"""Rows beside a cut are met by coefficients that are given: rounding must not make them unmeetable."""


@dataclass(frozen=True, slots=True)
class Plan:
    """What an extension needs: the spline, its coefficients, its tightening; the law's index of knot 0."""

    spline: Spline
    c: Floats
    tightening: Tightening
    first_knot: int

    def moved(self, by: float) -> Plan:
        """The plan of the same curve, with so much added to its parameter."""
        return replace(self, spline=replace(self.spline, knots=self.spline.knots + by))


@dataclass(frozen=True, slots=True)
class State:
    """The motion at the start of a section: parameter, ṡ and s̈."""

    s: float
    v: float
    a: float


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked: the curve and its limits to s_end, checked at ticks."""

    curve: AxisCurve
    limits: AxisLimits
    bound: SpeedBound
    s_end: float
    tick: float


@dataclass(frozen=True, slots=True)
class Breaks:
    """The curve's breaks inside a section, and where knots stand for them (k,) each."""

    places: Floats
    knots: Floats


@dataclass(frozen=True, slots=True)
class Section:
    """Rows, the solver's start (n,), first factors, and the estimated duration (s)."""

    rows: Rows
    start: Floats
    tightening: Tightening
    expected: float


def from_rest(ask: Request, est: Estimate, s_start: float) -> Section:
    """The section from rest at s_start to rest at the end."""
    length = ask.s_end - s_start
    rest = knotting.rest_length(est, est.jerk_start, length)
    breaks = _breaks(ask, est)
    marks = _marks(breaks, s_start + rest, ask, est, length)
    knots = _knots(ask, est, marks)
    spline = chosen().make(knots, rest, ask.s_end - marks[-1])
    none = Tightening.none(len(spline.width))
    return Section(_rows(ask, spline, breaks), _guess(est, spline), none, float(est.t[-1]))


def from_motion(ask: Request, est: Estimate, state: State) -> Section:
    """The section from a state in motion to rest; nothing is known of the pieces before."""
    breaks = _breaks(ask, est)
    marks = _marks(breaks, state.s, ask, est, ask.s_end - state.s)
    knots = _knots(ask, est, marks)
    return with_state(ask, est, knots, breaks, state)


def with_state(ask: Request, est: Estimate, knots: Floats, breaks: Breaks, state: State) -> Section:
    """The section over knots whose first lies at the state's parameter; a virtual piece carries the state."""
    x, slope = state.v**2, 2.0 * state.a
    reach = _STOP_SHARE * x / max(abs(state.a), 1e-12 * x / (knots[-1] - knots[0]))
    gap = knots[1] - knots[0]
    if gap > reach:  # half of a gap hardly wider: two knots must not fall together
        knots = np.concatenate((knots[:1], [knots[0] + min(reach, 0.5 * gap)], knots[1:]))
    ahead = knots[1] - knots[0]
    before = min(ahead, reach)
    spline = chosen().make(np.concatenate(([knots[0] - before], knots)), 0.0, ask.s_end - knots[-1])
    start = _guess(est, spline)
    start[:2] = x - 0.5 * slope * before, x + 0.5 * slope * ahead
    return Section(_rows(ask, spline, breaks), start, Tightening.none(len(spline.width)), float(est.t[-1]))


def continued(ask: Request, est: Estimate, state: State, old: Plan | None, pieces: int) -> Section:
    """The section from a state in motion; what the old plan found beyond it (after `pieces`) is kept."""
    if old is None:
        return from_motion(ask, est, state)
    first = pieces - old.first_knot
    last = _still_good(est, old, first)
    if last <= first + 1:
        return from_motion(ask, est, state)
    kept = old.spline.knots[first : last + 1]
    breaks = _breaks(ask, est)
    marks = _marks(breaks, kept[-1], ask, est, ask.s_end - state.s)
    fresh = _knots(ask, est, marks)
    fresh = fresh[fresh > kept[-1] + _NEXT_WIDTH * (kept[-1] - kept[-2])]
    section = with_state(ask, est, np.concatenate((kept, fresh)), breaks, state)
    return _resumed(section, old, first, last)


def _still_good(est: Estimate, old: Plan, first: int) -> int:
    """Last knot of the old plan that fits the new estimate: where one of them brakes, it does not."""
    x, _ = old.spline.at_knots(old.c)
    knots = old.spline.knots
    v, estimated = np.sqrt(np.maximum(x, 0.0)), np.interp(knots, est.s, est.v)
    good = np.flatnonzero(v[first:-1] >= _BRAKING_SHARE * estimated[first:-1])
    last = first + int(good[-1]) if good.size else first
    too_fast = np.flatnonzero((v[first:] > _TOO_FAST * estimated[first:]) | (knots[first:] >= est.s[-1]))
    return min(last, first + int(too_fast[0]) - 1) if too_fast.size else last


def _resumed(section: Section, old: Plan, first: int, last: int) -> Section:
    """The start and the tightening of kept pieces as the old plan had them, a little looser at the cut."""
    start, now = section.start.copy(), section.tightening
    spline, k = section.rows.spline, last - first
    if abs(spline.width[1] - old.spline.width[first]) > INSET * spline.width[1]:
        return section
    middle = 0.5 * (spline.knots[1:] + spline.knots[:-1])
    before = np.interp(middle, 0.5 * (old.spline.knots[1:] + old.spline.knots[:-1]), old.c)
    known = middle < old.spline.knots[-1]
    known[:2] = False
    start[known] = np.maximum(_RESUME_SHARE * before, _RESUME_LEAST * start)[known]
    now.acceleration[1 : k + 2] = old.tightening.acceleration[first : last + 1]
    now.jerk[1 : k + 1] = old.tightening.jerk[first:last]
    now.speed[1 : k + 1] = old.tightening.speed[first:last]
    now.acceleration[:4] /= _LOOSER_ACCELERATION
    now.jerk[:3] /= _LOOSER_JERK
    return replace(section, start=start, tightening=now)


def _breaks(ask: Request, est: Estimate) -> Breaks:
    return Breaks(est.breaks, programmed.knots_of(est.breaks, ask.bound, ask.tick))


def _marks(breaks: Breaks, first: float, ask: Request, est: Estimate, length: float) -> Floats:
    """First knot, breaks, last knot; the rest pieces outside are free of breaks that matter."""
    last = ask.s_end - knotting.rest_length(est, est.jerk_end, length)
    inner = breaks.knots
    return np.concatenate(([first], inner[(inner > first) & (inner < last)], [last]))


def _knots(ask: Request, est: Estimate, marks: Floats) -> Floats:
    dt = knotting.spacing(est, ask.tick)
    changing = float(np.diff(est.t)[~est.calm[1:]].sum())
    if changing > knotting.MOST * dt:
        hours = float(est.t[-1]) / 3600.0
        what = f"it would take some {hours:.3g} hours: a limit of acceleration or jerk is too small for it"
        raise TimingError(what, float(marks[0]))
    return chosen().place(est.s, est.t, est.calm, marks, dt, ask.tick)


def _guess(est: Estimate, spline: Spline) -> Floats:
    """Coefficients the solver starts from: a part of the estimated speed."""
    return chosen().guess(est.s, est.v, spline.knots, _START_SHARE)


def _rows(ask: Request, spline: Spline, breaks: Breaks) -> Rows:
    numerics, given = chosen(), spline.fixed > 0
    derivatives = ask.curve.derivatives(numerics.insides(spline.knots, given))
    counts = ask.limits.jerk * ask.tick < _JERK_COUNTS * np.maximum(
        ask.limits.acceleration, ask.limits.braking
    )
    in_jerk = np.where(counts, ask.limits.jerk, np.inf)
    places, owner = numerics.asked(
        spline.knots, spline.width, spline.rest_start, spline.rest_end, breaks.places
    )
    speeds, bad = numerics.on_pieces(ask.bound(places), owner, len(spline.width), given)
    if bad >= 0:
        raise TimingError("the programmed speed is not a positive number", float(spline.knots[bad]))
    edges = numerics.edges(spline.knots, breaks.places, breaks.knots)
    first, second, third = derivatives
    ends = third[:-1:2], third[1::2]
    return limiting.build(spline, first[::2], second[::2], ends, ask.limits, speeds, edges, in_jerk, numerics)
