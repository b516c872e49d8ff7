"""How wide an edge over a tangential corner may be for its deviation to stay within a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from viapoint.runtime.path.edges import round_edge
from viapoint.runtime.path.moves import Floats
from viapoint.runtime.path.segments import Segment

# A deviation of orientation counts as the displacement of a point so far (m) from the TCP: the default
# tolerance of 0.02 mm then allows 0.11°.
LEVER = 0.01
# Points on the edge where its deviation is measured; it has one maximum on each side of the corner.
SAMPLES = 25
_SHARES = np.linspace(0.0, 1.0, SAMPLES)
# The search ends between this share of the tolerance and the tolerance itself.
ENOUGH = 0.7
_AIM = 0.85
_MOST_TRIALS = 24
_NOTHING = 1e-15  # m; only keeps the power law finite

Cut = Callable[[float], tuple[float, float]]


def first_guess(kink: float, bend: float, tolerance: float) -> float:
    """The distance d at which an edge over jumps of the first and second derivative deviates by `tolerance`.

    The quintic's deviation is 3/16·kink·d at the corner and 0.0107·bend·d² on both sides of it.
    """
    a, b = 0.0107 * bend, 3.0 / 16.0 * kink
    return 2.0 * tolerance / (b + math.sqrt(b * b + 4.0 * a * tolerance))


def widest_edge(
    left: Segment, right: Segment, cut: Cut, reach: float, tolerance: float, guess: float
) -> float:
    """The distance before and after the corner, at most `reach`; 0 where even the least is too wide."""

    def deviation_at(distance: float) -> float:
        return deviation(left, right, *cut(distance))

    trial = min(guess * math.sqrt(_AIM), reach)
    measured = deviation_at(trial)
    low, high = 0.0, reach
    order = 2.0  # of the deviation in the distance: 2 for a jump of curvature, 1 for a kink
    for _ in range(_MOST_TRIALS):
        if measured <= tolerance:
            low = trial
            if measured >= ENOUGH * tolerance or trial == reach:
                break
        else:
            high = trial
        following = min(trial * (_AIM * tolerance / max(measured, _NOTHING)) ** (1.0 / order), reach)
        if not low < following < high and following != reach:
            following = math.sqrt(low * high) if low > 0.0 else 0.1 * high
        previous, trial = (trial, measured), following
        measured = deviation_at(trial)
        order = _order(previous, (trial, measured))
    return low


def deviation(left: Segment, right: Segment, leave: float, join: float) -> float:
    """Largest distance (m) of an edge from what was programmed; orientation counted with `LEVER`.

    Auxiliary axes count fully, rotary ones with 1 m per rad: what they carry may be that large.
    Points of the edge are compared with points of about the same progress, which is never less than
    their distance from the path.
    """
    edge = round_edge(left, right, leave, join)
    w = edge.length * _SHARES
    w_left, w_right = _beside(left, right, leave, join, _SHARES)
    made, a, b = edge.poses(w), left.poses(w_left), right.poses(w_right)
    away = made.position - np.concatenate((a.position, b.position))
    angle = _angles(made.quaternion, np.concatenate((a.quaternion, b.quaternion)))
    total = np.sqrt((away * away).sum(axis=1)) + LEVER * angle
    if edge.auxiliary is not None and left.auxiliary is not None and right.auxiliary is not None:
        programmed = np.concatenate((left.auxiliary.points(w_left), right.auxiliary.points(w_right)))
        total = total + np.linalg.norm(edge.auxiliary.points(w) - programmed, axis=1)
    return float(total.max())


def _angles(a: Floats, b: Floats) -> Floats:
    """(N,) rad between orientations (N, 4), by the chord between the quaternions, of which ± are one."""
    chords = np.minimum(((a - b) ** 2).sum(axis=1), ((a + b) ** 2).sum(axis=1))
    angles: Floats = 4.0 * np.arcsin(0.5 * np.sqrt(chords))
    return angles


def _beside(left: Segment, right: Segment, leave: float, join: float, t: Floats) -> tuple[Floats, Floats]:
    """Parameters of the uncut segments at the shares t (N,) of an edge's parameter range."""
    lost = left.length - leave
    if left.space is not right.space:
        return _mixed(left, right, leave, join, t)
    x = t * (lost + join)
    before = x <= lost
    return leave + x[before], x[~before] - lost


def _mixed(left: Segment, right: Segment, leave: float, join: float, t: Floats) -> tuple[Floats, Floats]:
    """Parameters beside the corner of a joint move and a path motion, whose scales differ.

    The speed along the edge changes evenly from one side's |dp/dw| to the other's, so progress is a
    quadratic of t; it is shared out by TCP length.
    """
    v0 = float(left.arc.rates(np.array([leave]))[0])
    v1 = float(right.arc.rates(np.array([join]))[0])
    lost, gained = left.length - leave, join
    cut = 0.5 * (v0 * lost + v1 * gained)
    x = 2.0 * cut * (2.0 * v0 * t + (v1 - v0) * t * t) / (v0 + v1)
    before = x <= cut
    return leave + lost * x[before] / cut, gained * (x[~before] - cut) / cut


def _order(a: tuple[float, float], b: tuple[float, float]) -> float:
    """Exponent of a power law through two (distance, deviation), kept within what smooth curves have."""
    if a[0] == b[0] or min(a[1], b[1]) <= 0.0:
        return 2.0
    return min(max(math.log(a[1] / b[1]) / math.log(a[0] / b[0]), 0.8), 4.0)
