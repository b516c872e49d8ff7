# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled choice of turns and of the solutions inside the joint ranges: the twin is `model`."""

import numpy as np

from libc.math cimport ceil, fabs, floor, rint, sqrt

from viapoint.runtime.robots import model as _twin

cdef double TURN = _twin.TURN
cdef double SAME_SOLUTION = _twin.SAME_SOLUTION


def nearest_turns(double[:, :] q, const double[:, :] reference, const unsigned char[::1] prismatic):
    """Turn joints (N, n), in place, as near as full turns take them to the reference (N or 1, n)."""
    cdef Py_ssize_t row, k
    cdef bint one = reference.shape[0] == 1
    for row in range(q.shape[0]):
        for k in range(q.shape[1]):
            if not prismatic[k]:
                q[row, k] += TURN * rint((reference[0 if one else row, k] - q[row, k]) / TURN)


def without_turns(const double[:, :] q, const double[:] start, const unsigned char[::1] prismatic):
    """Joints (N, n) without jumps of full turns between the rows, and from `start` (n,) to the first."""
    cdef Py_ssize_t row, k
    cdef double turns, before
    result = np.empty((q.shape[0], q.shape[1]))
    cdef double[:, ::1] joints = result
    for k in range(q.shape[1]):
        turns, before = 0.0, start[k]
        for row in range(q.shape[0]):
            if not prismatic[k]:
                turns += rint((q[row, k] - before) / TURN)
            joints[row, k], before = q[row, k] - TURN * turns, q[row, k]
    return result


def distinct(const double[:, ::1] q, const unsigned char[::1] valid):
    """The valid rows (K,) of branches (N, n) that are none of the valid ones before them."""
    cdef Py_ssize_t row, other, k, found = 0
    cdef double away
    cdef bint met
    numbers = np.empty(q.shape[0], dtype=np.int64)
    cdef long long[::1] rows = numbers
    for row in range(q.shape[0]):
        met = not valid[row]
        for other in range(row):
            if met or not valid[other]:
                continue
            away = 0.0
            for k in range(q.shape[1]):
                away = max(away, fabs(q[row, k] - q[other, k]))
            met = away < SAME_SOLUTION
        if not met:
            rows[found] = row
            found += 1
    return numbers[:found]


def turned(
    const double[:, ::1] q, const long long[::1] chosen, const double[::1] lower, const double[::1] upper,
    const unsigned char[::1] prismatic,
):
    """All joints (K, n) that differ from one of the `chosen` rows of q (N, n) by full turns and lie in the
    ranges; and of which row each is (K,).
    """
    cdef Py_ssize_t n = q.shape[1], each, row, k, j, at = 0, total = 0, many
    cdef long long[:, :, ::1] turns = np.empty((chosen.shape[0], 2, n), dtype=np.int64)  # first and last
    cdef long long[::1] now = np.empty(n, dtype=np.int64)
    cdef double low, high
    for each in range(chosen.shape[0]):
        row, many = chosen[each], 1
        for k in range(n):
            low, high = lower[k] - q[row, k], upper[k] - q[row, k]
            turns[each, 0, k] = 0 if prismatic[k] else <long long>ceil(low / TURN)
            turns[each, 1, k] = <long long>floor(high / TURN)
            if prismatic[k]:
                turns[each, 1, k] = -1 if low > 0.0 or high < 0.0 else 0
            many *= max(turns[each, 1, k] - turns[each, 0, k] + 1, 0)
        total += many
    joints, owners = np.empty((total, n)), np.empty(total, dtype=np.int64)
    cdef double[:, ::1] found = joints
    cdef long long[::1] owner = owners
    for each in range(chosen.shape[0]):
        row, many = chosen[each], 1
        for k in range(n):
            now[k] = turns[each, 0, k]
            many *= max(turns[each, 1, k] - turns[each, 0, k] + 1, 0)
        for j in range(many):
            owner[at] = row
            for k in range(n):
                found[at, k] = q[row, k] + TURN * now[k]
            at += 1
            for k in range(n - 1, -1, -1):  # the last joint turns first
                now[k] += 1
                if now[k] <= turns[each, 1, k]:
                    break
                now[k] = turns[each, 0, k]
    return joints, owners


def nearest_first(const double[:, ::1] joints, const double[::1] reference, const double[::1] speed):
    """The order (K,) of joints (K, n) by their distance to a reference, in units of each joint's speed."""
    cdef Py_ssize_t total = joints.shape[0], row, k
    cdef double away, step
    numbers = np.empty(total, dtype=np.int64)
    cdef long long[::1] order = numbers
    cdef double[::1] distance = np.empty(total)
    for row in range(total):
        away = 0.0
        for k in range(joints.shape[1]):
            step = (joints[row, k] - reference[k]) / speed[k]
            away += step * step
        away = sqrt(away)
        k = row
        while k > 0 and distance[k - 1] > away:
            distance[k], order[k] = distance[k - 1], order[k - 1]
            k -= 1
        distance[k], order[k] = away, row
    return numbers
