"""A jog that is held: the way of the robot while a rate of its coordinates is asked for, tick by tick.

Every coordinate catches up with the rate asked for as quickly as its limits allow. What is sent is part of a
plan: ticks on at that rate, then a stop. A plan is taken only if all its ticks, the stop's included, keep the
joints' ranges and limits and break no rule of the workspace. So the robot can stop before whatever lies
ahead, and it slows down where its joints could not follow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.chase import Follower, towards
from viapoint.runtime.kernel.jogaxes import Bounds, Coordinates, Drives, Here, Placed, TcpAxes
from viapoint.runtime.kernel.obstacles import Lookout, Obstacle
from viapoint.runtime.records import Floats
from viapoint.runtime.workspace import Monitor

_AHEAD_S: Final = 0.05
"""s at the rate asked for, between two plans."""

_SLOWER: Final = 0.7
"""Part of its rate at which a jog goes on where its joints could not follow at that rate."""

_RUNGS: Final = 10
"""How often that is tried: to 3 % of the rate."""

_SLOWEST: Final = _SLOWER**_RUNGS

_LONGEST_S: Final = 3.0
"""s. A rate of the TCP that takes longer to come to, or to leave, is none that its joints can follow."""

_HALVINGS: Final = 22
"""Of a rate, to stop within some micrometres: how far a stop leads depends steeply on it."""

_NO_WAY: Final = 1e-5
"""m, rad. A jog that could go no farther before it must stop does not begin."""

_STILL: Final = 1e-12
"""m/s, rad/s and the like. What is left of a rate in other axes by rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Demand:
    """A rate asked for: of axes J1 …, E1 … (n + k,), or of the TCP along and about the axes of a space (6,).

    `R` (3, 3) is R_base_space; None for the tool's own axes, and for joints. `name` tells it from others.
    """

    name: str
    rates: Floats
    of_joints: bool = False
    R: Floats | None = None


@dataclass(frozen=True, slots=True)
class _Plan:
    """Ticks to come: where they lead, the states (N, m, 3) of the coordinates, and TCP lengths (N,) m.

    After `free` of them the next plan is due; None where the robot comes to rest at the end.
    """

    placed: Placed
    states: Floats
    lengths: Floats
    free: int | None
    hardest: Floats  # (2, m) acceleration and jerk with which it brakes

    def __len__(self) -> int:
        return len(self.states)

    def way(self, rates: Floats) -> float:
        """How far it leads in the sense of rates (m,)."""
        return float(self.states[-1, :, 0] @ np.sign(rates)) if len(self) else 0.0


