# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled core of the recorder: numbers into message templates, links into frames, checksums.

Twins: `wire.encode`, `mcapwriter.address`, `zlib.crc32`, and `link_frames` with `chained` in `scene`. The same bytes: it is
built for machines whose numbers begin with the lowest byte, as those in the file do.
"""

import zlib

import numpy as np

from libc.math cimport sqrt
from libc.string cimport memcpy

from viapoint.runtime.recording import scene as _twin
from viapoint.runtime.recording import wire as _wire

cdef extern from "_fold.h" nogil:
    const int LANES
    const int LANE
    bint folds()
    void fold(const unsigned char *data, long blocks, unsigned int state, unsigned char *folded)

cdef double SHORT = _twin.SHORT
cdef double DOWNWARD = _twin.DOWNWARD
cdef int PADDED_VARINT = _wire.PADDED_VARINT
cdef long long NANOSECONDS = _wire.NANOSECONDS
cdef unsigned int START = 0xFFFFFFFF  # the state a CRC begins in; zlib's argument is its inverse


def encode(
    unsigned char[:, :] out, const unsigned char[::1] row, const long long[::1] slots,
    const double[:, ::1] values, const long long[::1] times, const long long[::1] nanoseconds
):
    """As `wire.encode`."""
    cdef Py_ssize_t i, k
    cdef unsigned char *at
    for i in range(values.shape[0]):
        at = &out[i, 0]
        memcpy(at, &row[0], row.shape[0])
        for k in range(values.shape[1]):
            memcpy(at + slots[k], &values[i, k], sizeof(double))
        for k in range(times.shape[0]):
            _pad(nanoseconds[i] // NANOSECONDS, at + times[k] + 1)
            _pad(nanoseconds[i] % NANOSECONDS, at + times[k] + 2 + PADDED_VARINT)


cdef inline void _pad(long long value, unsigned char *at) noexcept nogil:
    """A varint of five bytes."""
    cdef int k
    for k in range(PADDED_VARINT):
        at[k] = (value >> (7 * k)) & 0x7F | (0x80 if k < PADDED_VARINT - 1 else 0)


def address(
    unsigned char[:, ::1] rows, unsigned char op, unsigned short channel, unsigned int sequence,
    const long long[::1] nanoseconds, unsigned long long offset
):
    """As `mcapwriter.address`."""
    cdef Py_ssize_t i, count = rows.shape[0]
    cdef unsigned long long length = rows.shape[1] - 9
    cdef unsigned int number
    cdef unsigned char *at
    result = np.empty((count, 2), "<u8")
    cdef unsigned long long[:, ::1] index = result
    for i in range(count):
        at, number = &rows[i, 0], sequence + <unsigned int>i
        at[0] = op
        memcpy(at + 1, &length, 8)
        memcpy(at + 9, &channel, 2)
        memcpy(at + 11, &number, 4)
        memcpy(at + 15, &nanoseconds[i], 8)
        memcpy(at + 23, &nanoseconds[i], 8)
        index[i, 0], index[i, 1] = nanoseconds[i], offset + i * rows.shape[1]
    return result


def crc32(const unsigned char[::1] data):
    """As `zlib.crc32`, which does what the processor cannot fold."""
    cdef Py_ssize_t blocks = data.shape[0] // (LANES * LANE) if folds() else 0
    cdef unsigned char folded[16]
    if not blocks:
        return zlib.crc32(data)
    fold(&data[0], blocks, START, folded)
    return zlib.crc32(data[blocks * LANES * LANE:], zlib.crc32(folded[:LANE], START))


cdef void _link_turn(const double *start, const double *end, double *q) noexcept nogil:
    """Quaternion w x y z of the smallest turn from upright to the link."""
    cdef double x = end[0] - start[0], y = end[1] - start[1], z = end[2] - start[2]
    cdef double length = sqrt(x * x + y * y + z * z)
    if length > SHORT:
        x, y, z = x / length, y / length, z / length
    else:
        x, y, z = 0.0, 0.0, 1.0
    if 1.0 + z < DOWNWARD:
        q[0], q[1], q[2], q[3] = 0.0, 1.0, 0.0, 0.0
        return
    length = sqrt((1.0 + z) * (1.0 + z) + y * y + x * x)
    q[0], q[1], q[2], q[3] = (1.0 + z) / length, -y / length, x / length, 0.0


def frame_values(const double[:, :, ::1] points, const double[:, ::1] position, const double[:, ::1] quaternion):
    """As `scene.frame_values`."""
    cdef Py_ssize_t count = points.shape[0], links = points.shape[1] - 1, i, k
    result = np.empty((count, 7 * (links + 1)))
    cdef double[:, ::1] out = result
    cdef double *before = [1.0, 0.0, 0.0, 0.0]
    cdef double q[4]
    cdef double w, x, y, z, dx, dy, dz, tx, ty, tz
    cdef double *row
    with nogil:
        for i in range(count):
            for k in range(links):
                row = &out[i, 7 * k]
                _link_turn(&points[i, k, 0], &points[i, k + 1, 0], q)
                if k == 0:
                    row[0], row[1], row[2] = points[i, 0, 0], points[i, 0, 1], points[i, 0, 2]
                    row[3], row[4], row[5], row[6] = q[1], q[2], q[3], q[0]
                else:
                    w, x, y, z = before[0], -before[1], -before[2], -before[3]
                    dx = points[i, k, 0] - points[i, k - 1, 0]
                    dy = points[i, k, 1] - points[i, k - 1, 1]
                    dz = points[i, k, 2] - points[i, k - 1, 2]
                    tx, ty, tz = 2.0 * (y * dz - z * dy), 2.0 * (z * dx - x * dz), 2.0 * (x * dy - y * dx)
                    row[0] = dx + w * tx + (y * tz - z * ty)
                    row[1] = dy + w * ty + (z * tx - x * tz)
                    row[2] = dz + w * tz + (x * ty - y * tx)
                    row[3] = w * q[1] + x * q[0] + y * q[3] - z * q[2]
                    row[4] = w * q[2] - x * q[3] + y * q[0] + z * q[1]
                    row[5] = w * q[3] + x * q[2] - y * q[1] + z * q[0]
                    row[6] = w * q[0] - x * q[1] - y * q[2] - z * q[3]
                memcpy(before, q, sizeof(q))
            row = &out[i, 7 * links]
            row[0], row[1], row[2] = position[i, 0], position[i, 1], position[i, 2]
            row[3], row[4], row[5] = quaternion[i, 1], quaternion[i, 2], quaternion[i, 3]
            row[6] = quaternion[i, 0]
    return result
