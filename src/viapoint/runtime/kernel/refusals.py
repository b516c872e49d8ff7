"""Why a row cannot be sent, in words. No state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from viapoint.language.units import DEG
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import JointLimits

SLACK: Final = (1.0 + 1e-6, 1.0 + 1e-6, 1.05, 1.0 + 1e-6)
_QUANTITIES: Final = ("speed", "acceleration", "jerk", "speed")
"""What is checked, ÷ limit at most: as the kernel promises, and rounding. Last the speed while braking."""


class Obstacle(NamedTuple):
    """Why a row cannot be sent."""

    code: str
    reason: str


FOLLOWING: Final = {"E430": "E440", "E431": "E441"}
HINTS: Final = {
    "E440": "begin or end the tracked section earlier, or nearer to the robot",
    "E441": "slow the belt or the motion down, or raise controller.tracking_reserve",
    "E442": "let the belt change its speed more slowly, or raise max_lag_mm",
    "E430": "limit the correction, or keep the path further inside the robot's reach",
    "E431": "lower max_rate, raise controller.tracking_reserve, or keep away from singular poses",
}


def exceeded(ratios: Sequence[Floats]) -> Obstacle | None:
    """What is wrong with a row of these ratios to what is allowed, (m,) each."""
    for each, slack, name in zip(ratios, SLACK, _QUANTITIES, strict=False):
        k = int(np.argmax(each))
        if each[k] > 1.0:
            times = np.ceil(each[k] * slack * 100.0) / 100.0
            return Obstacle("E431", f"J{k + 1} would need {times:.2f} times its {name} limit")
        if not np.isfinite(each).all():
            return Obstacle("E490", "a joint is no finite number")
    return None


def leaves_range(limits: JointLimits, stop: Floats) -> Obstacle:
    """Joints (n,) would come to rest at `stop`, outside their range."""
    k = int(np.argmin(limits.contain(stop)))
    low, high = limits.lower[k] / DEG, limits.upper[k] / DEG
    return Obstacle("E430", f"J{k + 1} comes to the end of its range {low:g} … {high:g} deg")
