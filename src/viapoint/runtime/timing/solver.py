"""Primal–dual interior point for the time law (Mehrotra's predictor–corrector): numpy twin of the core.

    minimise Σ wᵢ/√cᵢ   subject to   −below ≤ A c ≤ above,   |J c| ≤ c^(−1/2),   c ≤ c_max
The tangent of c^(−1/2) lies below it, so a Newton step never oversteps a jerk limit. A jerk row touches
three neighbours: the Hessian is pentadiagonal. The start need not be feasible; a solve can be resumed
from its slacks and multipliers after the rows have been changed a little.

With slack s, multiplier z, residual r and δ = ds/s, the predictor has dz/z = −(1 + δ): one division
per row serves step lengths, complementarity and the corrector (Nocedal & Wright, Numerical
Optimization, 14.2 and 19.3). Every sum is taken in the order of the core: both give the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.rows import Problem

FEASIBLE: Final = 3e-3
"""Largest violation of a scaled row that is taken for none; ticks decide in the end."""

HOPELESS: Final = 1e3
"""Gap, in durations, of a solve that will not converge; a fresh start has 1 to 10."""

FIRST_SLACK: Final = 0.3
FIRST_BARRIER: Final = 0.1
"""Least slack, and barrier in mean durations of a piece, of a fresh start."""

RESUMED_SLACK: Final = 0.01
RESUMED_BARRIER: Final = 0.003
RESUMED_SHARE: Final = 0.02
"""The same for resuming: slightly off the boundary, as the rows have moved."""

LEAST_CENTRING: Final = 0.03
TO_BOUNDARY: Final = 0.95
LEAST_SHRINK: Final = 1e-9
SLACK_GROWTH: Final = 4.0
"""The curved jerk bound leaves more room than its tangent; slacks may follow it, but not at once."""


@dataclass(slots=True)
class State:
    """Slacks s and multipliers z of all rows, for resuming; changed by every solve.

    acceleration (2, m+1, n+1), jerk (2, 2m, n), bound (n,); upper sides first. `scale` (n,) is √c of the
    first start, by which jerk rows are balanced; `iterations` counts all solves.
    """

    scale: Floats
    sa: Floats
    za: Floats
    sj: Floats
    zj: Floats
    sx: Floats
    zx: Floats
    iterations: int = 0
    gap: float = np.inf
    violation: float = np.inf


def duration(weight: Floats, c: Floats) -> float:
    """The objective, s: Σ weight/√c."""
    return _in_order(weight / np.sqrt(c))


def _in_order(x: Floats) -> float:
    """Σx, one after the other."""
    return float(np.add.accumulate(x)[-1])


def fresh(p: Problem, c: Floats) -> State:
    """Slacks of the start c, lifted off the boundary, and multipliers of equal products with them."""
    scale = np.sqrt(c)
    ya, yj = _bands2(p.lo, p.hi, _padded(c)), _bands3(p.jm * scale, p.j0 * scale, p.jp * scale, _padded(c))
    slacks = (
        np.stack((p.above - ya, p.below + ya)),
        np.stack((1.0 - yj, 1.0 + yj)),
        1.0 - c * p.inverse_max,
    )
    sa, sj, sx = (np.maximum(s, FIRST_SLACK) for s in slacks)
    mu = FIRST_BARRIER * duration(p.weight, c) / len(c)
    return State(scale, sa, mu / sa, sj, mu / sj, sx, mu / sx)


def lift(p: Problem, c: Floats, state: State) -> None:
    """Make the slacks and multipliers of an earlier solve a start for this one."""
    mu = RESUMED_BARRIER * duration(p.weight, c) / len(c)
    for slack, dual in ((state.sa, state.za), (state.sj, state.zj), (state.sx, state.zx)):
        np.maximum(slack, RESUMED_SLACK, out=slack)
        np.maximum(dual, mu / np.maximum(slack, RESUMED_SHARE), out=dual)


def improve(p: Problem, c: Floats, state: State, tolerance: float, most: int) -> Floats:
    """c (n,) improved until the duality gap is below `tolerance` of the duration; `state` is changed."""
    work = _Work(p, c, state)
    for _ in range(most):
        work.measure()
        if work.done(tolerance) or not work.step():
            break
    state.gap, state.violation = work.gap, work.violation
    return work.c


def _padded(c: Floats) -> Floats:
    return np.concatenate(([0.0], c, [0.0]))


def _bands2(lo: Floats, hi: Floats, padded: Floats) -> Floats:
    """Rows at knots times coefficients, (k, n+1)."""
    return lo * padded[:-1] + hi * padded[1:]


def _bands3(jm: Floats, j0: Floats, jp: Floats, padded: Floats) -> Floats:
    """Rows on pieces times coefficients, (k, n)."""
    return jm * padded[:-2] + j0 * padded[1:-1] + jp * padded[2:]


class _Side:
    """One kind of row: slacks, multipliers, and what a step needs of them."""

    def __init__(self, s: Floats, z: Floats) -> None:
        self.s, self.z = s, z

    def measure(self, room: Floats) -> None:
        """Residual of s = room, inverse slack, weight z/s, product sz."""
        self.r = room - self.s
        self.inverse = 1.0 / self.s
        self.w = self.z * self.inverse
        self.g = self.s * self.z
        self.force = -self.w * self.r

    def predict(self, change: Floats) -> None:
        """δ of the predictor, when `room` changes by `change`."""
        self.delta = (self.r + change) * self.inverse

    def centre(self, mu: float, product: float) -> None:
        """Right side of the corrector: (μ − ds dz)/s on top of the predictor's."""
        self.c = (mu + product * self.g * self.delta * (1.0 + self.delta)) * self.inverse
        self.force = self.c + self.force

    def direct(self, change: Floats) -> None:
        """Step of the corrector."""
        self.ds = self.r + change
        self.dz = self.c - self.z - self.w * self.ds

    def move(self, primal: float, dual: float) -> None:
        self.s += primal * self.ds
        self.z += dual * self.dz


