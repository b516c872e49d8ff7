# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled core of the workspace: joints to clearances, and along a motion from look to look.

Twins: `Monitor.clearances` with `Chain`, `distances` and `boxes`; `watch._Search`; `course`. The clearances
are those of the twin. Looks are made at other places, one after the other, which changes nothing in what
is found.
"""

import numpy as np

from libc.math cimport atan2, cos, fabs, sin, sqrt

from viapoint.runtime.workspace import boxes as _boxes
from viapoint.runtime.workspace import monitor as _monitor

cdef extern from "_distances.h" nogil:
    struct Boxes:
        int count, pieces, sides
        const double *R
        const double *centre
        const double *half
        const double *corners
        const double *normals
    double segment_segment(const double *, const double *, const double *, const double *)
    double segment_box(const double *, const double *, const double *)
    double box_clearance(const Boxes *, int, const double *, const double *, double, double)
    double union_clearance(const Boxes *, const double *, const double *, double, double, double, double *)

cdef double AMPLE = _boxes.AMPLE
cdef double JOINED = _boxes.JOINED
cdef double TOUCH = _monitor.TOUCH
cdef double CONE_RADIUS = _monitor.CONE_RADIUS
cdef double UNLIMITED = _monitor.UNLIMITED


cdef class _Zones:
    """Cuboids, with the arrays they point into."""

    cdef Boxes c
    cdef double[:, :, ::1] R, corners
    cdef double[:, ::1] centre, half, normals

    def __init__(self, boxes, corners, normals):
        self.R, self.centre, self.half = _copy(boxes.R_base_box), _copy(boxes.centre), _copy(boxes.half)
        self.corners, self.normals = corners, normals
        self.c.count, self.c.pieces, self.c.sides = len(boxes), corners.shape[0], corners.shape[1]
        if self.c.count:
            self.c.R, self.c.centre, self.c.half = &self.R[0, 0, 0], &self.centre[0, 0], &self.half[0, 0]
        if self.c.pieces:
            self.c.corners, self.c.normals = &self.corners[0, 0, 0], &self.normals[0, 0]


def _copy(values):
    return np.array(values, dtype=np.float64, order="C")


cdef class Rules:
    """What one robot with one tool may not do: the arrays of a chain, a body and the zones of a cell."""

    cdef int n, moving, pairs, terms, zones, points
    cdef bint has_cone
    cdef double half_angle
    cdef double[:, :, ::1] K, KK
    cdef double[:, ::1] Kp, KKp, slide, home, at
    cdef double[::1] axis, pointing, radius, scale, scratch, clear, exclusive, q
    cdef long long[::1] carried, part
    cdef long long[:, ::1] pair
    cdef _Zones forbidden, safe, shared

    def __init__(self, chain, body, forbidden, safe, shared, cone, scale):
        """`cone`: axis in the base (3,), tool's axis with the joints at 0 (3,), half angle; or None."""
        none = np.zeros((0, 1, 3)), np.zeros((0, 3))
        K, p = chain.cross, chain.point
        self.K, self.KK = _copy(K), _copy(K @ K)
        self.Kp, self.KKp = _copy(np.einsum("nij,nj->ni", K, p)), _copy(np.einsum("nij,nj->ni", K @ K, p))
        self.slide, self.home, self.carried = _copy(chain.slide), _copy(chain.home), chain.carried.astype(np.int64)
        self.radius, self.part, self.pair = _copy(body.radius), body.moving, body.pairs.reshape(-1, 2)
        self.forbidden, self.shared = _Zones(forbidden, *none), _Zones(shared, *none)
        self.safe = _Zones(safe.boxes, *safe.shell)
        self.has_cone = cone is not None
        if cone is not None:
            self.axis, self.pointing, self.half_angle = _copy(cone[0]), _copy(cone[1]), cone[2]
        self.n, self.points, self.moving = K.shape[0], self.home.shape[0], len(body.moving)
        self.pairs, self.zones = len(body.pairs), len(shared)
        self.scale, self.terms = _copy(scale), len(scale)
        self.at, self.scratch = np.empty((self.points, 3)), np.empty(2 * self.safe.c.count + 1)
        self.clear, self.exclusive, self.q = np.empty(self.terms), np.empty(self.zones + 1), np.empty(self.n)

    def clearances(self, const double[:, :] joints):
        """Joints (N, n) → clearances (N, K) and (N, E), as `Monitor.clearances`."""
        cdef Py_ssize_t row, count = joints.shape[0]
        cdef int k
        rules, zones = np.empty((count, self.terms)), np.empty((count, self.zones))
        cdef double[:, ::1] to_rules = rules, to_zones = zones
        for row in range(count):
            for k in range(self.n):
                self.q[k] = joints[row, k]
            self._look()
            to_rules[row, :] = self.clear
            for k in range(self.zones):
                to_zones[row, k] = self.exclusive[k]
        return rules, zones

    cdef void _look(self) noexcept nogil:
        """Clearances with the joints at q."""
        cdef int j, k, z, column = 0
        cdef const double *a
        cdef const double *b
        cdef double gap
        self._place()
        for k in range(self.zones):
            self.exclusive[k] = UNLIMITED
        for k in range(self.moving):
            j = self.part[k]
            a, b = &self.at[j, 0], &self.at[j + 1, 0]
            for z in range(self.forbidden.c.count):
                self.clear[column] = box_clearance(&self.forbidden.c, z, a, b, self.radius[j], AMPLE)
                column += 1
            for z in range(self.zones):
                gap = box_clearance(&self.shared.c, z, a, b, self.radius[j], AMPLE)
                self.exclusive[z] = min(self.exclusive[z], gap)
        if self.safe.c.count:
            for k in range(self.moving):
                j = self.part[k]
                self.clear[column] = union_clearance(
                    &self.safe.c, &self.at[j, 0], &self.at[j + 1, 0], self.radius[j], AMPLE, JOINED, &self.scratch[0]
                )
                column += 1
        for k in range(self.pairs):
            j, z = self.pair[k, 0], self.pair[k, 1]
            gap = segment_segment(&self.at[j, 0], &self.at[j + 1, 0], &self.at[z, 0], &self.at[z + 1, 0])
            self.clear[column] = gap - self.radius[j] - self.radius[z]
            column += 1
        if self.has_cone:
            column += 1  # with the places, which know the rotation
        if column == 0:
            self.clear[0] = UNLIMITED

    cdef void _place(self) noexcept nogil:
        """The points of the frame with the joints at q, and the clearance of the cone."""
        cdef double R[9]
        cdef double t[3]
        cdef double turn[9]
        cdef double shift[3]
        cdef double turned[9]
        cdef double s, c
        cdef int joint, i, j, k
        for i in range(9):
            R[i] = 1.0 if i % 4 == 0 else 0.0
        for i in range(3):
            t[i] = 0.0
        for joint in range(self.n + 1):
            for k in range(self.points):
                if self.carried[k] == joint:
                    for i in range(3):
                        self.at[k, i] = t[i] + (
                            R[3 * i] * self.home[k, 0] + R[3 * i + 1] * self.home[k, 1] + R[3 * i + 2] * self.home[k, 2]
                        )
            if joint == self.n:
                break
            s, c = sin(self.q[joint]), 1.0 - cos(self.q[joint])
            for i in range(3):
                shift[i] = self.q[joint] * self.slide[joint, i] - (s * self.Kp[joint, i] + c * self.KKp[joint, i])
                for j in range(3):
                    turn[3 * i + j] = s * self.K[joint, i, j] + c * self.KK[joint, i, j]
            for i in range(3):
                t[i] += R[3 * i] * shift[0] + R[3 * i + 1] * shift[1] + R[3 * i + 2] * shift[2]
                for j in range(3):
                    turned[3 * i + j] = R[3 * i] * turn[j] + R[3 * i + 1] * turn[3 + j] + R[3 * i + 2] * turn[6 + j]
            for i in range(9):
                R[i] += turned[i]
        if self.has_cone:
            self._lean(R)

    cdef void _lean(self, const double *R) noexcept nogil:
        """The clearance of the cone, with the hand turned by R."""
        cdef double at[3]
        cdef double across[3]
        cdef int i
        for i in range(3):
            at[i] = R[3 * i] * self.pointing[0] + R[3 * i + 1] * self.pointing[1] + R[3 * i + 2] * self.pointing[2]
        for i in range(3):
            across[i] = at[(i + 1) % 3] * self.axis[(i + 2) % 3] - at[(i + 2) % 3] * self.axis[(i + 1) % 3]
        cdef double sine = sqrt(across[0] * across[0] + across[1] * across[1] + across[2] * across[2])
        cdef double cosine = at[0] * self.axis[0] + at[1] * self.axis[1] + at[2] * self.axis[2]
        self.clear[self.terms - 1] = CONE_RADIUS * (self.half_angle - atan2(sine, cosine))

    cdef double _room(self, bint *broken) noexcept nogil:
        """m of travel for which the last look vouches, and whether it saw a rule broken."""
        cdef double room = UNLIMITED, least = UNLIMITED
        cdef int k
        for k in range(self.terms):
            room = min(room, self.clear[k] * self.scale[k])
            least = min(least, self.clear[k])
        for k in range(self.zones):
            room = min(room, fabs(self.exclusive[k]))
        broken[0] = least < -TOUCH
        return max(room, 0.0)

    def along_rows(self, const double[::1] travel, double room, const double[:, :] joints):
        """Rows with `travel` (N,) and their joints (N, n), from look to look, as `_march`."""
        return self._march(travel, room, joints, None, None, None)

    def along_course(
        self, const double[::1] travel, double room, const double[::1] ends, const double[::1] rates, coeffs
    ):
        """Places (N,) of a course: cells by travel (C + 1,), their rates (C,), coefficients (C, D+1, m)."""
        return self._march(travel, room, None, ends, rates, coeffs)

    cdef _march(
        self, const double[::1] travel, double room, const double[:, :] joints, const double[::1] ends,
        const double[::1] rates, const double[:, :, ::1] coeffs
    ):
        """Looks from the first row that `room` does not vouch for, each as far on as the one before vouches.

        Rows looked at (L,), the travel for which each vouches (L,), whether it is in the exclusive zones
        (L, E), and whether the last one breaks a rule.
        """
        cdef Py_ssize_t count = travel.shape[0], row = _beyond(travel, 0, room), looks = 0
        cdef Py_ssize_t cell = 0
        cdef bint broken = False
        cdef int k
        rows, radius = np.empty(count, dtype=np.int64), np.empty(count)
        within = np.empty((count, self.zones), dtype=np.bool_)
        cdef long long[::1] to_rows = rows
        cdef double[::1] to_radius = radius
        cdef unsigned char[:, ::1] to_within = within.view(np.uint8)
        with nogil:
            while row < count:
                if joints is not None:
                    for k in range(self.n):
                        self.q[k] = joints[row, k]
                else:
                    while cell + 1 < rates.shape[0] and ends[cell + 1] <= travel[row]:
                        cell += 1
                    self._evaluate(coeffs, cell, (travel[row] - ends[cell]) / rates[cell] - 1.0 if rates[cell] > 0.0 else -1.0)
                self._look()
                to_rows[looks], to_radius[looks] = row, self._room(&broken)
                for k in range(self.zones):
                    to_within[looks, k] = self.exclusive[k] < -TOUCH
                looks += 1
                if broken:
                    break
                row = _beyond(travel, row + 1, travel[row] + to_radius[looks - 1])
        return rows[:looks], radius[:looks], within[:looks], broken

    cdef void _evaluate(self, const double[:, :, ::1] coeffs, Py_ssize_t cell, double x) noexcept nogil:
        """Joints at x (−1 … 1) of a cell, by Clenshaw."""
        cdef int k, degree = coeffs.shape[1] - 1, order
        cdef double first, second, third
        x = min(max(x, -1.0), 1.0)
        for k in range(self.n):
            first, second = 0.0, 0.0
            for order in range(degree, 0, -1):
                third = coeffs[cell, order, k] + 2.0 * x * first - second
                first, second = third, first
            self.q[k] = coeffs[cell, 0, k] + x * first - second


