# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled core of what is measured in every tick: the twin is `peaks.feed`. Same steps."""

import numpy as np

cdef extern from "_peaks.h" nogil:
    void differences(Py_ssize_t, Py_ssize_t, Py_ssize_t, const double *, double, double *, double *)


def feed(double[:, ::1] tail, const double[:, :] rows, double tick, double[:, ::1] peaks):
    """As `peaks.feed`."""
    cdef Py_ssize_t count = rows.shape[0], axes = tail.shape[1], row, k
    cdef double[:, ::1] before
    if count == 0 or axes == 0:
        return
    if rows.strides[1] != sizeof(double):
        rows = np.ascontiguousarray(rows)
    before = np.empty((3, axes))
    for k in range(axes):
        before[0, k] = tail[2, k]
        before[1, k] = (tail[2, k] - tail[1, k]) / tick
        before[2, k] = (before[1, k] - (tail[1, k] - tail[0, k]) / tick) / tick
    differences(
        count, axes, rows.strides[0] // <Py_ssize_t>sizeof(double), &rows[0, 0], tick, &before[0, 0], &peaks[0, 0]
    )
    for row in range(max(0, 3 - count)):
        tail[row] = tail[row + count]
    for row in range(max(0, count - 3), count):
        tail[3 - count + row] = rows[row]
