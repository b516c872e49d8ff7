"""Exact profiles where every axis is linear in s: Ruckig, one degree of freedom. Used nowhere else."""

from __future__ import annotations

from typing import Final

import numpy as np
import ruckig

from viapoint.runtime.timing.estimate import StraightLine
from viapoint.runtime.timing.law import Knots
from viapoint.runtime.timing.limits import AxisLimits
from viapoint.runtime.timing.section import State

_PART: Final = 1.0 - 2e-6
"""Part of the limits planned with: differences over ticks carry rounding of about 1e-6 of a limit."""

_TICKS_TO_FULL: Final = 0.25
"""A limit that is inf is replaced by reaching the next lower one within this part of a tick."""

_NO_ACCELERATION: Final = 1e-9
"""Part of the limit that is rounding. At top speed Ruckig answers it with a much slower profile."""

_RATIO_FLOOR: Final = 1e-300


def profile(line: StraightLine, limits: AxisLimits, state: State, s_end: float, tick: float) -> Knots | None:
    """Time-optimal knots from the state to rest at s_end; None if there is no such profile."""
    speed, up, down, jerk = _along(line, limits, s_end - state.s, tick)
    if abs(state.a) < _NO_ACCELERATION * min(up, down):
        state = State(state.s, state.v, 0.0)
    ask = ruckig.InputParameter(1)
    ask.current_position, ask.target_position = [0.0], [s_end - state.s]
    ask.current_velocity, ask.current_acceleration = [state.v], [state.a]
    ask.max_velocity, ask.max_jerk = [max(speed, state.v)], [jerk]
    ask.max_acceleration, ask.min_acceleration = [max(up, state.a)], [min(-down, state.a)]
    ask.min_velocity = [-1e-3 * speed]
    found = ruckig.Trajectory(1)
    if ruckig.Ruckig(1).calculate(ask, found) not in (ruckig.Result.Working, ruckig.Result.Finished):
        return None
    return _knots(found, state, s_end)


def stopping_distance(line: StraightLine, limits: AxisLimits, state: State, tick: float) -> float:
    """Distance in which the state comes to rest on a line of these rates: elsewhere a first guess."""
    _, up, down, jerk = _along(line, limits, 1.0, tick)
    ask = ruckig.InputParameter(1)
    ask.control_interface = ruckig.ControlInterface.Velocity
    ask.current_position, ask.current_velocity, ask.current_acceleration = [0.0], [state.v], [state.a]
    ask.target_velocity, ask.target_acceleration = [0.0], [0.0]
    ask.max_acceleration, ask.min_acceleration, ask.max_jerk = [up], [-down], [jerk]
    found = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(ask, found)
    (end,), _, _ = found.at_time(found.duration)
    return float(end)


def _along(
    line: StraightLine, limits: AxisLimits, length: float, tick: float
) -> tuple[float, float, float, float]:
    """Limits of ṡ, s̈ (both signs) and jerk from those of the axes; infinite ones made large."""
    rates = np.maximum(line.rates, _RATIO_FLOOR)
    with np.errstate(over="ignore"):
        speed, up, down, jerk = (
            float((x / rates).min(initial=np.inf))
            for x in (limits.speed, limits.acceleration, limits.braking, limits.jerk)
        )
    quick = _TICKS_TO_FULL * tick
    speed = min(speed, line.bound, length / quick)
    up, down = min(up, speed / quick), min(down, speed / quick)
    return speed * _PART, up * _PART, down * _PART, min(jerk, min(up, down) / quick) * _PART


def _knots(found: ruckig.Trajectory, state: State, s_end: float) -> Knots | None:
    phases = found.profiles[0][0]
    if phases.brake.duration > 0.0:
        return None
    duration = np.array(phases.t)
    keep = duration > 1e-12
    end = np.concatenate((np.flatnonzero(keep) + 1,))
    t = np.concatenate(([0.0], np.cumsum(duration)))[np.concatenate(([0], end))]
    index = np.concatenate(([0], end))
    s = state.s + np.array(phases.p)[index]
    v, a = np.array(phases.v)[index], np.array(phases.a)[index]
    s[-1], v[-1], a[-1] = s_end, 0.0, 0.0
    if (v < 0.0).any() or (np.diff(s) <= 0.0).any():
        return None
    return t, s, v, a
