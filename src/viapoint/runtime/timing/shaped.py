"""Time laws whose changes of speed have a shape: the faces of `planner`, with the shape in front.

Where every axis is linear the law is up, along and down in one change each; elsewhere it is the
ladder's. A law that goes on is cut where it holds its speed: a change under way is finished first. Ticks
judge as they do elsewhere. Not here: halts, which brake as quickly as the limits allow (planner).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing import ladder, planner, shapes
from viapoint.runtime.timing.core import chosen
from viapoint.runtime.timing.curve import AxisCurve
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.estimate import Estimate, StraightLine, estimate
from viapoint.runtime.timing.law import PROGRAMMED_SPEED, Knots, Quality, TimeLaw
from viapoint.runtime.timing.limits import AxisLimits, SpeedBound
from viapoint.runtime.timing.planner import checked_at, stretched
from viapoint.runtime.timing.report import Codes
from viapoint.runtime.timing.rows import Tightening
from viapoint.runtime.timing.search import Joint, continued_law, law_of, ratios, set_points, within
from viapoint.runtime.timing.section import Request, State
from viapoint.runtime.timing.shapes import Change, Shape, knots, quickest
from viapoint.runtime.timing.ticks import Ratios
from viapoint.runtime.timing.tighten import tighten

_PART: Final = 1.0 - 2e-6
"""Part of the limits planned with where they are met exactly, as in `exact`."""

_LONGER: Final = 2.0
"""Stopping distance of these changes in those of an S-curve at most: where acceleration limits both."""

_GROWTH: Final = 1.4

_PASSES: Final = 8
_HALVINGS: Final = 60
_LOWER: Final = 0.25
_LOWEST: Final = 6
"""A section in which no speed of the ladder can be reached is tried with lower ones, so many times."""


@dataclass(frozen=True, slots=True)
class Profile:
    """How laws are planned: functions with the faces of `planner.plan` and `planner.extend`."""

    plan: Callable[..., TimeLaw]
    extend: Callable[..., TimeLaw | None]
    stopping: float
    """Its stopping distances, in those of an S-curve."""
    growth: float
    """Factor between the distances tried over which it slows down."""


def profile(name: str) -> Profile:
    """The profile `s-curve`, `sinusoidal` or `bezier`."""
    if name == "s-curve":
        return Profile(planner.plan, planner.extend, 1.0, _GROWTH)
    shape = {s.name: s for s in (shapes.SINUSOIDAL, shapes.BEZIER)}[name]
    return Profile(partial(plan, shape), partial(extend, shape), _LONGER, _LONGER)


def plan(
    shape: Shape,
    curve: AxisCurve,
    limits: AxisLimits,
    speed_bound: SpeedBound,
    *,
    s_start: float,
    s_end: float,
    tick: float,
    t0: float = 0.0,
) -> TimeLaw:
    """Law from rest to rest, as `planner.plan`."""
    est = estimate(curve, limits, speed_bound, s_start, s_end, tick)
    ask = Request(curve, limits, speed_bound, s_end, checked_at(tick, est))
    law = _Search(shape, ask, est, State(s_start, 0.0, 0.0), t0, None).run()
    if law is None:
        raise TimingError("no speed is low enough for the section's limits", s_start)
    return law if within(law.quality.peaks) else stretched(ask, law)


def extend(
    shape: Shape,
    law: TimeLaw,
    curve: AxisCurve,
    limits: AxisLimits,
    speed_bound: SpeedBound,
    *,
    s_end: float,
    tick: float,
    commit_time: float,
) -> TimeLaw | None:
    """`law` replanned from where it holds its speed next after commit_time; as `planner.extend`."""
    if commit_time <= law.t0:
        return plan(shape, curve, limits, speed_bound, s_start=law.s_start, s_end=s_end, tick=tick, t0=law.t0)
    joint = _joint(law, commit_time - law.t0)
    if joint is None or joint.state.s >= s_end:
        return None
    est = estimate(curve, limits, speed_bound, joint.state.s, s_end, tick, joint.state.v)
    ask = Request(curve, limits, speed_bound, s_end, checked_at(tick, est))
    found = _Search(shape, ask, est, joint.state, law.t0, joint).run()
    return found if found is not None and within(found.quality.peaks) else None


def _joint(law: TimeLaw, since: float) -> Joint | None:
    """Where to cut: at once where the speed is held, else at the end of the change under way."""
    if since >= law.duration:
        return None
    k = int(np.searchsorted(law.t, since, side="right"))
    if law.a[k - 1] == law.a[k] == 0.0 and law.v[k - 1] == law.v[k]:
        v = float(law.v[k])
        s, _, _ = law.since_start(np.array([since]))
        return Joint(law, k, since, State(float(s[0]), v, 0.0), None)
    held = np.flatnonzero((law.a[k:] == 0.0) & (law.v[k:] > 0.0))
    if held.size == 0:
        return None
    k += int(held[0])
    return Joint(law, k, float(law.t[k]), State(float(law.s[k]), float(law.v[k]), 0.0), None)


class _Search:
    """Find changes of speed, look at the ticks, tighten the cells where one is over a limit, look again."""

    def __init__(
        self, shape: Shape, ask: Request, est: Estimate, state: State, t0: float, joint: Joint | None
    ) -> None:
        self.shape, self.ask, self.est, self.state = shape, ask, est, state
        self.t0, self.joint = t0, joint

    def run(self) -> TimeLaw | None:
        """The first law within all limits, else the last one found; None: there is no way at all."""
        if self.est.straight is not None:
            changes = _straight(self.shape, self.ask, self.est.straight, self.state)
            if changes is not None:
                law, _, _ = self._law(changes, 1)
                if within(law.quality.peaks):
                    return law
        return self._climbed()

    def _climbed(self) -> TimeLaw | None:
        grid = ladder.cells(self.ask, self.est, self.state.s)
        factors = Tightening.none(len(grid.edges) - 1)
        law: TimeLaw | None = None
        for passes in range(1, _PASSES + 1):
            changes = self._changes(grid.tightened(factors))
            if changes is None:
                break
            law, s, r = self._law(changes, passes)
            if within(law.quality.peaks):
                break
            factors = tighten(factors, grid.edges, s, r, 0, passes, chosen().touched)
        return law

    def _changes(self, grid: ladder.Cells) -> list[Change] | None:
        highest = np.inf
        for _ in range(_LOWEST):
            found = ladder.search(self.shape, grid, self.state.v, self.ask.tick)
            if found is not None or self.state.v > 0.0:
                return found
            highest = _LOWER * min(highest, float(grid.ceiling.max()))
            grid = replace(grid, bound=np.minimum(grid.bound, highest))
        return None

    def _law(self, changes: list[Change], passes: int) -> tuple[TimeLaw, Floats, Ratios]:
        """The law of changes, checked; parameters at its ticks and their ratios."""
        found: Knots = knots(self.shape, changes, self.ask.s_end)
        joint = self.joint
        law = law_of(self.t0, found, None) if joint is None else continued_law(joint, found, None)
        s, q = set_points(self.ask, law, 0.0 if joint is None else joint.t)
        bound = self.ask.bound(np.clip(s, self.state.s, self.ask.s_end))
        speed = np.diff(s) / (self.ask.tick * np.minimum(bound[1:], bound[:-1]))
        r = ratios(self.ask, q, np.where(s[:-1] >= self.state.s, speed, 0.0))
        codes = _limiters(self.ask, found)
        before = law.limiter[: len(law.limiter) - len(codes)]
        quality = Quality(self.shape.name, passes=passes, peaks=r.peaks)
        return replace(law, limiter=np.concatenate((before, codes)), quality=quality), s, r


def _straight(shape: Shape, ask: Request, line: StraightLine, state: State) -> list[Change] | None:
    """Up, along and down on a line; None if it is too short for coming to rest on it."""
    with np.errstate(divide="ignore"):
        speed, up, down, jerk = (
            float((x / line.rates).min(initial=np.inf)) * _PART
            for x in (ask.limits.speed, ask.limits.acceleration, ask.limits.braking, ask.limits.jerk)
        )
    length = ask.s_end - state.s
    top = max(min(speed, line.bound * _PART, length / ask.tick), state.v)

    def changes(v: float) -> tuple[Change, Change]:
        rising = quickest(shape, v - state.v, up, jerk, ask.tick) if v > state.v else 0.0
        rise = Change(state.s, state.v, v, rising)
        fall = Change(0.0, v, 0.0, quickest(shape, v, down, jerk, ask.tick))
        return rise, replace(fall, s=ask.s_end - fall.length)

    def fits(v: float) -> bool:
        rise, fall = changes(v)
        return rise.length + fall.length <= length

    low, high = state.v, top
    if not fits(low):
        return None
    for _ in range(0 if fits(high) else _HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    rise, fall = changes(high if fits(high) else low)
    along = fall.s - rise.s - rise.length
    held = Change(rise.s + rise.length, rise.v_to, rise.v_to, max(along, 0.0) / max(rise.v_to, 1e-300))
    return [change for change in (rise, held, fall) if change.time > 0.0]


def _limiters(ask: Request, found: Knots) -> Codes:
    """Codes (K-1,) of what holds each part back: the programmed speed where it is held, else an axis."""
    _, s, v, _ = found
    middle = 0.5 * (s[1:] + s[:-1])
    first, _, _ = ask.curve.derivatives(middle)
    axis = np.argmax(np.abs(first) / ask.limits.jerk, axis=1)
    held = (v[1:] == v[:-1]) & (v[1:] > 0.9 * ask.bound(middle))
    return np.where(held, PROGRAMMED_SPEED, axis).astype(np.int16)
