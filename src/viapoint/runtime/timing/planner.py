"""Time laws for sections of path: `plan` from rest, `extend` of a law already being executed.

Solve, look at the ticks, tighten where one is over a limit, resume. Not here: equations (spline, rows),
numerics (solver, ticks).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing import exact, solver
from viapoint.runtime.timing.core import chosen
from viapoint.runtime.timing.curve import AxisCurve
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.estimate import Estimate, estimate
from viapoint.runtime.timing.exact import Knots
from viapoint.runtime.timing.law import UNLIMITED, Quality, TimeLaw, hermite
from viapoint.runtime.timing.limits import AxisLimits, SpeedBound
from viapoint.runtime.timing.rows import tightened
from viapoint.runtime.timing.section import Plan, Request, Section, State, continued, from_rest
from viapoint.runtime.timing.ticks import Ratios
from viapoint.runtime.timing.tighten import tighten

SPEED_ALLOWED: Final = 1.0
ACCELERATION_ALLOWED: Final = 1.0
JERK_ALLOWED: Final = 1.05
_ROUNDING: Final = 1e-9
"""Ratios over a limit by this much are rounding of differences."""

_TOLERANCES: Final = (2e-2, 6e-3, 3e-3)
"""Duality gap, of the duration, per pass: early passes only show where ticks are over a limit."""

_PASSES: Final = 8
_ITERATIONS: Final = 40
_GAP_OF_SENSE: Final = 0.2
_VIOLATION_OF_SENSE: Final = 0.05
"""A solve that ends above these has met rows that contradict each other."""

_SETTLED: Final = 1.01
_STRETCHES: Final = 60
_STRETCH_MARGIN: Final = 1.002
_LONGEST_STRETCH: Final = 1e4
"""A law slowed down so far and still over a limit: the curve itself jumps."""


@dataclass(frozen=True, slots=True)
class _Joint:
    """Where new law hangs on: the old law, how many of its pieces stay, time since t0 and state there."""

    law: TimeLaw
    pieces: int
    t: float
    state: State


def plan(
    curve: AxisCurve,
    limits: AxisLimits,
    speed_bound: SpeedBound,
    *,
    s_start: float,
    s_end: float,
    tick: float,
    t0: float = 0.0,
) -> TimeLaw:
    """Law from rest at s_start to rest at s_end, starting at t0 (a tick); kept to all limits at ticks.

    Raises TimingError if numbers are not finite, nothing limits the motion, or the curve jumps.
    """
    _require(s_start, s_end, tick)
    ask = Request(curve, limits, speed_bound, s_end, tick)
    est = estimate(curve, limits, speed_bound, s_start, s_end, tick)
    law = _exact(ask, est, State(s_start, 0.0, 0.0), t0, None)
    if law is None:
        law = _Search(ask, from_rest(ask, est, s_start), t0, None).run()
    return law if law.quality.stretch == 1.0 and _within(law.quality.peaks) else _stretch(ask, law)


def extend(
    law: TimeLaw,
    curve: AxisCurve,
    limits: AxisLimits,
    speed_bound: SpeedBound,
    *,
    s_end: float,
    tick: float,
    commit_time: float,
) -> TimeLaw | None:
    """`law`, already being executed, replanned from commit_time on to rest at s_end; bit-identical before.

    None if no law was found whose ticks are within all limits, across the join too, or if the old law
    is at rest by then: the caller keeps the old law, which ends at rest. Raises TimingError as `plan`.
    """
    _require(law.s_start, s_end, tick)
    if commit_time <= law.t0:
        return plan(curve, limits, speed_bound, s_start=law.s_start, s_end=s_end, tick=tick, t0=law.t0)
    joint = _joint(law, commit_time - law.t0)
    if joint is None or joint.state.s >= s_end:
        return None
    ask = Request(curve, limits, speed_bound, s_end, tick)
    est = estimate(curve, limits, speed_bound, joint.state.s, s_end, tick, joint.state.v)
    exact_law = _exact(ask, est, joint.state, law.t0, joint)
    if exact_law is not None:
        return exact_law
    section = continued(ask, est, joint.state, law.plan, joint.pieces)
    found = _Search(ask, section, law.t0, joint).run()
    return found if _within(found.quality.peaks) else None


def _joint(law: TimeLaw, since: float) -> _Joint | None:
    """Where to cut: at the first knot from `since` on if its spline can go on, else exactly there."""
    k = int(np.searchsorted(law.t, since, side="left"))
    if k >= len(law.t) - 1 and (law.plan is not None or since >= law.duration):
        return None
    if law.plan is not None:
        state = State(float(law.s[k]), float(law.v[k]), float(law.a[k]))
        return _Joint(law, k, float(law.t[k]), state)
    s, v, a = (float(x[0]) for x in law.since_start(np.array([since])))
    return _Joint(law, k, since, State(s, v, a)) if v > 0.0 else None


def _require(s_start: float, s_end: float, tick: float) -> None:
    if not (math.isfinite(s_start) and math.isfinite(s_end) and s_end > s_start):
        raise TimingError(f"a section needs s_start < s_end, both finite: {s_start!r}, {s_end!r}", s_start)
    if not (math.isfinite(tick) and tick > 0.0):
        raise TimingError(f"the tick must be a positive time: {tick!r}")


def _within(peaks: tuple[float, float, float]) -> bool:
    speed, acceleration, jerk = peaks
    return (
        speed <= SPEED_ALLOWED + _ROUNDING
        and acceleration <= ACCELERATION_ALLOWED + _ROUNDING
        and jerk <= JERK_ALLOWED
    )


def _exact(ask: Request, est: Estimate, state: State, t0: float, joint: _Joint | None) -> TimeLaw | None:
    """Ruckig's profile where every axis is linear; None elsewhere, or if its ticks are over a limit."""
    if est.straight is None:
        return None
    knots = exact.profile(est.straight, ask.limits, state, ask.s_end, ask.tick)
    if knots is None:
        return None
    law = _law(t0, knots, None) if joint is None else _continued(joint, knots, None)
    s, q = _set_points(ask, law, 0.0 if joint is None else joint.t)
    speed = np.where(s[:-1] >= state.s, np.diff(s) / (ask.tick * est.straight.bound), 0.0)
    peaks = _ratios(ask, q, speed).peaks
    law = _judged(law, Quality("exact", passes=1, peaks=peaks))
    return law if _within(peaks) else None


