# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True, initializedcheck=False
"""Compiled kinematics of the six-joint arm with a spherical wrist: the twin is `anthropomorphic`.

The same formulas, pose by pose instead of array by array. An arm is a row of numbers, `packed` of the twin says which.
"""

import numpy as np

from libc.math cimport atan2, cos, fabs, hypot, rint, sin, sqrt

from viapoint.runtime import rotations as _rotations
from viapoint.runtime.robots import anthropomorphic as _twin

cdef extern from "_tcp.h" nogil:
    void tool_centre(
        const double *, const double *, const double *, long, long, double, double *, double *
    )

cdef double WRIST_SINGULAR = _twin.WRIST_SINGULAR
cdef double SHOULDER_SINGULAR = _twin.SHOULDER_SINGULAR
cdef double REACH_TOLERANCE = _twin.REACH_TOLERANCE
cdef double SAME_ELBOW = _twin.SAME_ELBOW
cdef double HALF_TURN = _rotations.HALF_TURN
cdef double TURN = _twin.TURN

cdef struct Arm:
    double height, a2x, a3z, along, a4z, a6x, forearm, bend
    double sign[6]
    double flange[9]


cdef struct Angles:
    double c[6]
    double s[6]
    double c23, s23


cdef Arm _arm(const double[::1] packed) noexcept:
    cdef Arm arm
    cdef int k
    arm.height, arm.a2x, arm.a3z, arm.along = packed[0], packed[1], packed[2], packed[3]
    arm.a4z, arm.a6x, arm.forearm, arm.bend = packed[4], packed[5], packed[6], packed[7]
    for k in range(6):
        arm.sign[k] = packed[8 + k]
    for k in range(9):
        arm.flange[k] = packed[14 + k]
    return arm


cdef inline Angles _angles(const Arm *arm, const double *q) noexcept nogil:
    cdef Angles at
    cdef double angle, both
    cdef int k
    for k in range(6):
        angle = q[k] * arm.sign[k]
        at.c[k], at.s[k] = cos(angle), sin(angle)
    both = q[1] * arm.sign[1] + q[2] * arm.sign[2]
    at.c23, at.s23 = cos(both), sin(both)
    return at


cdef inline double _radial(const Arm *arm, const Angles *at) noexcept nogil:
    return arm.a2x + arm.a3z * at.s[1] + arm.along * at.c23 + arm.a4z * at.s23


cdef inline void _wrist_point(const Arm *arm, const Angles *at, double *p) noexcept nogil:
    cdef double radial = _radial(arm, at)
    p[0], p[1] = radial * at.c[0], radial * at.s[0]
    p[2] = arm.height + arm.a3z * at.c[1] - arm.along * at.s23 + arm.a4z * at.c23


cdef void _pose(const Arm *arm, const Angles *at, double *X) noexcept nogil:
    """The flange, 16 numbers."""
    cdef double c4 = at.c[3], c5 = at.c[4], c6 = at.c[5], s4 = at.s[3], s5 = at.s[4], s6 = at.s[5]
    cdef double y[3]
    cdef double upper[3]
    cdef double lower[3]
    cdef double R[9]
    cdef double p[3]
    cdef double x
    cdef int i, j, k
    upper[0], upper[1], upper[2] = c5, s5 * s6, s5 * c6
    y[0], y[1], y[2] = s4 * s5, c4 * c6 - s4 * c5 * s6, -c4 * s6 - s4 * c5 * c6
    lower[0], lower[1], lower[2] = -c4 * s5, s4 * c6 + c4 * c5 * s6, c4 * c5 * c6 - s4 * s6
    for j in range(3):
        x = at.c23 * upper[j] + at.s23 * lower[j]
        R[j] = at.c[0] * x - at.s[0] * y[j]
        R[3 + j] = at.s[0] * x + at.c[0] * y[j]
        R[6 + j] = at.c23 * lower[j] - at.s23 * upper[j]
    _wrist_point(arm, at, p)
    for i in range(3):
        for j in range(3):
            x = 0.0
            for k in range(3):
                x += R[3 * i + k] * arm.flange[3 * k + j]
            X[4 * i + j] = x
        X[4 * i + 3] = p[i] + arm.a6x * R[3 * i]
    X[12] = X[13] = X[14] = 0.0
    X[15] = 1.0


