# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled core of the time law: the interior point, ticks and their check, as in solver and ticks.

Same equations, same order of steps as the numpy twin; `core` chooses between them. Nothing is decided
here that the twin does not decide the same way.
"""

import numpy as np

from libc.math cimport sqrt

from viapoint.runtime.timing import solver as _twin

ctypedef const double *In
ctypedef double *Out

cdef extern from "_loops.h" nogil:
    void bands2(int, In, In, In, Out)
    void bands3(int, In, In, In, In, Out)
    void measure(int, In, In, In, Out, Out, Out, Out, Out, Out, Out, Out, Out, Out)
    void weigh(int, In, In, In, In, In, In, Out, Out, Out, Out)
    void predict(int, In, In, In, In, In, In, Out, In, In, In, In, Out, Out, Out, Out, Out)
    void centre(int, double, double, In, In, In, In, Out, In, In, In, In, Out, Out, Out)
    void direct(int, In, In, In, Out, In, Out, In, Out, In, Out, Out, Out)
    void advance(int, double, In, Out)
    void follow(int, double, In, In, Out, Out)
    void square2(int, In, In, In, Out, Out, Out)
    void square3(int, In, In, In, In, In, In, Out, Out, Out, Out, Out, Out)
    void back2(int, In, In, In, Out, Out)
    void back3(int, In, In, In, In, In, In, Out, Out, Out)
    int factor(int, Out, Out, Out)
    void differences(int, double, double, double, double, In, Out, Out, Out)
    void substitute(int, In, In, In, Out)
    double lowest(int, In, double)
    double highest(int, In, double)
    double sum(int, In)

cdef double FEASIBLE = _twin.FEASIBLE
cdef double HOPELESS = _twin.HOPELESS
cdef double LEAST_CENTRING = _twin.LEAST_CENTRING
cdef double TO_BOUNDARY = _twin.TO_BOUNDARY
cdef double LEAST_SHRINK = _twin.LEAST_SHRINK
cdef double SLACK_GROWTH = _twin.SLACK_GROWTH


cdef inline double _step(double shrink, double share) noexcept nogil:
    return min(1.0, share / max(shrink, LEAST_SHRINK))


cdef class _Work:
    """One solve: pointers into the problem and the state, and scratch space."""

    cdef int n, ma, mj, fixed
    cdef double gap, violation, count, low, high, first, second, dual
    cdef double[::1] c, padded, weight, inverse_max, scale
    cdef double[:, ::1] lo, hi, above, below, jm, j0, jp
    cdef double[:, ::1] jerks  # the jerk rows' values (mj, n) at the iterate
    cdef double[:, :, ::1] sa, za, ra, ia, da, sj, zj, rj, ij, dj
    cdef double[::1] sx, zx, rx, ix, dx
    cdef double[::1] room, bend, zero, y, both, skew, force, total, dc
    cdef double[:, ::1] sums, parts, hessian

    def __init__(self, p, c, state):
        self.c = np.array(c)
        cdef int n = len(self.c)
        self.n, self.ma, self.mj, self.fixed = n, p.lo.shape[0], p.jm.shape[0], p.fixed
        self.weight, self.inverse_max, self.scale = p.weight, p.inverse_max, state.scale
        self.lo, self.hi, self.above, self.below = p.lo, p.hi, p.above, p.below
        self.jm, self.j0, self.jp = p.jm * state.scale, p.j0 * state.scale, p.jp * state.scale
        self.sa, self.za, self.sj, self.zj = state.sa, state.za, state.sj, state.zj
        self.sx, self.zx = state.sx, state.zx
        self.ra, self.ia, self.da = np.empty((3, 2, self.ma, n + 1))
        self.rj, self.ij, self.dj = np.empty((3, 2, self.mj, n))
        self.rx, self.ix, self.dx, self.room, self.bend, self.dc = np.empty((6, n))
        self.zero, self.y, self.both, self.skew, self.force, self.total = np.zeros((6, n + 1))
        self.padded = np.zeros(n + 2)
        self.sums, self.parts, self.hessian = np.empty((2, n + 1)), np.empty((9, n + 1)), np.empty((3, n))
        self.jerks = np.empty((self.mj, n))
        self.find_jerks()
        self.count = 2.0 * self.ma * (n + 1) + 2.0 * self.mj * n + n

    cdef void clear(self, double[:, ::1] x) noexcept nogil:
        cdef int i, k
        for k in range(x.shape[0]):
            for i in range(x.shape[1]):
                x[k, i] = 0.0

    cdef void pad(self, double[::1] c) noexcept nogil:
        cdef int i
        for i in range(self.n):
            self.padded[i + 1] = c[i]

    cdef void row2(self, int k) noexcept nogil:
        bands2(self.n + 1, &self.lo[k, 0], &self.hi[k, 0], &self.padded[0], &self.y[0])

    cdef void row3(self, int k) noexcept nogil:
        bands3(self.n, &self.jm[k, 0], &self.j0[k, 0], &self.jp[k, 0], &self.padded[0], &self.y[0])

    cdef void find_jerks(self) noexcept nogil:
        cdef int k
        self.pad(self.c)
        for k in range(self.mj):
            bands3(self.n, &self.jm[k, 0], &self.j0[k, 0], &self.jp[k, 0], &self.padded[0], &self.jerks[k, 0])

    cdef void bound_room(self) noexcept nogil:
        """Right side of jerk, scale/√c, and its slope."""
        cdef int i
        cdef double root
        for i in range(self.n):
            root = sqrt(self.c[i])
            self.room[i] = self.scale[i] / root
            self.bend[i] = -0.5 * self.scale[i] / (self.c[i] * root)

    cdef void measure(self) noexcept nogil:
        """Residuals, inverse slacks, gap and violation at the iterate."""
        cdef int i, k, n = self.n
        cdef double *gap = &self.sums[0, 0]
        cdef double *worst = &self.sums[1, 0]
        self.clear(self.sums)
        self.bound_room()
        self.pad(self.c)
        for k in range(self.ma):
            self.row2(k)
            measure(n + 1, &self.above[k, 0], &self.below[k, 0], &self.y[0], &self.sa[0, k, 0], &self.za[0, k, 0],
                    &self.ra[0, k, 0], &self.ia[0, k, 0], &self.sa[1, k, 0], &self.za[1, k, 0],
                    &self.ra[1, k, 0], &self.ia[1, k, 0], gap, worst)
        for k in range(self.mj):
            measure(n, &self.room[0], &self.room[0], &self.jerks[k, 0], &self.sj[0, k, 0], &self.zj[0, k, 0],
                    &self.rj[0, k, 0], &self.ij[0, k, 0], &self.sj[1, k, 0], &self.zj[1, k, 0],
                    &self.rj[1, k, 0], &self.ij[1, k, 0], gap, worst)
        for i in range(n):
            self.rx[i] = 1.0 - self.c[i] * self.inverse_max[i] - self.sx[i]
            self.ix[i] = 1.0 / self.sx[i]
            gap[i] += self.sx[i] * self.zx[i]
            worst[i] = min(worst[i], self.rx[i])
        self.gap = sum(n + 1, gap)
        self.violation = -lowest(n + 1, worst, 0.0)

    cdef bint done(self, double tolerance) noexcept nogil:
        cdef int i
        cdef double duration = 0.0
        for i in range(self.n):
            duration += self.weight[i] / sqrt(self.c[i])
        return (self.gap < tolerance * duration and self.violation < FEASIBLE) or self.gap > HOPELESS * duration

    cdef void build(self) noexcept nogil:
        """The Hessian, and the predictor's right side (into dc)."""
        cdef int k, n = self.n
        cdef double *p0 = &self.parts[0, 0]
        cdef double *p1 = &self.parts[1, 0]
        cdef double *p2 = &self.parts[2, 0]
        cdef double *p3 = &self.parts[3, 0]
        cdef double *p4 = &self.parts[4, 0]
        cdef double *p5 = &self.parts[5, 0]
        self.clear(self.parts)
        for k in range(self.ma):
            weigh(n + 1, &self.za[0, k, 0], &self.ra[0, k, 0], &self.ia[0, k, 0], &self.za[1, k, 0],
                  &self.ra[1, k, 0], &self.ia[1, k, 0], &self.both[0], &self.skew[0], &self.force[0], &self.total[0])
            square2(n + 1, &self.lo[k, 0], &self.hi[k, 0], &self.both[0], p0, p1, p2)
            back2(n + 1, &self.lo[k, 0], &self.hi[k, 0], &self.force[0], &self.parts[6, 0], &self.parts[7, 0])
        self.hessian_knots(p0, p1, p2)
        self.forces_knots(&self.parts[6, 0], &self.parts[7, 0])
        self.clear(self.parts)
        for k in range(self.mj):
            weigh(n, &self.zj[0, k, 0], &self.rj[0, k, 0], &self.ij[0, k, 0], &self.zj[1, k, 0],
                  &self.rj[1, k, 0], &self.ij[1, k, 0], &self.both[0], &self.skew[0], &self.force[0], &self.total[0])
            square3(n, &self.jm[k, 0], &self.j0[k, 0], &self.jp[k, 0], &self.bend[0], &self.both[0], &self.skew[0],
                    p0, p1, p2, p3, p4, p5)
            back3(n, &self.jm[k, 0], &self.j0[k, 0], &self.jp[k, 0], &self.bend[0], &self.force[0], &self.total[0],
                  &self.parts[6, 0], &self.parts[7, 0], &self.parts[8, 0])
        self.hessian_pieces()
        self.forces_pieces(&self.parts[6, 0], &self.parts[7, 0], &self.parts[8, 0])
        self.bound_force(0.0, 0.0, False)

    cdef void hessian_knots(self, double *before, double *behind, double *mixed) noexcept nogil:
        cdef int i, n = self.n
        cdef double c, w
        for i in range(n):
            c = self.c[i]
            w = self.zx[i] * self.ix[i]
            self.hessian[0, i] = 0.75 * self.weight[i] / (c * c * sqrt(c)) + w * (self.inverse_max[i] * self.inverse_max[i])
            self.hessian[0, i] += behind[i] + before[i + 1]
            self.hessian[1, i] = mixed[i + 1] if i + 1 < n else 0.0
            self.hessian[2, i] = 0.0

    cdef void hessian_pieces(self) noexcept nogil:
        """Own, before, behind, with_before, with_behind, across: parts 0 to 5."""
        cdef int i, n = self.n
        for i in range(n):
            self.hessian[0, i] += self.parts[0, i]
            if i >= 1:
                self.hessian[0, i] += self.parts[2, i - 1]
            if i + 1 < n:
                self.hessian[0, i] += self.parts[1, i + 1]
                self.hessian[1, i] += self.parts[4, i] + self.parts[3, i + 1]
            if i + 2 < n:
                self.hessian[2, i] = self.parts[5, i + 1]
        for i in range(self.fixed):
            self.hessian[0, i], self.hessian[1, i], self.hessian[2, i] = 1.0, 0.0, 0.0

    cdef void forces_knots(self, double *before, double *behind) noexcept nogil:
        """Start of a right side: the objective's gradient and the rows at knots."""
        cdef int i
        for i in range(self.n):
            self.dc[i] = -0.5 * self.weight[i] / (self.c[i] * sqrt(self.c[i]))
            self.dc[i] += behind[i] + before[i + 1]

    cdef void forces_pieces(self, double *own, double *before, double *behind) noexcept nogil:
        cdef int i, n = self.n
        for i in range(n):
            self.dc[i] += own[i]
            if i >= 1:
                self.dc[i] += behind[i - 1]
            if i + 1 < n:
                self.dc[i] += before[i + 1]

    cdef void bound_force(self, double mu, double product, bint centred) noexcept nogil:
        """The rows c ≤ c_max; then the sign, and the given coefficients cut out."""
        cdef int i
        cdef double force
        for i in range(self.n):
            force = -(self.zx[i] * self.ix[i]) * self.rx[i]
            if centred:
                self.dx[i] = (mu + product * (self.sx[i] * self.zx[i]) * self.dx[i] * (1.0 + self.dx[i])) * self.ix[i]
                force = self.dx[i] + force
            self.dc[i] = -(self.dc[i] + force * self.inverse_max[i])
        for i in range(self.fixed):
            self.dc[i] = 0.0

    cdef void predict(self) noexcept nogil:
        """ds/s of the predictor, its extremes, and what it does to the products."""
        cdef int i, k, n = self.n
        cdef double *low = &self.parts[0, 0]
        cdef double *high = &self.parts[1, 0]
        cdef double *first = &self.parts[2, 0]
        cdef double *second = &self.parts[3, 0]
        self.clear(self.parts)
        for i in range(n + 1):
            high[i] = -1.0
        self.pad(self.dc)
        for k in range(self.ma):
            self.row2(k)
            predict(n + 1, &self.zero[0], &self.y[0], &self.sa[0, k, 0], &self.za[0, k, 0], &self.ra[0, k, 0],
                    &self.ia[0, k, 0], &self.da[0, k, 0], &self.sa[1, k, 0], &self.za[1, k, 0], &self.ra[1, k, 0],
                    &self.ia[1, k, 0], &self.da[1, k, 0], low, high, first, second)
        self.curve()
        for k in range(self.mj):
            self.row3(k)
            predict(n, &self.both[0], &self.y[0], &self.sj[0, k, 0], &self.zj[0, k, 0], &self.rj[0, k, 0],
                    &self.ij[0, k, 0], &self.dj[0, k, 0], &self.sj[1, k, 0], &self.zj[1, k, 0], &self.rj[1, k, 0],
                    &self.ij[1, k, 0], &self.dj[1, k, 0], low, high, first, second)
        for i in range(n):
            self.dx[i] = (self.rx[i] - self.dc[i] * self.inverse_max[i]) * self.ix[i]
            low[i], high[i] = min(low[i], self.dx[i]), max(high[i], self.dx[i])
            first[i] += self.sx[i] * self.zx[i] * self.dx[i]
            second[i] += self.sx[i] * self.zx[i] * self.dx[i] * self.dx[i]
        self.low, self.high = lowest(n + 1, low, 0.0), highest(n + 1, high, -1.0)
        self.first, self.second = sum(n + 1, first), sum(n + 1, second)

    cdef void curve(self) noexcept nogil:
        """Change of jerk's right side with dc, into `both`."""
        cdef int i
        for i in range(self.n):
            self.both[i] = self.bend[i] * self.dc[i]

    cdef void correct(self) noexcept nogil:
        """Mehrotra's barrier and the corrector's right side."""
        cdef int k, n = self.n
        cdef double primal = _step(-self.low, 1.0), dual = _step(1.0 + self.high, 1.0)
        cdef double after = (self.gap + primal * self.first - dual * (self.gap + self.first)
                             - primal * dual * (self.first + self.second))
        cdef double share = min(1.0, max(after / self.gap, LEAST_CENTRING))
        cdef double mu = share * share * self.gap / self.count, product = primal * dual
        self.clear(self.parts)
        for k in range(self.ma):
            centre(n + 1, mu, product, &self.sa[0, k, 0], &self.za[0, k, 0], &self.ra[0, k, 0], &self.ia[0, k, 0],
                   &self.da[0, k, 0], &self.sa[1, k, 0], &self.za[1, k, 0], &self.ra[1, k, 0], &self.ia[1, k, 0],
                   &self.da[1, k, 0], &self.force[0], &self.total[0])
            back2(n + 1, &self.lo[k, 0], &self.hi[k, 0], &self.force[0], &self.parts[0, 0], &self.parts[1, 0])
        self.forces_knots(&self.parts[0, 0], &self.parts[1, 0])
        for k in range(self.mj):
            centre(n, mu, product, &self.sj[0, k, 0], &self.zj[0, k, 0], &self.rj[0, k, 0], &self.ij[0, k, 0],
                   &self.dj[0, k, 0], &self.sj[1, k, 0], &self.zj[1, k, 0], &self.rj[1, k, 0], &self.ij[1, k, 0],
                   &self.dj[1, k, 0], &self.force[0], &self.total[0])
            back3(n, &self.jm[k, 0], &self.j0[k, 0], &self.jp[k, 0], &self.bend[0], &self.force[0], &self.total[0],
                  &self.parts[2, 0], &self.parts[3, 0], &self.parts[4, 0])
        self.forces_pieces(&self.parts[2, 0], &self.parts[3, 0], &self.parts[4, 0])
        self.bound_force(mu, product, True)

    cdef void direct(self) noexcept nogil:
        """The corrector's steps of slacks and multipliers, and their extremes."""
        cdef int i, k, n = self.n
        cdef double *low = &self.parts[0, 0]
        cdef double *dual = &self.parts[1, 0]
        cdef double step
        self.clear(self.parts)
        self.pad(self.dc)
        for k in range(self.ma):
            self.row2(k)
            direct(n + 1, &self.zero[0], &self.y[0], &self.za[0, k, 0], &self.ra[0, k, 0], &self.ia[0, k, 0],
                   &self.da[0, k, 0], &self.za[1, k, 0], &self.ra[1, k, 0], &self.ia[1, k, 0], &self.da[1, k, 0],
                   low, dual)
        self.curve()
        for k in range(self.mj):
            self.row3(k)
            direct(n, &self.both[0], &self.y[0], &self.zj[0, k, 0], &self.rj[0, k, 0], &self.ij[0, k, 0],
                   &self.dj[0, k, 0], &self.zj[1, k, 0], &self.rj[1, k, 0], &self.ij[1, k, 0], &self.dj[1, k, 0],
                   low, dual)
        for i in range(n):
            step = self.rx[i] - self.dc[i] * self.inverse_max[i]
            self.dx[i] = self.dx[i] - self.zx[i] - self.zx[i] * self.ix[i] * step
            self.rx[i] = step
            low[i] = min(low[i], min(step * self.ix[i], self.dc[i] / self.c[i]))
            dual[i] = min(dual[i], self.dx[i] / self.zx[i])
        self.low, self.dual = lowest(n + 1, low, 0.0), lowest(n + 1, dual, 0.0)

    cdef void move(self) noexcept nogil:
        """The longest step inside all bounds; the jerk slacks follow their curved bound."""
        cdef int k, n = self.n
        cdef int na = 2 * self.ma * (n + 1), nj = 2 * self.mj * n
        cdef double primal = _step(-self.low, TO_BOUNDARY), dual = _step(-self.dual, TO_BOUNDARY)
        advance(n, primal, &self.dc[0], &self.c[0])
        advance(na, primal, &self.ra[0, 0, 0], &self.sa[0, 0, 0])
        advance(na, dual, &self.da[0, 0, 0], &self.za[0, 0, 0])
        advance(nj, primal, &self.rj[0, 0, 0], &self.sj[0, 0, 0])
        advance(nj, dual, &self.dj[0, 0, 0], &self.zj[0, 0, 0])
        advance(n, primal, &self.rx[0], &self.sx[0])
        advance(n, dual, &self.dx[0], &self.zx[0])
        self.bound_room()
        self.find_jerks()
        for k in range(self.mj):
            follow(n, SLACK_GROWTH, &self.room[0], &self.jerks[k, 0], &self.sj[0, k, 0], &self.sj[1, k, 0])

    cdef int run(self, double tolerance, int most) noexcept nogil:
        """Iterations done until converged, out of luck, or `most`."""
        cdef int k, n = self.n
        for k in range(most):
            self.measure()
            if self.done(tolerance):
                return k
            self.build()
            if not factor(n, &self.hessian[0, 0], &self.hessian[1, 0], &self.hessian[2, 0]):
                return k
            substitute(n, &self.hessian[0, 0], &self.hessian[1, 0], &self.hessian[2, 0], &self.dc[0])
            self.predict()
            self.correct()
            substitute(n, &self.hessian[0, 0], &self.hessian[1, 0], &self.hessian[2, 0], &self.dc[0])
            self.direct()
            self.move()
        return most


