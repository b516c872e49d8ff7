"""The loop around the solver, for one section: solve, look at the ticks, tighten where one is over, resume.

Not here: equations (spline, rows), numerics (solver, ticks), what to do if no law is found (planner).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing import selection, solver
from viapoint.runtime.timing.core import chosen
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.law import UNLIMITED, Knots, Quality, TimeLaw
from viapoint.runtime.timing.report import of_rows
from viapoint.runtime.timing.rows import Tightening
from viapoint.runtime.timing.section import Plan, Request, Section, State
from viapoint.runtime.timing.selection import Selection
from viapoint.runtime.timing.ticks import Ratios
from viapoint.runtime.timing.tighten import tighten

SPEED_ALLOWED: Final = 1.0
ACCELERATION_ALLOWED: Final = 1.0
JERK_ALLOWED: Final = 1.05
_ROUNDING: Final = 1e-9
"""Ratios over a limit by this much are rounding of differences."""

_ROUGHLY: Final = 5e-2
_FINALLY: Final = 1e-3
"""Duality gap, of the duration: a first solve only finds √x at the ends of pieces for the second."""

_PASSES: Final = 12
_ITERATIONS: Final = 40
_GAP_OF_SENSE: Final = 0.2
_VIOLATION_OF_SENSE: Final = 0.05
"""A solve that ends above these has met rows that contradict each other."""

_CRAWLS: Final = 20.0
"""Durations, in estimated ones, beyond which a law in motion crawls: rows that were tightened against a
given start are then met by standing all but still, and every pass slows it down tenfold."""

_UNCHECKED: Final = (math.inf, math.inf, math.inf)
"""Peaks of a law that is refused without looking at its ticks: there may be millions."""


@dataclass(frozen=True, slots=True)
class Joint:
    """Where new law hangs on: the old law, how many of its pieces stay, time since t0 and state there.

    `plan` is the old law's, if the cut is at one of its knots.
    """

    law: TimeLaw
    pieces: int
    t: float
    state: State
    plan: Plan | None


def within(peaks: Sequence[float], more: Sequence[float] = (0.0, 0.0, 0.0)) -> bool:
    """True if no tick is over a limit, though speed, acceleration and jerk were `more` than their peaks."""
    speed, acceleration, jerk = (peak + extra for peak, extra in zip(peaks, more, strict=True))
    return (
        speed <= SPEED_ALLOWED + _ROUNDING
        and acceleration <= ACCELERATION_ALLOWED + _ROUNDING
        and jerk <= JERK_ALLOWED
    )


def law_of(t0: float, knots: Knots, plan: Plan | None) -> TimeLaw:
    """The law through knots, starting at t0; not judged yet."""
    t, s, v, a = knots
    width, coeffs = chosen().hermite(t, s, v, a)
    limiter = np.full(len(width), UNLIMITED, dtype=np.int16)
    return TimeLaw(t0, t, s, v, a, width, coeffs, limiter, Quality("none"), plan)


def positions(law: TimeLaw, first: int, last: int, tick: float) -> Floats:
    """s at the ticks first … last, counted from the law's start: the very numbers its check looked at."""
    return chosen().positions(law.t, law.width, law.coeffs, law.s_end, first, last, tick)


def set_points(ask: Request, law: TimeLaw, since: float) -> tuple[Floats, Floats]:
    """s (N,) and axes (N, m) at the ticks from three before `since` (s after t0) to three after the end."""
    first = math.floor(since / ask.tick) - 3
    last = math.ceil(law.duration / ask.tick) + 3
    s = positions(law, first, last, ask.tick)
    q = ask.curve.values(s)
    if not np.isfinite(q).all():
        where = float(s[int(np.argmin(np.isfinite(q).all(axis=1)))])
        raise TimingError(f"an axis is not a finite number at s = {where:.9g}", where)
    return s, q


def ratios(ask: Request, q: Floats, path_speed: Floats) -> Ratios:
    """Tick ratios of the axes q (N, m), and of the path's speed to the programmed one (N-1,)."""
    speed, acceleration, jerk = chosen().ratios(q, ask.limits, ask.tick)
    return Ratios(np.maximum(speed, path_speed), acceleration, jerk)