cdef inline void _own_rotation(const Arm *arm, const double *X, double *R) noexcept nogil:
    """The family's own flange rotation, X·flangeᵀ, 9 numbers."""
    cdef double x
    cdef int i, j, k
    for i in range(3):
        for j in range(3):
            x = 0.0
            for k in range(3):
                x += X[4 * i + k] * arm.flange[3 * j + k]
            R[3 * i + j] = x


def fk(const double[::1] packed, const double[:, ::1] q):
    """Joints (N, 6) to flange poses (N, 4, 4)."""
    cdef Arm arm = _arm(packed)
    cdef Angles at
    cdef Py_ssize_t row
    result = np.empty((q.shape[0], 4, 4))
    cdef double[:, :, ::1] X = result
    for row in range(q.shape[0]):
        at = _angles(&arm, &q[row, 0])
        _pose(&arm, &at, &X[row, 0, 0])
    return result


def tcp(const double[::1] packed, const double[:, :] q, const double[:, ::1] tool):
    """Joints (N, 6) to TCP positions (N, 3) and quaternions (N, 4), of a tool (4, 4) on the flange."""
    cdef Arm arm = _arm(packed)
    cdef double hand[12]
    cdef int i, j, k
    cdef double[:, ::1] p
    cdef double[:, ::1] turned
    if q.strides[1] != sizeof(double):
        q = np.ascontiguousarray(q)
    position, quaternion = np.empty((q.shape[0], 3)), np.empty((q.shape[0], 4))
    p, turned = position, quaternion
    for i in range(3):
        for j in range(4):
            hand[4 * i + j] = 0.0
            for k in range(3):
                hand[4 * i + j] += arm.flange[3 * i + k] * tool[k, j]
    hand[3] += arm.a6x
    if q.shape[0]:
        tool_centre(
            &packed[0], hand, &q[0, 0], q.shape[0], q.strides[0] // <Py_ssize_t>sizeof(double), HALF_TURN,
            &p[0, 0], &turned[0, 0],
        )
    return position, quaternion


def link_points(const double[::1] packed, const double[:, ::1] q):
    """Joints (N, 6) to the wire frame (N, 7, 3)."""
    cdef Arm arm = _arm(packed)
    cdef Angles at
    cdef double X[16]
    cdef double radial, lift
    cdef double *p
    cdef Py_ssize_t row
    cdef int k
    result = np.zeros((q.shape[0], 7, 3))
    cdef double[:, :, ::1] points = result
    for row in range(q.shape[0]):
        at = _angles(&arm, &q[row, 0])
        _pose(&arm, &at, X)
        p = &points[row, 0, 0]
        p[5] = p[8] = arm.height
        p[6], p[7] = arm.a2x * at.c[0], arm.a2x * at.s[0]
        radial = arm.a2x + arm.a3z * at.s[1]
        p[9], p[10], p[11] = radial * at.c[0], radial * at.s[0], arm.height + arm.a3z * at.c[1]
        lift = arm.a4z * at.s23
        p[12], p[13], p[14] = p[9] + at.c[0] * lift, p[10] + at.s[0] * lift, p[11] + arm.a4z * at.c23
        _wrist_point(&arm, &at, p + 15)
        for k in range(3):
            p[18 + k] = X[4 * k + 3]
    return result


