"""Time laws for sections of path: `plan` from rest, `extend` of a law already being executed.

Chooses the method: Ruckig's exact profile where every axis is linear, else the spline's search; and, as
the last resort of `plan`, uniform stretching. Not here: equations (spline, rows), the search itself.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from viapoint.runtime.timing import exact
from viapoint.runtime.timing.curve import AxisCurve
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.estimate import Estimate, StraightLine, estimate
from viapoint.runtime.timing.law import Quality, TimeLaw
from viapoint.runtime.timing.limits import AxisLimits, SpeedBound
from viapoint.runtime.timing.report import of_profile
from viapoint.runtime.timing.search import (
    JERK_ALLOWED,
    Joint,
    Search,
    continued_law,
    judged,
    law_of,
    ratios,
    set_points,
    within,
)
from viapoint.runtime.timing.section import Request, State, continued, from_rest

_CUT_AFTER: Final = 1e-3
"""Part of a tick after the commit time at which a law may be cut: the tick itself stays as it is."""

_HALT_DELAYS: Final = (0.0, 0.004, 0.012, 0.030, 0.060)
"""s after the commit time at which halts are tried."""

_HALT_FACTORS: Final = (1.02, 1.1, 1.25, 1.5, 2.0, 3.0)
"""Stopping distances tried, in units of that of a straight line."""

_MOST_CHECKED: Final = 400_000
"""Ticks of a law that are checked one by one. A longer one, some minutes for one section, is all but still:
its accelerations are over within a few ticks, and it is checked in larger steps."""

_STRETCHES: Final = 60
_STRETCH_MARGIN: Final = 1.002
_LONGEST_STRETCH: Final = 1e4
"""A law slowed down so far and still over a limit: the curve itself jumps."""


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
    est = estimate(curve, limits, speed_bound, s_start, s_end, tick)
    ask = Request(curve, limits, speed_bound, s_end, checked_at(tick, est))
    law = _exact(ask, est, State(s_start, 0.0, 0.0), t0, None)
    if law is None:
        law = Search(ask, from_rest(ask, est, s_start), t0, None).run()
    return law if law.quality.stretch == 1.0 and within(law.quality.peaks) else stretched(ask, law)


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
    joint = _joint(law, commit_time - law.t0 + _CUT_AFTER * tick, at_once=s_end < law.s_end)
    if joint is None or joint.state.s >= s_end:
        return None
    est = estimate(curve, limits, speed_bound, joint.state.s, s_end, tick, joint.state.v)
    ask = Request(curve, limits, speed_bound, s_end, checked_at(tick, est))
    exact_law = _exact(ask, est, joint.state, law.t0, joint)
    if exact_law is not None:
        return exact_law
    section = continued(ask, est, joint.state, joint.plan, joint.pieces)
    found = Search(ask, section, law.t0, joint).run()
    return found if within(found.quality.peaks) else None


def halt(
    law: TimeLaw,
    curve: AxisCurve,
    limits: AxisLimits,
    speed_bound: SpeedBound,
    *,
    tick: float,
    commit_time: float,
) -> TimeLaw | None:
    """`law` brought to rest soon after commit_time, before its own end; bit-identical until then.

    Growing stopping distances are tried, from that of a straight line on; where none keeps all limits (the
    law uses them up just then), a little later. None: the law's own end is the nearest rest that was found.
    """
    for delay in _HALT_DELAYS:
        joint = _joint(law, commit_time - law.t0 + delay, at_once=True)
        if joint is None:
            return None
        state = joint.state
        rates = np.abs(curve.derivatives(np.array([state.s]))[0][0])
        shortest = exact.stopping_distance(StraightLine(rates, math.inf), limits, state, tick)
        for factor in _HALT_FACTORS:
            s_end = state.s + max(shortest, state.v * tick) * factor
            if s_end >= law.s_end:
                break
            found = extend(
                law, curve, limits, speed_bound, s_end=s_end, tick=tick, commit_time=commit_time + delay
            )
            if found is not None:
                return found
    return None


def _joint(law: TimeLaw, since: float, at_once: bool) -> Joint | None:
    """Where to cut: at the first knot from `since` on if its spline can go on, else (or `at_once`) there."""
    if since >= law.duration:
        return None
    k = int(np.searchsorted(law.t, since, side="left"))
    if law.plan is not None and not at_once:
        state = State(float(law.s[k]), float(law.v[k]), float(law.a[k]))
        return Joint(law, k, float(law.t[k]), state, law.plan) if k < len(law.t) - 1 else None
    s, v, a = (float(x[0]) for x in law.since_start(np.array([since])))
    return Joint(law, k, since, State(s, v, a), None) if v > 0.0 else None


def checked_at(tick: float, est: Estimate) -> float:
    """Step at which a law is checked: its ticks, unless they are beyond number."""
    return max(tick, float(est.t[-1]) / _MOST_CHECKED)


def _require(s_start: float, s_end: float, tick: float) -> None:
    if not (math.isfinite(s_start) and math.isfinite(s_end) and s_end > s_start):
        raise TimingError(f"a section needs s_start < s_end, both finite: {s_start!r}, {s_end!r}", s_start)
    if not (math.isfinite(tick) and tick > 0.0):
        raise TimingError(f"the tick must be a positive time: {tick!r}")


def _exact(ask: Request, est: Estimate, state: State, t0: float, joint: Joint | None) -> TimeLaw | None:
    """Ruckig's profile where every axis is linear; None elsewhere, or if its ticks are over a limit."""
    if est.straight is None:
        return None
    knots = exact.profile(est.straight, ask.limits, state, ask.s_end, ask.tick)
    if knots is None:
        return None
    law = law_of(t0, knots, None) if joint is None else continued_law(joint, knots, None)
    s, q = set_points(ask, law, 0.0 if joint is None else joint.t)
    speed = np.where(s[:-1] >= state.s, np.diff(s) / (ask.tick * est.straight.bound), 0.0)
    peaks = ratios(ask, q, speed).peaks
    if not within(peaks):
        return None
    codes = of_profile(est.straight, ask.limits, knots)
    before = law.limiter[: len(law.limiter) - len(codes)]
    law = judged(law, Quality("exact", passes=1, peaks=peaks))
    return replace(law, limiter=np.concatenate((before, codes)))


def stretched(ask: Request, law: TimeLaw) -> TimeLaw:
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
        s, q = set_points(ask, slower, 0.0)
        bound = ask.bound(s)
        speed_ratio = np.diff(s) / (ask.tick * np.minimum(bound[1:], bound[:-1]))
        peaks = ratios(ask, q, speed_ratio).peaks
        if within(peaks):
            quality = Quality(law.quality.method, law.quality.iterations, law.quality.passes, factor, peaks)
            return judged(slower, quality)
    raise TimingError("the axes jump: no speed keeps them within their limits", law.s_start)


def _slowed(law: TimeLaw, factor: float) -> TimeLaw:
    return replace(
        law, t=law.t * factor, v=law.v / factor, a=law.a / factor**2, width=law.width * factor, plan=None
    )
