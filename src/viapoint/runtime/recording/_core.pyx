# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled core of the recorder: ticks into blocks, numbers into message templates, links into frames.

Twins: `fill`, `motion` and `changes` of `blocks`, `wire.encode`, `mcapwriter.address`, and `link_frames` with
`chained` in `scene`. The same bytes: it is built for machines whose numbers begin with the lowest byte, as
those in the file do.
"""

import numpy as np

from cpython.buffer cimport PyBUF_FORMAT, PyBUF_STRIDED_RO, PyBuffer_Release, PyObject_GetBuffer
from libc.math cimport sqrt
from libc.string cimport memcpy

from viapoint.runtime.recording import scene as _twin
from viapoint.runtime.recording import wire as _wire

cdef extern from "_loose.h":
    ctypedef double loose_double
    ctypedef int loose_int

cdef double SHORT = _twin.SHORT
cdef double DOWNWARD = _twin.DOWNWARD
cdef int PADDED_VARINT = _wire.PADDED_VARINT
cdef size_t TIME_SLOT_SIZE = _wire.TIME_SLOT_SIZE
cdef long long NANOSECONDS = _wire.NANOSECONDS


def fill(
    unsigned char[::1] message, const long long[::1] starts, tuple values, Py_ssize_t at, Py_ssize_t start,
    Py_ssize_t count
):
    """As `blocks.fill`, of doubles and 64-bit integers; raises TypeError for others."""
    cdef Py_buffer view
    cdef Py_ssize_t k
    for k in range(len(values)):
        PyObject_GetBuffer(values[k], &view, PyBUF_STRIDED_RO | PyBUF_FORMAT)
        try:
            _put(&view, &message[0] + starts[k], at, start, count)
        finally:
            PyBuffer_Release(&view)


cdef int _put(
    const Py_buffer *view, unsigned char *out, Py_ssize_t at, Py_ssize_t start, Py_ssize_t count
) except -1:
    """Rows of one array."""
    cdef Py_ssize_t width = view.shape[1] if view.ndim == 2 else 1, down = view.strides[0], i, k
    cdef Py_ssize_t across = view.strides[1] // view.itemsize if view.ndim == 2 else 1
    cdef const char *row = <const char *>view.buf + start * down
    cdef char kind = view.format[0]
    cdef loose_double *doubles = <loose_double *>out + at * width
    cdef loose_int *numbers = <loose_int *>out + at * width
    cdef const double *source
    if view.itemsize != sizeof(double) or kind not in (c"d", c"l", c"q"):
        raise TypeError(f"a window's arrays are of doubles and of 64-bit integers, not of {view.format!r}")
    if kind != c"d":
        for i in range(count):
            for k in range(width):
                numbers[k] = <int>(<const long long *>(row + i * down))[k * across]
            numbers += width
    elif across == 1 and down == width * view.itemsize:
        memcpy(doubles, row, count * down)
    else:
        for i in range(count):
            source = <const double *>(row + i * down)
            for k in range(width):
                doubles[k] = source[k * across]
            doubles += width
    return 0


def motion(
    const loose_double[:, ::1] actual, const double[:, ::1] before, Py_ssize_t first, Py_ssize_t stride, double tick_s
):
    """As `blocks.motion`."""
    cdef Py_ssize_t count = max(0, (actual.shape[0] - first + stride - 1) // stride), n = actual.shape[1], i, k, row
    cdef double now, last, first_of_all, speed
    result = np.empty((count, n, 3))
    cdef double[:, :, ::1] out = result
    for i in range(count):
        row = first + i * stride
        for k in range(n):
            now = actual[row, k]
            last = actual[row - 1, k] if row > 0 else before[1, k]
            first_of_all = actual[row - 2, k] if row > 1 else before[row, k]
            speed = (now - last) / tick_s
            out[i, k, 0], out[i, k, 1] = now, speed
            out[i, k, 2] = (speed - (last - first_of_all) / tick_s) / tick_s
    return result


def changes(
    const loose_int[::1] line, const loose_int[::1] ahead, const loose_double[::1] speed,
    const loose_double[:, ::1] joints, const double[::1] before, double standing
):
    """As `blocks.changes`."""
    cdef Py_ssize_t i, k
    cdef bint moves, moved = False
    cdef double step, total
    found = []
    for i in range(line.shape[0]):
        moves = speed[i] > standing
        if not moves:
            total = 0.0
            for k in range(joints.shape[1]):
                step = joints[i, k] - (joints[i - 1, k] if i > 0 else before[k])
                total += step * step
            moves = sqrt(total) > standing
        if i == 0 or line[i] != line[i - 1] or ahead[i] != ahead[i - 1] or moves != moved:
            found.append((i, line[i], ahead[i], moves))
        moved = moves
    return found


def encode(
    unsigned char[:, :] out, const unsigned char[::1] row, const long long[::1] slots,
    const double[:, ::1] values, const long long[::1] times, const long long[::1] nanoseconds
):
    """As `wire.encode`."""
    cdef Py_ssize_t i, k
    cdef unsigned char *at
    cdef unsigned char *time = NULL
    for i in range(values.shape[0]):
        at = &out[i, 0]
        memcpy(at, &row[0], row.shape[0])
        for k in range(values.shape[1]):
            memcpy(at + slots[k], &values[i, k], sizeof(double))
        for k in range(times.shape[0]):
            if k == 0:
                time = at + times[0]
                _pad(nanoseconds[i] // NANOSECONDS, time + 1)
                _pad(nanoseconds[i] % NANOSECONDS, time + 2 + PADDED_VARINT)
            else:
                memcpy(at + times[k], time, TIME_SLOT_SIZE)


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