def jacobian(const double[::1] packed, const double[:, ::1] q):
    """Joints (N, 6) to the flange's Jacobian (N, 6, 6): each axis × (flange − a point of it), and the axis."""
    cdef Arm arm = _arm(packed)
    cdef Angles at
    cdef double axes[6][3]
    cdef double origins[6][3]
    cdef double flange[3]
    cdef double arm_vector[3]
    cdef double c1, s1, upright
    cdef Py_ssize_t row
    cdef int i, k
    result = np.empty((q.shape[0], 6, 6))
    cdef double[:, :, ::1] J = result
    for row in range(q.shape[0]):
        at = _angles(&arm, &q[row, 0])
        c1, s1 = at.c[0], at.s[0]
        axes[0][0], axes[0][1], axes[0][2] = 0.0, 0.0, 1.0
        for k in range(1, 3):
            axes[k][0], axes[k][1], axes[k][2] = -s1, c1, 0.0
        axes[3][0], axes[3][1], axes[3][2] = c1 * at.c23, s1 * at.c23, -at.s23
        for k in range(3):
            upright = c1 * at.s23 if k == 0 else (s1 * at.s23 if k == 1 else at.c23)
            axes[4][k] = at.c[3] * axes[1][k] + at.s[3] * upright
            axes[5][k] = at.c[4] * axes[3][k] + at.s[4] * (at.s[3] * axes[1][k] - at.c[3] * upright)
        _wrist_point(&arm, &at, origins[3])
        for k in range(3):
            origins[0][k] = 0.0
            origins[4][k] = origins[5][k] = origins[3][k]
            flange[k] = origins[3][k] + arm.a6x * axes[5][k]
        origins[1][0], origins[1][1], origins[1][2] = arm.a2x * c1, arm.a2x * s1, arm.height
        upright = arm.a2x + arm.a3z * at.s[1]
        origins[2][0], origins[2][1] = upright * c1, upright * s1
        origins[2][2] = arm.height + arm.a3z * at.c[1]
        for i in range(6):
            for k in range(3):
                arm_vector[k] = flange[k] - origins[i][k]
                J[row, 3 + k, i] = arm.sign[i] * axes[i][k]
            J[row, 0, i] = arm.sign[i] * (axes[i][1] * arm_vector[2] - axes[i][2] * arm_vector[1])
            J[row, 1, i] = arm.sign[i] * (axes[i][2] * arm_vector[0] - axes[i][0] * arm_vector[2])
            J[row, 2, i] = arm.sign[i] * (axes[i][0] * arm_vector[1] - axes[i][1] * arm_vector[0])
    return result


def free_joint(const double[::1] packed, const double[:, ::1] q):
    """Joints (N, 6) to (N,): whether J1 or J4 is free."""
    cdef Arm arm = _arm(packed)
    cdef Angles at
    cdef Py_ssize_t row
    result = np.empty(q.shape[0], dtype=np.bool_)
    cdef unsigned char[::1] free = result.view(np.uint8)
    for row in range(q.shape[0]):
        at = _angles(&arm, &q[row, 0])
        free[row] = fabs(at.s[4]) < WRIST_SINGULAR or fabs(_radial(&arm, &at)) < SHOULDER_SINGULAR
    return result


def clearance(const double[::1] packed, const double[:, ::1] q):
    """Joints (N, 6) to about how far (N,), in m, the arm has to move to a singular pose of J1 or J4."""
    cdef Arm arm = _arm(packed)
    cdef Angles at
    cdef Py_ssize_t row
    result = np.empty(q.shape[0])
    cdef double[::1] nearest = result
    for row in range(q.shape[0]):
        at = _angles(&arm, &q[row, 0])
        nearest[row] = min(fabs(_radial(&arm, &at)), arm.forearm * fabs(at.s[4]))
    return result


