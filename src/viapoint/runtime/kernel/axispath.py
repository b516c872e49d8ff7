"""The path as the axes see it: joints, TCP length and TCP angle as smooth functions of the path parameter.

Geometry gives poses; closed-form inverse kinematics turns them into joints. Both are sampled once,
when a piece of path is finished, and kept as Chebyshev cells (`fitting`): the time law differentiates
them, the generator evaluates them per tick, and the set points that leave are the very functions that
were verified. Not here: time, limits, actions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np

from viapoint.runtime.kernel import chebyshev
from viapoint.runtime.kernel.auxiliary import NO_AXES, AuxiliaryAxes
from viapoint.runtime.kernel.chebyshev import Cells, Tables
from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.kernel.fitting import JOINT_TOLERANCE, Fitted, fit, joint_jump
from viapoint.runtime.kernel.joining import Joined, Joiner
from viapoint.runtime.kernel.sampling import NearSingular
from viapoint.runtime.kernel.spans import Division, Span, divide, whole
from viapoint.runtime.kernel.speeds import rate_bounds, speed_ratio
from viapoint.runtime.kernel.stretch import Stretch
from viapoint.runtime.memo import Memo
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot

_STANDING: Final = 1e-6
"""m of path parameter in which the path stands still, where it was cut off: enough to tell places apart."""


Inspector = Callable[[Sequence[Stretch], Joined, Floats, Floats], tuple[int, PlanningError | None]]
"""Told of stretches before they are path: joined, with s (S + 1,) where they begin and lengths (C, 4)
travelled before each cell. How many may be laid, and why the next one may not, if any."""


class Laid(NamedTuple):
    """Stretches put onto the path: s where each begins and the last one ends, and why the next one is not."""

    places: list[float]
    fault: PlanningError | None


class AxisPath:
    """Axis functions of the path, growing piece by piece; the parameter s runs on from piece to piece.

    Columns: the robot's n joints; k auxiliary axes; TCP length (m) and TCP angle (rad) as far as path
    limits apply to them (not along joint moves); both again as travelled.
    """

    def __init__(self, robot: Robot, q_start: Floats, auxiliary: AuxiliaryAxes = NO_AXES) -> None:
        self.robot = robot
        self.n = len(q_start)
        self.driven = self.n + len(auxiliary)
        self.length = 0.0
        self.beside: Floats | None = None
        """(4,): what the last columns have beside this path, of other paths that were travelled before."""
        self.inspect: Inspector | None = None
        self._joiner = Joiner(robot, auxiliary)
        self._known: Memo[tuple[Joined, Sequence[Stretch]]] = Memo()  # kept so that no id comes again
        self._cells = Cells(self.driven + 4)
        self._last = np.concatenate((q_start, auxiliary.start, np.zeros(4)))

    @property
    def q_end(self) -> Floats:
        """Joints (n,) at the end."""
        return self._last[: self.n].copy()

    @property
    def e_end(self) -> Floats:
        """Auxiliary axes (k,) at the end."""
        return self._last[self.n : self.driven].copy()

    @property
    def travelled(self) -> float:
        """TCP length at the end, m."""
        return float(self._last[-2])

    def extend(self, stretches: Sequence[Stretch], configuration: int, *, at_rest: bool) -> Laid:
        """Compile pieces that follow each other in one configuration, in one batch, onto the end.

        The end is passed `at_rest` or without a stop. Raises NearSingular where a batch is too much to ask,
        PlanningError where a pose is out of reach; then nothing is laid.
        """
        q = self._last[: self.n]
        key = configuration, at_rest, q.tobytes(), *(stretch.key for stretch in stretches)
        joined, _ = self._known.get(
            key, lambda: (self._ordinary(q, stretches, configuration, at_rest), stretches)
        )
        return self._lay(stretches, joined)

    def _ordinary(self, q: Floats, stretches: Sequence[Stretch], configuration: int, at_rest: bool) -> Joined:
        fitted = self._fit(stretches, [whole(stretch, configuration) for stretch in stretches])
        owner = np.array([cell.span for cell in fitted.cells])
        return self._joiner.join(q, stretches, fitted, owner, at_rest=at_rest)

    def follow(
        self,
        stretch: Stretch,
        configuration: int,
        rest: tuple[bool, bool],
        tolerance: float = JOINT_TOLERANCE,
    ) -> Division:
        """Compile one piece onto the end, through and past singular poses; entered in a configuration.

        `rest` says whether the path stands still at its begin and its end. Raises PlanningError naming the
        line: pose out of reach, joint out of range, or joints that cannot follow continuously.
        """
        plain = whole(stretch, configuration)
        division = Division([plain], configuration, False, False)
        try:
            fitted = self._fit([stretch], [plain], tolerance=tolerance)
        except NearSingular:
            division = divide(self.robot, stretch, configuration, self.q_end, rest)
            fitted = self._patiently(stretch, division.spans, tolerance)
        owner = np.zeros(len(fitted.cells), dtype=np.int64)
        q = self._last[: self.n]
        laid = self._lay([stretch], self._joiner.join(q, [stretch], fitted, owner, at_rest=rest[0]))
        if laid.fault is not None:
            raise laid.fault
        return division

    def _fit(
        self,
        stretches: Sequence[Stretch],
        spans: Sequence[Span],
        *,
        patient: bool = False,
        tolerance: float = JOINT_TOLERANCE,
    ) -> Fitted:
        return fit(self.robot, stretches, spans, self._last[: self.n], patient=patient, tolerance=tolerance)

    def _patiently(self, stretch: Stretch, spans: Sequence[Span], tolerance: float) -> Fitted:
        try:
            return self._fit([stretch] * len(spans), spans, patient=True, tolerance=tolerance)
        except NearSingular:
            raise joint_jump(stretch, 0.0) from None

    def _lay(self, stretches: Sequence[Stretch], joined: Joined) -> Laid:
        begins = np.cumsum(np.concatenate(([self.length], joined.lengths)))
        travelled = np.cumsum(np.concatenate((self._last[None, self.driven :], joined.rises)), axis=0)
        count, fault = len(joined.lengths), None
        if self.inspect is not None:
            count, fault = self.inspect(stretches, joined, begins, travelled[:-1])
        if fault is None and joined.fault is not None:
            fault = joined.fault()
        if count:
            cells = joined.bounds[count]
            starts = joined.starts[:cells] + begins[joined.owner[:cells]]
            self._cells.append(starts, joined.widths[:cells], joined.coefficients[:cells], travelled[:cells])
            self.length = float(begins[count])
            self._last = np.concatenate((joined.ends[count - 1], travelled[cells]))
        return Laid(begins[: count + 1].tolist(), fault)

    def hold(self, s: float) -> None:
        """What lies behind s is not travelled: the path goes on from the place s, behind its present end."""
        place = self._cells.evaluate(np.array([s]))[0]
        coeffs = np.zeros((1, chebyshev.DEGREE + 1, place.shape[1]))
        coeffs[0, 0] = place[0]
        self._cells.append(np.array([self.length]), np.array([_STANDING]), coeffs)
        self.length += _STANDING
        self._last = place[0].copy()

    def rebase(self, q: Floats) -> None:
        """What is put onto the end from now on begins at joints q (n,)."""
        self._last = np.concatenate((q, self._last[self.n :]))

    def values(self, s: Floats) -> Floats:
        """Limited axes (N, n + k + 2) at s (N,)."""
        if self.length == 0.0:
            return self.everything(s)[:, :-2]
        return self._cells.evaluate(s, columns=(0, self.driven + 2))[0]

    def derivatives(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        """First, second and third derivatives of the limited axes, each (N, n + k + 2)."""
        first, second, third = self._cells.evaluate(s, (1, 2, 3), (0, self.driven + 2))
        return first, second, third

    def everything(self, s: Floats) -> Floats:
        """All columns (N, n + k + 4) at s (N,): what the generator sends and reports."""
        if self.length == 0.0:  # no path yet: the robot stands
            columns = np.tile(self._last, (len(s), 1))
        else:
            columns = self._cells.evaluate(s)[0]
        if self.beside is not None:
            columns[:, -4:] += self.beside
        return columns

    def travelled_at(self, s: float) -> float:
        """TCP length at s as in `everything`, m."""
        if self.length == 0.0:
            return float(self.everything(np.array([s]))[0, -2])
        length = float(
            self._cells.evaluate(np.array([s]), columns=(self.driven + 2, self.driven + 3))[0][0, 0]
        )
        return length if self.beside is None else length + float(self.beside[-2])

    def standing(self, s: float) -> Floats:
        """All columns (n + k + 4,) where the path stands at s, as what comes next begins."""
        if s < self.length:
            return np.asarray(self.everything(np.array([s]))[0])
        columns = self._last.copy()
        if self.beside is not None:
            columns[-4:] += self.beside
        return columns

    def rates(self, s: Floats) -> Floats:
        """TCP length and angle per path parameter, (N, 2)."""
        return self._cells.evaluate(s, (1,), (self.driven + 2, self.driven + 4))[0]

    def rate_bounds(self, s: Floats, begins: Floats, rules: Floats) -> Floats:
        """As `speeds.rate_bounds`."""
        return rate_bounds(self._cells.tables, s, begins, rules)

    def speed_ratio(self, before: float, s: Floats, begins: Floats, rules: Floats, tick: float) -> float:
        """As `speeds.speed_ratio`."""
        return speed_ratio(self._cells.tables, before, s, begins, rules, tick)

    def between(self, s_from: float, s_to: float) -> Tables | None:
        """The cells from s_from to s_to; None if one lies across an end."""
        return self._cells.between(s_from, s_to)

    def forget(self, s: float) -> None:
        """Drop what lies wholly before s: the robot will not come back there."""
        self._cells.forget(s)
