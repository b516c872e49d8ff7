"""From ticks over a limit to rows: which pieces a tick touches, and by how much their rows tighten."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.rows import Tightening
from viapoint.runtime.timing.ticks import Ratios

SPEED_AIM: Final = 0.9995
ACCELERATION_AIM: Final = 0.9992
JERK_AIM: Final = 1.034
"""Tick ratios that tightening aims at: just inside what the check allows (1, 1, 1.05)."""

_JERK_POWER: Final = 1.5
_ACCELERATION_POWER: Final = 1.3
"""Rows are met on average while ticks show peaks: a little more than proportional converges faster."""

_SOON: Final = 2
_LATER: Final = 0.002
"""Passes after which what is still over is tightened by so much more a pass: a tick that moves with every
solve is met before the passes run out."""

_JERK_MOST: Final = 1.6
_ACCELERATION_MOST: Final = 1.2
"""Largest ratio answered in one pass."""


def tighten(
    now: Tightening,
    knots: Floats,
    s: Floats,
    r: Ratios,
    fixed: int,
    passes: int,
    touched: Callable[[Floats, Floats, Floats, float, float], Floats],
) -> Tightening:
    """Factors for the next pass from the ratios at ticks s (N,); those of given pieces stay.

    `touched` is the function of this module or its compiled twin.
    """
    late = 1.0 - _LATER * max(0, passes - _SOON)
    speed = touched(knots, s, r.speed, SPEED_AIM, 1.0)
    acceleration = np.minimum(touched(knots, s, r.acceleration, ACCELERATION_AIM, late), _ACCELERATION_MOST)
    jerk = np.minimum(touched(knots, s, r.jerk, JERK_AIM, 1.0), _JERK_MOST)
    at_knots = np.maximum(
        np.append(acceleration[:1], acceleration), np.append(acceleration, acceleration[-1:])
    )
    if fixed:
        at_knots[: fixed + 1] = 1.0
        jerk[:fixed] = 1.0
    return Tightening(
        acceleration=now.acceleration * at_knots**_ACCELERATION_POWER,
        jerk=now.jerk * jerk**_JERK_POWER,
        speed=now.speed * speed,
    )


def touched(knots: Floats, s: Floats, ratio: Floats, aim: float, late: float) -> Floats:
    """Largest ratio/(aim·late), at least 1, of the differences over the aim that touch each piece (n,)."""
    n = len(knots) - 1
    factor = np.ones(n)
    over = np.flatnonzero(ratio > aim)
    if over.size == 0:
        return factor
    span = len(s) - len(ratio)
    first = np.clip(np.searchsorted(knots, s[over], side="right") - 1, 0, n - 1)
    last = np.clip(np.searchsorted(knots, s[over + span], side="left") - 1, first, n - 1)
    for step in range(int((last - first).max()) + 1):
        np.maximum.at(factor, np.minimum(first + step, last), ratio[over] / (aim * late))
    return factor