class Jogger:
    """A robot being jogged from rest at axes (n + k,), with a tool."""

    def __init__(self, cell: Cell, monitor: Monitor, axes: Floats, tool: int) -> None:
        self.obstacle: Obstacle | None = None
        """What the robot stops for, or has stopped for."""
        self.demand: Demand | None = None
        """What is asked for."""
        self._cell = cell
        self._tool = tool
        self._tick = cell.tick
        self._ahead = max(1, round(_AHEAD_S / cell.tick))
        self._lookout = Lookout(cell, monitor, axes, tool)
        n = cell.robot.joint_count
        self._here = Here(axes, cell.robot.fk(axes[:n]) @ cell.tools[tool].X_flange_tool)
        self._coordinates: Coordinates = Drives(cell, tool)
        self._driven: Demand | None = None  # what the coordinates are those of
        self._now: Floats = np.zeros((self._coordinates.count, 3))  # states of the coordinates
        self._plan: _Plan | None = None
        self._sent = 0  # ticks of it
        self._length = 0.0  # of the TCP's way up to the plan
        self._hardest: Floats | None = None  # of the plan
        self._rung = 0
        self._share = 1.0
        self._factor = 1.0

    @property
    def at_rest(self) -> bool:
        """Nothing of the jog is left to be sent."""
        return self._plan is None

    def ask(self, demand: Demand | None, share: float) -> Obstacle | None:
        """From the next tick on: that demand, at a share of its rates; None: come to rest.

        Answers what keeps a robot at rest from moving at all.
        """
        self.demand, self._share, self._rung = demand, share, 0
        self.obstacle = None
        self._replan()
        if self._plan is None and demand is not None:
            self.demand = None
            return self.obstacle
        return None

    def brake(self, factor: float) -> None:
        """Come to rest with so many times the deceleration and jerk."""
        self._factor = factor
        self.ask(None, self._share)

    def look(self, count: int) -> tuple[Floats, Floats]:
        """At most `count` ticks to come: axes (N, n + k), and TCP lengths (N,) m since the jog began."""
        assert self._plan is not None, "only while it moves"
        plan, end = self._plan, len(self._plan)
        if plan.free is not None:
            end = plan.free
        rows = slice(self._sent, min(self._sent + count, end))
        return plan.placed.axes[rows], self._length + plan.lengths[rows]

    def commit(self, count: int) -> None:
        """The first so many of the ticks looked at were sent."""
        assert self._plan is not None, "only while it moves"
        plan, last = self._plan, self._sent + count - 1
        self._lookout.sent(plan.placed.axes[self._sent : last + 1])
        self._here = Here(plan.placed.axes[last], plan.placed.X[last])
        self._now = plan.states[last]
        self._sent += count
        if self._sent == len(plan):
            self._drop()
            self._replan()
        elif self._sent == plan.free:
            self._replan()

    def _drop(self) -> None:
        """The plan is over: the robot is at rest."""
        assert self._plan is not None, "there was one"
        self._length += float(self._plan.lengths[-1])
        self._plan, self._sent, self._hardest = None, 0, None
        self._now = np.zeros_like(self._now)

    # --- plans ---------------------------------------------------------------------------------------

    def _replan(self) -> None:
        """A plan from where the robot is for what is asked for; without a good one the present one stays."""
        demand = self.demand
        if self.at_rest:
            if demand is not None and self.obstacle is None:
                self._begin(demand)
            return
        if demand is not None and not self._turns_to(demand):
            demand = None  # to rest first
        if demand is not None:
            self._drive(demand)
            return
        self._to_rest()
        if self.at_rest and self.demand is not None:  # it had not set out yet
            self._begin(self.demand)

    def _begin(self, demand: Demand) -> None:
        """From rest: in the coordinates of the demand, in a configuration in which the robot can set out."""
        found: Obstacle | None = None
        for coordinates in self._choices(demand):
            self._coordinates, self._driven, self._rung = coordinates, demand, 0
            self._now = np.zeros((coordinates.count, 3))
            self.obstacle = None
            self._drive(demand)
            if self._plan is not None and not self._leads_nowhere(self._plan):
                return
            self._plan, self._sent = None, 0
            found = found or self.obstacle
        self.obstacle = found

    def _choices(self, demand: Demand) -> list[Coordinates]:
        """Coordinates of a demand; at a singular pose several configurations meet."""
        cell, here = self._cell, self._here
        if demand.of_joints:
            return [Drives(cell, self._tool)]
        robot, n = cell.robot, cell.robot.joint_count
        q, R = here.axes[:n], here.X[:3, :3] if demand.R is None else demand.R
        own = int(robot.configuration(q))
        others = range(len(robot.kinematics.configurations))
        choices: list[Coordinates] = []
        for index in (own, *(k for k in others if k != own)):
            X = here.X @ np.linalg.inv(cell.tools[self._tool].X_flange_tool)
            found, reachable = robot.ik_branch(X[None], index, q)
            if reachable[0] and np.abs(found[0] - q).max() < 1e-9:
                choices.append(TcpAxes(cell, self._tool, R, index))
        return choices or [TcpAxes(cell, self._tool, R, own)]

    def _leads_nowhere(self, plan: _Plan) -> bool:
        return plan.free is None and float(np.abs(plan.states[-1, :, 0]).max()) < _NO_WAY

    def _turns_to(self, demand: Demand) -> bool:
        """In motion: whether the coordinates can be those of another demand without coming to rest."""
        driven, coordinates = self._driven, self._coordinates
        if driven is None or driven.name == demand.name:
            return True
        if demand.of_joints or not isinstance(coordinates, TcpAxes):
            return demand.of_joints and driven.of_joints
        R = demand.R
        if R is None:
            if self._now[3:, 1:].any() or demand.rates[3:].any():
                return False  # the tool's axes turn with it
            R = self._here.X[:3, :3]
        across = R.T @ coordinates.R
        now = np.concatenate((across @ self._now[:3], across @ self._now[3:]))
        self._now, self._hardest = np.where(np.abs(now) < _STILL, 0.0, now), None
        coordinates.R, self._driven = R, demand
        return True

    def _to_rest(self) -> None:
        rest = np.zeros(self._coordinates.count)
        for hard in (False, True):
            stop = self._checked(self._planned(rest, 0, hard=hard))
            if isinstance(stop, _Plan):
                self._take(stop)
                return
        if self._plan is not None and self._plan.free is not None:
            self._hurry()

    def _hurry(self) -> None:
        """No stop can be made from here: try again a tick on, until the present plan makes its own."""
        plan = self._plan
        assert plan is not None, "in motion"
        free = self._sent + 1
        following = free if free < len(plan) and plan.free is not None and free < plan.free else None
        self._plan = replace(plan, free=following)

    def _drive(self, demand: Demand) -> None:
        """On at the rate asked for, or as near to it as may be; else as far as may be, and stop."""
        wanted = self._share * demand.rates
        self._rung = max(self._rung - 1, 0)
        while True:
            rates = self._slowed(wanted)
            plan = self._planned(rates, self._ahead)
            found = self._checked(plan)
            if isinstance(found, _Plan):
                self._take(found)
                return
            if found.is_place or self._rung == _RUNGS:
                break
            self._rung += 1
        self.obstacle = found
        farthest = self._farthest(rates, self._ahead if plan is None else plan.free or 0)
        if farthest is not None:
            self._take(farthest)
        elif self._plan is not None:
            self._plan = replace(self._plan, free=None)

    def _slowed(self, wanted: Floats) -> Floats:
        """Rates (m,) that the limits and what went before allow of those wanted."""
        bounds = self._bounds(wanted)
        asked = np.flatnonzero(wanted)
        share = _SLOWER**self._rung
        if len(asked):
            share = min(share, float((bounds.rate[asked] / np.abs(wanted[asked])).min()))
        if share < _SLOWEST:
            self._rung, share = _RUNGS, _SLOWEST
        return share * wanted

    def _bounds(self, rates: Floats) -> Bounds:
        return self._coordinates.bounds(self._here, (rates != 0.0) | self._now[:, 1:].any(axis=1))

    def _farthest(self, rates: Floats, most: int) -> _Plan | None:
        """The plan with the most ticks, fewer than `most`, before a stop that is good; then a little slower,
        so that it ends just before what it stops for."""
        best, low, high = None, 0, most
        while low < high:
            middle = (low + high) // 2
            found = self._checked(self._planned(rates, None, middle))
            if isinstance(found, _Plan):
                best, low = found, middle + 1
            else:
                high = middle
        if best is None:
            return None
        slow, fast = 0.0, 1.0
        for _ in range(_HALVINGS):
            share = 0.5 * (slow + fast)
            found = self._checked(self._planned(share * rates, None, low))
            if isinstance(found, _Plan):
                slow, best = share, max(best, found, key=lambda plan: plan.way(rates))
            else:
                fast = share
        return replace(best, free=None)

    def _planned(
        self, rates: Floats, ahead: int | None, ticks: int | None = None, *, hard: bool = False
    ) -> _Plan | None:
        """To those rates, `ahead` ticks at them (or `ticks` from now on in all), then to rest.

        With `hard` it brakes at least as the plan before would. None where it takes too long to be tried.
        """
        bounds, tick = self._bounds(rates), self._tick
        hardest = np.stack((bounds.acceleration, bounds.jerk))
        if hard and self._hardest is not None:
            hardest = np.maximum(hardest, self._hardest)
        starts = [Follower(0.0, *self._now[i, 1:].tolist()) for i in range(len(rates))]
        limits, braking = (
            list(zip(*(self._factor * each).tolist(), strict=True))
            for each in (np.stack((bounds.acceleration, bounds.jerk)), hardest)
        )
        driven: Floats | None = None
        if ahead != 0 and ticks != 0:
            ways = [
                towards(start, rate, *limit)
                for start, rate, limit in zip(starts, rates.tolist(), limits, strict=True)
            ]
            longest = max(way.duration for way in ways)
            if self._gives_up and longest > _LONGEST_S:
                return None
            if ticks is None:
                ticks = int(np.ceil(longest / tick - 1e-9)) + (ahead or 0)
            times = (tick * np.arange(1, ticks + 1)).tolist()
            driven = np.array([way.states(times) for way in ways]).transpose(1, 0, 2)
        if driven is not None and len(driven):
            ends = [Follower(*state.tolist()) for state in driven[-1]]
        else:
            driven, ends = np.zeros((0, len(rates), 3)), starts
        stops = [towards(end, 0.0, *limit) for end, limit in zip(ends, braking, strict=True)]
        longest = max(stop.duration for stop in stops)
        if self._gives_up and longest > _LONGEST_S:
            return None
        count = int(np.ceil(longest / tick - 1e-9))
        times = (tick * np.arange(1, count + 1)).tolist()
        braked = np.array([stop.states(times) for stop in stops]).reshape(len(rates), count, 3)
        states = np.concatenate((driven, braked.transpose(1, 0, 2)))
        if len(states):
            states[-1, :, 1:] = 0.0
        return self._laid(states, len(driven), hardest)

    @property
    def _gives_up(self) -> bool:
        """Next to a singular pose a joint may leave the TCP next to no acceleration."""
        return isinstance(self._coordinates, TcpAxes)

    def _laid(self, states: Floats, free: int, hardest: Floats) -> _Plan:
        placed = self._coordinates.place(self._here, states[:, :, 0])
        steps = np.diff(placed.X[:, :3, 3], axis=0, prepend=self._here.X[None, :3, 3])
        lengths = np.linalg.norm(steps, axis=1).cumsum()
        return _Plan(placed, states, lengths, free or None, hardest)

    def _checked(self, plan: _Plan | None) -> _Plan | Obstacle:
        """The plan, if every tick of it may be sent; else what is wrong with the first that may not."""
        if plan is None:
            return self._lookout.hardly_moves(self._here.axes)
        if not len(plan):
            return plan
        return self._lookout.wrong(plan.placed, self._factor) or plan

    def _take(self, plan: _Plan) -> None:
        if self._plan is not None and self._sent:
            self._length += float(self._plan.lengths[self._sent - 1])
        self._plan, self._sent = (plan, 0) if len(plan) else (None, 0)
        self._hardest = plan.hardest
        if self._plan is None:
            self._now, self._hardest = np.zeros_like(self._now), None