def _law(t0: float, knots: Knots, plan: Plan | None) -> TimeLaw:
    t, s, v, a = knots
    width, coeffs = hermite(t, s, v, a)
    limiter = np.full(len(width), UNLIMITED, dtype=np.int16)
    return TimeLaw(t0, t, s, v, a, width, coeffs, limiter, Quality("none"), plan)


def _set_points(ask: Request, law: TimeLaw, since: float) -> tuple[Floats, Floats]:
    """s (N,) and axes (N, m) at the ticks from three before `since` (s after t0) to three after the end."""
    first = math.floor(since / ask.tick) - 3
    last = math.ceil(law.duration / ask.tick) + 3
    s = chosen().positions(law.t, law.width, law.coeffs, law.s_end, first, last, ask.tick)
    q = ask.curve.values(s)
    if not np.isfinite(q).all():
        where = float(s[int(np.argmin(np.isfinite(q).all(axis=1)))])
        raise TimingError(f"an axis is not a finite number at s = {where:.9g}", where)
    return s, q


def _ratios(ask: Request, q: Floats, path_speed: Floats) -> Ratios:
    """Tick ratios of the axes q (N, m), and of the path's speed to the programmed one (N-1,)."""
    speed, acceleration, jerk = chosen().ratios(q, ask.limits, ask.tick)
    return Ratios(np.maximum(speed, path_speed), acceleration, jerk)


