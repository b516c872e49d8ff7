# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled core of what is measured in every tick. The twin is `peaks.feed`. Same steps."""

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

