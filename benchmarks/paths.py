"""The paths of the benchmarks, as programs: contours, splines, singular poses, polylines, flips of the wrist.

Every program goes to its start by a joint move and stops there; what comes after it is one path without a
stop, and that is what is judged. All are for the library's `frigeni6`. Random ones carry their seed.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

Point = tuple[float, float]

X, Y, Z = 1500.0, 0.0, 1400.0
"""mm: the middle of the working area; the tool points down there (B=90), far from singular poses."""

JOINT_ACCELERATION = (400, 400, 400, 900, 900, 1200)  # deg/s², those of the library's robot
PATH_ACCELERATION, ANGULAR_ACCELERATION = 10000, 1800  # mm/s², deg/s²
BODY_RADIUS = 1  # mm: a wire, so that paths near the base are run too


@dataclass(frozen=True)
class Program:
    """A name for the table and a text to compile."""

    name: str
    text: str
    with_optimum: bool = False
    """Whether the jerk-limited optimum is sought too: for some paths of every kind."""


def cell_text(jerk_per_acceleration: float = 10.0, extra: str = "") -> str:
    """A cell whose jerk limits are so many 1/s times the acceleration limits."""
    joints = [jerk_per_acceleration * a for a in JOINT_ACCELERATION]
    return (
        '[robot]\nmodel = "frigeni6"\n'
        f"[body]\nradius_mm = {[BODY_RADIUS] * 6}\n"
        f"[limits.joints]\njerk_deg_s3 = {joints}\n"
        f"[limits.path]\njerk_mm_s3 = {jerk_per_acceleration * PATH_ACCELERATION}\n"
        f"angular_jerk_deg_s3 = {jerk_per_acceleration * ANGULAR_ACCELERATION}\n{extra}"
    )


def start(x: float = X, y: float = Y, z: float = Z, a: float = 0, b: float = 90, c: float = 0) -> str:
    """To the start, and an exact stop there."""
    return f"MJ X={x:.6f} Y={y:.6f} Z={z:.6f} A={a} B={b} C={c} F60\nWAIT 0"


def program(begin: str, lines: Iterable[str]) -> str:
    return "\n".join((begin, *lines, "END", ""))


def polyline(points: list[Point], radius: float, speed: float) -> str:
    """Lines in the plane through points relative to the middle, corners rounded."""
    (x, y), *rest = points
    lines = [f"ML X={X + px:.6f} Y={Y + py:.6f} F{speed:g} R{radius:.6f}" for px, py in rest]
    return program(start(X + x, Y + y), lines)


def turtle(steps: Iterable[tuple[float, float]]) -> list[Point]:
    """Points reached by (length, absolute heading in degrees)."""
    points = [(0.0, 0.0)]
    for length, heading in steps:
        x, y = points[-1]
        angle = math.radians(heading)
        points.append((x + length * math.cos(angle), y + length * math.sin(angle)))
    return points


ZIGZAG = turtle((30.0, 45.0 * (k % 2)) for k in range(20))
SQUARE_SPIRAL = turtle((40.0 * (1 + k // 2 / 4), 90.0 * k) for k in range(20))


def corner_radius(deviation: float, angle: float) -> float:
    """R (mm) of the quartic round edge that passes a corner of `angle` degrees at this distance.

    Its middle lies 3/16 R |u₁ − u₀| from the corner, u the directions of the lines (F, round edges).
    """
    return deviation * 16.0 / 3.0 / (2.0 * math.sin(math.radians(angle) / 2.0))


def _contours() -> Iterator[Program]:
    yield Program("zigzag F100", polyline(ZIGZAG, corner_radius(1.0, 45.0), 100))
    yield Program("zigzag F500", polyline(ZIGZAG, corner_radius(1.0, 45.0), 500), True)
    yield Program("square spiral F500", polyline(SQUARE_SPIRAL, corner_radius(1.0, 90.0), 500), True)
    star = [((150 if k % 2 else 70) * math.cos(k * 0.6283), 150 * math.sin(k * 0.6283)) for k in range(11)]
    yield Program("star F400 R5", polyline(star, 5.0, 400), True)
    fine = turtle((3.0, (0, 90, 0, -90)[k % 4]) for k in range(40))
    yield Program("battlements of 3 mm F100", polyline(fine, 0.8, 100))
    wide = [(0.0, 0.0), (300.0, 0.0), (300.0, 400.0), (-200.0, 400.0), (-200.0, -400.0), (300.0, -400.0)]
    yield Program("rectangle F2000 R60", polyline(wide, 60.0, 2000))
    yield Program("slot: lines and arcs", _slot())
    yield Program("circle of 50 mm F500", circle(360.0))
    yield Program("three turns of it", circle(1080.0))


def _slot() -> str:
    """A closed contour of tangential lines and half circles, passed within the path tolerance."""
    lines = []
    for side in (1, -1, 1, -1):
        x, y = X + side * 100.0, Y + side * 40.0
        lines.append(f"ML X={x:.3f} Y={Y - side * 40.0:.3f} F300")
        lines.append(f"MC X={x:.3f} Y={y:.3f} QX={x + side * 40.0:.3f} QY={Y:.3f} QZ={Z:.3f} F300")
    return program(start(X - 100.0, Y - 40.0), lines)


def circle(angle: float) -> str:
    target = f"MC X={X - 50:.3f} Y={Y:.3f} QX={X:.3f} QY={Y + 50:.3f} QZ={Z:.3f} H{angle:g} F500"
    return program(start(X + 50.0, Y), (target,))


def _splines() -> Iterator[Program]:
    wave = [(40.0 * k, 60.0 * math.sin(1.3 * k)) for k in range(-6, 7)]
    yield Program("spline wave F600", _spline([(x, y, Z, 90.0, 0.0) for x, y in wave], 600), True)
    helix = [
        (120 * math.cos(k), 120 * math.sin(k), Z + 25 * k, 90 - 25 * math.sin(k), 20 * math.cos(k))
        for k in range(13)
    ]
    yield Program("spline helix, turning F400", _spline(helix, 400), True)
    draw = random.Random(11)
    wild = [(draw.uniform(-250, 250), draw.uniform(-350, 350), draw.uniform(1100, 1700)) for _ in range(10)]
    yield Program("spline, random F1000", _spline([(*p, 90.0, 0.0) for p in wild], 1000))


def _spline(points: list[tuple[float, float, float, float, float]], speed: float) -> str:
    (x, y, z, b, c), *rest = points
    lines = [
        f"MS X={X + x:.4f} Y={Y + y:.4f} Z={z:.4f} A=0 B={b:.4f} C={c:.4f} F{speed}" for x, y, z, b, c in rest
    ]
    return program(start(X + x, Y + y, z, 0, b, c), lines)


def _polylines() -> Iterator[Program]:
    sine = [(2.0 * k - 200.0, 40.0 * math.sin(k / 12.0)) for k in range(201)]
    yield Program("200 lines of 2 mm along a sine", polyline(sine, 0.8, 400))
    ring = [(50.0 * math.cos(k * math.pi / 200), 50.0 * math.sin(k * math.pi / 200)) for k in range(401)]
    yield Program("400 lines along a circle", polyline(ring, 0.35, 500))
    draw = random.Random(5)
    heading, steps = 0.0, []
    for _ in range(80):
        heading += draw.uniform(-70.0, 70.0)
        steps.append((draw.uniform(4.0, 30.0), heading))
    points = turtle(steps)
    middle = (sum(p[0] for p in points) / len(points), sum(p[1] for p in points) / len(points))
    placed = [(x - middle[0], y - middle[1]) for x, y in points]
    yield Program("80 random lines R2 F300", polyline(placed, 2.0, 300), True)


def _singular() -> Iterator[Program]:
    """The tool points along X; in the plane Y = 0 the wrist is stretched at one height of the line."""
    for y in (50.0, 5.0, 0.5):
        lines = (f"ML X=1750 Y={y} Z=2300 F300 R40", f"ML X=1750 Y={y + 150} Z=2300 F300")
        text = program(start(1750.0, y, 2950.0, 0, 0, 0), lines)
        yield Program(f"wrist singularity passed at {y:g} mm", text, y == 5.0)
    yield Program("arm nearly stretched", program(start(2050, -900, 1500), ("ML Y=900 F800",)))
    yield Program("base axis passed at 60 mm", program(start(60, -500, 2500, 0, -60, 90), ("ML Y=500 F300",)))


def _turning() -> Iterator[Program]:
    flip = ("ML X=1600 Y=60 A=0 B=90 C=170 F300 R20", "ML X=1500 Y=120 A=0 B=90 C=0 F300")
    yield Program("flips of the flange", program(start(), flip))
    tilt = [f"ML X={1450 + 30 * k} Y={20 * (k % 2)} B={90 + 35 * (-1) ** k} F300 R9" for k in range(8)]
    yield Program("tilting line by line", program(start(1420), tilt), True)
    yield Program("rotation in place", program(start(), ("ML B=40 C=60 F100",)))


def _joint_moves() -> Iterator[Program]:
    draw = random.Random(3)
    lines = []
    for _ in range(8):
        joints = [draw.uniform(-50, 50) for _ in range(6)]
        lines.append("MJ " + " ".join(f"J{i}={q:.3f}" for i, q in enumerate(joints, 1)) + " F150 R12")
    yield Program("joint moves with R", program(start(), lines))
    place = []
    for x, y in ((1500, -400), (1300, 500), (1600, 300), (1350, -250)):
        place += [
            f"MJ X={x} Y={y} Z=1500 A=0 B=90 C=0 F120 R60",
            f"ML X={x} Y={y} Z=1350 F500 R20",
            f"ML X={x + 80} Y={y} Z=1350 F250 R20",
            f"ML X={x + 80} Y={y} Z=1500 F500 R60",
        ]
    yield Program("joint moves, lines and R", program(start(), place))


def programs() -> list[Program]:
    """All of them."""
    kinds = (_contours, _splines, _polylines, _singular, _turning, _joint_moves)
    return [each for kind in kinds for each in kind()]
