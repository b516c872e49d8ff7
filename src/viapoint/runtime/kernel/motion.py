"""Motion along the route: which stretch the time law covers, and when and how it is planned anew.

Between two exact stops the law covers a horizon of pieces and ends at rest at its end; before the
braking for that end begins, the horizon is moved on. Everything that changes a motion under way (more
path, another override, a halt, an emergency stop) is one operation: the law is planned anew from the next
tick on, on the same path, within the limits; what was sent stays as it is.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.kernel.horizon import Horizon
from viapoint.runtime.kernel.leg import Leg
from viapoint.runtime.kernel.limiters import Limiters
from viapoint.runtime.kernel.lingering import Lingering
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.memo import Memo
from viapoint.runtime.records import Floats
from viapoint.runtime.timing import (
    AxisLimits,
    TimeLaw,
    TimingError,
    halt,
    positions,
    profile,
    within,
)

_HORIZON_PIECES: Final = 48
"""Pieces a law covers at least: some fifteen blocks with round edges; 3–4 blocks are within 0.2 % of full
knowledge, and the cost of a solve grows with its length."""

_RENEW_PIECES: Final = 8
"""Pieces left in the law when it is extended."""

_FELT_BEFORE: Final = 0.15
"""s before its last braking from which on a law is planned anew: what comes earlier is what it would be
without that end."""

_STOPPING_SHARE: Final = 3.0
"""The horizon is at least this many stopping distances long, and renewed while half of it is left."""

_ASKED_BEFORE: Final = 2
"""Ticks before braking in which a zone is asked for: the next law begins after that in which it is given."""

_ROUNDING: Final = 1e-9
"""Part of a tick by which a law's end may pass a tick and count as in it."""

_STILL: Final = 1e-12
"""Rate of an axis below which its speed limit bounds nothing."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Ticks of a moving path: s (N,), axis functions (N, n + k + 4), and whether the last one is at rest."""

    s: Floats
    columns: Floats
    arrived: bool


