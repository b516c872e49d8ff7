# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled evaluation of segments: poses, rates and derivatives; the twins are `curves` and `turns`.

A segment is a row of numbers, as `packing` writes it: kind and figures of its curve, then of its turn.
"""

import numpy as np

from libc.math cimport cos, sin, sqrt
from libc.string cimport memcpy

from viapoint.runtime.path import packing as _packing
from viapoint.runtime.path import rates as _twin

cdef int STRAIGHT = _packing.STRAIGHT
cdef int ARC = _packing.ARC
cdef int UNIFORM = _packing.UNIFORM
cdef double SERIES_BELOW = _twin.SERIES_BELOW

cdef enum:
    MOST_CONTROLS = 6  # of a quintic

cdef struct State:
    double p[3]
    double p1[3]
    double p2[3]
    double q[4]
    double rate[3]
    double change[3]


def sample(list segments, const long long[::1] counts, const double[::1] w):
    """Places w (N,), so many on each segment, to positions (N, 3), quaternions (N, 4), |dp/dw| and |ω| (N, 2)."""
    cdef Py_ssize_t k, row = 0, last = 0, total = w.shape[0]
    cdef const double[::1] segment
    cdef State at
    positions, quaternions, speeds = np.empty((total, 3)), np.empty((total, 4)), np.empty((total, 2))
    cdef double[:, ::1] p = positions
    cdef double[:, ::1] q = quaternions
    cdef double[:, ::1] rates = speeds
    for k in range(len(segments)):
        segment = segments[k]
        last += counts[k]
        while row < last:
            _evaluate(&segment[0], w[row], &at)
            memcpy(&p[row, 0], at.p, sizeof(at.p))
            memcpy(&q[row, 0], at.q, sizeof(at.q))
            rates[row, 0], rates[row, 1] = sqrt(_dot(at.p1, at.p1)), sqrt(_dot(at.rate, at.rate))
            row += 1
    return positions, quaternions, speeds


def jet(const double[::1] segment, double w):
    """Position and orientation, each with two derivatives by w: (3,), (3,), (3,), (4,), (3,), (3,)."""
    cdef State at
    _evaluate(&segment[0], w, &at)
    row = np.empty(19)
    cdef double[::1] numbers = row
    memcpy(&numbers[0], &at, sizeof(State))
    return row[:3], row[3:6], row[6:9], row[9:13], row[13:16], row[16:]


def bezier(const double[:, ::1] controls, const double[::1] t):
    """As `bezier.bezier`."""
    cdef Py_ssize_t count = t.shape[0], row, k, d = controls.shape[1], level, degree = controls.shape[0] - 1
    values, firsts, seconds = np.empty((3, count, d))
    cdef double[:, ::1] value = values, first = firsts, second = seconds
    cdef double[::1] points = np.empty(controls.shape[0] * d)
    for row in range(count):
        memcpy(&points[0], &controls[0, 0], controls.shape[0] * d * sizeof(double))
        for level in range(degree, 0, -1):
            if level == 2:
                for k in range(d):
                    second[row, k] = degree * (degree - 1) * (points[2 * d + k] - 2.0 * points[d + k] + points[k])
            if level == 1:
                for k in range(d):
                    first[row, k] = degree * (points[d + k] - points[k])
            for k in range(level * d):
                points[k] += t[row] * (points[k + d] - points[k])
        memcpy(&value[row, 0], &points[0], d * sizeof(double))
    return values, firsts, seconds


cdef void _evaluate(const double *segment, double w, State *at) noexcept nogil:
    _turn(segment + 1 + _curve(segment, w, at), w, at)


cdef int _curve(const double *segment, double w, State *at) noexcept nogil:
    """The curve at w; how many numbers it takes after its kind."""
    cdef int kind = <int>segment[0], i, degree
    cdef const double *numbers = segment + 1
    cdef double a, c, s, radius, length
    if kind == STRAIGHT:
        for i in range(3):
            at.p[i], at.p1[i], at.p2[i] = numbers[i] + w * numbers[3 + i], numbers[3 + i], 0.0
        return 6
    if kind == ARC:
        radius = numbers[0]
        a = w / radius
        c, s = cos(a), sin(a)
        for i in range(3):
            at.p[i] = numbers[1 + i] + radius * c * numbers[4 + i] + radius * s * numbers[7 + i]
            at.p1[i] = c * numbers[7 + i] - s * numbers[4 + i]
            at.p2[i] = (numbers[1 + i] - at.p[i]) / (radius * radius)
        return 10
    degree, length = <int>numbers[0], numbers[1]
    _bezier(numbers + 2, degree, w / length, at.p, at.p1, at.p2)
    for i in range(3):
        at.p1[i] /= length
        at.p2[i] /= length * length
    return 2 + 3 * (degree + 1)


cdef void _bezier(
    const double *controls, int degree, double t, double *value, double *first, double *second
) noexcept nogil:
    """By De Casteljau's algorithm; degree 2 or more."""
    cdef double points[3 * MOST_CONTROLS]
    cdef int level, k, i
    memcpy(points, controls, 3 * (degree + 1) * sizeof(double))
    for level in range(degree, 0, -1):
        if level == 2:
            for i in range(3):
                second[i] = degree * (degree - 1) * (points[6 + i] - 2.0 * points[3 + i] + points[i])
        if level == 1:
            for i in range(3):
                first[i] = degree * (points[3 + i] - points[i])
        for k in range(3 * level):
            points[k] += t * (points[k + 3] - points[k])
    memcpy(value, points, 3 * sizeof(double))