class _Work:
    """One solve: the iterate, its rows, and a step."""

    def __init__(self, p: Problem, c: Floats, state: State) -> None:
        self.p, self.c, self.state = p, c, state
        self.jerk = (p.jm * state.scale, p.j0 * state.scale, p.jp * state.scale)
        self.a, self.j, self.x = (
            _Side(state.sa, state.za),
            _Side(state.sj, state.zj),
            _Side(state.sx, state.zx),
        )
        self.sides = (self.a, self.j, self.x)
        self.count = state.sa.size + state.sj.size + state.sx.size

    def _jerk_room(self) -> Floats:
        yj = _bands3(*self.jerk, _padded(self.c))
        room = self.state.scale / np.sqrt(self.c)
        return np.stack((room - yj, room + yj))

    def measure(self) -> None:
        """Residuals, weights, gap and violation at the iterate."""
        p = self.p
        ya = _bands2(p.lo, p.hi, _padded(self.c))
        self.a.measure(np.stack((p.above - ya, p.below + ya)))
        self.j.measure(self._jerk_room())
        self.x.measure(1.0 - self.c * p.inverse_max)
        self.bend = -0.5 * self.state.scale / (self.c * np.sqrt(self.c))
        self.gap = self._total([side.g for side in self.sides])
        self.violation = -min(float(side.r.min(initial=0.0)) for side in self.sides)

    def _total(self, products: list[Floats]) -> float:
        """Σ over all rows: upper and lower side, then down the rows, then along the path."""
        a, j, x = products
        total = (a[0] + a[1]).sum(axis=0)
        for row in j[0] + j[1]:
            total[:-1] += row
        total[:-1] += x
        return _in_order(total)

    def done(self, tolerance: float) -> bool:
        """True if gap and violation are small, or the gap has grown beyond hope: rows that contradict."""
        time = duration(self.p.weight, self.c)
        good = self.gap < tolerance * time and self.violation < FEASIBLE
        return good or self.gap > HOPELESS * time

    def step(self) -> bool:
        """One predictor–corrector step; False if the factorisation fails (c stays as it is)."""
        factors = _factor(*(row.tolist() for row in self._hessian()))
        if factors is None:
            return False
        self.factors = factors
        for side, change in zip(self.sides, self._changes(self._newton()), strict=True):
            side.predict(change)
        mu, product = self._centring()
        for side in self.sides:
            side.centre(mu, product)
        dc = self._newton()
        for side, change in zip(self.sides, self._changes(dc), strict=True):
            side.direct(change)
        self._move(dc)
        return True

    def _changes(self, dc: Floats) -> tuple[Floats, Floats, Floats]:
        """How the rooms of all rows change with dc."""
        ya = _bands2(self.p.lo, self.p.hi, _padded(dc))
        yj, curve = _bands3(*self.jerk, _padded(dc)), self.bend * dc
        return np.stack((-ya, ya)), np.stack((curve - yj, curve + yj)), -dc * self.p.inverse_max

    def _newton(self) -> Floats:
        """Step of c for the present forces."""
        p, (jm, j0, jp) = self.p, self.jerk
        fa = self.a.force[0] - self.a.force[1]
        fj = self.j.force[0] - self.j.force[1]
        r = -0.5 * p.weight / (self.c * np.sqrt(self.c))
        r += (fa * p.hi).sum(axis=0)[:-1] + (fa * p.lo).sum(axis=0)[1:]
        r += (fj * j0 - self.bend * (self.j.force[0] + self.j.force[1])).sum(axis=0)
        r[1:] += (fj * jp).sum(axis=0)[:-1]
        r[:-1] += (fj * jm).sum(axis=0)[1:]
        r = -(r + self.x.force * p.inverse_max)
        r[: p.fixed] = 0.0
        return np.array(_substitute(*self.factors, r.tolist()))

    def _hessian(self) -> Floats:
        """Lower band (3, n) of ∇²f + Aᵀ(z/s)A over all rows; the given coefficients are cut out."""
        p, c, k = self.p, self.c, self.p.fixed
        h = np.zeros((3, len(c)))
        w = self.a.w[0] + self.a.w[1]
        high = w * p.hi
        h[0] = 0.75 * p.weight / (c * c * np.sqrt(c)) + self.x.w * p.inverse_max**2
        h[0] += (high * p.hi).sum(axis=0)[:-1] + (w * p.lo * p.lo).sum(axis=0)[1:]
        h[1, :-1] = (high * p.lo).sum(axis=0)[1:-1]
        self._add_jerk(h)
        h[0, :k], h[1, :k], h[2, :k] = 1.0, 0.0, 0.0
        return h

    def _add_jerk(self, h: Floats) -> None:
        """Rows J − g (upper) and −J − g (lower), g the slope of c^(−1/2) on the diagonal."""
        (jm, j0, jp), g = self.jerk, self.bend
        both, skew = self.j.w[0] + self.j.w[1], self.j.w[0] - self.j.w[1]
        tilt = both * j0 - skew * g
        ahead = both * jp
        h[0] += (tilt * j0 - g * skew * j0 + g * g * both).sum(axis=0)
        h[0, 1:] += (ahead * jp).sum(axis=0)[:-1]
        h[0, :-1] += (both * jm * jm).sum(axis=0)[1:]
        h[1, :-1] += (tilt * jp).sum(axis=0)[:-1] + (tilt * jm).sum(axis=0)[1:]
        h[2, :-2] = (ahead * jm).sum(axis=0)[1:-1]

    def _centring(self) -> tuple[float, float]:
        """Barrier μ (the mean gap times the square of what the predictor would leave), and α_p α_d."""
        low = min(float(side.delta.min(initial=0.0)) for side in self.sides)
        high = max(float(side.delta.max(initial=-1.0)) for side in self.sides)
        primal, dual = _step(-low, 1.0), _step(1.0 + high, 1.0)
        first = self._total([side.g * side.delta for side in self.sides])
        second = self._total([side.g * side.delta * side.delta for side in self.sides])
        after = self.gap + primal * first - dual * (self.gap + first) - primal * dual * (first + second)
        share = min(1.0, max(after / self.gap, LEAST_CENTRING))
        return share * share * self.gap / self.count, primal * dual

    def _move(self, dc: Floats) -> None:
        """The longest step inside all bounds; the jerk slacks follow their curved bound."""
        low = min(float((side.ds * side.inverse).min(initial=0.0)) for side in self.sides)
        low = min(low, float((dc / self.c).min()))
        dual = min(float((side.dz / side.z).min(initial=0.0)) for side in self.sides)
        primal_step, dual_step = _step(-low, TO_BOUNDARY), _step(-dual, TO_BOUNDARY)
        self.c = self.c + primal_step * dc
        for side in self.sides:
            side.move(primal_step, dual_step)
        sj = self.j.s
        np.maximum(sj, np.minimum(self._jerk_room(), SLACK_GROWTH * sj), out=sj)
        self.state.iterations += 1


