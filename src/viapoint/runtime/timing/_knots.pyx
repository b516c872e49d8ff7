# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled numerics of the spline's knots, as their numpy twins in `knots`, `programmed` and `spline`: the same
operations in the same order, so that both give the same bits.
"""

import numpy as np

from libc.math cimport INFINITY, fabs, floor, rint, sqrt

from viapoint.runtime.timing import curve as _curve
from viapoint.runtime.timing import knots as _twin
from viapoint.runtime.timing.spline import Spline

cdef extern from "../_numbers.h" nogil:
    double lower(double, double)
    double higher(double, double)
    Py_ssize_t last_below(const double *, Py_ssize_t, double)

cdef double CALM_SPACING = _twin.CALM_SPACING, GROWTH = _twin.GROWTH, FROM_REST = _twin.FROM_REST
cdef double BUSY = _twin.BUSY, SHORTEST = _twin.SHORTEST, INSET = _curve.INSET
cdef int FEWEST = _twin.FEWEST, PIECES_PER_EDGE = _twin.PIECES_PER_EDGE


cdef double _interpolated(double at, const double[::1] x, const double[::1] y) noexcept nogil:
    """As numpy's `interp` of finite numbers."""
    cdef Py_ssize_t k = last_below(&x[0], x.shape[0], at)
    if k < 0:
        return y[0]
    if k == x.shape[0] - 1 or x[k] == at:
        return y[k]
    return (y[k + 1] - y[k]) / (x[k + 1] - x[k]) * (at - x[k]) + y[k]


def place(double[::1] s, double[::1] t, calm, double[::1] marks, double dt, double tick):
    """As `knots.place`."""
    cdef double shortest = higher(SHORTEST, 0.5 * tick), duration, passed, least, most
    cdef double[::1] counter = np.empty(s.shape[0]), times, places, at
    cdef Py_ssize_t k, i, n, kept = 0, total = 0
    times = np.empty(marks.shape[0])
    for k in range(marks.shape[0]):
        times[k] = _interpolated(marks[k], s, t)
    marks = marks.copy()
    n = marks.shape[0] - 1
    for k in range(1, n):
        if times[k] - times[kept] >= shortest and times[n] - times[k] >= shortest:
            kept += 1
            marks[kept], times[kept] = marks[k], times[k]
    kept += 1
    marks[kept], times[kept] = marks[n], times[n]
    n = kept
    _count(t, calm.view(np.uint8), dt, times[0], times[n], counter)
    places = np.empty(n + 1)
    for k in range(n + 1):
        places[k] = _interpolated(marks[k], s, counter)
    cdef long long[::1] fixed = np.empty(n + 1, dtype=np.int64)
    for k in range(n):
        duration, passed = times[k + 1] - times[k], places[k + 1] - places[k]
        most = higher(floor(duration / shortest), 1.0)
        least = lower(PIECES_PER_EDGE, most) if duration < BUSY * dt * passed else 1.0
        least = higher(higher(rint(passed), 1.0), least)
        if n == 1:
            least = higher(least, FEWEST)
        if k == 0 or k == n - 1:
            least = higher(least, 2.0)
        fixed[k] = total
        total += <long long>least
    fixed[n] = total
    result = np.empty(total + 1)
    at = result
    for k in range(n):
        passed = places[k + 1] - places[k]
        for i in range(fixed[k + 1] - fixed[k]):
            at[fixed[k] + i] = _interpolated(places[k] + passed * i / (fixed[k + 1] - fixed[k]), counter, s)
    _smooth(at, marks, fixed)
    return result


cdef void _count(
    const double[::1] t, const unsigned char[::1] calm, double dt, double first, double last, double[::1] counter
) noexcept nogil:
    """As `knots._counter`."""
    cdef Py_ssize_t n = t.shape[0], i, before = 0, behind = 0, following
    cdef double each, each_before = 0.0, away, end = t[n - 1]
    counter[0] = 0.0
    while calm[before]:
        before += 1
    following = before + 1
    while calm[following]:
        following += 1
    behind = following
    for i in range(n):  # the changes beside t[i]: the first that is not earlier, and the one before it
        while t[behind] < t[i]:
            following = behind + 1
            while following < n and calm[following]:
                following += 1
            if following == n:
                break
            before, behind = behind, following
        away = lower(fabs(t[i] - t[before]), fabs(t[behind] - t[i]))
        each = lower(dt + GROWTH * away, higher(dt, CALM_SPACING))
        if first > 0.0:
            each = lower(each, FROM_REST * higher(t[i], first))
        each = lower(each, FROM_REST * higher(end - t[i], end - last))
        if i > 0:
            counter[i] = counter[i - 1] + (t[i] - t[i - 1]) * 0.5 * (1.0 / each + 1.0 / each_before)
        each_before = each


cdef void _smooth(double[::1] knots, const double[::1] marks, const long long[::1] fixed) noexcept nogil:
    """As `knots._smooth`."""
    cdef Py_ssize_t n = knots.shape[0] - 1, i, k
    cdef double before, now
    for k in range(fixed.shape[0]):
        knots[fixed[k]] = marks[k]
    for _ in range(3):
        before = knots[0]
        for i in range(1, n):
            now = knots[i]
            knots[i] = 0.5 * now + 0.25 * (before + knots[i + 1])
            before = now
        for k in range(fixed.shape[0]):
            knots[fixed[k]] = marks[k]


