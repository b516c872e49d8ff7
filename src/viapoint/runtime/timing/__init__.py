"""Time laws: how fast a curve of several axes may be run through within their limits.

Pure arithmetic on arrays: no robot, no program, no clock.
"""

from viapoint.runtime.timing.curve import AxisCurve
from viapoint.runtime.timing.errors import TimingError
from viapoint.runtime.timing.law import PROGRAMMED_SPEED, UNLIMITED, Quality, TimeLaw
from viapoint.runtime.timing.limits import AxisLimits, SpeedBound
from viapoint.runtime.timing.planner import extend, halt, plan
from viapoint.runtime.timing.search import positions, within
from viapoint.runtime.timing.shaped import Profile, profile

__all__ = [
    "PROGRAMMED_SPEED",
    "UNLIMITED",
    "AxisCurve",
    "AxisLimits",
    "Profile",
    "Quality",
    "SpeedBound",
    "TimeLaw",
    "TimingError",
    "extend",
    "halt",
    "plan",
    "positions",
    "profile",
    "within",
]
