"""Motion times beside those of LinuxCNC 2.9's trajectory planner, on the same paths.

Its times were measured with 1000 mm/s² per axis, no jerk limit, and 1 mm of tolerance at corners. Ours: the
kernel's own geometry and look-ahead with round edges of the same deviation, the acceleration of the TCP
within 1000 mm/s² as a *vector* and its jerk within 50,000 mm/s³, on an arm whose joints do not limit. The
vectors are bounded by their projections on directions all round the plane, each a little tighter, so that
the bound is never looser than the circle. `faster` compares speeds: its time by ours, less one. `optimum`
is the shortest time there is on the same path within that acceleration and speed, without any limit of jerk:
what no law can be below, and its ratio. The last columns show what the ticks of the result really have; jerk
by differences over ticks may be 1.05 times its limit, as everywhere.

With the extra `bench`, a last line says what could be gained on the zigzag by another curve at its corners.

    python benchmarks/linuxcnc.py
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import paths
from freecurve import Zigzag
from sections import Floats, Section, lay

from viapoint.language.units import MM
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.runtime.kernel import chebyshev
from viapoint.runtime.kernel.chebyshev import Cells
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.timing import AxisLimits, TimeLaw, plan

ACCELERATION, JERK = 1.0, 50.0  # m/s², m/s³
DIRECTIONS = 64
DEVIATION = 1.0  # mm at corners
ZIGZAG_F500 = 4.873  # s, LinuxCNC's
LONGEST_CELL = 0.01
"""m a polynomial of the position spans at most: exact on lines and round edges, to 1e-15 m on the circle."""

SWEEP = 100_000
"""Places at which the optimum is computed."""

MANY = 1e6
"""deg/s, deg/s² and deg/s³: joint limits that do not limit."""

CELL = (
    '[robot]\nmodel = "frigeni6"\n'
    f"[body]\nradius_mm = {[paths.BODY_RADIUS] * 6}\n"
    f"[limits.joints]\nspeed_deg_s = {[MANY] * 6}\n"
    f"acceleration_deg_s2 = {[MANY] * 6}\njerk_deg_s3 = {[MANY] * 6}\n"
    f"[limits.path]\nacceleration_mm_s2 = {ACCELERATION / MM}\njerk_mm_s3 = {JERK / MM}\n"
    f"angular_acceleration_deg_s2 = {MANY}\nangular_jerk_deg_s3 = {MANY}\n"
)


@dataclass(frozen=True)
class Row:
    """A path, its text, LinuxCNC's time with blending and with exact stops (s), and how much faster to be."""

    name: str
    text: str
    blending: float
    exact_stop: float | None
    goal: float


def rows() -> list[Row]:
    """The comparison; goals: not slower at F 100, 7 % faster at F 500."""
    zigzag, square = paths.ZIGZAG, paths.turtle((40.0, 90.0 * k) for k in range(20))
    r_zigzag, r_square = (paths.corner_radius(DEVIATION, angle) for angle in (45.0, 90.0))
    circle = paths.circle(360.0)
    return [
        Row("zigzag, 20 x 30 mm, F100", paths.polyline(zigzag, r_zigzag, 100), 6.042, 8.062, 0.0),
        Row("zigzag, 20 x 30 mm, F500", paths.polyline(zigzag, r_zigzag, 500), ZIGZAG_F500, 7.022, 0.07),
        Row("square, 20 x 40 mm, F100", paths.polyline(square, r_square, 100), 9.386, 10.242, 0.0),
        Row("square, 20 x 40 mm, F500", paths.polyline(square, r_square, 500), 7.701, 8.442, 0.07),
        Row("circle of 50 mm, F500", circle, 1.898, None, 0.07),
    ]


def plane(section: Section) -> Cells:
    """The TCP's position on directions round the X-Y plane, as functions of s."""
    angle = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    directions = np.stack((np.cos(angle), np.sin(angle)))
    cells = Cells(DIRECTIONS)
    s = 0.0
    for piece in section.pieces:
        count = max(1, int(np.ceil(piece.length / LONGEST_CELL)))
        starts = piece.length * np.arange(count) / count
        widths = np.full(count, piece.length / count)
        if s + piece.length > section.begin + 1e-9:
            w = (starts[:, None] + widths[:, None] * chebyshev.NODES).ravel()
            values = piece.poses(w).position[:, :2] @ directions
            cells.append(s + starts, widths, chebyshev.coefficients(values.reshape(count, -1, DIRECTIONS)))
        s += piece.length
    return cells


@dataclass(frozen=True)
class Projected:
    """The axes of a curve and, after them, those directions."""

    curve: Any
    directions: Cells

    def __getattr__(self, name: str) -> Any:
        return getattr(self.curve, name)

    def values(self, s: Floats) -> Floats:
        return np.hstack((self.curve.values(s), self.directions.evaluate(s)[0]))

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        pairs = zip(self.curve.derivatives(s), self.directions.evaluate(s, (1, 2, 3)), strict=True)
        first, second, third = (np.hstack(pair) for pair in pairs)
        return first, second, third


def limits(section: Section) -> AxisLimits:
    """Those of the section, and of the projections: the polygon inside the circle."""
    inside = np.cos(np.pi / 2 / DIRECTIONS)
    ours = section.limits
    each = np.ones(DIRECTIONS)
    return AxisLimits(
        speed=np.append(ours.speed, np.inf * each),
        acceleration=np.append(ours.acceleration, inside * ACCELERATION * each),
        jerk=np.append(ours.jerk, inside * JERK * each),
    )


