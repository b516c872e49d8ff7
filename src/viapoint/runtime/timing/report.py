"""What holds the speed back, piece by piece of a law, for the report. It decides nothing.

Codes as in `law`: an axis index, PROGRAMMED_SPEED or UNLIMITED.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.estimate import StraightLine
from viapoint.runtime.timing.law import PROGRAMMED_SPEED, UNLIMITED, Knots
from viapoint.runtime.timing.limits import AxisLimits
from viapoint.runtime.timing.rows import Rows

Codes = npt.NDArray[np.int16]

_ACTIVE: Final = 0.9
"""Part of a limit above which it holds the speed back: solutions stay a little inside."""

_CHANGING: Final = 1e-6
"""Part of the largest acceleration that counts as one, in exact profiles."""


def of_rows(rows: Rows, used: tuple[Floats, Floats], c: Floats) -> Codes:
    """Codes (n,) of the pieces: the largest of all scaled rows there, from what c uses of them."""
    knots, jerk = used
    acceleration = np.maximum(knots[:, 1:], knots[:, :-1])
    root = np.sqrt(c)
    axes = np.maximum(np.maximum(acceleration, jerk), rows.axis_speed * root)
    return _largest(axes, root / rows.programmed[1])


def _largest(axes: Floats, programmed: Floats) -> Codes:
    every = np.vstack((programmed[None, :], axes))
    axis = np.argmax(every, axis=0)
    return np.where(every.max(axis=0) < _ACTIVE, UNLIMITED, axis + PROGRAMMED_SPEED).astype(np.int16)


def of_profile(line: StraightLine, limits: AxisLimits, knots: Knots) -> Codes:
    """Codes (K-1,) of an exact profile's phases: jerk changes, acceleration holds, speed holds."""
    _, _, _, a = knots
    none = _CHANGING * np.abs(a).max()
    jerk, acceleration, speed = (
        int(np.argmax(line.rates / limit)) for limit in (limits.jerk, limits.gentlest, limits.speed)
    )
    if (line.rates / limits.speed).max() * line.bound < 1.0:
        speed = PROGRAMMED_SPEED
    held = np.abs(np.diff(a)) <= none
    still = np.abs(a[1:]) <= none
    return np.where(held, np.where(still, speed, acceleration), jerk).astype(np.int16)
