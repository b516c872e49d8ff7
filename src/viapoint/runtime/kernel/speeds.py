"""Programmed speeds: what F, FC and FA mean for a piece of path, as a bound on the path parameter's rate."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.core import chosen
from viapoint.runtime.kernel.chebyshev import Tables, evaluate
from viapoint.runtime.records import Floats
from viapoint.vm.ports import Motion, MotionKind, Speed, SpeedKind

_STILL: Final = 1e-9
"""Length per path parameter below which the TCP (or its orientation) counts as not moving."""


class SpeedRule(NamedTuple):
    """Bounds of one motion, SI; inf where the kind of speed does not apply.

    `joint` bounds the joint-space length of a joint move (rad/s), `linear` the TCP (m/s), `angular` its
    orientation (rad/s). A motion that lacks the asked length falls back to the generic reading of the number.
    """

    joint: float
    linear: float
    angular: float
    fallback_joint: float
    fallback_linear: float
    fallback_angular: float

    def on(self, *, joint_space: bool) -> SpeedRule:
        """The rule on a piece of path: what does not bound it is inf."""
        joint, linear, angular, *fallback = self
        if joint_space:
            return SpeedRule(joint, linear, angular, fallback[0], np.inf, np.inf)
        return SpeedRule(np.inf, linear, angular, np.inf, *fallback[1:])


UNBOUND: Final = SpeedRule(*([np.inf] * 6))
"""Of a motion in which auxiliary axes move alone: their own limits decide."""


def rate_bounds(cells: Tables, s: Floats, begins: Floats, rules: Floats) -> Floats:
    """Bounds (N,) on the rate of the path parameter s (N,).

    The last two columns of the cells are TCP length and angle as travelled; from each of `begins` (R,) on,
    ascending, the rule (R, 6) of that row holds, fields as of `SpeedRule.on`.
    """
    if (core := chosen("kernel._axes")) is not None:
        return np.asarray(core.rate_bounds(*cells, np.ascontiguousarray(s), begins, rules, _STILL))
    columns = cells.table.shape[-1]
    (rates,) = evaluate(cells, s, (1,), (columns - 2, columns))
    rule = rules[np.searchsorted(begins[1:], s, side="right")]
    bound = np.minimum(_per_rate(rule[:, 1:3], rates), rule[:, 0])
    fallback = np.minimum(_per_rate(rule[:, 4:6], rates), rule[:, 3])
    return np.where(np.isfinite(bound), bound, fallback)


def speed_ratio(cells: Tables, before: float, s: Floats, begins: Floats, rules: Floats, tick: float) -> float:
    """The largest speed ÷ bound of the ticks in which the parameter goes from `before` on to s (N,).

    Within a tick the bound may jump; the larger of its ends is the one that held.
    """
    if (core := chosen("kernel._axes")) is not None:
        return float(core.speed_ratio(*cells, before, np.ascontiguousarray(s), begins, rules, _STILL, tick))
    s = np.concatenate(([before], s))
    bound = rate_bounds(cells, s, begins, rules)
    return float((np.diff(s) / tick / np.maximum(bound[1:], bound[:-1])).max())


def _per_rate(speeds: Floats, rates: Floats) -> Floats:
    quotient = np.where(rates > _STILL, speeds / np.maximum(rates, _STILL), np.inf)
    result: Floats = quotient.min(axis=1)
    return result


def speed_rule(motion: Motion, cell: Cell) -> SpeedRule:
    """The rule of `motion`; without a programmed speed, the cell's default for its kind."""
    joint_space = motion.kind in (MotionKind.JOINT, MotionKind.HOME)
    default = cell.default_speed.joint / DEG if joint_space else cell.default_speed.path / MM
    speed = motion.speed or Speed(SpeedKind.GENERIC, default)
    linear, angular = speed.value * MM, speed.value * DEG
    none = np.inf
    generic = (angular, linear, angular)
    match speed.kind:
        case SpeedKind.GENERIC if joint_space:
            return SpeedRule(angular, none, none, *generic)
        case SpeedKind.GENERIC:
            return SpeedRule(none, linear, angular, *generic)
        case SpeedKind.LINEAR:
            return SpeedRule(none, linear, none, *generic)
        case SpeedKind.ANGULAR:
            return SpeedRule(none, none, angular, *generic)