class _Search:
    """Solve, check, tighten, resume: one section."""

    def __init__(self, ask: Request, section: Section, t0: float, joint: _Joint | None) -> None:
        self.ask = ask
        self.section = section
        self.spline = section.rows.spline
        self.t0 = t0
        self.joint = joint
        self.passes = 0

    def run(self) -> TimeLaw:
        """The fastest law whose ticks are within all limits; if none is, the last one found."""
        c, factors = self.section.start, self.section.tightening
        state: solver.State | None = None
        best: TimeLaw | None = None
        last: TimeLaw | None = None
        for k in range(_PASSES):
            tolerance = _TOLERANCES[min(k, len(_TOLERANCES) - 1)]
            problem = tightened(self.section.rows, factors, c)
            if state is None:
                state = solver.fresh(problem, c)
            else:
                solver.lift(problem, c, state)
            better = chosen().improve(problem, c, state, tolerance, _ITERATIONS)
            if not self._solved(better, state):
                break
            c = better
            last, s, r = self._judge(c, Plan(self.spline, c, factors, self._first_knot()), state.iterations)
            good = _within(last.quality.peaks)
            if good and (best is None or last.duration < best.duration):
                best = last
            if good and state.gap <= _SETTLED * _TOLERANCES[-1] * last.duration:
                break
            if not good:
                factors = tighten(factors, self.spline.knots, s, r, self.spline.fixed)
        if best is None and last is None:
            last, _, _ = self._judge(c, Plan(self.spline, c, factors, self._first_knot()), 0)
        found = best or last
        assert found is not None
        return found

    def _solved(self, c: Floats, state: solver.State) -> bool:
        """False if the rows could not be met: tightened against what is given at a cut, for instance."""
        duration = float((self.spline.weight / np.sqrt(c)).sum())
        return state.gap <= _GAP_OF_SENSE * duration and state.violation <= _VIOLATION_OF_SENSE

    def _first_knot(self) -> int:
        return 1 if self.joint is None else self.joint.pieces - 1

    def _judge(self, c: Floats, plan: Plan, iterations: int) -> tuple[TimeLaw, Floats, Ratios]:
        """The law of c, the parameters at its ticks and their ratios."""
        self.passes += 1
        knots = self._knots(c)
        law = self._joined(knots, plan)
        since = 0.0 if self.joint is None else self.joint.t
        s, q = _set_points(self.ask, law, since)
        r = _ratios(self.ask, q, self._programmed(s))
        quality = Quality("spline", iterations, self.passes, 1.0, r.peaks)
        return _judged(law, quality), s, r

    def _knots(self, c: Floats) -> Knots:
        """Times (from the first knot), positions, speeds, accelerations; rest pieces included."""
        spline = self.spline
        x, slope = spline.at_knots(c)
        x = np.maximum(x, 0.0)
        duration = spline.durations(c, x)
        last = 3.0 * spline.rest_end / math.sqrt(x[-1])
        s, v, a = spline.knots, np.sqrt(x), 0.5 * slope
        if spline.fixed:
            s, v, a, duration = s[1:], v[1:], a[1:], duration[1:]
            before = np.zeros(0)
        else:
            first = 3.0 * spline.rest_start / math.sqrt(x[0])
            before = np.array([spline.knots[0] - spline.rest_start])
            duration = np.concatenate(([first], duration))
        t = np.concatenate(([0.0], np.cumsum(duration), [0.0]))
        t[-1] = t[-2] + last
        still = np.zeros(len(before))
        return (
            t,
            np.concatenate((before, s, [self.ask.s_end])),
            np.concatenate((still, v, [0.0])),
            np.concatenate((still, a, [0.0])),
        )

    def _joined(self, knots: Knots, plan: Plan) -> TimeLaw:
        if self.joint is None:
            return _law(self.t0, knots, plan)
        return _continued(self.joint, knots, plan)

    def _programmed(self, s: Floats) -> Floats:
        """Ratio of the ticks' mean speeds to the programmed speed of the slower piece they touch."""
        rows = self.section.rows
        piece = np.searchsorted(self.spline.knots, s, side="right") - 1
        allowed = rows.programmed[np.clip(piece, 0, len(rows.programmed) - 1)]
        ratio: Floats = np.diff(s) / (self.ask.tick * np.minimum(allowed[1:], allowed[:-1]))
        return ratio


def _judged(law: TimeLaw, quality: Quality) -> TimeLaw:
    return replace(law, quality=quality)


def _continued(joint: _Joint, knots: Knots, plan: Plan | None) -> TimeLaw:
    """The joint's law up to its cut, then the new knots (the first is the cut)."""
    old, k = joint.law, joint.pieces
    t, s, v, a = knots
    width, coeffs = hermite(t, s, v, a)
    join = np.concatenate
    return TimeLaw(
        old.t0,
        join((old.t[:k], joint.t + t)),
        join((old.s[:k], s)),
        join((old.v[:k], v)),
        join((old.a[:k], a)),
        join((old.width[:k], width)),
        join((old.coeffs[:k], coeffs)),
        join((old.limiter[:k], np.full(len(width), UNLIMITED, dtype=np.int16))),
        Quality("none"),
        plan,
    )


def _stretch(ask: Request, law: TimeLaw) -> TimeLaw:
    """The law slowed down uniformly until its ticks are within all limits."""
    factor = 1.0
    peaks = law.quality.peaks
    for _ in range(_STRETCHES):
        speed, acceleration, jerk = peaks
        needed = max(speed, math.sqrt(acceleration), math.cbrt(jerk / JERK_ALLOWED))
        factor *= max(needed, 1.0) * _STRETCH_MARGIN
        if not factor < _LONGEST_STRETCH:
            break
        slower = _slowed(law, factor)
        s, q = _set_points(ask, slower, 0.0)
        speed_ratio = np.diff(s) / (ask.tick * np.minimum(ask.bound(s)[1:], ask.bound(s)[:-1]))
        peaks = _ratios(ask, q, speed_ratio).peaks
        if _within(peaks):
            quality = Quality(law.quality.method, law.quality.iterations, law.quality.passes, factor, peaks)
            return _judged(slower, quality)
    raise TimingError("the axes jump: no speed keeps them within their limits", law.s_start)


def _slowed(law: TimeLaw, factor: float) -> TimeLaw:
    return replace(
        law, t=law.t * factor, v=law.v / factor, a=law.a / factor**2, width=law.width * factor, plan=None
    )
