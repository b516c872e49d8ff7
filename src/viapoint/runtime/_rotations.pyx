# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled conversions between rotation matrices and quaternions: the twin is `rotations`."""

import numpy as np

from libc.math cimport fabs, sqrt

from viapoint.runtime import rotations as _twin

cdef double HALF_TURN = _twin.HALF_TURN


def quaternion_to_matrix(const double[:, ::1] q):
    """(N, 4) unit quaternions to (N, 3, 3)."""
    cdef Py_ssize_t row
    cdef double w, x, y, z
    result = np.empty((q.shape[0], 3, 3))
    cdef double[:, :, ::1] R = result
    for row in range(q.shape[0]):
        w, x, y, z = q[row, 0], q[row, 1], q[row, 2], q[row, 3]
        R[row, 0, 0], R[row, 1, 1] = 1.0 - 2.0 * (y * y + z * z), 1.0 - 2.0 * (x * x + z * z)
        R[row, 2, 2] = 1.0 - 2.0 * (x * x + y * y)
        R[row, 0, 1], R[row, 1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
        R[row, 0, 2], R[row, 2, 0] = 2.0 * (x * z + w * y), 2.0 * (x * z - w * y)
        R[row, 1, 2], R[row, 2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)
    return result


def matrix_to_quaternion(const double[:, :, ::1] R):
    """(N, 3, 3) to (N, 4) canonical quaternions, by the largest row of 4·q·qᵀ."""
    cdef Py_ssize_t row
    cdef int best, k, j
    cdef double outer[4][4]
    cdef double a, b, c, scale
    result = np.empty((R.shape[0], 4))
    cdef double[:, ::1] q = result
    for row in range(R.shape[0]):
        a, b, c = R[row, 0, 0], R[row, 1, 1], R[row, 2, 2]
        outer[0][0], outer[1][1] = 1.0 + a + b + c, 1.0 + a - b - c
        outer[2][2], outer[3][3] = 1.0 + b - c - a, 1.0 + c - a - b
        outer[0][1], outer[0][2] = R[row, 2, 1] - R[row, 1, 2], R[row, 0, 2] - R[row, 2, 0]
        outer[0][3], outer[2][3] = R[row, 1, 0] - R[row, 0, 1], R[row, 2, 1] + R[row, 1, 2]
        outer[1][3], outer[1][2] = R[row, 0, 2] + R[row, 2, 0], R[row, 1, 0] + R[row, 0, 1]
        best = 0
        for k in range(1, 4):
            for j in range(k):
                outer[k][j] = outer[j][k]
            if outer[k][k] > outer[best][best]:
                best = k
        scale = 0.0
        for k in range(4):
            scale += outer[best][k] * outer[best][k]
        scale = sqrt(scale)
        for k in (0, 3, 2, 1):  # of two signs, the one in which the first that is not zero is positive
            if fabs(outer[best][k] / scale) >= HALF_TURN:
                if outer[best][k] < 0.0:
                    scale = -scale
                break
        for k in range(4):
            q[row, k] = outer[best][k] / scale
    return result


def quaternion_multiply(const double[:, ::1] a, const double[:, ::1] b):
    """Hamilton products (N, 4) of quaternions (N, 4)."""
    cdef Py_ssize_t row
    cdef const double *p
    cdef const double *q
    result = np.empty((a.shape[0], 4))
    cdef double[:, ::1] out = result
    for row in range(a.shape[0]):
        p, q = &a[row, 0], &b[row, 0]
        out[row, 0] = p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3]
        out[row, 1] = p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2]
        out[row, 2] = p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1]
        out[row, 3] = p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]
    return result