cdef void _turn(const double *turn, double w, State *at) noexcept nogil:
    """The orientation: a kind, then start and rate, or as many intervals with knots, middles, controls."""
    cdef const double *knots
    cdef const double *middle
    cdef double phi[3]
    cdef double phi1[3]
    cdef double phi2[3]
    cdef double h
    cdef int count, k = 0, i
    if <int>turn[0] == UNIFORM:
        for i in range(3):
            phi[i], at.rate[i], at.change[i] = w * turn[5 + i], turn[5 + i], 0.0
        _turned(phi, turn + 1, at.q)
        return
    count, knots = <int>turn[1], turn + 2
    while k < count - 1 and knots[k + 1] <= w:
        k += 1
    h = knots[k + 1] - knots[k]
    middle = knots + count + 1
    _bezier(middle + 4 * count + 18 * k, 5, (w - knots[k]) / h, phi, phi1, phi2)
    for i in range(3):
        phi1[i] /= h
        phi2[i] /= h * h
    _turned(phi, middle + 4 * k, at.q)
    _rates(phi, phi1, phi2, at.rate, at.change)


cdef void _turned(const double *phi, const double *q, double *out) noexcept nogil:
    """exp(φ)·q."""
    cdef double half = 0.5 * sqrt(_dot(phi, phi))
    cdef double c = cos(half), scale = 0.5 * (sin(half) / half if half > 0.0 else 1.0)
    cdef double x = scale * phi[0], y = scale * phi[1], z = scale * phi[2]
    out[0] = c * q[0] - x * q[1] - y * q[2] - z * q[3]
    out[1] = c * q[1] + x * q[0] + y * q[3] - z * q[2]
    out[2] = c * q[2] - x * q[3] + y * q[0] + z * q[1]
    out[3] = c * q[3] + x * q[2] - y * q[1] + z * q[0]


cdef void _rates(
    const double *phi, const double *phi1, const double *phi2, double *rate, double *change
) noexcept nogil:
    """φ, φ′, φ″ to ω and dω/dw."""
    cdef double x = _dot(phi, phi), x1 = 2.0 * _dot(phi, phi1), theta, s, c, a, b, da, db
    cdef double side1[3]
    cdef double side2[3]
    cdef double out1[3]
    cdef double out2[3]
    cdef double bent[3]
    cdef int i
    if x < SERIES_BELOW:
        a = 1.0 / 2 - x * (1.0 / 24 - x * (1.0 / 720 - x / 40320))
        b = 1.0 / 6 - x * (1.0 / 120 - x * (1.0 / 5040 - x / 362880))
        da = -1.0 / 24 + x * (1.0 / 360 - x * (1.0 / 13440 - x / 907200))
        db = -1.0 / 120 + x * (1.0 / 2520 - x * (1.0 / 120960 - x / 9979200))
    else:
        theta = sqrt(x)
        s, c = sin(theta), cos(theta)
        a, b = (1.0 - c) / x, (theta - s) / (x * theta)
        da = (theta * s - 2.0 * (1.0 - c)) / (2.0 * x * x)
        db = (3.0 * s - 2.0 * theta - theta * c) / (2.0 * x * x * theta)
    _cross(phi, phi1, side1)
    _cross(phi, phi2, side2)
    _cross(phi, side1, out1)
    _cross(phi, side2, out2)
    _cross(phi1, side1, bent)
    for i in range(3):
        rate[i] = phi1[i] + a * side1[i] + b * out1[i]
        change[i] = phi2[i] + a * side2[i] + b * out2[i] + x1 * (da * side1[i] + db * out1[i]) + b * bent[i]


cdef inline double _dot(const double *a, const double *b) noexcept nogil:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


cdef inline void _cross(const double *a, const double *b, double *c) noexcept nogil:
    c[0], c[1], c[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