def sure(const double[::1] travel, Py_ssize_t row, const long long[::1] rows, const double[::1] radius):
    """As `watch.sure`."""
    cdef Py_ssize_t look
    cdef double most = 0.0
    for look in range(rows.shape[0]):
        most = max(most, radius[look] - fabs(travel[row] - travel[rows[look]]))
    return most


cdef Py_ssize_t _beyond(const double[::1] travel, Py_ssize_t row, double limit) noexcept nogil:
    """The first row, not before `row`, with more travel than `limit`: in leaps, then by halves."""
    cdef Py_ssize_t count = travel.shape[0], leap = 1, middle, end
    if row >= count or travel[row] > limit:
        return row
    while row + leap < count and travel[row + leap] <= limit:
        row += leap
        leap *= 2
    end = min(row + leap, count)
    while end - row > 1:
        middle = (row + end) // 2
        if travel[middle] <= limit:
            row = middle
        else:
            end = middle
    return end


def paces(const double[:, :, ::1] coeffs, const double[::1] pace):
    """Rates (C,) and travel (C + 1,) of cells, as `course.paces`."""
    cdef Py_ssize_t cells = coeffs.shape[0], cell, order, k
    rates, travel = np.empty(cells), np.empty(cells + 1)
    cdef double[::1] to_rates = rates, to_travel = travel
    cdef double rate, steepest
    to_travel[0] = 0.0
    for cell in range(cells):
        rate = 0.0
        for k in range(pace.shape[0]):
            steepest = 0.0
            for order in range(1, coeffs.shape[1]):
                steepest += order * order * fabs(coeffs[cell, order, k])
            rate += steepest * pace[k]
        to_rates[cell] = rate
        to_travel[cell + 1] = to_travel[cell] + 2.0 * rate
    return rates, travel


