"""The dynamic parameters of an arm from how it moved and the torques measured meanwhile (F ch. 8). Pure.

Torques are linear in masses, first moments, inertias and friction, so that least squares find them; but only
the combinations that torques depend on, the base parameters. What the motion does not show is refused.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.robots.dynamics import STANDARD_GRAVITY, Regressor

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.recording import Recording
    from viapoint.runtime.robots import Robot

LARGEST_CONDITION: Final = 1000.0
"""Of the equations with columns of length 1: how much more errors of torques count in parameters."""

STANDS: Final = 1e-3
"""Share of its top speed below which a joint stands: what friction does then, no sign of a speed says."""

_INDEPENDENT: Final = 1e-9
"""A column of length 1 that the ones before leave less of is a combination of them; others are above 0.1."""

_PROBES: Final = 200
"""Random states that show which parameters torques can depend on at all: each gives n equations."""

_EXACT: Final = 1e-9
"""Share of the torques' size that a residual is taken for at least: torques of a model have none."""

_AT_ONCE: Final = 1024

_OF_A_LINK: Final = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
_OF_A_JOINT: Final = ("Ia", "Fc", "Fv")


class IdentificationError(ValueError):
    """Measurements that do not determine the parameters; the sentence says why, and what to do."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionSamples:
    """What was measured: joints, speeds, accelerations (N, n) in rad or m and s, torques (N, n) in N·m or N.

    `base` (N, 3) m/s² accelerates the base, where a track carries it.
    """

    joints: Floats
    speeds: Floats
    accelerations: Floats
    torques: Floats
    base: Floats | None = None

    @classmethod
    def of(cls, recording: Recording, cell: Cell | None = None) -> MotionSamples:
        """Of a recording, speeds and accelerations by backward differences over its tick.

        The `cell` says which auxiliary axis carries the robot. Raises IdentificationError for a recording
        without torques, and where the robot moved with different tools: they would be one link.
        """
        trace, tick = recording.trace, recording.info.tick_s
        if trace.torque.shape[1] == 0:
            raise IdentificationError("the recording has no torques: the masses of its robot are not known")
        carrier = None if cell is None else AuxiliaryAxes.of(cell).carrier
        base = np.zeros((len(trace), 3))
        if carrier is not None:
            base[2:, 0] = np.diff(trace.auxiliary[:, carrier], n=2) / tick**2
        samples = cls.differenced(trace.actual, trace.torque, tick, base)
        number = trace.first_tick + np.arange(2, len(trace))
        told = [event.tick for event in recording.events_of("reference")]  # there the joints jump
        kept = ~np.isin(number, [at + k for at in told for k in (0, 1, 2)])
        changes = recording.events_of("tool")
        tool = np.searchsorted([event.tick for event in changes], number, side="left")
        counted = set(tool[kept & samples.moving].tolist())
        carried = {str(changes[k - 1].data["index"]) if k else "0" for k in counted}
        if len(carried) > 1:
            names = " and ".join(f"T{index}" for index in sorted(carried))
            raise IdentificationError(f"the robot moved with tools {names}: record a motion with one")
        return samples[kept]

    @classmethod
    def differenced(cls, q: Floats, torque: Floats, tick: float, base: Floats | None = None) -> MotionSamples:
        """Of joints and torques (N, n) at every `tick` s: N − 2 samples, by backward differences."""
        first, second = np.diff(q[1:], axis=0) / tick, np.diff(q, n=2, axis=0) / tick**2
        return cls(q[2:], first, second, torque[2:], None if base is None else base[2:])

    def __len__(self) -> int:
        return len(self.joints)

    def __getitem__(self, rows: slice | Bools) -> MotionSamples:
        base = None if self.base is None else self.base[rows]
        q, v, a, torque = self.joints, self.speeds, self.accelerations, self.torques
        return MotionSamples(q[rows], v[rows], a[rows], torque[rows], base)

    @property
    def moving(self) -> Bools:
        """(N,) whether any joint moves."""
        return np.asarray((self.speeds != 0.0).any(axis=1))


class _Model:
    """The torques of a robot as linear functions of all parameters (p,): the links', then the joints'."""

    def __init__(self, robot: Robot, gravity: Floats) -> None:
        self.robot = robot
        self.n = robot.joint_count
        self._regressor = Regressor(robot, gravity)
        numbers = range(1, self.n + 1)
        self.names = tuple(
            [f"{name}{i}" for i in numbers for name in _OF_A_LINK]
            + [f"{name}{i}" for name in _OF_A_JOINT for i in numbers]
        )

    def rows(self, q: Floats, v: Floats, a: Floats, base: Floats | None) -> Floats:
        """(N, n, p) at joints, speeds, accelerations (N, n)."""
        links = self._regressor.rows(q, v, a, np.zeros((len(q), 3)) if base is None else base)
        each = [part[:, :, None] * np.eye(self.n) for part in (a, np.sign(v), v)]
        return np.concatenate((links, *each), axis=2)

    def grouped(self) -> tuple[tuple[int, ...], Floats]:
        """The parameters that lead the base parameters, and how these are made of all: (b,), (b, p).

        Equations at random states are reduced column by column (QR): a column that depends on those before
        is added to them. Where gravity cannot show a parameter, or no motion, it is in none.
        """
        rng, limits = np.random.default_rng(0), self.robot.limits
        q, v, a = (
            rng.uniform(low, high, (_PROBES, self.n))
            for low, high in (
                (limits.lower, limits.upper),
                (-limits.speed, limits.speed),
                (-limits.acceleration, limits.acceleration),
            )
        )
        W = self.rows(q, v, a, None).reshape(-1, len(self.names))
        length = np.linalg.norm(W, axis=0)
        length[length <= _INDEPENDENT * length.max()] = np.inf  # it has no influence at all
        R = _triangle([W / length])
        leading = np.flatnonzero(np.abs(np.diag(R)) > _INDEPENDENT)
        among, *_ = np.linalg.lstsq(W[:, leading] / length[leading], W, rcond=None)
        combined = among / length[leading, None]
        combined[np.abs(combined) < _INDEPENDENT] = 0.0
        return tuple(leading.tolist()), combined


@dataclass(frozen=True, slots=True, eq=False)
class DynamicsIdentification:
    """Base parameters `values` (b,) with one standard deviation each, `uncertainty` (b,), in SI units.

    `names` (b,) are of the parameter that leads each; `grouping` (b, p) says how it is made of all
    `parameters` (p,): value = grouping · parameters. `residuals` (n,) is the root mean square of what is left
    of the torques of each joint, `sizes` (n,) that of the torques. Deviations hold for errors of the torques
    that are independent from sample to sample.
    """

    names: tuple[str, ...]
    values: Floats
    uncertainty: Floats
    parameters: tuple[str, ...]
    grouping: Floats
    residuals: Floats
    sizes: Floats
    condition: float
    equations: int
    _model: _Model = field(repr=False)
    _leading: tuple[int, ...] = field(repr=False)

    def torques(self, q: Floats, speed: Floats, second: Floats, base: Floats | None = None) -> Floats:
        """(N, n) N·m or N predicted at joints, speeds, accelerations (N, n); no friction at speed 0."""
        found, lead = [], list(self._leading)
        for k in range(0, len(q), _AT_ONCE):
            part = slice(k, k + _AT_ONCE)
            pushed = None if base is None else base[part]
            found.append(
                self._model.rows(q[part], speed[part], second[part], pushed)[:, :, lead] @ self.values
            )
        return np.concatenate(found) if found else np.zeros_like(q)

    def left(self, samples: MotionSamples) -> Floats:
        """(n,): root mean square of measured minus predicted torques, of each joint while it moves.

        NaN for a joint that stands. Raises IdentificationError for samples that are none.
        """
        used = _checked(self._model.robot, samples)
        predicted = self.torques(samples.joints, samples.speeds, samples.accelerations, samples.base)
        square = np.where(used, samples.torques - predicted, 0.0) ** 2
        counts = used.sum(axis=0)
        return np.sqrt(np.where(counts > 0, square.sum(axis=0) / np.maximum(counts, 1), np.nan))


def _checked(robot: Robot, samples: MotionSamples) -> Bools:
    """(N, n): in which samples each joint moves. Raises IdentificationError."""
    n = robot.joint_count
    for name in ("joints", "speeds", "accelerations", "torques"):
        part = getattr(samples, name)
        if part.ndim != 2 or part.shape[1] != n or len(part) != len(samples.joints):
            raise IdentificationError(f"{name} must be samples of {n} joints, not of shape {part.shape}")
        if not np.isfinite(part).all():
            row = int(np.argmin(np.isfinite(part).all(axis=1)))
            raise IdentificationError(f"{name} of sample {row} are not all finite numbers")
    if samples.base is not None and not (
        samples.base.shape == (len(samples), 3) and np.isfinite(samples.base).all()
    ):
        raise IdentificationError("base must be three finite numbers for each sample")
    return np.asarray(np.abs(samples.speeds) > STANDS * robot.limits.speed)


def identify_dynamics(
    robot: Robot, samples: MotionSamples, *, gravity: Floats | None = None
) -> DynamicsIdentification:
    """Base parameters of a robot's links, motor inertias and friction, by weighted least squares.

    `gravity` (3,) m/s² is that of the base, straight down where it is not given. A joint counts in the
    samples in which it moves. What the flange carried belongs to the last link. Raises IdentificationError
    for samples that are not finite, too few, or of a motion that does not tell the parameters apart.
    """
    used = _checked(robot, samples)
    model = _Model(robot, np.array([0.0, 0.0, -STANDARD_GRAVITY]) if gravity is None else gravity)
    leading, grouping = model.grouped()
    names = tuple(model.names[k] for k in leading)
    counts, b = used.sum(axis=0), len(leading)
    if still := [f"J{i + 1}" for i in range(model.n) if counts[i] == 0]:
        raise IdentificationError(f"{', '.join(still)} never move{'s' * (len(still) == 1)}: move every joint")
    if int(counts.sum()) < 2 * b:
        raise IdentificationError(
            f"{counts.sum()} equations are too few for {b} parameters: at least {2 * b} are needed, "
            "one for each joint in each sample in which it moves"
        )
    triangles = _triangles(model, samples, used, list(leading))
    sizes = np.sqrt(np.array([float(R[:, -1] @ R[:, -1]) for R in triangles]) / counts)
    if not sizes.any():
        raise IdentificationError("all torques are 0: nothing was measured")
    least = _EXACT * sizes.max()
    x, _, _ = _solved(triangles, np.maximum(sizes, least), names)
    share = 1.0 - b / counts.sum()  # of the equations that are left to judge by
    rms = np.sqrt(np.array([_square(R, x) for R in triangles]) / counts)
    x, deviation, condition = _solved(triangles, np.maximum(rms / np.sqrt(share), least), names)
    rms = np.sqrt(np.array([_square(R, x) for R in triangles]) / counts)
    return DynamicsIdentification(
        names=names,
        values=x,
        uncertainty=deviation,
        parameters=model.names,
        grouping=grouping,
        residuals=rms,
        sizes=sizes,
        condition=condition,
        equations=int(counts.sum()),
        _model=model,
        _leading=leading,
    )


def _triangles(model: _Model, samples: MotionSamples, used: Bools, leading: list[int]) -> list[Floats]:
    """Of each joint the equations with their right side (·, b + 1), reduced to a triangle piece by piece."""
    result: list[Floats] = [np.zeros((0, len(leading) + 1)) for _ in range(model.n)]
    for k in range(0, len(samples), _AT_ONCE):
        one = samples[k : k + _AT_ONCE]
        rows = model.rows(one.joints, one.speeds, one.accelerations, one.base)[:, :, leading]
        for i in range(model.n):
            moves = used[k : k + _AT_ONCE, i]
            more = np.concatenate((rows[moves, i], one.torques[moves, i, None]), axis=1)
            result[i] = _triangle([result[i], more])
    return result


def _triangle(equations: list[Floats]) -> Floats:
    """What least squares need of equations: the triangle of their QR."""
    return np.asarray(np.linalg.qr(np.concatenate(equations), mode="r"), dtype=np.float64)


def _square(R: Floats, x: Floats) -> float:
    left = R @ np.append(x, -1.0)
    return float(left @ left)


def _solved(
    triangles: list[Floats], deviations: Floats, names: tuple[str, ...]
) -> tuple[Floats, Floats, float]:
    """Parameters, their standard deviations and the condition, with joints weighed by their deviations."""
    weighed = [R / deviation for R, deviation in zip(triangles, deviations, strict=True)]
    R = _triangle(weighed)
    A, right = R[:, :-1], R[:, -1]
    length = np.linalg.norm(A, axis=0)
    length[length == 0.0] = 1.0
    U, S, Vt = np.linalg.svd(A / length, full_matrices=False)
    if S[-1] * LARGEST_CONDITION < S[0]:
        alike = [names[k] for k in np.argsort(-np.abs(Vt[-1]), kind="stable") if abs(Vt[-1][k]) > 0.2]
        condition = f"{S[0] / S[-1]:.3g}" if S[-1] > 1e-12 * S[0] else "infinite"
        raise IdentificationError(
            f"the motion does not tell {', '.join(alike)} apart (condition {condition}, at most "
            f"{LARGEST_CONDITION:g}): move those joints in more poses, with other speeds and accelerations"
        )
    inverse = Vt.T / S
    x = inverse @ (U.T @ right) / length
    return x, np.sqrt((inverse**2).sum(axis=1)) / length, float(S[0] / S[-1])
