# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled numerics of the speed estimate, as their numpy twins in `samples`: the same operations in the same
order, so that both give the same bits.
"""

import numpy as np

from libc.math cimport INFINITY, ceil, fabs, isinf, sqrt

from viapoint.runtime.timing import samples as _twin

cdef extern from "../_numbers.h" nogil:
    double lower(double, double)
    double higher(double, double)

cdef int SAMPLES = _twin.SAMPLES, SAMPLES_PER_PIECE = _twin.SAMPLES_PER_PIECE
cdef double[::1] RAMP = _twin.RAMP, SPLITS = _twin.SPLITS
cdef double FLANK = _twin.FLANK, FINEST = _twin.FINEST, TICKS_TO_FULL = _twin.TICKS_TO_FULL
cdef double STRAIGHT = _twin.STRAIGHT, HELD = _twin.HELD, SLOWEST = _twin.SLOWEST


def first_samples(double[::1] marks):
    """As `samples.first_samples`."""
    cdef Py_ssize_t pieces = marks.shape[0] - 1, ramp = RAMP.shape[0], total = 2 * ramp + 1, k, i, n = 0
    cdef double span = marks[pieces] - marks[0], near = span / SAMPLES, length, place
    cdef long long[::1] count = np.empty(pieces, dtype=np.int64)
    for k in range(pieces):
        count[k] = <long long>higher(ceil((marks[k + 1] - marks[k]) / span * SAMPLES), SAMPLES_PER_PIECE)
        total += count[k]
    result = np.empty(total)
    cdef double[::1] s = result
    for k in range(ramp - 1, -1, -1):  # the ramps ascend, as do the pieces: each place stands nearly right
        n = _sorted_in(s, n, marks[0] + near * RAMP[k])
    for k in range(pieces):
        length = marks[k + 1] - marks[k]
        for i in range(count[k]):
            n = _sorted_in(s, n, marks[k] + length * i / count[k])
    for k in range(ramp):
        n = _sorted_in(s, n, marks[pieces] - near * RAMP[k])
    n = _sorted_in(s, n, marks[pieces])
    return result[:n]


cdef inline Py_ssize_t _sorted_in(double[::1] s, Py_ssize_t n, double place) noexcept nogil:
    """Put a place among the n ascending ones before it; how many there are then."""
    cdef Py_ssize_t k = n, i
    while k > 0 and s[k - 1] > place:
        k -= 1
    if k > 0 and s[k - 1] == place:
        return n
    for i in range(n, k, -1):
        s[i] = s[i - 1]
    s[k] = place
    return n + 1


def dips(double[::1] s, double[::1] logs, double[::1] ceiling, double above):
    """As `samples.dips`."""
    cdef Py_ssize_t n = s.shape[0] - 1, splits = SPLITS.shape[0], i, k, found = 0
    cdef double change
    cdef bint steep
    between, numbers = np.empty(n * splits), np.empty(n * splits, dtype=np.int64)
    cdef double[::1] places = between
    cdef long long[::1] before = numbers
    for i in range(n):
        change = logs[i + 1] - logs[i]
        steep = fabs(change) > above
        if not steep and i > 0 and i + 1 < n:
            steep = logs[i] - logs[i - 1] < -FLANK and logs[i + 2] - logs[i + 1] > FLANK
        if steep and s[i + 1] - s[i] > FINEST * lower(ceiling[i + 1], ceiling[i]):
            for k in range(splits):
                places[found], before[found] = s[i] + (s[i + 1] - s[i]) * SPLITS[k], i
                found += 1
    return between[:found], numbers[:found]


def merged(rows, more, long long[::1] before):
    """As `samples.merged`."""
    cdef Py_ssize_t n = len(rows), added = len(more), i, j, k = 0, to = 0
    cdef double[:, ::1] old = np.ascontiguousarray(rows).reshape(n, -1)
    cdef double[:, ::1] new = np.ascontiguousarray(more).reshape(added, -1)
    result = np.empty((n + added, *rows.shape[1:]))
    cdef double[:, ::1] every = result.reshape(n + added, -1)
    for i in range(n):
        for j in range(old.shape[1]):
            every[to, j] = old[i, j]
        to += 1
        while k < added and before[k] == i:
            for j in range(old.shape[1]):
                every[to, j] = new[k, j]
            to += 1
            k += 1
    return result


def even(double[:, :] first, double[::1] programmed):
    """As `samples.even`."""
    cdef Py_ssize_t n = first.shape[0], m = first.shape[1], i, k
    cdef double largest = 0.0, slowest = INFINITY, fastest = 0.0
    for k in range(m):
        largest = higher(largest, fabs(first[0, k]))
    for i in range(n):
        for k in range(m):
            if fabs(first[i, k] - first[0, k]) > STRAIGHT * fabs(first[0, k]) + STRAIGHT * largest:
                return None
        slowest, fastest = lower(slowest, programmed[i]), higher(fastest, programmed[i])
    if not (isinf(slowest) or fastest <= slowest * (1.0 + STRAIGHT)):
        return None
    result = np.zeros(m)
    cdef double[::1] rates = result
    for i in range(n):
        for k in range(m):
            rates[k] = higher(rates[k], fabs(first[i, k]))
    return result


def rooms(double[:, :] first, double[::1] acceleration, double[::1] braking, double[::1] jerk):
    """As `samples.rooms`."""
    cdef Py_ssize_t n = first.shape[0], m = first.shape[1], i, k
    found = np.empty((3, n))
    cdef double[:, ::1] room = found
    cdef double slope, gain, brake, rest
    for i in range(n):
        gain = brake = rest = INFINITY
        for k in range(m):
            slope = fabs(first[i, k])
            gain = lower(acceleration[k] / slope, gain)
            brake = lower(braking[k] / slope, brake)
            rest = lower(jerk[k] / slope, rest)
        room[0, i], room[1, i], room[2, i] = gain, brake, rest
    return found[0], found[1], found[2]


def scanned(double[::1] s, double[::1] ceiling, room, double top, double tick, double x_start):
    """As `samples.scanned`."""
    cdef Py_ssize_t n = s.shape[0], i
    cdef double[::1] accelerating = room[0], braking = room[1], swinging = room[2]
    cdef double instant = top / (TICKS_TO_FULL * tick), ends, jerk_start, jerk_end, least
    found, away = np.empty((2, n)), np.empty((2, n))
    cdef double[:, ::1] cubes = away
    cdef double[::1] v = found[0], most = found[1], gained = np.empty(n), lost = np.empty(n)
    cdef double gain, brake, gain_before = 0.0, brake_before = 0.0
    for i in range(n):
        most[i] = lower(ceiling[i], top)
        gain, brake = lower(accelerating[i], instant), lower(braking[i], instant)
        if i == 0:
            gained[0] = lost[0] = 0.0
        else:
            gained[i] = gained[i - 1] + (gain + gain_before) * (s[i] - s[i - 1])
            lost[i] = lost[i - 1] + (brake + brake_before) * (s[i] - s[i - 1])
        gain_before, brake_before = gain, brake
        v[i] = most[i] * most[i]
    v[0], v[n - 1] = x_start, 0.0
    least = INFINITY
    for i in range(n):
        least = lower(v[i] - gained[i], least)
        v[i] = least + gained[i]
    least = INFINITY
    for i in range(n - 1, -1, -1):
        least = lower(v[i] + lost[i], least)
        v[i] = sqrt(higher(least - lost[i], 0.0))
    ends = lower(lower(accelerating[0], instant), lower(braking[0], instant))
    jerk_start = lower(swinging[0], ends / (TICKS_TO_FULL * tick))
    gain = lower(lower(accelerating[n - 1], instant), lower(braking[n - 1], instant))
    jerk_end = lower(swinging[n - 1], gain / (TICKS_TO_FULL * tick))
    for i in range(n):
        cubes[0, i] = 6.0 * higher(s[i] - s[0], 0.0) / jerk_start
        cubes[1, i] = 6.0 * higher(s[n - 1] - s[i], 0.0) / jerk_end
    return found[0], found[1], away, (lower(ends, gain), jerk_start, jerk_end)


def timed(double[::1] s, double[::1] v, double[::1] ceiling, double[:, ::1] roots, jerk, double top, bint rests):
    """As `samples.timed`."""
    cdef Py_ssize_t n = s.shape[0], i
    cdef double jerk_start = jerk[0], jerk_end = jerk[1], time = 0.0
    found, held = np.empty((2, n)), np.empty(n, dtype=np.bool_)
    cdef double[::1] speed = found[0], t = found[1]
    cdef unsigned char[::1] calm = held.view(np.uint8)
    cdef bint steady, steady_before = False
    for i in range(n):
        speed[i] = v[i]
        if rests:
            speed[i] = lower(speed[i], 0.5 * jerk_start * (roots[0, i] * roots[0, i]))
        speed[i] = lower(speed[i], 0.5 * jerk_end * (roots[1, i] * roots[1, i]))
    for i in range(n):
        if i > 0:
            time += 2.0 * (s[i] - s[i - 1]) / higher(speed[i] + speed[i - 1], SLOWEST * top)
        t[i] = time
        steady = i + 1 < n and fabs(speed[i + 1] - speed[i]) <= HELD * speed[i + 1]
        calm[i] = steady and steady_before and speed[i] >= (1.0 - HELD) * ceiling[i]
        steady_before = steady
    return found[0], found[1], held