def make(double[::1] knots, double rest_start, double rest_end):
    """As `spline.make`."""
    cdef Py_ssize_t n = knots.shape[0] - 1, i
    found = np.zeros((4, n + 1)), np.empty((2, n))
    cdef double[:, ::1] entries = found[0]
    cdef double[::1] h = found[1][0], weight = found[1][1]
    cdef double growth
    for i in range(n):
        h[i] = weight[i] = knots[i + 1] - knots[i]
    for i in range(1, n):
        growth = h[i - 1] + h[i]
        entries[0, i], entries[1, i] = h[i] / growth, h[i - 1] / growth
        entries[2, i], entries[3, i] = -2.0 / growth, 2.0 / growth
    if rest_start > 0.0:
        growth = 1.0 + 2.0 * h[0] / (3.0 * rest_start)
        entries[1, 0] = 1.0 / growth
        entries[3, 0] = (4.0 / 3.0) / rest_start * entries[1, 0]
        weight[0] += 3.0 * rest_start * sqrt(growth)
    else:
        weight[0] = 0.0
    growth = 1.0 + 2.0 * h[n - 1] / (3.0 * rest_end)
    entries[0, n] = 1.0 / growth
    entries[2, n] = -(4.0 / 3.0) / rest_end * entries[0, n]
    weight[n - 1] += 3.0 * rest_end * sqrt(growth)
    return Spline(knots.base, found[1][0], *found[0], found[1][1], rest_start, rest_end)


def guess(double[::1] s, double[::1] v, double[::1] knots, double share):
    """As `knots.guess`."""
    cdef Py_ssize_t n = knots.shape[0] - 1, i
    cdef double speed, most = 0.0
    result = np.empty(n)
    cdef double[::1] x = result
    for i in range(n):
        speed = _interpolated(0.5 * (knots[i + 1] + knots[i]), s, v)
        x[i] = share * (speed * speed)
        most = higher(most, x[i])
    for i in range(n):
        x[i] = higher(x[i], 1e-9 * most)
    return result


def insides(double[::1] knots, bint given):
    """As `knots.insides`."""
    cdef Py_ssize_t n = knots.shape[0] - 1, i
    cdef double low, high, inset
    result = np.empty(2 * n + 1)
    cdef double[::1] places = result
    for i in range(n):
        low, high = knots[i], knots[i + 1]
        if given:
            low, high = higher(low, knots[1]), higher(high, knots[1])
        inset = INSET * (high - low)
        places[2 * i], places[2 * i + 1] = low + inset, high - inset
    places[2 * n] = knots[n]
    return result


def asked(double[::1] knots, double[::1] width, double rest_start, double rest_end, double[::1] breaks):
    """As `programmed.asked`."""
    cdef Py_ssize_t n = width.shape[0], i, k, piece, total = 3 * n
    cdef double inset, first = knots[0] - rest_start, last = knots[n] + rest_end
    places, owners = np.empty(3 * n + 2 * breaks.shape[0]), np.empty(2 * breaks.shape[0], dtype=np.int64)
    cdef double[::1] at = places
    cdef long long[::1] owner = owners
    for i in range(n):
        inset = INSET * width[i]
        at[i], at[n + i], at[2 * n + i] = knots[i] + inset, 0.5 * (knots[i] + knots[i + 1]), knots[i + 1] - inset
    for i in range(breaks.shape[0]):
        if breaks[i] > first and breaks[i] < last:
            piece = min(max(last_below(&knots[0], n + 1, breaks[i]), 0), n - 1)
            inset = INSET * width[piece]
            for k in range(2):
                at[total] = breaks[i] - inset if k == 0 else breaks[i] + inset
                owner[total - 3 * n] = min(max(last_below(&knots[0], n + 1, at[total]), 0), n - 1)
                total += 1
    if rest_start == 0.0:
        for i in range(total):
            at[i] = higher(at[i], knots[1])
    return places[:total], owners[: total - 3 * n]


def on_pieces(double[::1] bounds, long long[::1] owner, Py_ssize_t n, bint given):
    """As `programmed.on_pieces`."""
    cdef Py_ssize_t i, j, bad = -1
    result = np.empty((3, n))
    cdef double[:, ::1] speeds = result
    cdef double[::1] beside = np.full(n, INFINITY)
    for i in range(owner.shape[0]):
        beside[owner[i]] = lower(beside[owner[i]], bounds[3 * n + i])
    for i in range(n):
        for j in range(3):
            speeds[j, i] = lower(beside[i], bounds[j * n + i])
            if not speeds[j, i] > 0.0 and bad < 0:
                bad = i
    if given:
        for j in range(3):
            speeds[j, 0] = INFINITY
    return result, bad


def edges(double[::1] knots, double[::1] breaks, double[::1] stands):
    """As `programmed.edges`."""
    cdef Py_ssize_t i, k
    result = np.array(knots)
    cdef double[::1] moved = result
    for i in range(breaks.shape[0]):
        k = last_below(&knots[0], knots.shape[0], stands[i])
        if k >= 0 and knots[k] == stands[i]:
            moved[k] = breaks[i]
    return result