def free_vectors(
    const double[::1] packed, const double[:, :, ::1] X, const double[:, ::1] q, const double[::1] sense
):
    """Poses (N, 4, 4) and their joints (N, 6) to the plane vectors (N, 2) of J1 and J4 in a branch of senses (3,)."""
    cdef Arm arm = _arm(packed)
    cdef Angles at
    cdef double R[9]
    cdef double c1, s1, x, y
    cdef Py_ssize_t row
    vectors = np.empty((X.shape[0], 2), dtype=np.complex128)
    cdef double[:, ::1] parts = vectors.view(np.float64)
    for row in range(X.shape[0]):
        at = _angles(&arm, &q[row, 0])
        c1, s1 = at.c[0], at.s[0]
        _own_rotation(&arm, &X[row, 0, 0], R)
        x, y = X[row, 0, 3] - arm.a6x * R[0], X[row, 1, 3] - arm.a6x * R[3]
        parts[row, 0], parts[row, 1] = sense[0] * x, sense[0] * arm.sign[0] * y
        parts[row, 2] = -sense[2] * (at.s23 * (c1 * R[0] + s1 * R[3]) + at.c23 * R[6])
        parts[row, 3] = sense[2] * arm.sign[3] * (c1 * R[3] - s1 * R[0])
    return vectors


def configuration(const double[::1] packed, const double[:, ::1] q):
    """Joints (N, 6) to indices (N,) of the branch that leads back to them."""
    cdef Arm arm = _arm(packed)
    cdef Angles at
    cdef double bend
    cdef bint back
    cdef Py_ssize_t row
    result = np.empty(q.shape[0], dtype=np.int64)
    cdef long long[::1] index = result
    for row in range(q.shape[0]):
        at = _angles(&arm, &q[row, 0])
        back = _radial(&arm, &at) < -SHOULDER_SINGULAR
        bend = sin(q[row, 2] * arm.sign[2] + arm.bend) * (-1.0 if back else 1.0)
        index[row] = 4 * back + 2 * (bend < -SAME_ELBOW) + (sin(q[row, 4]) < -WRIST_SINGULAR)
    return result


def ik_branch(
    const double[::1] packed,
    const double[:, :, ::1] X,
    const double[:, ::1] senses,
    const double[:, ::1] reference,
    bint given_1,
    bint given_4,
):
    """Poses (N, 4, 4) to joints (N, 6) of a branch up to full turns, and whether they are reached (N,).

    `senses` (N or 1, 3) are those of shoulder, elbow and wrist; `reference` (N or 1, 6).
    """
    cdef Arm arm = _arm(packed)
    cdef Py_ssize_t row, count = X.shape[0]
    cdef bint one_sense = senses.shape[0] == 1, one_reference = reference.shape[0] == 1
    cdef const double *sense
    cdef const double *near
    joints, reached = np.empty((count, 6)), np.empty(count, dtype=np.bool_)
    cdef double[:, ::1] q = joints
    cdef unsigned char[::1] reachable = reached.view(np.uint8)
    for row in range(count):
        sense = &senses[0 if one_sense else row, 0]
        near = &reference[0 if one_reference else row, 0]
        reachable[row] = _solve(&arm, &X[row, 0, 0], sense, near, given_1, given_4, &q[row, 0])
    return joints, reached


def ik(const double[::1] packed, const double[:, :, ::1] X, const double[:, ::1] senses, const double[:, ::1] near):
    """Poses (N, 4, 4) to joints (N, 8, 6) of every branch, −π … π, and whether they are valid (N, 8).

    `senses` (8, 3) as of `ik_branch`; `near` (8 or 1, 6) are the references of the branches.
    """
    cdef Arm arm = _arm(packed)
    cdef Py_ssize_t row, branch, k
    cdef bint one = near.shape[0] == 1, reachable, stretched
    joints, found = np.empty((X.shape[0], 8, 6)), np.empty((X.shape[0], 8), dtype=np.bool_)
    cdef double[:, :, ::1] q = joints
    cdef unsigned char[:, ::1] valid = found.view(np.uint8)
    cdef double *at
    for row in range(X.shape[0]):
        for branch in range(8):
            at = &q[row, branch, 0]
            reachable = _solve(
                &arm, &X[row, 0, 0], &senses[branch, 0], &near[0 if one else branch, 0], False, False, at
            )
            for k in range(6):
                at[k] -= TURN * rint(at[k] / TURN)
            stretched = fabs(sin(at[2] * arm.sign[2] + arm.bend)) < SAME_ELBOW
            valid[row, branch] = reachable and not (stretched and (branch & 2))  # UP and DOWN are one
    return joints, found