class Mover:
    """Where the robot is on the route, and the law by which it goes on, forward or back.

    Laws run along r = direction · s, so that going back is planned and timed like going forward.
    """

    def __init__(self, cell: Cell, route: Route, override: float) -> None:
        self.law: TimeLaw | None = None
        self.s = 0.0
        self.direction = 1.0
        """1 forward, −1 back along the route, of the law or of the one before it."""
        self.override = override
        self.share = 1.0
        """Below 1 the path is run in a slower time, where what carries it needs more of the joints."""
        self.pause: Callable[[float, float], float | None] = lambda s, direction: None
        """The next place from s on, in a direction, at which to be at rest though the path goes on."""
        self.limiters = Limiters(cell)
        self._route = route
        self._tick = cell.tick
        joints, others, path = cell.robot.limits, AuxiliaryAxes.of(cell).limits, cell.path_limits
        acceleration = np.append(joints.acceleration, others.acceleration)
        self.limits = AxisLimits(
            speed=np.concatenate((joints.speed, others.speed, (path.speed, path.angular_speed))),
            acceleration=np.append(acceleration, (path.acceleration, path.angular_acceleration)),
            jerk=np.concatenate((joints.jerk, others.jerk, (path.jerk, path.angular_jerk))),
            deceleration=np.append(acceleration, (path.deceleration, path.angular_acceleration)),
        )
        self._path = path
        self._lingers = (0.5 * cell.filter.ticks + 1.0) * cell.tick if cell.filter.ticks else 0.0
        """s for which a programmed speed holds beyond where it is programmed: half of the filter."""
        self._profile = profile(cell.profile)
        self._keyed = self.limits, _key(self.limits)
        self._known: Memo[tuple[TimeLaw, tuple[float, ...]]] = Memo()
        self._slowing_until = -np.inf  # r up to which a higher override still holds, while slowing down
        self._slowing_from = override

    @property
    def scale(self) -> float:
        """Of all speeds: the override and the share."""
        return self.override * self.share

    @property
    def _bounds(self) -> AxisLimits:
        """The limits that laws keep: those of the axes in the slower time of a share."""
        share = self.share
        return self.limits if share == 1.0 else self.limits.scaled(share**2, share**3)

    @property
    def wanted(self) -> float:
        """s up to which the route should be known for the law to be as fast as the limits allow."""
        return self.s + self._reach(self.s)

    def start(self, tick: int, line: int) -> bool:
        """From rest at `tick`: plan a law along what is known of the route; False if nothing is.

        Raises PlanningError, naming `line`, where no law keeps the limits.
        """
        return self._start(tick, line, 1.0, self._horizon(self.s))

    def start_back(self, tick: int, line: int) -> bool:
        """From rest at `tick`: back to the exact stop before, or as far as the route is kept."""
        end, pause = self._route.stop_before(self.s), self.pause(self.s, -1.0)
        return self._start(tick, line, -1.0, -(end if pause is None else max(end, pause)))

    def _start(self, tick: int, line: int, direction: float, end: float) -> bool:
        begin = direction * self.s
        if end <= begin:
            return False
        self.direction, self._slowing_until = direction, -np.inf
        t0, leg = tick * self._tick, self._route.leg(begin, end) if direction > 0.0 else None
        try:
            law = None if leg is None else self._again(leg, begin, end)
            self.law = law.moved(t0, begin, end) if law else self._from_rest(self._curve(end), begin, end, t0)
        except TimingError as error:
            raise PlanningError("E320", f"the motion cannot be timed: {error}", line) from None
        return True

    def _again(self, leg: Leg, begin: float, end: float) -> TimeLaw | None:
        """The law of a leg as it was planned for one like it; None where it could not be moved to where this
        one lies: parameters are rounded there, and differences over ticks magnify that.
        """

        def planned() -> tuple[TimeLaw, tuple[float, ...]]:
            law = self._from_rest(leg, 0.0, leg.length)
            return law, self._felt(np.abs(leg.derivatives(law.s)[0]).max(axis=0))

        law, felt = self._known.get((self.scale, self.share, self._limits_key, *leg.key), planned)
        rounding = math.ulp(end)
        return law if within(law.quality.peaks, [rounding * each for each in felt]) else None

    @property
    def _limits_key(self) -> bytes:
        """Equal for limits that are equal."""
        limits, key = self._keyed
        if limits is not self.limits:
            _, key = self._keyed = self.limits, _key(self.limits)
        return key

    def _felt(self, rates: Floats) -> tuple[float, ...]:
        """Part of the limits of speed, acceleration and jerk per m by which set points miss the path, where
        axes move at most at `rates` (m,).
        """
        bounds, tick = self._bounds, self._tick
        limits = ((bounds.speed, 2.0 / tick), (bounds.gentlest, 4.0 / tick**2), (bounds.jerk, 8.0 / tick**3))
        return tuple(float((rates / limit).max()) * factor for limit, factor in limits)

    def _from_rest(
        self, curve: Leg | Horizon | Lingering, begin: float, end: float, t0: float = 0.0
    ) -> TimeLaw:
        if self._lingers and isinstance(curve, Leg):
            curve = Lingering(curve, begin, end, self._lingers, np.zeros(0))
        return self._profile.plan(
            curve,
            self._bounds,
            partial(self._speed_bound, curve),
            s_start=begin,
            s_end=end,
            tick=self._tick,
            t0=t0,
        )

    def extend(self, tick: int) -> bool:
        """At `tick`, moving: let the law reach further if it is time to; True if later ticks changed."""
        law = self._moving
        if self.direction < 0.0 or law.s_end in self._route.stops or not self._due(law):
            return False
        end = self._horizon(self.s)
        return end > law.s_end and self._adopt(self._anew(tick, end, _settled_until(law)))

    def halt(self, tick: int, *, deceleration_factor: float = 1.0) -> bool:
        """At `tick`, moving: come to rest as soon as the limits allow; True if later ticks changed.

        With a factor, acceleration and jerk limits are taken that many times. Where the law uses up its
        limits it is first followed until it leaves room; at the latest it ends by itself.
        """
        return self._adopt(self._halted(tick, deceleration_factor))

    @property
    def braking_tick(self) -> int:
        """The tick, or one just before it, in which the present law begins to brake for its end."""
        law = self._moving
        driving = np.flatnonzero(law.a[:-1] >= -_STILL)
        since = float(law.t[driving[-1]]) if driving.size else 0.0
        return math.floor((law.t0 + since) / self._tick) - _ASKED_BEFORE

    def tick_at(self, s: float) -> int | None:
        """The first tick in which the present law has come to s; None where it does not."""
        law = self._moving
        if not law.s_start <= self.direction * s <= law.s_end:
            return None
        return math.ceil(float(law.time_of(self.direction * s)) / self._tick)

    def ticks_to_rest(self, tick: int) -> int:
        """How many ticks a halt at `tick`, moving, would take."""
        try:
            law = self._halted(tick, 1.0)()
        except TimingError:
            law = None
        return math.ceil((law or self._moving).t_end / self._tick) - tick

    def _halted(self, tick: int, factor: float) -> Callable[[], TimeLaw | None]:
        """The present law brought to rest after `tick`, with so many times the deceleration and jerk."""
        limits = self._bounds.scaled(factor, factor)
        law = self._moving
        curve = self._curve(law.s_end)
        bound, next_time = partial(self._speed_bound, curve), (tick + 1) * self._tick

        def stopped() -> TimeLaw | None:
            return halt(law, curve, limits, bound, tick=self._tick, commit_time=next_time)

        return stopped

    def set_override(self, tick: int, override: float) -> bool:
        """Scale all speeds by `override` (0 … 1) from the next tick on; True if later ticks changed.

        A higher one takes effect at once. A lower one is reached within the limits: over the shortest of
        growing distances in which a law can slow down.
        """
        before, self.override = self.scale, override
        return self._rescale(tick, before)

    def take_share(self, tick: int, share: float, clear: Callable[[], bool]) -> bool:
        """Take another share from the next tick on, if what comes then is `clear`; else nothing changes."""
        law = self._moving
        kept = law, self.share, self._slowing_until, self._slowing_from
        before, self.share = self.scale, share
        if round(law.t0 / self._tick) == tick:  # it has not set out yet
            self._adopt(partial(self._from_rest, self._curve(law.s_end), law.s_start, law.s_end, law.t0))
        elif not self._rescale(tick, before):  # near its end: as fast as it is, but braking more gently
            self._adopt(self._anew(tick, law.s_end))
        if self.law is not law and clear():
            return True
        self.law, self.share, self._slowing_until, self._slowing_from = kept
        return False

    def _rescale(self, tick: int, before: float) -> bool:
        """Go over from one scale of all speeds to the present one; True if later ticks changed."""
        if self.law is None:
            return False
        law, override = self.law, self.scale
        if override >= before:
            return self._adopt(self._anew(tick, law.s_end))
        r, v, _ = (float(x[0]) for x in law.at(np.array([(tick + 1) * self._tick])))
        self._slowing_from = before if r >= self._slowing_until else max(before, self._slowing_from)
        distance = max(v * self._tick, 0.5 * v * v * (1.0 - (override / before) ** 2) / self._deceleration(r))
        while r + distance < law.s_end:
            self._slowing_until = r + distance
            if self._adopt(self._anew(tick, law.s_end)):
                return True
            distance *= self._profile.growth
        self._slowing_until = law.s_end  # too near to its end to slow down before it: the next law will
        return False

    def forget(self, tick: int) -> None:
        """Drop what the law says of the time before `tick`: otherwise a path without stops adds up."""
        if self.law is not None:
            self.law = self.law.without_past(tick * self._tick)

    @property
    def _moving(self) -> TimeLaw:
        assert self.law is not None, "only while moving"
        return self.law

    def _anew(self, tick: int, end: float, since: float = -np.inf) -> Callable[[], TimeLaw | None]:
        """The present law planned anew after `tick`, and not before time `since`, to rest at `end`."""
        law = self._moving
        curve = self._curve(end)
        bound = partial(self._speed_bound, curve)

        def planned() -> TimeLaw | None:
            time = max((tick + 1) * self._tick, since)
            return self._profile.extend(
                law, curve, self._bounds, bound, s_end=end, tick=self._tick, commit_time=time
            )

        return planned

    def _adopt(self, planned: Callable[[], TimeLaw | None]) -> bool:
        """Take a law over if one was found; else the present one runs on, and ends at rest."""
        try:
            law = planned()
        except TimingError:
            return False
        if law is not None:
            self.law = law
        return law is not None

    def _curve(self, end: float) -> Horizon | Lingering:
        begin = self.direction * self.s
        curve = Horizon(self._route, self.direction, begin, end)
        if not self._lingers:
            return curve
        reach = self._lingers * min(self._path.speed, self._route.programmed.fastest(self.s, _HORIZON_PIECES))
        before, behind = sorted((self.s, self.s - self.direction * reach))
        return Lingering(
            curve, begin, end, self._lingers, self.direction * self._route.programmed.breaks(before, behind)
        )

    def _speed_bound(self, curve: Leg | Horizon | Lingering, r: Floats) -> Floats:
        """Bound (N,) on the rate of r (N,): programmed speed and speed limits, scaled by the override."""
        bound = curve.speed_bound(r)
        if self.scale == 1.0 and self._slowing_until <= self.direction * self.s:
            return bound
        rates = np.abs(curve.derivatives(r)[0])
        axes = np.where(rates > _STILL, self.limits.speed / np.maximum(rates, _STILL), np.inf)
        scale = np.where(r < self._slowing_until, self._slowing_from, self.scale)
        return np.asarray(scale * np.minimum(bound, axes.min(axis=1)))

    def _deceleration(self, r: float) -> float:
        """How fast the rate of r may fall at r, curvature left aside."""
        rates = np.abs(self._route.axes.derivatives(np.array([self.direction * r]))[0][0])
        return float(np.min(self._bounds.braking / np.maximum(rates, _STILL)))

    def places(self, first_tick: int, count: int) -> tuple[Floats, bool]:
        """s (N,) at no more than `count` ticks from first_tick on; True if the last one is at rest."""
        law = self._moving
        first = first_tick - round(law.t0 / self._tick)
        left = max(math.ceil(law.duration / self._tick - _ROUNDING) - first, 0) + 1
        r = positions(law, first, first + min(left, count) - 1, self._tick)
        end, arrived = law.s_end, left <= count
        np.minimum(r, math.nextafter(end, -math.inf), out=r)  # at the end itself is the tick of arrival alone
        if arrived:
            r[-1] = end
        return (r if self.direction > 0.0 else -r), arrived

    def rows(self, first_tick: int, count: int) -> Rows:
        """At most `count` ticks from first_tick on, ending early in the tick in which the law is at rest."""
        s, arrived = self.places(first_tick, count)
        return Rows(s, self._route.axes.everything(s), arrived)

    def _due(self, law: TimeLaw) -> bool:
        ends = self._route.ends
        pieces = bisect.bisect_right(ends, law.s_end) - bisect.bisect_right(ends, self.s)
        return pieces <= _RENEW_PIECES or law.s_end - self.s < 0.5 * self._reach(self.s)

    def _reach(self, s: float) -> float:
        """How far from s the route should be known: some stopping distances from the programmed speed."""
        path = self._path
        speed = min(path.speed, self._route.programmed.fastest(s, _HORIZON_PIECES))
        share = _STOPPING_SHARE * self._profile.stopping
        return share * speed * (0.5 * speed / path.deceleration + path.acceleration / path.jerk)

    def _horizon(self, s: float) -> float:
        """s at which a law from s may end at rest: the next exact stop, or the end of enough pieces."""
        route = self._route
        rests = (route.end, route.next_stop(s), self.pause(s, 1.0))
        last = min(place for place in rests if place is not None)
        k = bisect.bisect_right(route.ends, s) + _HORIZON_PIECES
        j = bisect.bisect_left(route.ends, s + self._reach(s))
        k = max(k, j)
        return min(last, route.ends[k]) if k < len(route.ends) else last


def _key(limits: AxisLimits) -> bytes:
    """Equal for limits that are equal."""
    return b"".join(
        each.tobytes() for each in (limits.speed, limits.acceleration, limits.braking, limits.jerk)
    )


def _settled_until(law: TimeLaw) -> float:
    """Time on the clock up to which the law does not yet feel that it ends; exact profiles are planned anew
    at once."""
    if law.plan is None:
        return -np.inf
    rising = np.flatnonzero(np.diff(law.v) >= 0.0)
    return law.t0 + float(law.t[rising[-1] + 1]) - _FELT_BEFORE if rising.size else -np.inf
