"""What is added to the set points between the planned path and the drives, tick by tick.

One stage of a tick: rows of the planned path go in, rows as sent come out. Corrections displace the
TCP; the inverse kinematics takes the displaced pose back to joints, in the configuration of the planned
ones; the joint filter comes last. Where nothing is added rows pass untouched. What cannot be sent is a
failure: the axes then brake by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.failure import ExecutionError
from viapoint.runtime.kernel.letdown import braking, stopping
from viapoint.runtime.kernel.motion import Rows
from viapoint.runtime.kernel.offsets import Correction, Place, Sensor
from viapoint.runtime.kernel.refusals import FOLLOWING, HINTS, SLACK, Obstacle, exceeded, leaves_range
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.kernel.smoothing import Smoother, gaussian
from viapoint.runtime.kernel.tracker import Phase, Tracker
from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.robots import JointLimits
from viapoint.runtime.signals import CorrectionScript, Scenario, SignalWorld

_HISTORY: Final = 3
"""Rows behind the present one that differences up to the jerk need."""


@dataclass(frozen=True, slots=True)
class Sent(Rows):
    """Rows as they are sent, and how far the TCP is from where the path has it, (N,) m."""

    deviation: Floats


@dataclass(frozen=True, slots=True)
class Stand:
    """What the robot is doing while rows are sent: tool, source line, and whether it is being stopped."""

    tool: int
    line: int
    stopping: bool
    held: bool
    """Whether anything keeps the path from going on."""
    factor: float
    """Acceleration and jerk limits are taken so many times: more than 1 in an emergency stop."""


def with_reserve(cell: Cell, scenario: Scenario | None, sensors: Sequence[Sensor]) -> Cell:
    """The cell that motions are timed for: where something will be added, a share of the joints' limits is
    kept free for it."""
    if not sensors and not (scenario is not None and scenario.corrections):
        return cell
    limits, share = cell.robot.limits, 1.0 - cell.tracking_reserve
    reserved = JointLimits(
        limits.lower, limits.upper, limits.speed * share, limits.acceleration * share, limits.jerk * share
    )
    return replace(cell, robot=cell.robot.with_limits(reserved))


class Feed:
    """The stage. `send` may be asked for more rows than are sent; `commit` says how many were.

    `failure` is what made it give up the path; then only `let_down` has rows.
    """

    def __init__(
        self, cell: Cell, route: Route, start: Floats, world: SignalWorld, sensors: Sequence[Sensor]
    ) -> None:
        """`start` (m,): the axis functions in which the robot stands."""
        self.failure: ExecutionError | None = None
        self.down = False
        """After a failure: the axes have come to rest."""
        self.joint_deviation: Floats = np.zeros(cell.robot.joint_count)
        """Largest difference between joints as sent and those of the path, so far (n,)."""
        self.deviation = 0.0
        """Largest distance of the TCP from where the path has it, m."""
        scripts = world.scenario.corrections if world.scenario is not None else ()
        self._cell = cell
        self._route = route
        sources: list[CorrectionScript | Sensor] = [*scripts, *sensors]
        self._corrections = [Correction(source, cell) for source in sources]
        self.tracker = Tracker(cell, world.scenario, world.parts)
        self._along: Floats = np.zeros(3)  # direction of the belt that is followed
        self._by_tick = bool(sensors)
        self._framed = any(correction.frame == "frame" for correction in self._corrections)
        self._settling = cell.filter.ticks
        self._smoother = Smoother(gaussian(cell.filter.ticks, cell.filter.sigma), np.append(start, 0.0))
        others = AuxiliaryAxes.of(cell).limits
        joints = cell.robot.limits
        self._limits = [
            np.concatenate(pair)
            for pair in (
                (joints.speed, others.speed),
                (joints.acceleration, others.acceleration),
                (joints.jerk, others.jerk),
            )
        ]
        self._past: Floats = np.tile(start, (_HISTORY, 1))  # rows before the filter, as committed
        self._rows = self._past
        self._factors: tuple[float, ...] = (1.0,) * _HISTORY  # of the limits of those rows
        self._factor = 1.0
        self._planned = start  # the path's own row, as committed
        self._path_rows: Floats = start[None]
        self._rested: int | None = None  # ticks since the path has come to rest, while the filter settles
        self._rest: int | None = None
        self._braking: Floats | None = None
        self._joint_steps: Floats = np.zeros((0, cell.robot.joint_count))
        self._deviations: Floats = np.zeros(0)

    @property
    def adds(self) -> bool:
        """Whether anything is ever added to the path."""
        return self.alters or bool(self.tracker.belts)

    @property
    def alters(self) -> bool:
        """Whether what is sent may differ from the path now."""
        return self.displaces or self._settling > 0

    @property
    def displaces(self) -> bool:
        """Whether there are corrections, or a belt: the robot may move although its path stands."""
        return bool(self._corrections) or self.tracker.phase is not Phase.OFF

    @property
    def leads_off(self) -> bool:
        """Whether set points are meant to be off the path: by corrections, or the filter."""
        return bool(self._corrections) or self._settling > 0

    @property
    def filters(self) -> bool:
        """Whether set points are later than the path."""
        return self._settling > 0

    @property
    def settling(self) -> bool:
        """The path is at rest, the set points are not yet."""
        return self._rested is not None

    def send(self, rows: Rows, first: int, count: int, stand: Stand) -> Sent | None:
        """At most `count` ticks from `first` on as they are to be sent; None with `failure` set if the first
        of them cannot be."""
        if self._by_tick:
            rows, count = _cut(rows, 1), 1
        rows, self._factor = self._padded(rows, count), stand.factor
        self._path_rows = rows.columns
        if not self.displaces:
            self._rows = np.concatenate((self._past, rows.columns))
            self._deviations, self._joint_steps = self._nothing(len(rows.s))
        else:
            found = self._displaced(rows, first, stand)
            if found is None:
                return None
            rows = found
        if self._settling == 0:
            return Sent(rows.s, rows.columns, rows.arrived, self._deviations[: len(rows.s)])
        return self._filtered(rows, stand.tool)

    def commit(self, count: int) -> None:
        """The first so many rows of the last `send` went out."""
        self.joint_deviation = np.maximum(
            self.joint_deviation, self._joint_steps[:count].max(axis=0, initial=0.0)
        )
        self.deviation = max(self.deviation, float(self._deviations[:count].max(initial=0.0)))
        self._past = self._rows[count : count + _HISTORY]
        self._factors = (*self._factors, *[self._factor] * min(count, _HISTORY))[-_HISTORY:]
        self._planned = self._path_rows[count - 1]
        for correction in self._corrections:
            correction.commit(count)
        self.tracker.commit(count)
        if self._settling:
            self._smoother.commit(count)
            rest = None if self._rest is None else self._rest + count
            self._rested = rest if rest is not None and 0 <= rest < self._settling else None

    @property
    def lets_down(self) -> bool:
        """The axes brake by themselves."""
        return self._braking is not None

    def let_down(self, count: int) -> Floats:
        """After a failure: at most `count` rows (N, m); `down` when the robot stands at the end of them."""
        if self._braking is None:
            path = self._cell.path_limits  # lengths, limited and travelled, are axes too
            acceleration = np.append(self._limits[1], 2 * [path.acceleration, path.angular_acceleration])
            jerk = np.append(self._limits[2], 2 * [path.jerk, path.angular_jerk])
            axes = braking(self._past, acceleration, jerk, self._cell.tick)
            self._braking = np.concatenate((axes, np.tile(axes[-1], (self._settling, 1))))
        rows, self._braking = self._braking[:count], self._braking[count:]
        self._rows = np.concatenate((self._past, rows))
        columns = self._smoother.smooth(np.column_stack((rows, np.zeros(len(rows)))))[:, :-1]
        self._smoother.commit(len(rows))
        self._past = self._rows[len(rows) :]
        self.down = len(self._braking) == 0
        return columns

    def move_path(self, q: Floats, along: Floats) -> None:
        """From now on the path has its joints (n,) there, and the belt displaces the TCP along a direction.

        The robot does not move by that.
        """
        self._planned = np.concatenate((q, self._planned[len(q) :]))
        self._along = along

    def change_path(self, route: Route, s: float) -> None:
        """At rest: what comes is on another route, on which the robot stands at s."""
        self._route = route
        self._smoother.set_last(s)

    def in_the_way(self, rows: Rows, first: int, stand: Stand) -> Obstacle | None:
        """What would keep rows of the path from being sent if the belt goes on as it is measured now.

        The reserve of the limits stays free for what the belt may do else. Nothing is changed by asking.
        """
        columns = rows.columns.copy()
        q = columns[:, : self._cell.robot.joint_count]
        q[:], reachable = self._carried(q, self.tracker.expected(first, len(q)))
        kept, self._rows = self._rows, np.concatenate((self._past, columns))
        _, why = self._sendable(reachable, stand, free=self._cell.tracking_reserve)
        self._rows = kept
        return why

    def ticks_of_letdown(self) -> int:
        """After a failure: how many ticks it takes until the axes rest; 1 if that is not known yet."""
        return 1 if self._braking is None else max(len(self._braking), 1)

    def foreseen(self, columns: Floats, first: int, stand: Stand) -> Floats:
        """Joints (N, n) in ticks from `first` on, in which the path has rows (N, m), with what a belt adds.

        The robot is taken to go on with the belt as in the last of the ticks up to what happens next.
        """
        q = columns[:, : self._cell.robot.joint_count]
        count, tracker = len(q), self.tracker
        if not tracker.active or count == 0:
            return q
        places = tracker.foreseen(first, count, stopping=stand.stopping, held=stand.held)
        moved, reachable = self._carried(q, places)
        good = count if reachable.all() else int(np.argmin(reachable))
        if good == 0:
            return q
        return np.concatenate((moved[:good], np.tile(moved[good - 1], (count - good, 1))))

    def _carried(self, q: Floats, places: Floats) -> tuple[Floats, Bools]:
        """Joints q (N, n) of the path carried so far (N,) along the belt; which of them are reachable."""
        robot = self._cell.robot
        X = robot.fk(q)
        X[:, :3, 3] += places[:, None] * self._along
        return robot.ik_branch(X, robot.configuration(q), q)

    def resting(self, s: float, count: int) -> Rows:
        """So many rows of a path that stands at s."""
        return Rows(np.full(count, s), np.tile(self._planned, (count, 1)), arrived=False)

    # --- corrections -----------------------------------------------------------------------------------

    def _displaced(self, rows: Rows, first: int, stand: Stand) -> Rows | None:
        """Rows with the corrections; cut before the first that cannot be sent."""
        n = self._cell.robot.joint_count
        belt = self._belt_way(rows, first, stand)
        rows = _cut(rows, len(belt))
        q = rows.columns[:, :n]
        try:
            X, offset = self._offset(rows, q, first, stand)
        except ExecutionError as error:
            self.failure = error
            return None
        self._deviations, self._joint_steps = self._nothing(len(q))
        if offset is not None:
            self._deviations = np.linalg.norm(offset, axis=1)
        elif not belt.any():
            self._rows = np.concatenate((self._past, rows.columns))
            return rows
        offset = belt if offset is None else offset + belt
        active: Bools = np.any(offset != 0.0, axis=1)  # other rows stay as they are, bit for bit
        X[:, :3, 3] += offset
        robot = self._cell.robot
        columns, reachable = rows.columns.copy(), ~active
        columns[active, :n], reachable[active] = robot.ik_branch(
            X[active], robot.configuration(q[active]), q[active]
        )
        self._rows = np.concatenate((self._past, columns))
        if not self.tracker.active:
            self._joint_steps = np.abs(columns[:, :n] - q)
        good, why = self._sendable(reachable, stand)
        if (behind := self.tracker.behind()) is not None and behind < good:
            good, why = behind, Obstacle("E442", self.tracker.how_far_behind(behind))
        if good == 0:
            self.failure = self._refusal(why, first, stand.line)
            return None
        if good == len(q):
            return replace(rows, columns=columns)
        return _cut(replace(rows, columns=columns), good)

    def _belt_way(self, rows: Rows, first: int, stand: Stand) -> Floats:
        """What the belt adds to rows, (M, 3) m in the base: up to the next thing that happens with it."""
        tracker, count = self.tracker, len(rows.s)
        if tracker.active:
            places = tracker.offsets(first, count, stopping=stand.stopping, held=stand.held)
            return places[:, None] * self._along
        waiting = tracker.phase is Phase.WAITING
        return np.zeros((tracker.rows(first, count) if waiting else count, 3))

    def _nothing(self, count: int) -> tuple[Floats, Floats]:
        return np.zeros(count), np.zeros((count, self._cell.robot.joint_count))

    def _offset(self, rows: Rows, q: Floats, first: int, stand: Stand) -> tuple[Floats, Floats | None]:
        """Flange poses (N, 4, 4) of joints q (N, n), and what corrections add, (N, 3) m in the base."""
        cell = self._cell
        X = cell.robot.fk(q)
        X_flange_tool = cell.tools[stand.tool].X_flange_tool
        place = Place(
            times=cell.tick * np.arange(first, first + len(q), dtype=np.float64),
            R_base_tcp=X[:, :3, :3] @ X_flange_tool[:3, :3],
            R_base_frame=self._frames(rows.s) if self._framed else X[:, :3, :3],
            X_before=cell.robot.fk(self._past[-1, : q.shape[1]]) @ X_flange_tool,
            line=stand.line,
        )
        total: Floats | None = None
        for correction in self._corrections:
            offset = correction.offsets(place, braking=stand.stopping)
            if offset is not None:
                total = offset if total is None else total + offset
        return X, total

    def _frames(self, s: Floats) -> Floats:
        """Rotations (N, 3, 3) of the frames of the motions at s."""
        used, inverse = np.unique(self._route.programmed.frames(s), return_inverse=True)
        rotations = np.array([self._cell.frames[k].X_base_frame[:3, :3] for k in used.tolist()])
        return np.asarray(rotations[inverse])

    def _sendable(self, reachable: Bools, stand: Stand, *, free: float = 0.0) -> tuple[int, Obstacle | None]:
        """How many rows can be sent so that the axes can still brake; what is wrong with the next one.

        A part of acceleration and jerk limits stays free.
        """
        n, driven = self._cell.robot.joint_count, len(self._limits[0])
        axes = self._rows[:, :driven]
        differences = [
            np.diff(axes[_HISTORY - order :], n=order, axis=0) / self._cell.tick**order for order in (1, 2, 3)
        ]
        factor = np.full((len(reachable), 1), stand.factor * (1.0 - free))
        for row in range(min(_HISTORY, len(factor))):  # differences reach back into rows of another factor
            factor[row] = max(stand.factor, *self._factors[row:]) * (1.0 - free)
        ratios = [
            np.abs(size) / (limit * slack * (factor if order else 1.0))
            for order, (size, limit, slack) in enumerate(zip(differences, self._limits, SLACK, strict=False))
        ]
        top, way = stopping(
            differences[0] + 0.5 * self._cell.tick * differences[1], differences[1], *self._limits[1:]
        )
        if stand.factor == 1.0:  # an emergency stop is braking already
            ratios.append(np.abs(top) / (self._limits[0] * SLACK[-1]))
        limits = self._cell.robot.limits
        stop = axes[_HISTORY:, :n] + way[:, :n]
        good = reachable & (limits.contain(axes[_HISTORY:, :n]) & limits.contain(stop)).all(axis=1)
        for each in ratios:
            good &= (each <= 1.0).all(axis=1)  # False for what is no number, too
        if good.all():
            return len(good), None
        row = int(np.argmin(good))
        if not reachable[row]:
            return row, Obstacle("E430", "the robot does not reach there")
        return row, exceeded([each[row] for each in ratios]) or leaves_range(limits, stop[row])

    def _refusal(self, why: Obstacle | None, tick: int, line: int) -> ExecutionError:
        assert why is not None, "a row was refused"
        size = float(self._deviations[0]) / MM
        t = tick * self._cell.tick
        code, what = why.code, f"corrections displace the TCP by {size:.2f} mm"
        if self.tracker.active:
            code, what = FOLLOWING.get(code, code), f"{self.tracker.where(tick)} is followed"
        message = f"{what} in tick {tick} (t = {t:.3f} s): {why.reason}"
        return ExecutionError(code, message, line, HINTS.get(code))

    # --- filter ----------------------------------------------------------------------------------------

    def _padded(self, rows: Rows, count: int) -> Rows:
        """Rows on to where the filter has settled: behind its end the path stands."""
        self._rest = None
        if self._settling == 0:
            return rows
        if not rows.arrived:
            return rows
        if self._rested is None:
            self._rest = -len(rows.s)  # after so many rows it has rested for 0 ticks
            wanted = len(rows.s) + self._settling
        else:
            self._rest = self._rested
            wanted = self._settling - self._rested
        wanted = min(wanted, count)
        more = max(wanted - len(rows.s), 0)
        s = np.append(rows.s, np.full(more, rows.s[-1]))
        columns = np.concatenate((rows.columns, np.tile(rows.columns[-1], (more, 1))))
        return _cut(Rows(s, columns, arrived=True), wanted)

    def _filtered(self, rows: Rows, tool: int) -> Sent:
        """Rows behind the filter; at rest when all that the filter sees is."""
        smooth = self._smoother.smooth(np.column_stack((rows.columns, rows.s)))
        columns, s = smooth[:, :-1], smooth[:, -1]
        arrived = rows.arrived and self._rest is not None and self._rest + len(s) == self._settling
        if self._rest is not None:  # the path is at its end when the filter has settled, not before
            end = rows.s[-1]
            s[s == end] = np.nextafter(end, self._smoother.oldest)
            if arrived:
                s[-1] = end
        n = self._cell.robot.joint_count
        path = self._route.axes.everything(s)[:, :n]
        self._joint_steps = np.abs(columns[:, :n] - path)
        self._deviations = self._apart(columns[:, :n], path, tool)
        return Sent(s, columns, arrived, self._deviations)

    def _apart(self, q: Floats, path: Floats, tool: int) -> Floats:
        """(N,) m between the TCPs of joints (N, n)."""
        fk, X_flange_tool = self._cell.robot.fk, self._cell.tools[tool].X_flange_tool
        apart = (fk(q) @ X_flange_tool - fk(path) @ X_flange_tool)[:, :3, 3]
        return np.asarray(np.linalg.norm(apart, axis=1))


def _cut(rows: Rows, count: int) -> Rows:
    """The first `count` rows; the path has arrived only if they are all of them."""
    if count >= len(rows.s):
        return rows
    return Rows(rows.s[:count], rows.columns[:count], arrived=False)
