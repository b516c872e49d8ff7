# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled core of what is measured in every tick. Twins: `peaks.feed`, `telemetry.held`. Same steps."""

import numpy as np

from libc.math cimport fabs


def feed(double[:, ::1] tail, const double[:, :] rows, double tick, double[:, ::1] peaks):
    """As `peaks.feed`."""
    cdef Py_ssize_t count = rows.shape[0], row, k
    cdef double x, speed, acceleration, before, earlier, earliest
    for k in range(tail.shape[1]):
        earliest = (tail[1, k] - tail[0, k]) / tick
        earlier = (tail[2, k] - tail[1, k]) / tick
        earliest = (earlier - earliest) / tick
        before = tail[2, k]
        for row in range(count):
            x = rows[row, k]
            speed = (x - before) / tick
            acceleration = (speed - earlier) / tick
            peaks[0, k] = max(peaks[0, k], fabs(speed))
            peaks[1, k] = max(peaks[1, k], fabs(acceleration))
            peaks[2, k] = max(peaks[2, k], fabs((acceleration - earliest) / tick))
            before, earlier, earliest = x, speed, acceleration
        for row in range(max(0, 3 - count)):
            tail[row, k] = tail[row + count, k]
        for row in range(max(0, count - 3), count):
            tail[3 - count + row, k] = rows[row, k]


def held(const double[:, :, ::1] X, const double[:, ::1] tool):
    """As `telemetry.held`."""
    cdef Py_ssize_t row, count = X.shape[0]
    cdef int i, j
    positions, rotations = np.empty((count, 3)), np.empty((count, 3, 3))
    cdef double[:, ::1] p = positions
    cdef double[:, :, ::1] R = rotations
    for row in range(count):
        for i in range(3):
            for j in range(3):
                R[row, i, j] = X[row, i, 0] * tool[0, j] + X[row, i, 1] * tool[1, j] + X[row, i, 2] * tool[2, j]
            p[row, i] = X[row, i, 3] + (
                X[row, i, 0] * tool[0, 3] + X[row, i, 1] * tool[1, 3] + X[row, i, 2] * tool[2, 3]
            )
    return positions, rotations