cdef bint _solve(
    const Arm *arm,
    const double *X,
    const double *sense,
    const double *near,
    bint given_1,
    bint given_4,
    double *q,
) noexcept nogil:
    cdef double R[9]
    cdef double x, y, z, c1, s1, radial, radius, scale
    cdef int k
    cdef bint reachable
    _own_rotation(arm, X, R)
    x, y, z = X[3] - arm.a6x * R[0], X[7] - arm.a6x * R[3], X[11] - arm.a6x * R[6]
    radius = hypot(x, y)
    if given_1 or radius < SHOULDER_SINGULAR:
        q[0] = near[0] * arm.sign[0]
        c1, s1 = cos(q[0]), sin(q[0])
        radial = c1 * x + s1 * y
    else:
        q[0] = atan2(sense[0] * y, sense[0] * x)
        scale = sense[0] / radius
        c1, s1, radial = x * scale, y * scale, sense[0] * radius
    reachable = _solve_arm(arm, radial - arm.a2x, z - arm.height, sense[1], q)
    _solve_wrist(R, c1, s1, sense[2], near[3] * arm.sign[3], given_4, q)
    for k in range(6):
        q[k] *= arm.sign[k]
    return reachable


cdef inline bint _solve_arm(
    const Arm *arm, double forward, double height, double elbow, double *q
) noexcept nogil:
    cdef double upper = arm.a3z, lower = arm.forearm
    cdef double squares = upper * upper + lower * lower, product = 2.0 * upper * lower
    cdef double cosine = (forward * forward + height * height - squares) / product
    cdef double far = upper + lower + REACH_TOLERANCE, close = max(fabs(upper - lower) - REACH_TOLERANCE, 0.0)
    cdef double sine
    cdef bint reachable = cosine <= (far * far - squares) / product
    reachable = reachable and cosine >= (close * close - squares) / product
    cosine = min(max(cosine, -1.0), 1.0)
    sine = elbow * sqrt((1.0 - cosine) * (1.0 + cosine))
    q[1] = atan2(forward, height) - atan2(lower * sine, upper + lower * cosine)
    q[2] = atan2(sine, cosine) - arm.bend
    return reachable


cdef inline void _solve_wrist(
    const double *R, double c1, double s1, double sense, double near, bint given, double *q
) noexcept nogil:
    cdef double arm = q[1] + q[2]
    cdef double c23 = cos(arm), s23 = sin(arm)
    cdef double x0 = c1 * R[0] + s1 * R[3]
    cdef double w00 = c23 * x0 - s23 * R[6], w20 = s23 * x0 + c23 * R[6]
    cdef double w10 = c1 * R[3] - s1 * R[0], w11 = c1 * R[4] - s1 * R[1], w12 = c1 * R[5] - s1 * R[2]
    cdef double w21 = s23 * (c1 * R[1] + s1 * R[4]) + c23 * R[7]
    cdef double w22 = s23 * (c1 * R[2] + s1 * R[5]) + c23 * R[8]
    cdef double sine = hypot(w10, w20)
    cdef double c4, s4, scale
    if given or sine < WRIST_SINGULAR:
        q[3] = near
        c4, s4 = cos(near), sin(near)
    else:
        q[3] = atan2(sense * w10, -sense * w20)
        scale = sense / sine
        c4, s4 = -w20 * scale, w10 * scale
    q[4] = atan2(s4 * w10 - c4 * w20, w00)
    q[5] = atan2(-(c4 * w12 + s4 * w22), c4 * w11 + s4 * w21)
