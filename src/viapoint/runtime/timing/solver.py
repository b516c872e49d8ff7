"""Primal–dual interior point for the time law (Mehrotra's predictor–corrector), numpy twin of the core.

    minimise Σ wᵢ/√cᵢ   subject to   −below ≤ A c ≤ above,  V c ≤ 1,  |J c|·√c ≤ 1,  c ≤ c_max
The Hessian is pentadiagonal, as a jerk row touches three neighbours. Jerk is written |J c| ≤ c^(−1/2):
the tangent of the right side lies below it, so a Newton step never oversteps a limit. The start need
not be feasible. A solve can be resumed with slightly other rows, from its old slacks and multipliers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg.lapack import dpbtrf, dpbtrs

from viapoint.runtime.records import Floats
from viapoint.runtime.timing.rows import Problem

FEASIBLE: Final = 3e-3
"""Largest violation of a scaled row that is taken for none; ticks decide in the end."""

_FIRST_SLACK: Final = 0.1
_FIRST_BARRIER: Final = 0.1
_RESUMED_SLACK: Final = 0.01
_RESUMED_BARRIER: Final = 0.0008
_RESUMED_SHARE: Final = 0.05
_LEAST_CENTRING: Final = 0.03
_TO_BOUNDARY: Final = 0.95
_SLACK_GROWTH: Final = 4.0
"""The curved jerk bound leaves more room than its tangent; slacks may follow it, but not at once."""


@dataclass(slots=True)
class State:
    """Slacks s and multipliers z of all rows, for resuming; changed by every solve.

    acceleration (2, m, n+1), jerk (2, 2m, n), value (n+1,), bound (n,); `scale` (n,) is √c of the first
    start, by which jerk rows are balanced; `iterations` counts all solves.
    """

    scale: Floats
    sa: Floats
    za: Floats
    sj: Floats
    zj: Floats
    sv: Floats
    zv: Floats
    sx: Floats
    zx: Floats
    iterations: int = 0
    gap: float = np.inf
    violation: float = np.inf


def solve(p: Problem, c: Floats, state: State | None, tolerance: float, most: int) -> tuple[Floats, State]:
    """Improve c (n,) until the duality gap is below `tolerance` of the duration, `most` iterations at most.

    `state` None starts anew. Returns the new c and the state (the given one, changed).
    """
    work = _Work(p, c, state)
    for _ in range(most):
        if work.converged(tolerance) or not work.step():
            break
    work.state.gap, work.state.violation = work.gap, work.violation
    return work.c, work.state


class _Work:
    """One solve: the iterate and what its rows give there."""

    def __init__(self, p: Problem, c: Floats, state: State | None) -> None:
        self.p = p
        self.c = c
        scale = np.sqrt(c) if state is None else state.scale
        self.jerk = (p.jm * scale, p.j0 * scale, p.jp * scale)
        self.scale = scale
        self._evaluate()
        if state is None:
            self.state = self._fresh()
        else:
            self.state = state
            self._lift()
        self.gap = self.violation = np.inf

    def _evaluate(self) -> None:
        """Row values at c, and the right side of jerk."""
        self.ya = self._apply_a(self.c)
        self.yv = self._apply_v(self.c)
        self.yj = self._apply_j(self.c)
        self.room = self.scale / np.sqrt(self.c)

    def _apply_a(self, d: Floats) -> Floats:
        y = np.zeros_like(self.p.lo)
        y[:, 1:] = self.p.lo[:, 1:] * d
        y[:, :-1] += self.p.hi[:, :-1] * d
        return y

    def _apply_v(self, d: Floats) -> Floats:
        y = np.zeros_like(self.p.value_lo)
        y[1:] = self.p.value_lo[1:] * d
        y[:-1] += self.p.value_hi[:-1] * d
        return y

    def _apply_j(self, d: Floats) -> Floats:
        jm, j0, jp = self.jerk
        y = j0 * d
        y[:, 1:] += jm[:, 1:] * d[:-1]
        y[:, :-1] += jp[:, :-1] * d[1:]
        return y

    def _back_a(self, w: Floats) -> Floats:
        """Aᵀw summed over axes."""
        r: Floats = (w * self.p.hi).sum(axis=0)[:-1] + (w * self.p.lo).sum(axis=0)[1:]
        return r

    def _back_v(self, w: Floats) -> Floats:
        return (w * self.p.value_hi)[:-1] + (w * self.p.value_lo)[1:]

    def _back_j(self, w: Floats) -> Floats:
        jm, j0, jp = self.jerk
        r: Floats = (w * j0).sum(axis=0)
        r[1:] += (w * jp).sum(axis=0)[:-1]
        r[:-1] += (w * jm).sum(axis=0)[1:]
        return r

    def _duration(self) -> float:
        return float((self.p.weight / np.sqrt(self.c)).sum())

    def _fresh(self) -> State:
        p = self.p
        mu = _FIRST_BARRIER * self._duration() / len(self.c)
        sa = np.maximum(np.stack((p.above - self.ya, p.below + self.ya)), _FIRST_SLACK)
        sj = np.maximum(np.stack((self.room - self.yj, self.room + self.yj)), _FIRST_SLACK)
        sv = np.maximum(1.0 - self.yv, _FIRST_SLACK)
        sx = np.maximum(1.0 - self.c * p.inverse_max, _FIRST_SLACK)
        return State(self.scale, sa, mu / sa, sj, mu / sj, sv, mu / sv, sx, mu / sx)

    def _lift(self) -> None:
        """Resume: slacks and multipliers slightly off the boundary, as the rows have moved."""
        mu = _RESUMED_BARRIER * self._duration() / len(self.c)
        s = self.state
        for slack, dual in ((s.sa, s.za), (s.sj, s.zj), (s.sv, s.zv), (s.sx, s.zx)):
            np.maximum(slack, _RESUMED_SLACK, out=slack)
            np.maximum(dual, mu / np.maximum(slack, _RESUMED_SHARE), out=dual)

    def converged(self, tolerance: float) -> bool:
        """Residuals, gap and violation at c; true if both are small."""
        p, s = self.p, self.state
        self.ra = np.stack((p.above - self.ya, p.below + self.ya)) - s.sa
        self.rj = np.stack((self.room - self.yj, self.room + self.yj)) - s.sj
        self.rv = 1.0 - self.yv - s.sv
        self.rx = 1.0 - self.c * p.inverse_max - s.sx
        pairs = ((s.za, s.sa), (s.zj, s.sj), (s.zv, s.sv), (s.zx, s.sx))
        self.gap = sum(float(np.vdot(z, x)) for z, x in pairs)
        self.count = sum(x.size for _, x in pairs)
        self.violation = -min(float(r.min(initial=0.0)) for r in (self.ra, self.rj, self.rv, self.rx))
        return self.gap < tolerance * self._duration() and self.violation < FEASIBLE

    def step(self) -> bool:
        """One predictor–corrector step; False if the factorisation fails (c stays as it is)."""
        s = self.state
        self.bend = -0.5 * self.room / self.c  # slope of the jerk's right side
        self.wa, self.wj, self.wv, self.wx = s.za / s.sa, s.zj / s.sj, s.zv / s.sv, s.zx / s.sx
        factor, info = dpbtrf(self._hessian(), lower=1, overwrite_ab=1)
        if info:
            return False
        self.factor = factor
        affine = (-self.wa * self.ra, -self.wj * self.rj, -self.wv * self.rv, -self.wx * self.rx)
        _, ds, dz = self._direction(affine, None)
        primal, dual = self._longest(ds, dz, self._slacks(), self._duals(), None)
        mu = self._centring(ds, dz, min(1.0, primal), min(1.0, dual))
        product = min(1.0, primal) * min(1.0, dual)
        centre = tuple((mu - product * a * b) / x for a, b, x in zip(ds, dz, self._slacks(), strict=True))
        together = tuple(a + b for a, b in zip(centre, affine, strict=True))
        dc, ds, dz = self._direction(together, centre)
        primal, dual = self._longest(ds, dz, self._slacks(), self._duals(), dc)
        self._move(min(1.0, _TO_BOUNDARY * primal), min(1.0, _TO_BOUNDARY * dual), dc, ds, dz)
        return True

    def _slacks(self) -> tuple[Floats, ...]:
        s = self.state
        return s.sa, s.sj, s.sv, s.sx

    def _duals(self) -> tuple[Floats, ...]:
        s = self.state
        return s.za, s.zj, s.zv, s.zx

    def _hessian(self) -> Floats:
        """Lower band (3, n) of ∇²f + Aᵀ(z/s)A over all rows; the given coefficients are cut out."""
        p, c, n = self.p, self.c, len(self.c)
        h = np.zeros((3, n), order="F")
        wa = self.wa[0] + self.wa[1]
        h[0] = 0.75 * p.weight * c**-2.5 + self.wx * p.inverse_max**2
        h[0] += self._back_square(wa, p.hi, p.lo) + self._back_square(self.wv, p.value_hi, p.value_lo)
        h[1, :-1] = (wa * p.hi * p.lo).sum(axis=0)[1:-1] + (self.wv * p.value_hi * p.value_lo)[1:-1]
        self._add_jerk(h)
        k = p.fixed
        h[0, :k], h[1, :k], h[2, :k] = 1.0, 0.0, 0.0
        return h

    @staticmethod
    def _back_square(w: Floats, hi: Floats, lo: Floats) -> Floats:
        high, low = w * hi * hi, w * lo * lo
        if high.ndim == 2:
            high, low = high.sum(axis=0), low.sum(axis=0)
        result: Floats = high[:-1] + low[1:]
        return result

    def _add_jerk(self, h: Floats) -> None:
        """Rows g − J (upper) and g + J (lower) with g the bend on the diagonal."""
        jm, j0, jp = self.jerk
        both, skew = self.wj[0] + self.wj[1], self.wj[0] - self.wj[1]
        g = self.bend
        tilt = both * j0 - skew * g
        h[0] += (tilt * j0).sum(axis=0) - g * (skew * j0).sum(axis=0) + g * g * both.sum(axis=0)
        h[0, 1:] += (both * jp * jp).sum(axis=0)[:-1]
        h[0, :-1] += (both * jm * jm).sum(axis=0)[1:]
        h[1, :-1] += (tilt * jp).sum(axis=0)[:-1]
        h[1, :-1] += (tilt * jm).sum(axis=0)[1:]
        h[2, :-2] = (both * jp * jm).sum(axis=0)[1:-1]

    def _direction(
        self, force: tuple[Floats, ...], centre: tuple[Floats, ...] | None
    ) -> tuple[Floats, tuple[Floats, ...], tuple[Floats, ...]]:
        """Newton direction of c, slacks and multipliers for right sides `force` (+ `centre` of the duals)."""
        p = self.p
        fa, fj, fv, fx = force
        r = -0.5 * p.weight * self.c**-1.5 + fx * p.inverse_max
        r += self._back_a(fa[0] - fa[1]) + self._back_v(fv)
        r += self._back_j(fj[0] - fj[1]) - self.bend * fj.sum(axis=(0, 1))
        r[: p.fixed] = 0.0
        dc, _ = dpbtrs(self.factor, -r, lower=1)
        da, dj, curve = self._apply_a(dc), self._apply_j(dc), self.bend * dc
        dsa = np.stack((self.ra[0] - da, self.ra[1] + da))
        dsj = np.stack((self.rj[0] + curve - dj, self.rj[1] + curve + dj))
        ds = (dsa, dsj, self.rv - self._apply_v(dc), self.rx - dc * p.inverse_max)
        weights = (self.wa, self.wj, self.wv, self.wx)
        duals = self._duals()
        dz = tuple(-z - w * d for z, w, d in zip(duals, weights, ds, strict=True))
        if centre is not None:
            dz = tuple(e + d for e, d in zip(centre, dz, strict=True))
        return dc, ds, dz

    def _longest(
        self,
        ds: tuple[Floats, ...],
        dz: tuple[Floats, ...],
        slacks: tuple[Floats, ...],
        duals: tuple[Floats, ...],
        dc: Floats | None,
    ) -> tuple[float, float]:
        """Longest steps that keep slacks (and c) and multipliers positive."""
        primal = max(_shrink(s, d) for s, d in zip(slacks, ds, strict=True))
        dual = max(_shrink(z, d) for z, d in zip(duals, dz, strict=True))
        if dc is not None:
            primal = max(primal, _shrink(self.c, dc))
        return 1.0 / max(primal, 1e-9), 1.0 / max(dual, 1e-9)

    def _centring(self, ds: tuple[Floats, ...], dz: tuple[Floats, ...], primal: float, dual: float) -> float:
        """Mehrotra's barrier: the mean gap times the square of what the predictor would leave of it."""
        after = self.gap
        for s, z, a, b in zip(self._slacks(), self._duals(), ds, dz, strict=True):
            after += primal * float(np.vdot(a, z)) + dual * float(np.vdot(s, b))
            after += primal * dual * float(np.vdot(a, b))
        share = min(1.0, max(after / self.gap, _LEAST_CENTRING)) ** 2
        return share * self.gap / self.count

    def _move(
        self, primal: float, dual: float, dc: Floats, ds: tuple[Floats, ...], dz: tuple[Floats, ...]
    ) -> None:
        self.c = self.c + primal * dc
        for slack, z, a, b in zip(self._slacks(), self._duals(), ds, dz, strict=True):
            slack += primal * a
            z += dual * b
        self._evaluate()
        real = np.stack((self.room - self.yj, self.room + self.yj))
        sj = self.state.sj
        np.maximum(sj, np.minimum(real, _SLACK_GROWTH * sj), out=sj)
        self.state.iterations += 1


def _shrink(x: Floats, dx: Floats) -> float:
    """Largest −dx/x: the inverse of the longest step that keeps x positive."""
    return -float((dx / x).min(initial=np.inf)) if x.size else 0.0