def improve(p, c, state, double tolerance, int most):
    """As `solver.improve`."""
    cdef _Work work = _Work(p, c, state)
    state.iterations += work.run(tolerance, most)
    state.gap, state.violation = work.gap, work.violation
    return np.asarray(work.c)


def ratios(double[:, :] q, limits, double tick):
    """As `ticks.ratios`: largest ratios over the axes (speed, acceleration, jerk), as arrays."""
    cdef int n = q.shape[0], m = q.shape[1], i, j
    cdef double[::1] speed = np.zeros(max(n - 1, 0)), accel = np.zeros(max(n - 2, 0)), jerk = np.zeros(max(n - 3, 0))
    cdef double[::1] by_v = 1.0 / (limits.speed * tick), by_j = 1.0 / (limits.jerk * (tick * tick * tick))
    cdef double[::1] by_a = 1.0 / (limits.acceleration * (tick * tick)), by_d = 1.0 / (limits.braking * (tick * tick))
    cdef double[::1] axis = np.empty(n + 1)
    cdef double none = 0.0
    for j in range(m):
        for i in range(n):
            axis[i] = q[i, j]
        differences(n, by_v[j], by_a[j], by_d[j], by_j[j], &axis[0], &speed[0] if n > 1 else &none,
                    &accel[0] if n > 2 else &none, &jerk[0] if n > 3 else &none)
    return np.asarray(speed), np.asarray(accel), np.asarray(jerk)


def positions(double[::1] t, double[::1] width, double[:, ::1] coeffs, double s_end, long first, long last, double tick):
    """Parameters s at the ticks first ... last of a law, t = k·tick since its start."""
    cdef long n = last - first + 1, i, k = 0, pieces = width.shape[0]
    cdef double[::1] s = np.empty(max(n, 0))
    cdef double tau, u, start = t[0], end = t[t.shape[0] - 1]
    for i in range(n):
        tau = (first + i) * tick
        if tau >= end:
            s[i] = s_end
            continue
        tau = max(tau, start)
        while k + 1 < pieces and t[k + 1] <= tau:
            k += 1
        u = (tau - t[k]) / width[k]
        s[i] = coeffs[k, 0] + u * (coeffs[k, 1] + u * (coeffs[k, 2] + u * (coeffs[k, 3]
               + u * (coeffs[k, 4] + u * coeffs[k, 5]))))
    return np.asarray(s)
