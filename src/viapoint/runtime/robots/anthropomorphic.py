"""Six revolute joints, z y y x y x, with a spherical wrist: closed form (F ch. 3 and 4).

Batched over poses. Lengths in m, angles in rad. Joint ranges and limits are the model's, not the family's.
The formulas are here in numpy; `_spherical` has them compiled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from viapoint.runtime.core import chosen
from viapoint.runtime.robots.model import TURN, Bools, Complexes, Floats, IkSolutions, Ints, SingularityReport
from viapoint.runtime.rotations import make_pose, matrix_to_quaternion

CONFIGURATIONS = tuple(
    (shoulder, elbow, wrist)
    for shoulder in ("FRONT", "BACK")
    for elbow in ("UP", "DOWN")
    for wrist in ("POSITIVE", "NEGATIVE")
)

# Below this sin J5 the joints J4 and J6 cannot be told apart: the reference decides. The pose is missed by
# at most as much (rad), ten times less than the accuracy promised for FK∘IK.
WRIST_SINGULAR = 1e-10
# Below this distance (m) of the wrist point from axis 1 the reference decides J1; same reason.
SHOULDER_SINGULAR = 1e-10
# A pose this much (m) beyond the stretched or the folded arm is taken as on it: rounding of a pose that is.
REACH_TOLERANCE = 1e-10
# Two branches whose elbow angle is smaller than this (rad) are one solution: the square root of the relative
# rounding of the reach, which is all that an elbow angle near 0 or 180° is known by.
SAME_ELBOW = 1e-7
_CORE = "robots._spherical"
# numpy's own differs from the C library's in the last digit where it uses vector instructions; third
# derivatives on a millimetre of path would show it.
_ATAN2 = np.frompyfunc(math.atan2, 2, 1)
# A joint vector is reported singular when a measure is below this: about where speeds grow 10⁵-fold.
REPORT_SINGULAR = 1e-5

# (8, 3) per configuration: +1 for FRONT, UP, POSITIVE, −1 for the others.
_SENSES: Floats = np.array(
    [[1.0 - 2.0 * (i >> 2 & 1), 1.0 - 2.0 * (i >> 1 & 1), 1.0 - 2.0 * (i & 1)] for i in range(8)]
)
# (8, 6) per configuration: what its free joints are at a singular pose when nothing else is known.
_NEUTRAL: Floats = np.where(
    np.ascontiguousarray(_SENSES[:, [0, 0, 0, 2, 0, 0]]) < 0.0, [np.pi, 0.0, 0.0, np.pi, 0.0, 0.0], 0.0
)
Signs = Floats  # (N,) or scalar
Triple = tuple[Floats, Floats, Floats]


@dataclass(frozen=True, slots=True, eq=False)
class SphericalWristArm:
    """Parameters as in F table 3-1, in m.

    `sign` (6,) is −1 where a joint counts against the family's sense; `R_flange` (3, 3) turns the family's
    flange frame (X along axis 6) into the model's.
    """

    a1z: float
    a2x: float
    a2z: float
    a3z: float
    a4x: float
    a4z: float
    a5x: float
    a6x: float
    sign: Floats = field(default_factory=lambda: np.ones(6))
    R_flange: Floats = field(default_factory=lambda: np.eye(3))
    forearm: float = field(init=False)  # elbow to wrist point: b4x, F 4-7
    bend: float = field(init=False)  # J3 at which upper arm and forearm are in line, with opposite sign
    senses: Floats = field(init=False)  # (8, 3) per configuration: +1 or −1 of shoulder, elbow and wrist
    packed: Floats = field(init=False)  # (23,) all of it as `_spherical` reads it

    def __post_init__(self) -> None:
        along = self.a4x + self.a5x
        lengths = [self.a1z + self.a2z, self.a2x, self.a3z, along, self.a4z, self.a6x]
        elbow = math.hypot(along, self.a4z), math.atan2(along, self.a4z)
        object.__setattr__(self, "forearm", elbow[0])
        object.__setattr__(self, "bend", elbow[1])
        # Seen from behind, an elbow that is up bends the other way.
        senses = _SENSES * np.stack((np.ones(8), _SENSES[:, 0], np.full(8, self.sign[4])), axis=1)
        object.__setattr__(self, "senses", senses)
        packed = np.concatenate((lengths, elbow, self.sign, self.R_flange.ravel()))
        object.__setattr__(self, "packed", packed)

    @property
    def configurations(self) -> tuple[tuple[str, ...], ...]:
        return CONFIGURATIONS

    # --- forward -----------------------------------------------------------------------------------

    def fk(self, q: Floats) -> Floats:
        """(..., 6) → (..., 4, 4): R_arm·R_wrist (F 3-10), and the points of the arm's plane."""
        if (core := chosen(_CORE)) is not None:
            return np.asarray(core.fk(self.packed, _rows(q))).reshape(*q.shape[:-1], 4, 4)
        c, s, c23, s23 = self._trigonometry(q)
        wrist = _wrist_matrix(c, s)
        x = c23[..., None] * wrist[..., 0, :] + s23[..., None] * wrist[..., 2, :]
        y = wrist[..., 1, :]
        c1, s1 = c[..., 0, None], s[..., 0, None]
        R = np.empty_like(wrist)
        R[..., 0, :] = c1 * x - s1 * y
        R[..., 1, :] = s1 * x + c1 * y
        R[..., 2, :] = c23[..., None] * wrist[..., 2, :] - s23[..., None] * wrist[..., 0, :]
        flange = self._wrist_point(c, s, c23, s23) + self.a6x * R[..., :, 0]
        return make_pose(flange, R @ self.R_flange)

    def tcp(self, q: Floats, X_flange_tool: Floats) -> tuple[Floats, Floats]:
        """(N, 6), a tool (4, 4) → positions (N, 3) and quaternions (N, 4) of its TCP."""
        if (core := chosen(_CORE)) is not None:
            found: tuple[Floats, Floats] = core.tcp(self.packed, q, X_flange_tool)
            return found
        X = self.fk(q)
        R = X[:, :3, :3]
        return X[:, :3, 3] + R @ X_flange_tool[:3, 3], matrix_to_quaternion(R @ X_flange_tool[:3, :3])

    def jacobian(self, q: Floats) -> Floats:
        """(..., 6) → (..., 6, 6): for each joint its axis × (flange − a point of the axis), and its axis."""
        if (core := chosen(_CORE)) is not None:
            return np.asarray(core.jacobian(self.packed, _rows(q))).reshape(*q.shape[:-1], 6, 6)
        c, s, c23, s23 = self._trigonometry(q)
        zero = np.zeros_like(c23)
        c1, s1, c4, s4 = c[..., 0], s[..., 0], c[..., 3], s[..., 3]
        across = np.stack((-s1, c1, zero), axis=-1)
        along = np.stack((c1 * c23, s1 * c23, -s23), axis=-1)
        upright = np.stack((c1 * s23, s1 * s23, c23), axis=-1)
        axis5 = c4[..., None] * across + s4[..., None] * upright
        wrist = self._wrist_point(c, s, c23, s23)
        axis6 = _wrist_axis(c, s, along, across, upright)
        flange = wrist + self.a6x * axis6
        vertical = np.stack((zero, zero, zero + 1.0), axis=-1)
        axes = np.stack((vertical, across, across, along, axis5, axis6), axis=-1)
        origins = np.stack(
            (np.zeros_like(wrist), self._shoulder(c, s), self._elbow(c, s), wrist, wrist, wrist), axis=-1
        )
        linear = np.cross(axes, flange[..., None] - origins, axisa=-2, axisb=-2, axisc=-2)
        J: Floats = np.concatenate((linear, axes), axis=-2) * self.sign
        return J

    def link_points(self, q: Floats) -> Floats:
        """(..., 6) → (..., 7, 3): base, axis 2's height, shoulder, elbow, forearm, wrist point, flange."""
        if (core := chosen(_CORE)) is not None:
            return np.asarray(core.link_points(self.packed, _rows(q))).reshape(*q.shape[:-1], 7, 3)
        c, s, c23, s23 = self._trigonometry(q)
        elbow = self._elbow(c, s)
        radial = self.a4z * s23
        lift = np.stack((c[..., 0] * radial, s[..., 0] * radial, self.a4z * c23), axis=-1)
        base = np.zeros_like(elbow)
        column = base + np.array([0.0, 0.0, self.a1z + self.a2z])
        wrist = self._wrist_point(c, s, c23, s23)
        points = (base, column, self._shoulder(c, s), elbow, elbow + lift, wrist, self.fk(q)[..., :3, 3])
        return np.stack(points, axis=-2)

    def _trigonometry(self, q: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        angles = q * self.sign
        both = angles[..., 1] + angles[..., 2]
        return np.cos(angles), np.sin(angles), np.cos(both), np.sin(both)

    def _shoulder(self, c: Floats, s: Floats) -> Floats:
        height = np.full_like(c[..., 0], self.a1z + self.a2z)
        return np.stack((self.a2x * c[..., 0], self.a2x * s[..., 0], height), axis=-1)

    def _elbow(self, c: Floats, s: Floats) -> Floats:
        radial = self.a2x + self.a3z * s[..., 1]
        height = self.a1z + self.a2z + self.a3z * c[..., 1]
        return np.stack((radial * c[..., 0], radial * s[..., 0], height), axis=-1)

    def _radial(self, s: Floats, c23: Floats, s23: Floats) -> Floats:
        """(...) m: the wrist point's coordinate along the arm's plane, negative behind axis 1."""
        radial: Floats = self.a2x + self.a3z * s[..., 1] + (self.a4x + self.a5x) * c23 + self.a4z * s23
        return radial

    def _wrist_point(self, c: Floats, s: Floats, c23: Floats, s23: Floats) -> Floats:
        radial = self._radial(s, c23, s23)
        height = self.a1z + self.a2z + self.a3z * c[..., 1] - (self.a4x + self.a5x) * s23 + self.a4z * c23
        return np.stack((radial * c[..., 0], radial * s[..., 0], height), axis=-1)

    # --- inverse -----------------------------------------------------------------------------------

    def ik(self, X: Floats, reference: Floats | None = None) -> IkSolutions:
        """(..., 4, 4) → q (..., 8, 6), valid (..., 8); free joints as in the reference (6,).

        Without one J1 = 0 (BACK: π) and J4 = 0 (NEGATIVE: π), so that the branches stay distinct.
        """
        if (core := chosen(_CORE)) is not None:
            near = _NEUTRAL if reference is None else _rows(reference)
            q, valid = core.ik(self.packed, np.ascontiguousarray(X).reshape(-1, 4, 4), self.senses, near)
            return IkSolutions(q.reshape(*X.shape[:-2], 8, 6), valid.reshape(*X.shape[:-2], 8))
        poses = np.repeat(X.reshape(-1, 4, 4), 8, axis=0)
        branches = np.tile(np.arange(8), len(poses) // 8)
        free = _NEUTRAL[branches] if reference is None else reference
        q, valid = self.ik_branch(poses, branches, free)
        q -= TURN * np.rint(q / TURN)
        stretched = np.abs(np.sin(self._elbow_angle(q))) < SAME_ELBOW
        valid &= ~(stretched & (branches >> 1 & 1 == 1))  # UP and DOWN are one
        return IkSolutions(q.reshape(*X.shape[:-2], 8, 6), valid.reshape(*X.shape[:-2], 8))

    def ik_branch(
        self, X: Floats, configuration: int | Ints, reference: Floats, given: tuple[int, ...] = ()
    ) -> tuple[Floats, Bools]:
        """(N, 4, 4) → q (N, 6) of one branch up to full turns, free joints as in the reference; reachable.

        So are those `given`, J1 or J4: their senses then decide those of the shoulder and the wrist.
        """
        if (core := chosen(_CORE)) is not None:
            senses = self.senses[configuration].reshape(-1, 3)
            X = np.ascontiguousarray(X)
            q, inside = core.ik_branch(self.packed, X, senses, _rows(reference), 0 in given, 3 in given)
            return q, inside
        shoulder, elbow, wrist = self._signs(configuration)
        rows = self._rotation_rows(X)
        point = self._wrist_centre(X, rows)
        geometric = reference * self.sign
        q = np.empty((len(X), 6))
        c1, s1, radial = _solve_axis_1(point[0], point[1], shoulder, geometric[..., 0], q[:, 0], 0 in given)
        reachable = self._solve_arm(radial - self.a2x, point[2] - (self.a1z + self.a2z), elbow, q)
        _solve_wrist(rows, c1, s1, q, wrist, geometric[..., 3], 3 in given)
        q *= self.sign
        return q, reachable

    @property
    def free_joints(self) -> tuple[int, ...]:
        """J1 with the wrist point on axis 1, J4 with the wrist stretched."""
        return 0, 3

    def free_vectors(self, X: Floats, q: Floats, configuration: int) -> Complexes:
        """The wrist point seen along axis 1, m (F 4-3); the hand's axis along the forearm (F 4-19)."""
        if (core := chosen(_CORE)) is not None:
            senses, X = self.senses[configuration], np.ascontiguousarray(X)
            return np.asarray(core.free_vectors(self.packed, X, _rows(q), senses))
        shoulder, _, wrist = self._signs(configuration)
        rows = self._rotation_rows(X)
        x, y, _ = self._wrist_centre(X, rows)
        c, s, c23, s23 = self._trigonometry(q)
        (r00, _, _), (r10, _, _), (r20, _, _) = rows
        c1, s1 = c[:, 0], s[:, 0]
        lift = s23 * (c1 * r00 + s1 * r10) + c23 * r20
        side = c1 * r10 - s1 * r00
        vectors = (shoulder * (x + self.sign[0] * 1j * y), wrist * (-lift + self.sign[3] * 1j * side))
        return np.stack(vectors, axis=1)

    def beyond(self, configuration: int, joint: int) -> int:
        """Through a stretched wrist J5 changes sign; over axis 1 the bend of the elbow keeps its own."""
        return configuration ^ (1 if joint == 3 else 0b110)

    def _wrist_centre(self, X: Floats, rows: tuple[Triple, Triple, Triple]) -> Triple:
        """The wrist point's coordinates (N,), m (F 4-1)."""
        x, y, z = (X[:, i, 3] - self.a6x * rows[i][0] for i in range(3))
        return x, y, z

    def _signs(self, configuration: int | Ints) -> tuple[Signs, Signs, Signs]:
        """+1 or −1 of shoulder, elbow (sense of its bend in the arm's plane) and wrist (of sin J5)."""
        shoulder, elbow, wrist = self.senses[configuration].T
        return shoulder, elbow, wrist

    def _rotation_rows(self, X: Floats) -> tuple[Triple, Triple, Triple]:
        """The nine elements (N,) of the family's own flange rotation."""
        R = X[:, :3, :3]
        if not np.array_equal(self.R_flange, np.eye(3)):
            R = R @ self.R_flange.T
        first, second, third = ((R[:, i, 0], R[:, i, 1], R[:, i, 2]) for i in range(3))
        return first, second, third

    def _solve_arm(self, forward: Floats, height: Floats, elbow: Signs, q: Floats) -> Bools:
        """J2 and J3 into q from the wrist point seen from the shoulder (F 4-6 … 4-14); reachable (N,)."""
        upper, lower = self.a3z, self.forearm
        squares, product = upper * upper + lower * lower, 2.0 * upper * lower
        cosine = (forward * forward + height * height - squares) / product
        farthest = ((upper + lower + REACH_TOLERANCE) ** 2 - squares) / product
        nearest = (max(abs(upper - lower) - REACH_TOLERANCE, 0.0) ** 2 - squares) / product
        reachable: Bools = (cosine <= farthest) & (cosine >= nearest)
        cosine = np.clip(cosine, -1.0, 1.0)
        sine = elbow * np.sqrt((1.0 - cosine) * (1.0 + cosine))
        q[:, 1] = _atan2(forward, height) - _atan2(lower * sine, upper + lower * cosine)
        q[:, 2] = _atan2(sine, cosine) - self.bend
        return reachable

    # --- configuration -----------------------------------------------------------------------------

    def _elbow_angle(self, q: Floats) -> Floats:
        """(..., 6) → (...) bend between upper arm and forearm; 0 stretched."""
        angle: Floats = q[..., 2] * self.sign[2] + self.bend
        return angle

    def configuration(self, q: Floats) -> Ints:
        """(..., 6) → (...) index into CONFIGURATIONS. At a singularity: FRONT, UP, POSITIVE."""
        if (core := chosen(_CORE)) is not None:
            return np.asarray(core.configuration(self.packed, _rows(q))).reshape(q.shape[:-1])
        _, s, c23, s23 = self._trigonometry(q)
        back = self._radial(s, c23, s23) < -SHOULDER_SINGULAR
        bend = np.sin(self._elbow_angle(q)) * np.where(back, -1.0, 1.0)
        negative = np.sin(q[..., 4]) < -WRIST_SINGULAR
        index: Ints = 4 * back.astype(np.int64) + 2 * (bend < -SAME_ELBOW) + negative
        return index

    def free_joint(self, X: Floats, q: Floats) -> Bools:
        """(N, 4, 4) and its solution (N, 6) → (N,): rows whose pose leaves J1 or J4 free."""
        if (core := chosen(_CORE)) is not None:
            return np.asarray(core.free_joint(self.packed, _rows(q)))
        _, s, c23, s23 = self._trigonometry(q)
        free: Bools = np.abs(np.sin(q[:, 4])) < WRIST_SINGULAR
        free |= np.abs(self._radial(s, c23, s23)) < SHOULDER_SINGULAR
        return free

    def clearance(self, q: Floats) -> Floats:
        """(N, 6) → (N,) m: of the wrist point from axis 1, or of it from in line with the hand."""
        if (core := chosen(_CORE)) is not None:
            return np.asarray(core.clearance(self.packed, _rows(q)))
        _, s, c23, s23 = self._trigonometry(q)
        nearest: Floats = np.minimum(np.abs(self._radial(s, c23, s23)), self.forearm * np.abs(s[:, 4]))
        return nearest

    def singularity(self, q: Floats) -> SingularityReport:
        """Measures: WRIST |sin J5|, ELBOW |sin of its bend|, SHOULDER m from axis 1 to the wrist point."""
        _, s, c23, s23 = self._trigonometry(q)
        measures = {
            "WRIST": abs(float(s[..., 4])),
            "ELBOW": abs(math.sin(self._elbow_angle(q))),
            "SHOULDER": abs(float(self._radial(s, c23, s23))),
        }
        return SingularityReport(measures, tuple(name for name, m in measures.items() if m < REPORT_SINGULAR))


def _atan2(y: Floats, x: Floats) -> Floats:
    """As numpy's, to the last digit on every machine: the compiled module's."""
    return np.asarray(_ATAN2(y, x), dtype=np.float64)


def _rows(q: Floats) -> Floats:
    """(..., 6) → (N, 6), contiguous."""
    return np.ascontiguousarray(q).reshape(-1, 6)


def _wrist_matrix(c: Floats, s: Floats) -> Floats:
    """Rx(J4)·Ry(J5)·Rx(J6) (F 4-20)."""
    c4, c5, c6, s4, s5, s6 = c[..., 3], c[..., 4], c[..., 5], s[..., 3], s[..., 4], s[..., 5]
    W = np.empty((*c4.shape, 3, 3))
    W[..., 0, 0], W[..., 0, 1], W[..., 0, 2] = c5, s5 * s6, s5 * c6
    W[..., 1, 0], W[..., 1, 1], W[..., 1, 2] = s4 * s5, c4 * c6 - s4 * c5 * s6, -c4 * s6 - s4 * c5 * c6
    W[..., 2, 0], W[..., 2, 1], W[..., 2, 2] = -c4 * s5, s4 * c6 + c4 * c5 * s6, c4 * c5 * c6 - s4 * s6
    return W


def _wrist_axis(c: Floats, s: Floats, along: Floats, across: Floats, upright: Floats) -> Floats:
    """(..., 3) direction of axis 6: the first column of R_arm·R_wrist."""
    c5, s5 = c[..., 4, None], s[..., 4, None]
    axis: Floats = c5 * along + s5 * (s[..., 3, None] * across - c[..., 3, None] * upright)
    return axis


def _solve_axis_1(
    x: Floats, y: Floats, shoulder: Signs, reference: Floats, q1: Floats, given: bool
) -> tuple[Floats, Floats, Floats]:
    """J1 into q1 (F 4-3); its cosine and sine, and the wrist point's coordinate in the arm's plane."""
    radius = np.hypot(x, y)
    singular = (radius < SHOULDER_SINGULAR) | given
    q1[:] = _atan2(shoulder * y, shoulder * x)
    if not singular.any():
        scale = shoulder / radius
        return x * scale, y * scale, shoulder * radius
    np.copyto(q1, reference, where=singular)
    c1, s1 = np.cos(q1), np.sin(q1)
    return c1, s1, c1 * x + s1 * y


def _solve_wrist(
    rows: tuple[Triple, Triple, Triple],
    c1: Floats,
    s1: Floats,
    q: Floats,
    sense: Signs,
    reference: Floats,
    given: bool,
) -> None:
    """J4, J5, J6 into q from R_wrist = R_armᵀ·R (F 4-19 … 4-25).

    J4 comes from the first column; J5 and J6 from what is left when J4 is taken out, so that the pose holds
    whatever J4 is at a singularity, and no digit is lost near one (F 4-21 loses half of them).
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = rows
    arm = q[:, 1] + q[:, 2]
    c23, s23 = np.cos(arm), np.sin(arm)
    x0 = c1 * r00 + s1 * r10
    w00, w20 = c23 * x0 - s23 * r20, s23 * x0 + c23 * r20
    w10, w11, w12 = c1 * r10 - s1 * r00, c1 * r11 - s1 * r01, c1 * r12 - s1 * r02
    w21 = s23 * (c1 * r01 + s1 * r11) + c23 * r21
    w22 = s23 * (c1 * r02 + s1 * r12) + c23 * r22
    sine = np.hypot(w10, w20)
    singular = (sine < WRIST_SINGULAR) | given
    q[:, 3] = _atan2(sense * w10, -sense * w20)
    if singular.any():
        np.copyto(q[:, 3], reference, where=singular)
        c4, s4 = np.cos(q[:, 3]), np.sin(q[:, 3])
    else:
        scale = sense / sine
        c4, s4 = -w20 * scale, w10 * scale
    q[:, 4] = _atan2(s4 * w10 - c4 * w20, w00)
    q[:, 5] = _atan2(-(c4 * w12 + s4 * w22), c4 * w11 + s4 * w21)
