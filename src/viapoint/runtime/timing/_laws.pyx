# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled numerics between solves: from limits to bounds, from coefficients to a law, from ticks to rows.

As their numpy twins in `rooms`, `rows`, `selection`, `solver`, `spline`, `law` and `tighten`: the same
operations in the same order, so that both give the same bits.
"""

import numpy as np

from libc.math cimport INFINITY, fabs, fmax, isfinite, isnan, sqrt
from libc.string cimport memcpy

from viapoint.runtime.timing import rows as _rows
from viapoint.runtime.timing import solver as _solver
from viapoint.runtime.timing import spline as _spline
from viapoint.runtime.timing.rows import Problem

cdef double SPEED_PART = _rows.SPEED_PART
cdef double FIRST_SLACK = _solver.FIRST_SLACK, FIRST_BARRIER = _solver.FIRST_BARRIER
cdef double RESUMED_SLACK = _solver.RESUMED_SLACK, RESUMED_BARRIER = _solver.RESUMED_BARRIER
cdef double RESUMED_SHARE = _solver.RESUMED_SHARE
cdef double TINY = _spline.TINY
cdef double[:, ::1] GAUSS = np.array(_spline.GAUSS)


def ceilings(double[:, :] first, double[:, :] second, double[:, :] third, double[::1] programmed,
             double[::1] speed, double[::1] acceleration, double[::1] jerk):
    """As `rooms.ceilings`."""
    cdef int n = first.shape[0], m = first.shape[1], i, k, bad = -1
    cdef double[::1] ceiling = np.empty(n), room = np.empty(n)
    cdef double fast, bent, least, x
    cdef bint good
    for i in range(n):
        fast = bent = least = INFINITY
        good = programmed[i] > 0.0
        for k in range(m):
            good = good and isfinite(first[i, k] + second[i, k] + third[i, k])
            x = speed[k] / fabs(first[i, k])
            fast = x if x < fast else fast
            x = acceleration[k] / fabs(second[i, k])
            bent = x if x < bent else bent
            x = jerk[k] / fabs(third[i, k])
            least = x if x < least else least
        if not good and bad < 0:
            bad = i
        bent = sqrt(bent)
        fast = programmed[i] if programmed[i] < fast else fast
        ceiling[i], room[i] = bent if bent < fast else fast, least
    return np.asarray(ceiling), np.asarray(room), bad


def sides(double[:, :] first, double[::1] speeding, double[::1] braking):
    """As `rows.sides`."""
    cdef int n = first.shape[0], m = first.shape[1], i, k
    cdef double[:, ::1] above = np.empty((m + 1, n)), below = np.empty((m + 1, n))
    cdef bint forward
    for k in range(m):
        for i in range(n):
            forward = first[i, k] >= 0.0
            above[k, i] = speeding[k] if forward else braking[k]
            below[k, i] = braking[k] if forward else speeding[k]
    for i in range(n):
        above[m, i] = below[m, i] = 1.0
    return np.asarray(above), np.asarray(below)


def bounds(double[:, ::1] ends, double[:, ::1] middle, double[:, ::1] programmed):
    """As `rows.bounds`."""
    cdef int n = middle.shape[1], m = middle.shape[0], i, k, j
    cdef double[::1] rates = np.zeros(n + 1), inverse = np.empty(n), knots = np.empty(n + 1)
    cdef double[:, ::1] three = np.empty((3, n))
    cdef double rate, c, least, most, part = SPEED_PART * SPEED_PART
    for k in range(m):
        for i in range(n + 1):
            rates[i] = ends[k, i] if ends[k, i] > rates[i] else rates[i]
    for i in range(n):
        rate = 0.0
        for k in range(m):
            rate = middle[k, i] if middle[k, i] > rate else rate
        for j in range(3):
            c = 1.0 / (rates[i] if j == 0 else rate if j == 1 else rates[i + 1])
            c = programmed[j, i] if programmed[j, i] < c else c
            three[j, i] = c * c
        least, most = min(min(three[0, i], three[1, i]), three[2, i]), max(max(three[0, i], three[1, i]), three[2, i])
        c = 2.0 * three[1, i] - 0.5 * (three[0, i] + three[2, i])
        c = least if isnan(c) else fmax(c if c < most else most, least)
        inverse[i] = 1.0 / (c * part)
    for i in range(n + 1):
        least = three[0, i] if i < n else three[2, n - 1]
        most = three[2, i - 1] if i > 0 else three[0, 0]
        knots[i] = (least if least < most else most) * part
    return np.asarray(inverse), np.asarray(knots)


cdef _chosen(tuple bands, const unsigned char[::1] which, int halves, bint last):
    """Of bands (m, n) each, the rows of axes that are `which`, in each of so many halves, and the last row."""
    cdef int m = which.shape[0], k, half, i, n, rows = last, at
    cdef const double[:, ::1] band
    for k in range(m):
        rows += halves * (which[k] != 0)
    n = bands[0].shape[1]
    result = np.empty((len(bands), rows, n))
    cdef double[:, :, ::1] found = result
    for i in range(len(bands)):
        band, at = bands[i], 0
        for half in range(halves):
            for k in range(m):
                if which[k]:
                    memcpy(&found[i, at, 0], &band[half * m + k, 0], n * sizeof(double))
                    at += 1
        if last:
            memcpy(&found[i, at, 0], &band[m, 0], n * sizeof(double))
    return result


def cut(p, to):
    """As `selection.cut`."""
    acceleration, jerk = to.acceleration, to.jerk
    if acceleration.all() and jerk.all():
        return p
    lo, hi, above, below = _chosen((p.lo, p.hi, p.above, p.below), acceleration.view(np.uint8), 1, True)
    jm, j0, jp = _chosen((p.jm, p.j0, p.jp), jerk.view(np.uint8), 2, False)
    return Problem(p.weight, p.fixed, lo, hi, above, below, jm, j0, jp, p.inverse_max)


cdef double _duration(double[::1] weight, double[::1] c):
    cdef int i
    cdef double total = weight[0] / sqrt(c[0])
    for i in range(1, c.shape[0]):
        total += weight[i] / sqrt(c[i])
    return total


def fresh(p, double[::1] c):
    """As `solver.fresh`."""
    cdef double[:, ::1] lo = p.lo, hi = p.hi, above = p.above, below = p.below
    cdef double[:, ::1] jm = p.jm, j0 = p.j0, jp = p.jp
    cdef double[::1] inverse_max = p.inverse_max
    cdef int ma = lo.shape[0], mj = jm.shape[0], n = c.shape[0], i, k
    cdef double[::1] padded = np.zeros(n + 2), scale = np.empty(n), sx = np.empty(n), zx = np.empty(n)
    cdef double[:, :, ::1] sa = np.empty((2, ma, n + 1)), za = np.empty((2, ma, n + 1))
    cdef double[:, :, ::1] sj = np.empty((2, mj, n)), zj = np.empty((2, mj, n))
    cdef double y, mu = FIRST_BARRIER * _duration(p.weight, c) / n
    for i in range(n):
        padded[i + 1], scale[i] = c[i], sqrt(c[i])
    for k in range(ma):
        for i in range(n + 1):
            y = lo[k, i] * padded[i] + hi[k, i] * padded[i + 1]
            sa[0, k, i], sa[1, k, i] = max(above[k, i] - y, FIRST_SLACK), max(below[k, i] + y, FIRST_SLACK)
            za[0, k, i], za[1, k, i] = mu / sa[0, k, i], mu / sa[1, k, i]
    for k in range(mj):
        for i in range(n):
            y = (jm[k, i] * scale[i] * padded[i] + j0[k, i] * scale[i] * padded[i + 1]
                 + jp[k, i] * scale[i] * padded[i + 2])
            sj[0, k, i], sj[1, k, i] = max(1.0 - y, FIRST_SLACK), max(1.0 + y, FIRST_SLACK)
            zj[0, k, i], zj[1, k, i] = mu / sj[0, k, i], mu / sj[1, k, i]
    for i in range(n):
        sx[i] = max(1.0 - c[i] * inverse_max[i], FIRST_SLACK)
        zx[i] = mu / sx[i]
    return _solver.State(
        np.asarray(scale), np.asarray(sa), np.asarray(za), np.asarray(sj), np.asarray(zj), np.asarray(sx),
        np.asarray(zx),
    )


cdef void _raise(double[::1] slack, double[::1] dual, double mu):
    cdef int i
    cdef double x
    for i in range(slack.shape[0]):
        slack[i] = max(slack[i], RESUMED_SLACK)
        x = mu / max(slack[i], RESUMED_SHARE)
        dual[i] = max(dual[i], x)


def lift(p, double[::1] c, state):
    """As `solver.lift`."""
    cdef double mu = RESUMED_BARRIER * _duration(p.weight, c) / c.shape[0]
    _raise(state.sa.ravel(), state.za.ravel(), mu)
    _raise(state.sj.ravel(), state.zj.ravel(), mu)
    _raise(state.sx, state.zx, mu)


def trace(spline, double[::1] c, double s_end):
    """As `spline.trace`."""
    cdef double[::1] knots = spline.knots, width = spline.width
    cdef double[::1] value_lo = spline.value_lo, value_hi = spline.value_hi
    cdef double[::1] slope_lo = spline.slope_lo, slope_hi = spline.slope_hi
    cdef int n = c.shape[0], skipped = 1 if spline.fixed else 0, resting = 1 - skipped
    cdef int count = n + 1 - skipped + resting + 1, i, j, k
    cdef double[:, ::1] result = np.zeros((4, count))
    cdef double[::1] x = np.empty(n + 1)
    cdef double before, behind, time = 0.0, total, inner
    for i in range(n + 1):
        before, behind = c[i - 1] if i > 0 else 0.0, c[i] if i < n else 0.0
        x[i] = value_lo[i] * before + value_hi[i] * behind
        x[i] = x[i] if x[i] > 0.0 else 0.0
        j = i - skipped + resting
        if i >= skipped:
            result[1, j], result[2, j] = knots[i], sqrt(x[i])
            result[3, j] = 0.5 * (slope_lo[i] * before + slope_hi[i] * behind)
    if resting:
        result[1, 0] = knots[0] - <double>spline.rest_start
        time = 3.0 * <double>spline.rest_start / sqrt(x[0])
        result[0, 1] = time
    for i in range(skipped, n):
        total = 0.0
        for k in range(GAUSS.shape[1]):
            inner = GAUSS[1, k] * x[i] + GAUSS[2, k] * c[i] + GAUSS[3, k] * x[i + 1]
            total += GAUSS[0, k] / sqrt(inner if inner > TINY else TINY)
        time += total * width[i]
        result[0, i + 1 - skipped + resting] = time
    result[0, count - 1] = time + 3.0 * <double>spline.rest_end / sqrt(x[n])
    result[1, count - 1] = s_end
    return tuple(np.asarray(result))


def hermite(double[::1] t, double[::1] s, double[::1] v, double[::1] a):
    """As `law.hermite`."""
    cdef int n = t.shape[0] - 1, i
    cdef double[::1] width = np.empty(n)
    cdef double[:, ::1] coeffs = np.empty((n, 6))
    cdef double h, rise, v0, v1, a0, a1, square
    for i in range(n):
        h, rise = t[i + 1] - t[i], s[i + 1] - s[i]
        v0, v1, square = v[i] * h, v[i + 1] * h, h * h
        a0, a1 = a[i] * square, a[i + 1] * square
        width[i] = h
        coeffs[i, 0], coeffs[i, 1], coeffs[i, 2] = s[i], v0, 0.5 * a0
        coeffs[i, 3] = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
        coeffs[i, 4] = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
        coeffs[i, 5] = 6.0 * rise - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1
    return np.asarray(width), np.asarray(coeffs)


def touched(double[::1] knots, double[::1] s, double[::1] ratio, double aim, double late):
    """As `tighten.touched`; s ascends."""
    cdef int n = knots.shape[0] - 1, count = ratio.shape[0], span = s.shape[0] - ratio.shape[0], i, first, last = 0, k
    cdef double[::1] factor = np.ones(n)
    cdef double over
    k = 0
    for i in range(count):
        if not ratio[i] > aim:
            continue
        over = ratio[i] / (aim * late)
        while k < n - 1 and knots[k + 1] <= s[i]:
            k += 1
        first = last = k
        while last < n - 1 and knots[last + 1] < s[i + span]:
            last += 1
        for first in range(k, last + 1):
            factor[first] = max(factor[first], over)
    return np.asarray(factor)