def ways(const double[:, :] joints, const double[::1] before, const double[::1] pace):
    """Travel (N,) of rows of joints (N, n) from joints (n,) on, as `watch.ways`."""
    cdef Py_ssize_t row, k
    travel = np.empty(joints.shape[0])
    cdef double[::1] out = travel
    cdef double total = 0.0
    for row in range(joints.shape[0]):
        for k in range(before.shape[0]):
            total += pace[k] * fabs(joints[row, k] - (joints[row - 1, k] if row else before[k]))
        out[row] = total
    return travel


def segment_segments(
    const double[:, ::1] p0, const double[:, ::1] p1, const double[:, ::1] q0, const double[:, ::1] q1
):
    """Distances (N,) of segments (N, 3), as `distances.segment_segment`."""
    cdef Py_ssize_t k
    result = np.empty(p0.shape[0])
    cdef double[::1] out = result
    for k in range(p0.shape[0]):
        out[k] = segment_segment(&p0[k, 0], &p1[k, 0], &q0[k, 0], &q1[k, 0])
    return result


def segment_boxes(const double[:, ::1] start, const double[:, ::1] end, const double[:, ::1] half):
    """Signed distances (N,) of segments (N, 3) from cuboids, as `distances.segment_box`."""
    cdef Py_ssize_t k
    result = np.empty(start.shape[0])
    cdef double[::1] out = result
    for k in range(start.shape[0]):
        out[k] = segment_box(&start[k, 0], &end[k, 0], &half[k, 0])
    return result