def _step(shrink: float, share: float) -> float:
    """Step length: `share` of the way to where something shrinking at this rate reaches zero, at most 1."""
    return min(1.0, share / max(shrink, LEAST_SHRINK))


def _factor(
    a: list[float], b: list[float], e: list[float]
) -> tuple[list[float], list[float], list[float]] | None:
    """L D Lᵀ of the pentadiagonal matrix with diagonal a and subdiagonals b, e; None if not positive."""
    d1 = d2 = b1 = e1 = e2 = 0.0  # of the row before, and the one before that
    for i, own in enumerate(a):
        d = own - b1 * b1 * d1
        d = d - e2 * e2 * d2
        if not d > 0.0:
            return None
        below = b[i] - e1 * b1 * d1
        inverse = 1.0 / d
        a[i], b[i], e[i] = d, below * inverse, e[i] * inverse
        d2, d1, b1, e2, e1 = d1, d, b[i], e1, e[i]
    return a, b, e


def _substitute(a: list[float], b: list[float], e: list[float], r: list[float]) -> list[float]:
    """Solve L D Lᵀ x = r with the factors of `_factor`; r becomes x."""
    r1 = r2 = b1 = e1 = e2 = 0.0
    for i, right in enumerate(r):
        x = right - b1 * r1
        x = x - e2 * r2
        r[i] = x
        r2, r1, b1, e2, e1 = r1, x, b[i], e1, e[i]
    r1 = r2 = 0.0
    for i in range(len(r) - 1, -1, -1):
        x = r[i] / a[i] - b[i] * r1
        x = x - e[i] * r2
        r[i] = x
        r2, r1 = r1, x
    return r
