"""A stretch of path as spans that smooth joints can follow, also through and close by singular poses.

Where a free joint's vector has a zero on the path or beside it, a span is set around it in which that
joint is taken from the vector's bearing: through an exact zero it goes on smoothly, in another
configuration; past a miss the span's parameter is widened until ticks can resolve the joint's turn.
Elsewhere a span is just path.
Not here: sampling and polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from viapoint.runtime.kernel.bearings import Bearing, Complexes, fit, held, smooth, zeros
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

_TOGETHER: Final = 5e-3
"""m. Zeros closer than this share a polynomial: between them the vector is too small to change over."""

_SAME_MISS: Final = 3.0
"""Zeros closer than so many misses are passed as one."""

_SLIVER: Final = 1e-9
"""m. Less path than this is no span of its own."""

_FAR: Final = 50.0
"""Width of the widened parameter, in misses, below which widening makes nothing smoother."""

_LEAST_WIDTH: Final = 1e-4
"""m of path that the widening takes at least; a joint beyond it turns by less than d/width per length."""

_FINE: Final = 2e-5
"""m. At a miss by more, ticks resolve the turn of the joint without widening: s of 10 m is rounded to
2e-15 m, which is 1e-10 rad of the joint and 1 rad/s³ at a millisecond."""

_WIDTHS: Final = _WIDTH * 0.5 ** np.arange(13)
"""Tried in this order; a vector that is not smooth even so near to its zero is left alone."""


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
        return np.minimum(np.maximum(self.centre + x, 0.0), self.path.length), x, rate

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
            now = self._beyond(span, joint) if crossed else span
            if span.warp is not None:
                result.append(now)
                continue
            done = span.begin
            for together in self._zeros(span, number):
                near = self._around(now, number, joint, together, done)
                if near is None:
                    continue
                if near.begin > done:
                    result.append(_part(now, done, near.begin))
                result += self._widened(near)
                done = near.end
                if near.bearings[-1].within % 2 == 1:
                    crossed = not crossed
                    now = self._beyond(now, joint)
            if done < span.end:
                result.append(_part(now, done, span.end))
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

    def _zeros(self, span: Span, number: int) -> list[list[complex]]:
        """Zeros on a span, those together in one list; an empty one: the joint is free all along it."""
        vector = partial(self._vector, span, number)
        edges = np.linspace(span.begin, span.end, max(1, round((span.end - span.begin) / _SCAN)) + 1)
        found = zeros(vector, edges, _NEAR)
        if found is None:
            return [[]]
        groups: list[list[complex]] = []
        for zero in sorted(found, key=lambda zero: (zero.real, zero.imag)):
            if groups and zero.real - groups[-1][-1].real <= _TOGETHER:
                groups[-1].append(zero)
            else:
                groups.append([zero])
        return groups

    def _around(self, span: Span, number: int, joint: int, near: list[complex], done: float) -> Span | None:
        """The part of a span behind `done` around zeros that are together; None where that is not smooth."""
        if not near:
            bearing = held(joint, float(self._reference[joint]))
            return replace(span, bearings=(*span.bearings, bearing))
        vector = partial(self._vector, span, number)
        begins = np.maximum(done, near[0].real - _WIDTHS)
        ends = np.minimum(span.end, near[-1].real + _WIDTHS)
        room = ends > begins
        for k in np.flatnonzero(room & smooth(vector, begins, np.maximum(ends, begins + _SLIVER))).tolist():
            begin, end = float(begins[k]), float(ends[k])
            centre = 0.5 * (begin + end)
            fitted = fit(vector, joint, centre, begin, end, _NEAR)
            if fitted is not None:
                bearings = (*span.bearings, fitted)
                return replace(span, begin=begin, end=end, centre=centre, bearings=bearings)
        return None

    def _widened(self, near: Span) -> list[Span]:
        """A part around zeros, with the surroundings of every miss widened that needs it."""
        bearing = near.bearings[-1]
        misses = sorted(bearing.misses, key=lambda miss: abs(miss.imag))
        spans: list[Span] = []
        for k, miss in enumerate(misses):
            apart = min((abs(other.real - miss.real) for other in misses[:k]), default=np.inf)
            if apart > _SAME_MISS * abs(miss.imag):
                spans += self._widening(near, miss, 0.5 * apart)
        spans.sort(key=lambda span: span.begin)
        result: list[Span] = []
        done = near.begin
        for span in spans:
            if span.begin < done - _SLIVER:
                continue
            if span.begin - done > _SLIVER:
                result.append(_part(near, done, span.begin))
            result.append(span if span.begin - done > _SLIVER else replace(span, begin=done))
            done = span.end
        if near.end - done > _SLIVER:
            return [*result, _part(near, done, near.end)]
        return [*result[:-1], replace(result[-1], end=near.end)]

    def _widening(self, near: Span, miss: complex, room: float) -> list[Span]:
        """The widened part around one miss, with so much room; none where it needs none or there is none."""
        bearing = near.bearings[-1]
        centre, distance = bearing.centre + miss.real, abs(miss.imag)
        warp = self._warp(distance, centre, near, room)
        if warp is None:
            return []
        bearings = (*near.bearings[:-1], bearing.moved(centre))
        begin, end = max(near.begin, centre - warp.width), min(near.end, centre + warp.width)
        if end <= begin:
            return []
        return [replace(near, begin=begin, end=end, centre=centre, bearings=bearings, warp=warp)]

    def _warp(self, miss: float, centre: float, near: Span, room: float) -> Warp | None:
        """The widening for a miss; where an end of the path leaves it no room the path must stand still."""
        need = max(_FAR * miss, _LEAST_WIDTH)
        ends = near.begin <= 0.0, near.end >= self._path.length
        rooms = [centre - near.begin, near.end - centre]
        for side in (0, 1):
            if ends[side] and not self._rest[side] and miss < _FINE and abs(rooms[side]) < need:
                self.stops[side] = True
            if ends[side] and (self._rest[side] or self.stops[side]):
                rooms[side] = np.inf
        width = min(_WIDTH, room, *rooms)
        return Warp(miss, width) if width >= _FAR * miss else None


def _part(span: Span, begin: float, end: float) -> Span:
    return replace(span, begin=begin, end=end, centre=begin)
