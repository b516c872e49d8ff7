# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled numerics around the solver: rows for a solve, what they use of their limits, programmed speeds.

As their numpy twins in `rows`, `selection`, `programmed` and `rooms`: the same operations in the same
order, so that both give the same bits.
"""

import numpy as np

from libc.math cimport INFINITY, fabs, fmax, pow, sqrt

from viapoint.runtime.timing import programmed as _twin
from viapoint.runtime.timing import rows as _rows
from viapoint.runtime.timing.rows import AxisRows, Problem

cdef double JUMP = _twin.JUMP
cdef double END_SHARE = _rows.END_SHARE


def axis_rows(spline, double[:, :] first, double[:, :] second, third, double[::1] acceleration, double[::1] jerk,
              double[::1] speed):
    """As `rows.axis_rows`."""
    cdef double[:, :] begin = third[0], end = third[1]
    cdef double[::1] h = spline.width, value_lo = spline.value_lo, value_hi = spline.value_hi
    cdef double[::1] slope_lo = spline.slope_lo, slope_hi = spline.slope_hi
    cdef int n = h.shape[0], m = first.shape[1], i, k
    cdef double[:, ::1] lo = np.empty((m, n + 1)), hi = np.empty((m, n + 1)), ends = np.empty((m, n + 1))
    cdef double[:, ::1] middle = np.empty((m, n))
    cdef double[:, :, ::1] left = np.empty((3, m, n)), right = np.empty((3, m, n))
    cdef double q1, q2, q3, mean, before, own, behind
    for k in range(m):
        for i in range(n + 1):
            q1, q2 = 0.5 * (first[i, k] / acceleration[k]), second[i, k] / acceleration[k]
            lo[k, i] = q1 * slope_lo[i] + q2 * value_lo[i]
            hi[k, i] = q1 * slope_hi[i] + q2 * value_hi[i]
            ends[k, i] = fabs(first[i, k]) / speed[k]
        for i in range(n):
            mean = second[i + 1, k] - second[i, k]
            middle[k, i] = fabs(0.5 * (first[i + 1, k] + first[i, k]) - 0.125 * h[i] * mean) / speed[k]
            mean = (1.0 - END_SHARE) * (mean / h[i])
            before, behind = -slope_lo[i] / h[i], slope_hi[i + 1] / h[i]
            own = (slope_lo[i + 1] - slope_hi[i]) / h[i]
            q1, q2 = 0.5 * first[i, k] / jerk[k], 1.5 * second[i, k] / jerk[k]
            q3 = (END_SHARE * begin[i, k] + mean) / jerk[k]
            left[0, k, i] = q1 * before + q2 * slope_lo[i] + q3 * value_lo[i]
            left[1, k, i] = q1 * own + q2 * slope_hi[i] + q3 * value_hi[i]
            left[2, k, i] = q1 * behind
            q1, q2 = 0.5 * first[i + 1, k] / jerk[k], 1.5 * second[i + 1, k] / jerk[k]
            q3 = (END_SHARE * end[i, k] + mean) / jerk[k]
            right[0, k, i] = q1 * before
            right[1, k, i] = q1 * own + q2 * slope_lo[i + 1] + q3 * value_lo[i + 1]
            right[2, k, i] = q1 * behind + q2 * slope_hi[i + 1] + q3 * value_hi[i + 1]
    return AxisRows(
        np.asarray(lo), np.asarray(hi), tuple(np.asarray(left)), tuple(np.asarray(right)), np.asarray(ends),
        np.asarray(middle),
    )


cdef void _jerk_rows(double[:, ::1] rows, double[:, ::1] by, double[::1] ratio, int first) noexcept nogil:
    cdef int i, k
    for k in range(by.shape[0]):
        for i in range(by.shape[1]):
            rows[first + k, i] = by[k, i] * ratio[i]


def tightened(rows, by, double[::1] c):
    """As `rows.tightened`."""
    spline = rows.spline
    cdef double[:, ::1] lo = rows.lo, hi = rows.hi
    cdef double[::1] acceleration = by.acceleration, jerk = by.jerk, speed = by.speed
    cdef double[::1] value_lo = spline.value_lo, value_hi = spline.value_hi, bound = rows.knot_max
    cdef int m = lo.shape[0], n = c.shape[0], i, k, fixed = spline.fixed
    cdef double[:, ::1] low = np.empty((m + 1, n + 1)), high = np.empty((m + 1, n + 1))
    cdef double[::1] left = np.empty(n), right = np.empty(n), inverse = np.empty(n), given = rows.inverse_max
    cdef double x, before, behind, faster
    for k in range(m):
        for i in range(n + 1):
            low[k, i] = lo[k, i] * acceleration[i]
            high[k, i] = hi[k, i] * acceleration[i]
    for i in range(n + 1):
        before, behind = c[i - 1] if i > 0 else 0.0, c[i] if i < n else 0.0
        x = value_lo[i] * before + value_hi[i] * behind
        x = x if x > 0.0 else 0.0
        if i < n:
            left[i] = sqrt(x / c[i]) * jerk[i]
        if i > 0:
            right[i - 1] = sqrt(x / c[i - 1]) * jerk[i - 1]
        before, behind = speed[i - 1] if i > 0 else speed[0], speed[i] if i < n else speed[n - 1]
        before, behind = before * before, behind * behind
        faster = bound[i] / (before if before >= behind else behind)
        low[m, i], high[m, i] = value_lo[i] / faster, value_hi[i] / faster
    for i in range(n):
        inverse[i] = given[i] * (speed[i] * speed[i])
    if fixed == 0:
        inverse[0] *= pow(max(1.0, jerk[0]), 2.0 / 3.0)
    inverse[n - 1] *= pow(max(1.0, jerk[n - 1]), 2.0 / 3.0)
    bands = np.empty((3, 2 * m, n))
    for k in range(3):
        _jerk_rows(bands[k], rows.left[k], left, 0)
        _jerk_rows(bands[k], rows.right[k], right, m)
    return Problem(
        weight=spline.weight, fixed=fixed, lo=np.asarray(low), hi=np.asarray(high), above=rows.above,
        below=rows.below, jm=bands[0], j0=bands[1], jp=bands[2], inverse_max=np.asarray(inverse),
    )


def usage(p, double[::1] c):
    """As `selection.usage`."""
    cdef double[:, ::1] lo = p.lo, hi = p.hi, above = p.above, below = p.below
    cdef double[:, ::1] jm = p.jm, j0 = p.j0, jp = p.jp
    cdef int m = jm.shape[0] // 2, n = c.shape[0], i, k
    cdef double[:, ::1] acceleration = np.empty((m, n + 1)), jerk = np.empty((m, n))
    cdef double[::1] padded = np.zeros(n + 2)
    cdef double y, z, up, down
    for i in range(n):
        padded[i + 1] = c[i]
    for k in range(m):
        for i in range(n + 1):
            y = lo[k, i] * padded[i] + hi[k, i] * padded[i + 1]
            up, down = y / above[k, i], -y / below[k, i]
            acceleration[k, i] = up if up >= down else down
        for i in range(n):
            y = fabs(jm[k, i] * padded[i] + j0[k, i] * padded[i + 1] + jp[k, i] * padded[i + 2])
            z = fabs(jm[m + k, i] * padded[i] + j0[m + k, i] * padded[i + 1] + jp[m + k, i] * padded[i + 2])
            jerk[k, i] = (y if y >= z else z) * sqrt(c[i])
    return np.asarray(acceleration), np.asarray(jerk)


def allowed(double[::1] edges, double[:, ::1] speeds, double[::1] s):
    """As `programmed.allowed`; s ascends."""
    cdef int n = speeds.shape[1], count = s.shape[0], i, k = 0, before = 0
    cdef double[::1] result = np.empty(max(count - 1, 0))
    cdef double here, last = 0.0, u, left, middle, right, least
    cdef int passed = 0, last_passed = 0
    for i in range(count):
        while k + 1 < n and edges[k + 1] <= s[i]:
            passed += fabs(speeds[2, k] - speeds[0, k + 1]) > JUMP * speeds[0, k + 1]
            k += 1
        left, middle, right = speeds[0, k], speeds[1, k], speeds[2, k]
        u = (s[i] - edges[k]) / (edges[k + 1] - edges[k])
        u = min(max(u, 0.0), 1.0)
        least = min(min(left, middle), right)
        here = left + u * (4.0 * middle - 3.0 * left - right + u * 2.0 * (left + right - 2.0 * middle))
        here = fmax(here, least)
        if i > 0:
            result[i - 1] = (here + last) / 2.0 if passed == last_passed else min(here, last)
        last, last_passed = here, passed
    return np.asarray(result)


def room(double[:, :] slope, double[::1] limit):
    """As `rooms.room`."""
    cdef int n = slope.shape[0], m = slope.shape[1], i, k
    cdef double[::1] result = np.empty(n)
    cdef double least, quotient
    for i in range(n):
        least = INFINITY
        for k in range(m):
            quotient = limit[k] / fabs(slope[i, k])
            if quotient < least:
                least = quotient
        result[i] = least
    return np.asarray(result)
