"""The quickest way up and down between held speeds, every change of speed in one shape.

The section is cut into cells; in each, the limits of all axes are gathered into a few numbers that bound
the speed held there and how quickly it may change. Over the grid of cell boundaries and speeds the quickest
sequence of holding, rising and falling is found backward from the end (dynamic programming). A rise
leaves its lower speed at a boundary, a fall reaches it at one: what lies between is held at the higher one.
Not here: ticks and their check (shaped).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.records import Bools, Floats, Ints
from viapoint.runtime.timing import programmed
from viapoint.runtime.timing.curve import INSET
from viapoint.runtime.timing.estimate import Estimate
from viapoint.runtime.timing.rows import SPEED_PART, Tightening
from viapoint.runtime.timing.section import Request
from viapoint.runtime.timing.shapes import Change, Shape

_CELLS: Final = 72
_SHORTEST: Final = 0.004
"""Cells of a section beside its breaks, and s of estimated time that each takes at least."""

_LOOKS: Final = 5
"""Places of a cell at which the curve is looked at; ticks decide in the end."""

_ROOM: Final = 0.97
"""Part of the limits that a held speed may use up in curves: the rest lets it change."""

_STEADY: Final = 0.96
"""A start above what its cell allows by less than this part is the rounding of another division."""

_RUNGS: Final = np.array(
    [0.004, 0.015, 0.04, 0.08, 0.14, 0.21, 0.3, 0.4, 0.5, 0.6, 0.7, 0.79, 0.87, 0.94, 1.0]
)
"""Speeds tried, in parts of the highest: finer where it is fast, for there the time is spent."""

_DIPS: Final = 10
_SAME: Final = 0.03
"""Speeds held in the slowest places are tried as they are, so many of them; closer ones are one."""

_FINER: Final = np.array([0.93, 0.965, 1.035, 1.07])
"""Speeds tried beside those that a first search has used."""

_ROUNDS: Final = 4
"""Rounds in which the time of a change and the cells that it passes settle."""

_ROUNDING: Final = 1e-12
"""Part of a length that is none."""

_SETTLED: Final = 1e-9
"""Part of its time by which a change may still fall short."""

_NOTHING: Final = 1e-9
"""Part of a limit that is as good as used up."""

_POINTS: Final = 9
"""Places of a change at which limits are looked at: among them those of peak acceleration and jerk."""


@dataclass(frozen=True, slots=True)
class Cells:
    """The section between `edges` (n+1,): per cell (n,) the largest rates of the axes in units of limits."""

    edges: Floats
    bound: Floats  # speed: programmed and of the axes
    up: Floats  # |q′| ÷ acceleration
    down: Floats  # |q′| ÷ deceleration
    bend: Floats  # |q″| ÷ acceleration
    jerk: Floats  # |q′| ÷ jerk
    jerk_bend: Floats  # 3·|q″| ÷ jerk
    jerk_twist: Floats  # |q‴| ÷ jerk

    def tightened(self, by: Tightening) -> Cells:
        """The same with limits divided by what ticks were over them."""
        a = np.maximum(by.acceleration[1:], by.acceleration[:-1])
        return Cells(
            self.edges,
            self.bound / by.speed,
            self.up * a,
            self.down * a,
            self.bend * a,
            self.jerk * by.jerk,
            self.jerk_bend * by.jerk,
            self.jerk_twist * by.jerk,
        )

    @property
    def ceiling(self) -> Floats:
        """(n,) speed that can be held in each cell."""
        with np.errstate(divide="ignore"):
            bend, twist = np.sqrt(_ROOM / self.bend), np.cbrt(_ROOM / self.jerk_twist)
        result: Floats = np.minimum(np.minimum(self.bound, bend), twist)
        return result


def cells(ask: Request, est: Estimate, s_start: float) -> Cells:
    """The section of a request from s_start on."""
    marks = programmed.knots_of(est.breaks, ask.bound, ask.tick)
    count = int(np.clip(est.t[-1] / _SHORTEST, 4, _CELLS))
    even = np.interp(np.linspace(0.0, float(est.t[-1]), count + 1)[1:-1], est.t, est.s)
    apart = INSET * (ask.s_end - s_start)
    inner = np.sort(np.concatenate((marks, even)))
    inner = inner[(np.diff(inner, prepend=s_start) > apart) & (inner < ask.s_end - apart)]
    edges = np.concatenate(([s_start], inner, [ask.s_end]))
    inside = INSET + (1.0 - 2.0 * INSET) * np.linspace(0.0, 1.0, _LOOKS)
    s = edges[:-1, None] + np.diff(edges)[:, None] * inside
    limits, shape = ask.limits, s.shape
    d1, d2, d3 = (np.abs(d).reshape(*shape, -1).max(axis=1) for d in ask.curve.derivatives(s.ravel()))
    bound = ask.bound(s.ravel()).reshape(shape).min(axis=1)
    with np.errstate(divide="ignore"):
        bound = np.minimum(bound, 1.0 / _most(d1, limits.speed)) * SPEED_PART
    return Cells(
        edges,
        np.minimum(bound, (ask.s_end - s_start) / ask.tick),
        _most(d1, limits.acceleration),
        _most(d1, limits.braking),
        _most(d2, limits.gentlest),
        _most(d1, limits.jerk),
        3.0 * _most(d2, limits.jerk),
        _most(d3, limits.jerk),
    )


def _most(rates: Floats, limit: Floats) -> Floats:
    """(n,) largest ratio over the axes of rates (n, m) to limits (m,)."""
    result: Floats = (rates / limit).max(axis=1, initial=0.0)
    return result


def search(shape: Shape, grid: Cells, v_start: float, tick: float) -> list[Change] | None:
    """The quickest changes from v_start at the first edge to rest at the last; None if there are none."""
    ceiling = grid.ceiling.copy()
    ceiling[(ceiling < v_start) & (ceiling >= _STEADY * v_start)] = v_start
    speeds = _speeds(ceiling, v_start)
    found = _Search(shape, grid, ceiling, speeds, tick).run(v_start)
    if found is None:
        return None
    used = np.array([change.v_to for change in found])
    finer = np.outer(used, _FINER).ravel()
    finer = _apart(finer[finer <= ceiling.max()], np.append(used, (0.0, v_start)))
    again = _Search(shape, grid, ceiling, finer, tick).run(v_start)
    return found if again is None else again


def _speeds(ceiling: Floats, v_start: float) -> Floats:
    """Speeds to try: rungs below the highest, and those of the slowest places."""
    inner = np.concatenate(([np.inf], ceiling, [np.inf]))
    low = ceiling[(ceiling <= inner[:-2]) & (ceiling <= inner[2:])]
    dips = np.sort(low)[:: max(1, len(low) // _DIPS)]
    top = float(ceiling.max())
    return _apart(np.concatenate((top * _RUNGS, dips)), np.array([0.0, top, v_start, float(ceiling.min())]))


def _apart(speeds: Floats, kept: Floats) -> Floats:
    """Ascending speeds that differ; those of `kept` stay as they are."""
    result = np.unique(kept)
    for v in np.sort(speeds)[::-1]:
        if np.all(np.abs(result - v) > _SAME * v):
            result = np.append(result, v)
    return np.sort(result)


@dataclass(slots=True)
class _Edges:
    """Changes that can be made: from edge `start` at speed number `a` to edge `end` at number `b`."""

    start: Ints
    a: Ints
    b: Ints
    end: Ints
    time: Floats  # of the change itself
    whole: Floats  # with what is held before or after it


class _Search:
    """One search over a grid of cell edges (n+1) and speeds (m)."""

    def __init__(self, shape: Shape, grid: Cells, ceiling: Floats, speeds: Floats, tick: float) -> None:
        self.grid, self.ceiling, self.speeds, self.tick = grid, ceiling, speeds, tick
        u = np.linspace(0.0, 1.0, _POINTS)
        self._u, self._place, self._speed = u, shape.place(u), shape.speed(u)
        self._acceleration, self._jerk = shape.acceleration(u), np.abs(shape.jerk(u))
        n = len(ceiling)
        self._log = np.log2(np.arange(1, n + 2)).astype(np.int64)
        self._log = np.concatenate(([0], self._log))
        rows = [ceiling]
        for k in range(int(self._log[n])):
            before = rows[-1]
            shifted = np.append(before[1 << k :], np.full(1 << k, np.inf))[: len(before)]
            rows.append(np.minimum(before, shifted))
        self._lowest = np.stack(rows)
        """[k, i]: lowest ceiling of 2^k cells from i on."""

    def run(self, v_start: float) -> list[Change] | None:
        rises, falls = self._edges(rising=True), self._edges(rising=False)
        edges = _joined(rises, falls)
        cost, chosen = self._backward(edges)
        first = int(np.searchsorted(self.speeds, v_start))
        return None if not np.isfinite(cost[0, first]) else self._changes(edges, chosen, first)

    def _edges(self, *, rising: bool) -> _Edges:
        """All rises, or all falls, that keep to the limits of the cells they pass."""
        n, speeds = len(self.ceiling), self.speeds
        low, high = np.triu_indices(len(speeds), 1)
        a, b = (low, high) if rising else (high, low)
        start, pair = np.meshgrid(np.arange(n), np.arange(len(low)), indexing="ij")
        open_here = speeds[a[pair]] <= self.ceiling[start]
        start, a, b = start[open_here], a[pair[open_here]], b[pair[open_here]]
        s, time = self.grid.edges, np.full(len(start), self.tick)
        for _ in range(_ROUNDS):
            end = self._end(start, a, b, time)
            keep = end <= n
            start, a, b, time, end = start[keep], a[keep], b[keep], time[keep], end[keep]
            time = np.maximum(time, self._needed(start, end, a, b, time, rising))
        end = self._end(start, a, b, time)
        keep = end <= n
        start, a, b, time, end = start[keep], a[keep], b[keep], time[keep], end[keep]
        keep = self._fit(start, end, a, b, time, rising)
        keep &= self._needed(start, end, a, b, time, rising) <= time * (1.0 + _SETTLED)
        rest = np.maximum(s[end] - s[start] - 0.5 * (speeds[a] + speeds[b]) * time, 0.0)
        whole = time + rest / np.maximum(speeds[a], speeds[b])
        return _Edges(start[keep], a[keep], b[keep], end[keep], time[keep], whole[keep])

    def _end(self, start: Ints, a: Ints, b: Ints, time: Floats) -> Ints:
        """First edge that is not before the end of a change; n + 1 if it is beyond all."""
        s = self.grid.edges
        reach = s[start] + 0.5 * (self.speeds[a] + self.speeds[b]) * time
        return np.asarray(np.searchsorted(s, reach - _ROUNDING * (s[-1] - s[0])))

    def _passed(
        self, start: Ints, end: Ints, a: Ints, b: Ints, time: Floats, rising: bool
    ) -> tuple[Ints, Floats]:
        """Cell and speed at every look (E, points) at changes that take `time`."""
        s, t = self.grid.edges, time[:, None]
        va, vb = self.speeds[a][:, None], self.speeds[b][:, None]
        begin = s[start][:, None] if rising else s[end][:, None] - 0.5 * (va + vb) * t
        place = begin + t * (va * self._u + (vb - va) * self._place)
        cell = np.searchsorted(s, place, side="right") - 1
        return np.minimum(np.maximum(cell, start[:, None]), end[:, None] - 1), va + (vb - va) * self._speed

    def _fit(self, start: Ints, end: Ints, a: Ints, b: Ints, time: Floats, rising: bool) -> Bools:
        """Whether changes (E,) and what is held beside them stay below the ceilings."""
        cell, v = self._passed(start, end, a, b, time, rising)
        # between two looks the speed is at most the higher one, in all cells from one look to the next
        fits = (np.maximum(v[:, 1:], v[:, :-1]) <= self._least(cell[:, :-1], cell[:, 1:])).all(axis=1)
        held = np.maximum(self.speeds[a], self.speeds[b])
        outer = self._least(cell[:, -1], end - 1) if rising else self._least(start, cell[:, 0])
        return np.asarray(fits & (held <= outer))

    def _least(self, first: Ints, last: Ints) -> Floats:
        """Lowest ceiling of the cells from first to last, arrays of one shape."""
        level = self._log[last - first + 1]
        result: Floats = np.minimum(self._lowest[level, first], self._lowest[level, last + 1 - (1 << level)])
        return result

    def _needed(self, start: Ints, end: Ints, a: Ints, b: Ints, time: Floats, rising: bool) -> Floats:
        """Time (E,) that acceleration and jerk need in the cells that changes pass when they take `time`.

        inf where a curve leaves nothing for a change of speed.
        """
        grid = self.grid
        cell, v = self._passed(start, end, a, b, time, rising)
        rise = np.abs(self.speeds[b] - self.speeds[a])[:, None]
        rate = (grid.up if rising else grid.down)[cell]
        with np.errstate(divide="ignore"):
            left = np.maximum(1.0 - grid.bend[cell] * v * v, _NOTHING)
            by_acceleration = rate * rise * self._acceleration / left
            turn = grid.jerk_bend[cell] * v * (rise * self._acceleration)
            free = np.maximum(1.0 - grid.jerk_twist[cell] * v**3, _NOTHING)
            by_jerk = turn + np.sqrt(turn * turn + 4.0 * free * grid.jerk[cell] * (rise * self._jerk))
            needed = np.maximum(by_acceleration, 0.5 * by_jerk / free)
        return np.asarray(needed.max(axis=1))

    def _backward(self, edges: _Edges) -> tuple[Floats, Ints]:
        """Time to the end from every edge and speed (n+1, m), and the change chosen there (−1: held)."""
        n, m = len(self.ceiling), len(self.speeds)
        cost, chosen = np.full((n + 1, m), np.inf), np.full((n + 1, m), -1)
        cost[n, 0] = 0.0
        order = np.argsort(edges.start, kind="stable")
        limits = np.searchsorted(edges.start[order], np.arange(n + 1))
        length = np.diff(self.grid.edges)
        for i in range(n - 1, -1, -1):
            with np.errstate(divide="ignore"):
                held = cost[i + 1] + length[i] / self.speeds
            cost[i] = np.where(self.speeds <= self.ceiling[i], held, np.inf)
            here = order[limits[i] : limits[i + 1]]
            total = edges.whole[here] + cost[edges.end[here], edges.b[here]]
            best = cost[i].copy()
            np.minimum.at(best, edges.a[here], total)
            won = (total == best[edges.a[here]]) & (total < cost[i][edges.a[here]])
            chosen[i, edges.a[here][won]] = here[won]
            cost[i] = best
        return cost, chosen

    def _changes(self, edges: _Edges, chosen: Ints, level: int) -> list[Change]:
        """The way chosen from the first edge at a speed on."""
        s, n = self.grid.edges, len(self.ceiling)
        result: list[Change] = []
        i, done = 0, float(s[0])
        while i < n:
            v, e = float(self.speeds[level]), int(chosen[i, level])
            if e < 0:
                i += 1
                continue
            w, end, time = float(self.speeds[edges.b[e]]), int(edges.end[e]), float(edges.time[e])
            begin = float(s[i]) if w > v else float(s[end]) - 0.5 * (v + w) * time
            _hold(result, done, max(begin, done), v)
            result.append(Change(max(begin, done), v, w, time))
            done = result[-1].s + result[-1].length
            i, level = end, int(edges.b[e])
        _hold(result, done, float(s[-1]), float(self.speeds[level]))
        return result


def _hold(changes: list[Change], begin: float, end: float, v: float) -> None:
    if v > 0.0 and end - begin > _ROUNDING * max(abs(end), 1.0):
        changes.append(Change(begin, v, v, (end - begin) / v))


def _joined(a: _Edges, b: _Edges) -> _Edges:
    return _Edges(*(np.concatenate((getattr(a, k), getattr(b, k))) for k in _Edges.__slots__))