class Search:
    """Solve, check, tighten, resume: one section."""

    def __init__(self, ask: Request, section: Section, t0: float, joint: Joint | None) -> None:
        self.ask = ask
        self.section = section
        self.spline = section.rows.spline
        self.t0 = t0
        self.joint = joint
        self.numerics = chosen()
        self.passes = 0
        self.solved: solver.State | None = None
        self.selected: Selection | None = None

    def run(self) -> TimeLaw:
        """The first law whose ticks are within all limits; if none is, the last one found."""
        factors = self.section.tightening
        c = self._solve(self.section.start, factors, _ROUGHLY)
        c = c if c is None else self._solve(c, factors, _FINALLY)
        law, s, r = self._judge(self.section.start if c is None else c, factors)
        while (
            c is not None and self.passes < _PASSES and not (within(law.quality.peaks) or self._crawls(law))
        ):
            knots, fixed = self.spline.knots, self.spline.fixed
            factors = tighten(factors, knots, s, r, fixed, self.passes, self.numerics.touched)
            c = self._solve(c, factors, _FINALLY)
            if c is not None:
                law, s, r = self._judge(c, factors)
        return self._reported(law)

    def _reported(self, law: TimeLaw) -> TimeLaw:
        """The law with what limits its pieces; rest pieces are as their neighbours."""
        if law.plan is None:
            return law
        c = law.plan.c
        problem = self.numerics.tightened(self.section.rows, law.plan.tightening, c)
        codes = of_rows(self.section.rows, self.numerics.usage(problem, c), c)
        before = codes[:1] if self.joint is None else self.joint.law.limiter[: self.joint.pieces]
        codes = codes if self.joint is None else codes[1:]
        return replace(law, limiter=np.concatenate((before, codes, codes[-1:])))

    def _solve(self, c: Floats, factors: Tightening, tolerance: float) -> Floats | None:
        """Better coefficients; None if the rows contradict each other (tightened against a given start)."""
        every = self.numerics.tightened(self.section.rows, factors, c)
        selected = self.selected or selection.select(self.numerics.usage(every, c))
        while True:
            problem = self.numerics.cut(every, selected)
            if self.solved is None:
                self.solved = self.numerics.fresh(problem, c)
            elif selected is self.selected:
                self.numerics.lift(problem, c, self.solved)
            else:
                self.solved = replace(self.numerics.fresh(problem, c), iterations=self.solved.iterations)
            self.selected = selected
            c = self.numerics.improve(problem, c, self.solved, tolerance, _ITERATIONS)
            if not self._sensible(c, self.solved):
                return None
            more = selection.missed(self.numerics.usage(every, c), selected)
            if more is None:
                return c
            selected = more

    def _sensible(self, c: Floats, state: solver.State) -> bool:
        duration = solver.duration(self.spline.weight, c)
        return state.gap <= _GAP_OF_SENSE * duration and state.violation <= _VIOLATION_OF_SENSE

    def _first_knot(self) -> int:
        return 1 if self.joint is None else self.joint.pieces - 1

    def _judge(self, c: Floats, factors: Tightening) -> tuple[TimeLaw, Floats, Ratios]:
        """The law of c, the parameters at its ticks and their ratios."""
        self.passes += 1
        knots = self.numerics.trace(self.spline, c, self.ask.s_end)
        law = self._joined(knots, Plan(self.spline, c, factors, self._first_knot()))
        if self._crawls(law):
            none = np.zeros(0)
            return (
                judged(law, Quality("spline", passes=self.passes, peaks=_UNCHECKED)),
                none,
                Ratios(none, none, none),
            )
        since = 0.0 if self.joint is None else self.joint.t
        s, q = set_points(self.ask, law, since)
        r = ratios(self.ask, q, self._programmed(s))
        quality = Quality(
            "spline", 0 if self.solved is None else self.solved.iterations, self.passes, 1.0, r.peaks
        )
        return judged(law, quality), s, r

    def _crawls(self, law: TimeLaw) -> bool:
        """Whether a law in motion takes so long that its rows cannot be meant."""
        return self.joint is not None and law.duration - self.joint.t > _CRAWLS * self.section.expected

    def _joined(self, knots: Knots, plan: Plan) -> TimeLaw:
        if self.joint is None:
            return law_of(self.t0, knots, plan)
        return continued_law(self.joint, knots, plan)

    def _programmed(self, s: Floats) -> Floats:
        """Ratio of the ticks' mean speeds to the programmed ones."""
        rows = self.section.rows
        allowed = self.numerics.allowed(rows.edges, rows.programmed, s)
        ratio: Floats = np.diff(s) / (self.ask.tick * allowed)
        return ratio


def judged(law: TimeLaw, quality: Quality) -> TimeLaw:
    """The law, with what its check has found."""
    return replace(law, quality=quality)


def continued_law(joint: Joint, knots: Knots, plan: Plan | None) -> TimeLaw:
    """The joint's law up to its cut, then the new knots (the first is the cut)."""
    old, k = joint.law, joint.pieces
    t, s, v, a = knots
    width, coeffs = chosen().hermite(t, s, v, a)
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
