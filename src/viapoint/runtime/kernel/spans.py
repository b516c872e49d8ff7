"""A stretch of path as spans that smooth joints can follow, also through and close by singular poses.

Where a free joint's vector has a zero on the path or beside it, a span is set around it in which that
joint is taken from the vector's bearing: through an exact zero it goes on smoothly, in another
configuration; past a miss the span's parameter is widened until ticks can resolve the joint's turn.
Elsewhere a span is just path.
Not here: sampling and polynomials.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from viapoint.runtime.kernel.bearings import SINGULAR, Bearing, Complexes, fit, held, zeros
from viapoint.runtime.kernel.stretch import FlangePath
from viapoint.runtime.kernel.warp import Warp
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.robots import Robot

_NEAR: Final = 1e-3
"""m. A miss by more is resolved by small cells; so is a zero that far off the end of a stretch."""

_WIDTH: Final = 0.05
"""m on either side of a zero that a span covers, where the vector is smooth so far: at its ends the joint is
known to 1e-14 rad without help."""

_SCAN: Final = 0.15
"""m of path searched for zeros at a time; less where the vector is not smooth over it."""

_TOGETHER: Final = 2e-4
"""m. Zeros closer than this are one place: they share a span."""

_FAR: Final = 50.0
"""Width of the widened parameter, in misses, below which widening makes nothing smoother."""

_LEAST_WIDTH: Final = 1e-4
"""m of path that the widening takes at least; a joint beyond it turns by less than d/width per length."""

_FINE: Final = 2e-5
"""m. At a miss by more, ticks resolve the turn of the joint without widening: s of 10 m is rounded to
2e-15 m, which is 1e-10 rad of the joint and 1 rad/s³ at a millisecond."""

_SHORTEST: Final = 1e-5
"""m. A vector that is not smooth even this near to its zero is left alone."""

_CENTRED: Final = 1e-12
"""Distance of the centre from the miss, in widths, that matters to nothing."""


@dataclass(frozen=True, slots=True)
class Span:
    """Part of a path, w in `begin` … `end`, in one configuration as it begins; its own parameter is u ≥ 0.

    `centre` is the w from which x counts, exactly also where it is tiny.
    """

    path: FlangePath
    begin: float
    end: float
    configuration: int
    centre: float
    bearings: tuple[Bearing, ...] = ()
    warp: Warp | None = None

    @property
    def length(self) -> float:
        """The range of u."""
        if self.warp is None:
            return self.end - self.begin
        first, last = self.warp.parameter(np.array([self.begin, self.end]) - self.centre)
        return float(last - first)

    def places(self, u: Floats) -> tuple[Floats, Floats, Floats]:
        """w, x and dw/du (N,) each, at u (N,)."""
        offset = self.begin - self.centre
        if self.warp is None:
            x, rate = u + offset, np.ones_like(u)
        else:
            x = self.warp.place(u + self.warp.parameter(np.array([offset])))
            rate = self.warp.rate(x)
        return np.clip(self.centre + x, 0.0, self.path.length), x, rate

    def joints(self, robot: Robot, w: Floats, x: Floats, reference: Floats) -> tuple[Floats, Bools, Floats]:
        """Joints (N, n), reachable (N,) and flange poses at places w, x (N,); turns nearest to reference."""
        X = self.path.flange_poses(w)
        if not self.bearings:
            q, reachable = robot.ik_branch(X, self.configuration, reference)
            return q, reachable, X
        wanted = np.tile(reference, (len(w), 1))
        for bearing in self.bearings:
            angle = bearing.angle(x + (self.centre - bearing.centre))
            near = reference[bearing.joint]
            wanted[:, bearing.joint] = near + np.angle(np.exp(1j * (angle - near)))
        given = tuple(bearing.joint for bearing in self.bearings)
        q, reachable = robot.ik_branch(X, self.configuration, wanted, given)
        return q, reachable, X


class Division(NamedTuple):
    """The spans of a stretch, the configuration it ends in, and whether it must stop at its ends for them."""

    spans: list[Span]
    configuration: int
    stop_before: bool
    stop_after: bool


def whole(path: FlangePath, configuration: int) -> Span:
    """A path as one span."""
    return Span(path, 0.0, path.length, configuration, 0.0)


def divide(
    robot: Robot,
    path: FlangePath,
    configuration: int,
    reference: Floats,
    rest: tuple[bool, bool],
    *,
    choose: bool = True,
) -> Division:
    """Spans of a path entered in a configuration; `reference` (n,) are the joints it is entered from.

    `rest` says whether the path stands still at its begin and end. A path that begins in a singular pose is
    entered on the branch that continues the reference, unless `choose` is false: then in the configuration.
    """
    divider = _Divider(robot, path, reference, rest)
    spans = [whole(path, configuration)]
    for number, joint in enumerate(robot.kinematics.free_joints):
        divided = divider.divided(spans, number, joint)
        if choose and divider.turns_round(divided[0], joint):
            configuration = robot.kinematics.beyond(configuration, joint)
            other = [replace(s, configuration=robot.kinematics.beyond(s.configuration, joint)) for s in spans]
            divided = divider.divided(other, number, joint)
        spans = divided
    last = _left_in(robot, spans[-1])
    return Division(spans, last, *divider.stops)


def _left_in(robot: Robot, span: Span) -> int:
    configuration = span.configuration
    for bearing in span.bearings:
        for _ in range(bearing.within):
            configuration = robot.kinematics.beyond(configuration, bearing.joint)
    return configuration


class _Divider:
    """Divides one path; remembers at which of its ends it needs to stand still."""

    def __init__(self, robot: Robot, path: FlangePath, reference: Floats, rest: tuple[bool, bool]) -> None:
        self._robot = robot
        self._path = path
        self._reference = reference
        self._rest = rest
        self.stops = [False, False]

    def divided(self, spans: list[Span], number: int, joint: int) -> list[Span]:
        """The spans divided at the zeros of one free joint's vector."""
        result: list[Span] = []
        crossed = False
        for span in spans:
            if span.warp is not None:
                result.append(self._beyond(span, joint) if crossed else span)
                continue
            done = span.begin
            for zero, lowest, highest in self._zeros(span, number, joint):
                now = self._beyond(span, joint) if crossed else span
                part = self._around(now, number, joint, zero, max(lowest, done), highest)
                if part is None:
                    continue
                if part.begin > done:
                    result.append(_part(now, done, part.begin))
                result.append(part)
                done = part.end
                crossed ^= part.bearings[-1].within % 2 == 1
            if done < span.end:
                result.append(_part(self._beyond(span, joint) if crossed else span, done, span.end))
        return result

    def turns_round(self, first: Span, joint: int) -> bool:
        """Whether the first span begins in a singular pose with the joint half a turn from the reference."""
        for bearing in first.bearings:
            if bearing.joint == joint and bearing.begins_singular:
                angle = bearing.angle(np.array([first.begin - bearing.centre]))[0]
                return bool(np.cos(angle - self._reference[joint]) < 0.0)
        return False

    def _beyond(self, span: Span, joint: int) -> Span:
        return replace(span, configuration=self._robot.kinematics.beyond(span.configuration, joint))

    def _vector(self, span: Span, number: int, w: Floats) -> Complexes:
        q, _, X = span.joints(self._robot, w, w - span.centre, self._reference)
        return self._robot.kinematics.free_vectors(X, q, span.configuration)[:, number]

    def _zeros(self, span: Span, number: int, joint: int) -> Iterator[tuple[complex | None, float, float]]:
        """Zeros on a span and the limits of the part around each; None: the joint is free all along it."""
        vector = partial(self._vector, span, number)
        edges = np.linspace(span.begin, span.end, max(1, round((span.end - span.begin) / _SCAN)) + 1)
        if np.all(np.abs(vector(np.linspace(span.begin, span.end, 2 * len(edges) + 1))) < SINGULAR):
            yield None, span.begin, span.end
            return
        found = [w for a, b in pairwise(edges.tolist()) for w in zeros(vector, a, b, _NEAR)]
        places = _places(found)
        limits = [span.begin, *(0.5 * (a.real + b.real) for a, b in pairwise(places)), span.end]
        for k, place in enumerate(places):
            yield place, *np.clip(limits[k : k + 2], span.begin, span.end).tolist()

    def _around(
        self, span: Span, number: int, joint: int, zero: complex | None, lowest: float, highest: float
    ) -> Span | None:
        """The part of a span around a zero, within limits; None where the vector is not smooth there."""
        if zero is None:
            bearing = held(joint, float(self._reference[joint]))
            return replace(span, bearings=(*span.bearings, bearing))
        vector = partial(self._vector, span, number)
        centre, width = zero.real, _WIDTH
        while width > _SHORTEST:
            begin, end = max(lowest, centre - width), min(highest, centre + width)
            if end <= begin:
                return None
            fitted = fit(vector, joint, centre, begin, end, _NEAR)
            if fitted is None:
                width *= 0.5
                continue
            off = _nearest(fitted).real
            if abs(off) <= _CENTRED * width:
                break
            centre += off
        else:
            return None
        warp = self._warp(abs(_nearest(fitted).imag), centre, lowest, highest, width)
        if warp is not None:
            begin, end = max(begin, centre - warp.width), min(end, centre + warp.width)
        return replace(
            span, begin=begin, end=end, centre=centre, bearings=(*span.bearings, fitted), warp=warp
        )

    def _warp(self, miss: float, centre: float, lowest: float, highest: float, width: float) -> Warp | None:
        """The widening for a miss; where an end of the path leaves it no room the path must stand still."""
        if miss == 0.0:
            return None
        need = max(_FAR * miss, _LEAST_WIDTH)
        outer = lowest <= 0.0, highest >= self._path.length
        room = [centre - lowest, highest - centre]
        for side in (0, 1):
            if outer[side] and not self._rest[side] and miss < _FINE and abs(room[side]) < need:
                self.stops[side] = True
            if outer[side] and (self._rest[side] or self.stops[side]):
                room[side] = np.inf
        width = min(width, *room)
        return Warp(miss, width) if width >= _FAR * miss else None


def _part(span: Span, begin: float, end: float) -> Span:
    return replace(span, begin=begin, end=end, centre=begin)


def _nearest(bearing: Bearing) -> complex:
    """The miss that is nearest to the path, x + i·d; 0 without any."""
    return min(bearing.misses, key=lambda miss: abs(miss.imag), default=0j)


def _places(found: list[complex]) -> list[complex]:
    """Zeros in the order of the path; of those together, the one nearest to it."""
    places: list[complex] = []
    for zero in sorted(found, key=lambda zero: (zero.real, zero.imag)):
        if not places or zero.real - places[-1].real > _TOGETHER:
            places.append(zero)
        elif abs(zero.imag) < abs(places[-1].imag):
            places[-1] = zero
    return places
