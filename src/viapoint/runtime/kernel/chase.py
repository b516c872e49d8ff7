"""Following a target that nobody planned, within limits of its own: one axis, one tick at a time.

Each tick is the first tick of Ruckig's time-optimal way from the present state to the target, seen by
somebody who moves with the target. Whoever has caught up stays on it.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import ruckig

_PART: Final = 1.0 - 1e-6
"""Part of the speed limit a target may have: Ruckig refuses one that moves as fast as its limit."""

_WIDER: Final = (1.0, 1.0 + 1e-4, 1.0 + 1e-3)
"""Speed limits tried: Ruckig finds no way where a state runs out exactly at its limit but for rounding."""

_THERE: Final = 1e-12
"""m, m/s. Nearer than this is rounding: the state is the target's."""


class Follower(NamedTuple):
    """State of an axis: m, m/s, m/s²."""

    position: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0


REST: Final = Follower()


class Chase:
    """How an axis may move: limits in m and s. Stateless but for Ruckig's own scratch."""

    def __init__(self, speed: float, acceleration: float, jerk: float, tick: float) -> None:
        self.speed = speed
        self.acceleration = acceleration
        self.jerk = jerk
        self._tick = tick
        self._solver = ruckig.Ruckig(1)
        self._found = ruckig.Trajectory(1)
        self._ask = _input(acceleration, jerk)
        self._brake = _input(acceleration, jerk)
        self._brake.control_interface = ruckig.ControlInterface.Velocity

    def step(self, now: Follower, target: float, rate: float) -> Follower:
        """The state one tick on, on the way to a target that is now there and moves at a rate.

        The axis itself never moves faster than its limit, so that it falls behind a target that does.
        """
        top = _PART * self.speed
        rate = min(max(rate, -top), top)
        away, closing = now.position - target, now.speed - rate
        ahead = target + rate * self._tick
        if max(abs(away), abs(closing)) <= _THERE and abs(now.acceleration) <= _THERE:
            return Follower(ahead, rate, 0.0)
        ask = self._ask
        ask.current_position, ask.current_velocity = [away], [closing]
        ask.current_acceleration = [now.acceleration]
        for more in _WIDER:
            ask.max_velocity, ask.min_velocity = [more * self.speed - rate], [-more * self.speed - rate]
            if self._solve(ask):
                break
        else:
            return self.stop(now)
        (away,), (closing,), (acceleration,) = self._found.at_time(self._tick)
        return Follower(ahead + away, rate + closing, acceleration)

    def duration(self, away: float, closing: float) -> float:
        """Time from rest beside a target, with so much to go and a rate seen from it, to be on it; s."""
        ask = self._ask
        ask.current_position, ask.current_velocity, ask.current_acceleration = [away], [closing], [0.0]
        ask.max_velocity, ask.min_velocity = [self.speed + closing], [closing - self.speed]
        return float(self._found.duration) if self._solve(ask) else 0.0

    def within(self, other: Chase) -> Chase:
        """Under the lower limits of both."""
        return Chase(
            min(self.speed, other.speed),
            min(self.acceleration, other.acceleration),
            min(self.jerk, other.jerk),
            self._tick,
        )

    def scaled(self, share: float) -> Chase:
        """With so much of acceleration and jerk."""
        return Chase(self.speed, share * self.acceleration, share * self.jerk, self._tick)

    def overshoot(self, closing: float, acceleration: float) -> float:
        """About how far a state beside a target leads away from it before the jerk limit turns it; m."""
        return float(abs(closing) ** 1.5 / self.jerk**0.5 + abs(acceleration) ** 3 / self.jerk**2)

    def stop(self, now: Follower) -> Follower:
        """The state one tick on, on the way to rest wherever that is soonest."""
        if now.speed == 0.0 and now.acceleration == 0.0:
            return now
        ask = self._brake
        ask.current_velocity, ask.current_acceleration = [now.speed], [now.acceleration]
        if not self._solve(ask):
            raise ArithmeticError(f"no way to rest from {now}")
        (way,), (speed,), (acceleration,) = self._found.at_time(self._tick)
        return Follower(now.position + way, speed, acceleration)

    def _solve(self, ask: ruckig.InputParameter) -> bool:
        try:
            result = self._solver.calculate(ask, self._found)
        except ruckig.RuckigError:
            return False
        return result in (ruckig.Result.Working, ruckig.Result.Finished)


def _input(acceleration: float, jerk: float) -> ruckig.InputParameter:
    """To rest at 0."""
    ask = ruckig.InputParameter(1)
    ask.current_position = ask.target_position = [0.0]
    ask.target_velocity = ask.target_acceleration = [0.0]
    ask.max_acceleration, ask.max_jerk = [acceleration], [jerk]
    return ask


class Way:
    """How an axis comes to a rate, and goes on at it."""

    def __init__(self, start: Follower, found: ruckig.Trajectory | None) -> None:
        self._start = start
        self._found = found
        self.duration = 0.0 if found is None else float(found.duration)
        """s until it has the rate."""

    def states(self, times: list[float]) -> list[Follower]:
        """At times (s) from the start on."""
        found, (position, rate, _) = self._found, self._start
        if found is None:
            return [Follower(position + rate * t, rate, 0.0) for t in times]
        rows = [found.at_time(t) for t in times]
        return [Follower(where[0], speed[0], second[0]) for where, speed, second in rows]


def towards(start: Follower, rate: float, acceleration: float, jerk: float) -> Way:
    """The quickest way from a state to a rate, within an acceleration and a jerk."""
    if start.speed == rate and start.acceleration == 0.0:
        return Way(start, None)
    ask = _input(acceleration, jerk)
    ask.control_interface = ruckig.ControlInterface.Velocity
    ask.current_position, ask.current_velocity = [start.position], [start.speed]
    ask.current_acceleration, ask.target_velocity = [start.acceleration], [rate]
    found = ruckig.Trajectory(1)
    if ruckig.Ruckig(1).calculate(ask, found) not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise ArithmeticError(f"no way from {start} to a rate of {rate}")
    return Way(start, found)
