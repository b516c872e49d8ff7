"""Time laws measured: how near to the fastest, what the ticks show, and what planning costs.

Paths: corners with round edges for two Cartesian axes, the same and a spline for an arm of two links
(joints through sampled inverse kinematics), and a line that passes its folded pose closely. Per path
and jerk limit: duration; the bound by acceleration alone (the method of TOPP-RA); their ratio; the
largest tick ratios of speed, acceleration and jerk; then what a plan costs with the compiled core and
with its numpy twin, and what streaming the same path block by block costs and loses.

    python benchmarks/timing.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from viapoint.runtime import core
from viapoint.runtime.timing import AxisLimits, TimeLaw, extend, plan

Floats = npt.NDArray[np.float64]

TICK = 1e-3
GRID = 4000
"""Stations of the acceleration bound."""

LINKS = (0.6, 0.5)
"""m, of the arm."""


@dataclass
class Path:
    """Axes as splines over the length of the path, which is the last axis."""

    name: str
    spline: CubicSpline
    length: float
    breaks: Floats
    speed: float  # programmed, m/s
    lim: AxisLimits
    blocks: int

    def values(self, s: Floats) -> Floats:
        return np.asarray(self.spline(s))

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        first, second, third = (np.asarray(self.spline(s, k)) for k in (1, 2, 3))
        return first, second, third

    def bound(self, s: Floats) -> Floats:
        return np.full(len(s), self.speed)


def corners(points: Floats, deviation: float) -> tuple[Floats, Floats, Floats]:
    """Length (N,), positions (N, 2), lengths of joints: lines and quartic round edges of this deviation."""
    step = np.diff(points, axis=0)
    length = np.linalg.norm(step, axis=1)
    u = step / length[:, None]
    cut = np.zeros(len(points))
    cut[1:-1] = np.minimum(
        deviation * 16 / 3 / np.linalg.norm(np.diff(u, axis=0), axis=1), 0.45 * length.min()
    )
    xy, s, joints = [points[:1]], [np.zeros(1)], []
    at = 0.0
    for k in range(len(u)):
        a, b = points[k] + cut[k] * u[k], points[k + 1] - cut[k + 1] * u[k]
        w = np.linspace(0.0, 1.0, 41)[1:]
        w = 0.9 * (0.5 - 0.5 * np.cos(np.pi * w)) + 0.1 * w
        xy.append(a + w[:, None] * (b - a))
        s.append(at + w * np.linalg.norm(b - a))
        joints.append(s[-1][-1])
        if k + 1 < len(u):
            corner, c = points[k + 1], cut[k + 1]
            control = [
                corner - c * u[k],
                corner - c / 2 * u[k],
                corner,
                corner + c / 2 * u[k + 1],
                corner + c * u[k + 1],
            ]
            t = np.linspace(0.0, 1.0, 601)[:, None]
            weights = (1, 4, 6, 4, 1)
            curve = sum(
                w * t**i * (1 - t) ** (4 - i) * p
                for i, (w, p) in enumerate(zip(weights, control, strict=True))
            )
            chord = np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))
            xy.append(curve[15::15])
            s.append(s[-1][-1] + chord[14::15])
            joints.append(s[-1][-1])
        at = float(s[-1][-1])
    return np.concatenate(s), np.concatenate(xy), np.array(joints[:-1])


def arm(xy: Floats) -> Floats:
    """Joints (N, 2) of the arm of two links."""
    x, y = xy.T
    a, b = LINKS
    q2 = np.arccos((x * x + y * y - a * a - b * b) / (2 * a * b))
    q1 = np.arctan2(y, x) - np.arctan2(b * np.sin(q2), a + b * np.cos(q2))
    return np.unwrap(np.column_stack((q1, q2)), axis=0)


def path(
    name: str,
    s: Floats,
    axes: Floats,
    breaks: Floats,
    speed: float,
    limit: tuple[float, float, float],
    blocks: int,
) -> Path:
    spline = CubicSpline(s, np.column_stack((axes, s)))
    v, a, jerk = (np.array([x, x, np.inf]) for x in limit)
    return Path(name, spline, float(s[-1]), breaks, speed, AxisLimits(v, a, jerk), blocks)


def paths(per_acceleration: float) -> list[Path]:
    """The paths with a jerk limit of this many 1/s times the acceleration limit."""
    turn = np.deg2rad(45.0) * (np.arange(20) % 2)
    zigzag = np.vstack((np.zeros(2), np.cumsum(0.03 * np.column_stack((np.cos(turn), np.sin(turn))), axis=0)))
    side = 0.04 * (1 + np.arange(20) // 2 / 4)
    quarter = np.pi / 2 * np.arange(20)
    spiral = np.vstack(
        (np.zeros(2), np.cumsum(side[:, None] * np.column_stack((np.cos(quarter), np.sin(quarter))), axis=0))
    )
    cartesian = (np.inf, 1.0, per_acceleration)
    joints = (3.0, 10.0, 10.0 * per_acceleration)
    result = [path(f"zigzag F{f * 1e3:.0f}", *corners(zigzag, 1e-3), f, cartesian, 20) for f in (0.1, 0.5)]
    s, xy, breaks = corners(spiral, 1e-3)
    result.append(path("spiral F500", s, xy, breaks, 0.5, cartesian, 20))
    reach = xy - xy.mean(axis=0)
    scale = 0.25 / np.abs(reach).max()
    placed = reach * scale + np.array([0.65, 0.2])
    result.append(path("spiral, arm", s * scale, arm(placed), breaks * scale, 1.5, joints, 20))
    return [*result, *_splines(joints)]


def _splines(joints: tuple[float, float, float]) -> list[Path]:
    t = np.linspace(0.0, 1.0, 4001)
    wave = np.column_stack((0.6 + 0.3 * np.cos(7 * t), 0.2 + 0.5 * np.sin(5 * t)))
    line = np.column_stack((-0.5 + t, np.full_like(t, 0.101)))
    result = []
    for name, xy, blocks in (("waves, arm", wave, 8), ("near-singular line, arm", line, 1)):
        s = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))))
        result.append(path(name, s, arm(xy), np.linspace(0, s[-1], blocks + 1)[1:-1], 1.5, joints, blocks))
    return result


def acceleration_bound(p: Path) -> float:
    """Fastest duration within speed and acceleration limits: controllable sets backwards, greedy forwards.

    Pham and Pham, A new approach to time-optimal path parameterization based on reachability analysis.
    """
    s = np.linspace(0.0, p.length, GRID)
    h = s[1]
    first, second, _ = p.derivatives(s)
    a, b = first / p.lim.acceleration, second / p.lim.acceleration
    top = np.minimum(p.speed, (p.lim.speed / np.maximum(np.abs(first), 1e-12)).min(axis=1)) ** 2
    reach = np.zeros(GRID)
    for k in range(GRID - 2, -1, -1):
        reach[k] = _highest(a[k], b[k], top[k], h, reach[k + 1])
    x = np.zeros(GRID)
    for k in range(GRID - 1):
        x[k + 1] = max(min(x[k] + 2 * h * _steepest(a[k], b[k], x[k]), reach[k + 1]), 0.0)
    return float((2 * h / np.maximum(np.sqrt(x[1:]) + np.sqrt(x[:-1]), 1e-9)).sum())


def _steepest(a: Floats, b: Floats, x: float) -> float:
    moving = np.abs(a) > 1e-12
    return float(((1.0 - b[moving] * x * np.sign(a[moving])) / np.abs(a[moving])).min())


def _highest(a: Floats, b: Floats, top: float, h: float, ahead: float) -> float:
    """Largest x from which some u keeps |a u + b x| ≤ 1 and 0 ≤ x + 2 h u ≤ ahead: by halving."""
    moving, still = np.abs(a) > 1e-12, np.abs(a) <= 1e-12
    low, high = 0.0, top
    for _ in range(36):
        x = 0.5 * (low + high)
        sign = np.sign(a[moving])
        up = ((1.0 - sign * b[moving] * x) / np.abs(a[moving])).min()
        down = ((-1.0 - sign * b[moving] * x) / np.abs(a[moving])).max()
        inside = (np.abs(b[still] * x) <= 1.0).all() and max(down, -x / 2 / h) <= min(up, (ahead - x) / 2 / h)
        low, high = (x, high) if inside else (low, x)
    return low


def whole(p: Path) -> TimeLaw:
    return plan(p, p.lim, p.bound, s_start=0.0, s_end=p.length, tick=TICK)


def stream(p: Path, ahead: int = 4) -> float:
    """Duration with four blocks of look-ahead, appended one by one."""
    ends = [float(x) for x in np.linspace(0.0, p.length, p.blocks + 1)[1:]]
    law = plan(p, p.lim, p.bound, s_start=0.0, s_end=ends[ahead - 1], tick=TICK)
    for k in range(ahead, p.blocks):
        commit = float(law.time_of(ends[k - ahead]))
        longer = extend(law, p, p.lim, p.bound, s_end=ends[k], tick=TICK, commit_time=commit)
        law = longer or law
    return law.duration


def milliseconds(work: Callable[[], object], name: str) -> float:
    """CPU time of one call, the best of some, with the named numerics."""
    core.asked = name
    best = np.inf
    for _ in range(5 if name == "compiled" else 2):
        begin = time.process_time()
        work()
        best = min(best, time.process_time() - begin)
    core.asked = "auto"
    return best * 1e3


def main() -> None:
    """Print one line per path and jerk limit."""
    bounds = {p.name: acceleration_bound(p) for p in paths(1.0)}
    fast = "compiled" if core.built("timing._core") else "python"
    print(f"tick {TICK * 1e3:g} ms, numerics: {fast}; times are CPU time")
    print(
        f"{'path':24} {'j/a':>5} {'T s':>7} {'bound':>7} {'ratio':>6}  {'speed':>6} {'accel':>6} {'jerk':>6}"
        f"  {'ms':>6} {'us/tick':>7} {'ms/block':>8} {'twin us/tick':>12}  {'streamed':>8} {'us/tick':>7}"
    )
    for per_acceleration in (10.0, 50.0, 1e4):
        for p in paths(per_acceleration):
            print(line(p, per_acceleration, bounds[p.name], fast), flush=True)


def line(p: Path, per_acceleration: float, bound: float, fast: str) -> str:
    """Everything about one path."""
    law = whole(p)
    ticks = law.duration / TICK
    speed, acceleration, jerk = law.quality.peaks
    cost, twin = milliseconds(lambda: whole(p), fast), milliseconds(lambda: whole(p), "python")
    text = (
        f"{p.name:24} {per_acceleration:5.0f} {law.duration:7.3f} {bound:7.3f} {law.duration / bound:6.3f}"
        f"  {speed:6.3f} {acceleration:6.3f} {jerk:6.3f}"
        f"  {cost:6.1f} {cost * 1e3 / ticks:7.2f} {cost / p.blocks:8.2f} {twin * 1e3 / ticks:12.2f}"
    )
    if p.blocks <= 4:
        return text
    again = milliseconds(lambda: stream(p), fast)
    return text + f"  {stream(p) / law.duration:8.4f} {again * 1e3 / ticks:7.2f}"


if __name__ == "__main__":
    main()
