"""The last resort of a robot that cannot be held on its path: every axis brakes by itself, in its limits."""

from __future__ import annotations

from typing import Final

import numpy as np
import ruckig

from viapoint.runtime.records import Floats

_PART: Final = 0.99
"""Part of the jerk limit used: speed and acceleration are known as differences over ticks only."""

_STILL: Final = 1e-12
"""rad/s. An axis that moves no faster stands: less than rounding moves it in a tick."""


def braking(last: Floats, acceleration: Floats, jerk: Floats, tick: float) -> Floats:
    """Rows (N, m) behind the `last` three sent (3, m), to rest, from the limits (m,) of the axes."""
    steps = np.diff(last, axis=0) / tick
    second = (steps[1] - steps[0]) / tick
    speed = steps[1] + 0.5 * tick * second  # a difference is the speed in the middle of its tick
    axes = [
        _axis(float(v), float(a), float(limit), _PART * float(j))
        for v, a, limit, j in zip(speed, second, acceleration, jerk, strict=True)
    ]
    duration = max((axis.duration for axis in axes if axis is not None), default=0.0)
    times = tick * np.arange(1, int(np.ceil(duration / tick)) + 2)
    rows: Floats = np.tile(last[-1], (len(times), 1))
    for column, axis in enumerate(axes):
        if axis is not None:
            rows[:, column] += [axis.at_time(min(t, axis.duration))[0][0] for t in times.tolist()]
    return rows


def stopping(speed: Floats, second: Floats, acceleration: Floats, jerk: Floats) -> tuple[Floats, Floats]:
    """How fast axes get while they brake, and how far: (..., m) each, from speeds and accelerations (..., m).

    An axis that still accelerates gets faster first. One that brakes already is seen as one that began to.
    """
    jerk = _PART * jerk
    sign = np.where(speed != 0.0, np.sign(speed), np.sign(second))
    towards = second * sign
    t = np.abs(towards) / jerk
    top = np.abs(speed) + 0.5 * jerk * t * t
    eased = np.where(towards > 0.0, np.abs(speed) * t + jerk * t**3 / 3.0, jerk * t**3 / 6.0 - top * t)
    long = top * (top / acceleration + acceleration / jerk) / 2.0
    way = np.where(top * jerk > acceleration**2, long, top * np.sqrt(top / jerk))
    return sign * np.where(towards > 0.0, top, np.abs(speed)), sign * np.maximum(eased + way, 0.0)


def _axis(speed: float, acceleration: float, limit: float, jerk: float) -> ruckig.Trajectory | None:
    """The way of one axis to rest; None where it stands."""
    if abs(speed) <= _STILL:
        return None
    ask = ruckig.InputParameter(1)
    ask.control_interface = ruckig.ControlInterface.Velocity
    ask.current_velocity, ask.current_acceleration = [speed], [acceleration]
    ask.max_acceleration, ask.max_jerk = [max(limit, abs(acceleration))], [jerk]
    found = ruckig.Trajectory(1)
    if ruckig.Ruckig(1).calculate(ask, found) not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise ArithmeticError(f"no way to rest from {speed} and {acceleration}")
    return found