class Ahead(Mover):
    """The kernel's way along the route, looking ahead as far as it does, with the projections as axes."""

    def __init__(self, cell: Cell, section: Section, directions: Cells) -> None:
        super().__init__(cell, section.route, 1.0)
        self.limits = limits(section)
        self._directions = directions
        self.s = section.begin

    def _curve(self, end: float) -> Any:
        return Projected(super()._curve(end), self._directions)

    def _again(self, *leg: object) -> TimeLaw | None:
        """Nothing is remembered: the axes here are more than those of a leg."""
        return None

    def run(self) -> TimeLaw:
        """The law by which the robot arrives, asked anew in every tick whether it should be extended."""
        self.start(0, 0)
        tick = 0
        while self.law is not None and tick * self._tick < self.law.t_end:
            self.s = float(self.law.at(np.array([tick * self._tick]))[0][0])
            self.extend(tick)
            tick += 1
        assert self.law is not None
        return self.law


def worst(curve: Projected, law: TimeLaw, tick: float) -> tuple[float, float]:
    """Largest acceleration and jerk of the TCP in the plane, as vectors, by differences of ticks."""
    s, _, _ = law.at(np.arange(-3, np.ceil(law.duration / tick) + 4) * tick)
    position = curve.values(s)[:, -DIRECTIONS:]
    plane = position[:, [0, DIRECTIONS // 2]]
    acceleration, jerk = (np.diff(plane, n=n, axis=0) / tick**n for n in (2, 3))
    return float(np.linalg.norm(acceleration, axis=1).max()), float(np.linalg.norm(jerk, axis=1).max())


def optimum(curve: Projected, section: Section) -> float:
    """Shortest time, s, with the acceleration in the plane within its limit as a vector, and no jerk limit.

    Bobrow's method: x = ṡ² at rest at both ends, as large as the curvature and the programmed speed allow,
    lowered by a sweep in each direction to where the acceleration reaches.
    """
    s = np.linspace(section.begin, section.end, SWEEP)
    s = 0.5 * (s[1:] + s[:-1])
    first, second, _ = (d[:, -DIRECTIONS:][:, [0, DIRECTIONS // 2]] for d in curve.derivatives(s))
    rate = np.linalg.norm(first, axis=1)
    bend = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / rate**3
    length = rate * (section.end - section.begin) / (SWEEP - 1)
    speed = section.bound(s) * rate
    x = np.minimum(ACCELERATION / np.maximum(bend, 1e-9), speed**2)
    forward, back = _swept(x, bend, length), _swept(x[::-1], bend[::-1], length[::-1])[::-1]
    v = np.sqrt(np.minimum(forward, back))
    return float((length / v).sum())


def _swept(x: Floats, bend: Floats, length: Floats) -> Floats:
    """x of places one after the other, from rest, as fast as the acceleration left by the bend allows."""
    result = np.empty_like(x)
    reached = 0.0
    for k, (most, curvature, step) in enumerate(zip(x.tolist(), bend.tolist(), length.tolist(), strict=True)):
        left = max(ACCELERATION**2 - (curvature * reached) ** 2, 0.0) ** 0.5
        ahead = min(most, reached + 2.0 * left * step)
        result[k] = 0.5 * (reached + ahead) if k == 0 else min(most, 0.5 * (reached + ahead))
        reached = ahead
    return result


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="the same: it is quick")
    parser.parse_args(arguments)
    print(
        f"{'path':26} {'ours s':>8} {'whole s':>8} {'LinuxCNC':>9} {'exact stop':>10} {'ratio':>7}"
        f" {'faster':>7} {'goal':>6} {'optimum':>8} {'ratio':>6} {'mm/s2':>7} {'mm/s3':>7}"
    )
    for row in rows():
        cell = parse_cell(CELL)
        section = lay(row.text, cell)
        directions = plane(section)
        curve = Projected(section, directions)
        law = Ahead(cell, section, directions).run()
        whole = plan(
            curve, limits(section), section.bound, s_start=section.begin, s_end=section.end, tick=cell.tick
        )
        acceleration, jerk = worst(curve, replace(law, t0=0.0), cell.tick)
        ratio, least = law.duration / row.blending, optimum(curve, section)
        faster = row.blending / law.duration - 1.0
        stop = "-" if row.exact_stop is None else f"{row.exact_stop:.3f}"
        print(
            f"{row.name:26} {law.duration:8.3f} {whole.duration:8.3f} {row.blending:9.3f} {stop:>10}"
            f" {ratio:7.4f} {faster:7.2%} {row.goal:6.1%} {least:8.3f} {least / row.blending:6.3f}"
            f" {acceleration / MM:7.0f} {jerk / MM:7.0f}"
            f"{'' if faster >= row.goal else '  missed'}",
            flush=True,
        )
    print(any_curve())


def any_curve() -> str:
    """What the zigzag would take at least with the best curve there is at its corners."""
    try:
        least = Zigzag(20, 30.0, 45.0, DEVIATION, 500.0, ACCELERATION / MM, JERK / MM).least()
    except ModuleNotFoundError as error:
        return f"\nzigzag F500 on any curve: not computed, {error.name} is missing (make bench installs it)"
    share = least / ZIGZAG_F500
    which = f"any curve that cuts its corners by {DEVIATION:g} mm"
    return f"\nzigzag F500 on {which}: not below {least:.3f} s, {share:.4f} of LinuxCNC's time"


if __name__ == "__main__":
    main()
