"""What a time law says of a motion: how fast it gets, what its stops cost, where it is slowed and by what.

For reports; it decides nothing. Lengths in m, speeds of the TCP in m/s.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.timing import TimeLaw

_GRID: Final = 33
"""Places looked at along a motion, beside the knots of its law."""

_FULL: Final = 0.98
"""Part of a motion's top speed at which it has set out, and until which it does not yet brake."""

_SLOWER: Final = 0.8
"""Part of the speed on either side below which a dip is one worth telling."""

_NEAR: Final = 0.25
"""Distance from a singular pose (sine of the angle, or m from an axis) up to which it explains a dip."""

_DIRECTION: Final = 1e-6
"""m of path over which a direction is taken."""


_STILL: Final = 1e-9
"""m of the TCP per path parameter below which it is not moving."""

_SAME: Final = 8
"""Decimals (rad, m) by which places are told apart."""


@dataclass(frozen=True, slots=True)
class Slowdown:
    """A motion is slowed by an axis, `place` m after its start, from `speed_asked` to `speed`.

    They are m/s of the TCP, rad/s of its orientation where the motion is a rotation `in_place`. `axis` counts
    the driven axes from 0. `singular` names the singular pose nearby, None if there is none.
    """

    line: int
    place: float
    axis: int
    speed_asked: float
    speed: float
    in_place: bool
    singular: str | None


@dataclass(frozen=True, slots=True)
class Seen:
    """One motion as its law runs it; see `forecast.BlockForecast`."""

    length: float
    peak: float
    starting: float
    stopping: float
    turned: tuple[str, str]
    end: tuple[float, ...]
    slowdowns: tuple[Slowdown, ...]


class Course:
    """Looks at a route under the laws of its motions.

    `leaves` and `arrives` are the TCP's directions (3,) at the begin and the end of what was looked at.
    """

    def __init__(self, cell: Cell, route: Route) -> None:
        self._robot = cell.robot
        self._route = route
        self.leaves: Floats | None = None
        self.arrives: Floats | None = None

    def block(
        self, law: TimeLaw, s_from: float, s_to: float, line: int, *, from_rest: bool, at_rest: bool
    ) -> Seen:
        """The motion from s_from to s_to, which its law has come to the end of."""
        s = _places(law, s_from, s_to)
        t = law.time_of(s)
        v = np.maximum(law.at(t)[1], 0.0)
        rates = self._route.axes.rates(s)
        bound = self._route.speed_bound(s)
        bound = np.where(np.isfinite(bound), bound, v.max())
        ends = self._route.axes.everything(s[[0, -1]])
        q = ends[:, : self._robot.joint_count]
        self._directions(s_from, s_to)
        return Seen(
            length=float(ends[1, -2] - ends[0, -2]),
            peak=float((v * rates[:, 0]).max()),
            starting=_lost(t, s, v, bound) if from_rest else 0.0,
            stopping=_lost(-t[::-1], -s[::-1], v[::-1], bound[::-1]) if at_rest else 0.0,
            turned=(self._configuration(q[0]), self._configuration(q[1])),
            end=tuple((np.round(ends[1, : self._route.axes.driven], _SAME) + 0.0).tolist()),
            slowdowns=self._slowdowns(law, s, v, rates, line),
        )

    def joints(self, s_from: float, s_to: float) -> Floats:
        """(N, n): the robot's joints at places along a motion, both ends among them."""
        return self._route.axes.everything(np.linspace(s_from, s_to, _GRID))[:, : self._robot.joint_count]

    def _configuration(self, q: Floats) -> str:
        return " ".join(self._robot.configuration_names(int(self._robot.configuration(q))))

    def _directions(self, s_from: float, s_to: float) -> None:
        near = min(_DIRECTION, 0.5 * (s_to - s_from))
        ends = np.array([s_from, s_from + near, s_to - near, s_to])
        p = self._robot.fk(self._route.axes.everything(ends)[:, : self._robot.joint_count])[:, :3, 3]
        self.leaves = _unit(p[1] - p[0]) if self.leaves is None else self.leaves
        self.arrives = _unit(p[3] - p[2])

    def _slowdowns(
        self, law: TimeLaw, s: Floats, v: Floats, rates: Floats, line: int
    ) -> tuple[Slowdown, ...]:
        """The deepest dip that an axis causes, if there is one."""
        axes = law.limited_by(s)
        in_place = bool(np.all(rates[:, 0] < _STILL))
        rate = rates[:, 1 if in_place else 0]
        speed = v * rate
        held = (axes >= 0) & (axes < self._route.axes.driven)
        dips = np.flatnonzero(_dips(speed) & held)
        if not dips.size:
            return ()
        k = int(dips[np.argmin(speed[dips])])
        q = self._route.axes.everything(s[k : k + 1])[0, : self._robot.joint_count]
        measures = self._robot.singularity(q).measures
        name = min(measures, key=lambda each: measures[each], default=None)
        near = name is not None and measures[name] < _NEAR
        asked = float(self._route.speed_bound(s[k : k + 1])[0] * rate[k])
        way = float(np.diff(self._route.axes.everything(s[[0, k]])[:, -2])[0])
        singular = name if near else None
        return (Slowdown(line, way, int(axes[k]), asked, float(speed[k]), in_place, singular),)


def _places(law: TimeLaw, s_from: float, s_to: float) -> Floats:
    knots = law.s[(law.s > s_from) & (law.s < s_to)]
    return np.unique(np.concatenate((np.linspace(s_from, s_to, _GRID), knots)))


def _dips(speed: Floats) -> Bools:
    """Places (N,) where the speed is well below what it is before and behind."""
    before = np.maximum.accumulate(speed)
    behind = np.maximum.accumulate(speed[::-1])[::-1]
    result: Bools = speed < _SLOWER * np.minimum(before, behind)
    return result


def _lost(t: Floats, s: Floats, v: Floats, bound: Floats) -> float:
    """s lost by setting out from rest: the time to full speed, less what that way takes at full speed.

    Full speed is the largest part of the programmed one, bound (N,), that the motion gets to.
    """
    share = v / bound
    top = float(share.max())
    k = int(np.argmax(share >= _FULL * top))
    at_full = np.diff(s[: k + 1]) * 0.5 * (1.0 / bound[:k] + 1.0 / bound[1 : k + 1])
    return max(float(t[k] - t[0] - at_full.sum() / top), 0.0) if top > 0.0 else 0.0


def _unit(way: Floats) -> Floats | None:
    length = float(np.linalg.norm(way))
    return way / length if length > 0.0 else None
