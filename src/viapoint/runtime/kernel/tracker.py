"""Following a belt: how far the TCP is displaced along it, tick by tick, and what phase that is in.

The path of a tracked section is planned where the belt will be once the robot has coupled, `reference` m of
travel behind the latch; the displacement is the belt's travel since the latch less the reference. Here are
numbers of a tick only; poses are the feed's, when a phase begins is the kernel's.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, unique
from typing import Final

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.cell import Cell, Conveyor
from viapoint.runtime.kernel.chase import REST, Chase, Follower
from viapoint.runtime.records import Floats
from viapoint.runtime.signals import Belt, PartQueues, Scenario

_COUPLED: Final = 2e-5
"""m. Nearer to the belt as it is measured, and to stay that near, the robot is on it: an encoder's count is
about 1e-5 m."""


@unique
class Phase(Enum):
    """What the robot does with a belt."""

    OFF = "off"
    WAITING = "waiting"  # for a part
    COUPLING = "coupling"
    COUPLED = "coupled"
    DECOUPLING = "decoupling"
    LEFT = "left"  # at rest again, off the path's own place


@dataclass(frozen=True, slots=True)
class Following:
    """A belt being followed: from which travel on, planned at which reference, and how it may be caught."""

    index: int
    latch: float
    reference: float
    couple: Chase
    follow: Chase


class Tracker:
    """The belts of a cell, and the one that is followed. `offsets` may be asked for more than is sent."""

    def __init__(self, cell: Cell, scenario: Scenario | None, parts: PartQueues) -> None:
        scripts = {script.index: script for script in scenario.belts} if scenario is not None else {}
        seed = scenario.seed if scenario is not None else 0
        self.belts = {
            index: Belt(conveyor, scripts.get(index), seed, cell.tick)
            for index, conveyor in cell.conveyors.items()
        }
        self.phase = Phase.OFF
        self.index = 0
        self.lag = 0.0
        """Largest distance from the belt while coupled, m."""
        self._tick = cell.tick
        self._parts_taken = parts
        self._taken = dict.fromkeys(self.belts, -1)  # the last part this robot took from each
        self._following: Following | None = None
        self._now = REST
        self._states: list[Follower] = []
        self._lags: Floats = np.zeros(0)
        self._turns_at: tuple[int, Phase] | None = None  # rows after which the next phase begins
        self._stopped = False

    @property
    def active(self) -> bool:
        """The robot may move with a belt."""
        return self.phase in (Phase.COUPLING, Phase.COUPLED, Phase.DECOUPLING)

    @property
    def moves(self) -> bool:
        """The robot does move with a belt, or by what is left of it."""
        return self.active and (self._now.speed != 0.0 or self._now.acceleration != 0.0)

    @property
    def belt(self) -> Belt:
        """The one that is followed or waited for."""
        return self.belts[self.index]

    def begin(self, index: int) -> None:
        """From now on conveyor `index` is to be followed: as soon as there is a part, if it carries parts."""
        self.index, self.phase, self.lag = index, Phase.WAITING, 0.0

    def part(self, tick: int) -> tuple[int, float] | None:
        """In WAITING: the part to take in a tick, if any, and its way from where points are taught."""
        found = self._parts(tick, 1)[0]
        parts = self.belt.conveyor.parts
        if found < 0 or parts is None:
            return None
        place = float(self.belt.travel(np.array([tick]))[0]) - int(found) * parts.pitch
        return int(found), place + (parts.trigger - parts.taught)

    def waits_in_vain(self, tick: int) -> bool:
        """In WAITING: the belt will never bring a part again."""
        return tick >= self.belt.rest_tick and self.part(tick) is None

    def couple(self, following: Following, part: int | None) -> None:
        """The path has been moved to the reference; the robot sets out for it."""
        if part is not None:
            self._taken[self.index] = part
            self._parts_taken.take(self.index, part)
        self._following = following
        self._now = Follower(-following.reference, 0.0, 0.0)
        self.phase = Phase.COUPLING

    def end(self) -> None:
        """Leave the belt: to rest as soon as may be."""
        self.phase = Phase.DECOUPLING if self.active else Phase.OFF

    def off(self) -> None:
        """The path begins where the robot stands: nothing is left of the belt."""
        self.phase, self.index, self._following, self._now = Phase.OFF, 0, None, REST

    def rows(self, first: int, count: int) -> int:
        """In WAITING: how many of the next ticks pass up to that with a part, or with none ever again."""
        if first <= self.belt.rest_tick < first + count:
            count = int(self.belt.rest_tick) - first + 1
        found = np.flatnonzero(self._parts(first, count) >= 0)
        return int(found[0]) + 1 if len(found) else count

    def foreseen(self, first: int, count: int, *, stopping: bool, held: bool) -> Floats:
        """Displacements (N,) m in the next ticks: as `offsets` has them, and on at the same speed."""
        places = self.offsets(first, count, stopping=stopping, held=held)
        more = np.arange(1, count - len(places) + 1)
        return np.concatenate((places, places[-1] + self._states[-1].speed * self._tick * more))

    def expected(self, first: int, count: int) -> Floats:
        """Displacements (N,) m in the next ticks if the belt keeps the speed that its encoder gives now."""
        assert self._following is not None, "only while a belt is followed"
        places, speeds = self.belt.measured(first - 1, 1)
        rate, target = float(speeds[0]), float(places[0]) - self._following.latch - self._following.reference
        now, found = self._now, []
        for k in range(count):
            now = self._following.follow.step(now, target + rate * k * self._tick, rate)
            found.append(now.position)
        return np.array(found)

    def ticks_to_rest(self) -> int:
        """How many ticks the robot goes on with the belt if it is stopped now."""
        if not self.moves:
            return 0
        now, ticks, stop = self._now, 0, self._stopping.stop
        while now.speed != 0.0 or now.acceleration != 0.0:
            now, ticks = stop(now), ticks + 1
        return ticks

    @property
    def _stopping(self) -> Chase:
        """How the robot leaves a belt. Not coupled its path is at rest, and leaves the joints' limits."""
        assert self._following is not None, "only while a belt is followed"
        coupled = self.phase is Phase.COUPLED
        return self._following.follow if coupled else self._following.couple

    def offsets(self, first: int, count: int, *, stopping: bool, held: bool) -> Floats:
        """Displacements (N,) m along the belt in ticks first …, `count` at most: up to the next phase."""
        assert self._following is not None, "only while a belt is followed"
        self._stopped = stopping or (self._stopped and held)
        self._turns_at = None
        if self._stopped or self.phase is Phase.DECOUPLING:
            self._states = self._brake(count)
        else:
            self._states = self._chase(self._following, first, count)
        places = np.array([state.position for state in self._states])
        truth = self.belt.travel(np.arange(first, first + len(places)))
        self._lags = np.abs(places - (truth - self._following.latch - self._following.reference))
        if self.phase is not Phase.COUPLED or self._stopped:
            self._lags = np.zeros(len(places))
        return places

    def behind(self) -> int | None:
        """The first row asked for last in which the robot is further from the belt than it may be."""
        if not self.active:
            return None
        far = np.flatnonzero(self._lags > self.belt.conveyor.max_lag)
        return int(far[0]) if len(far) else None

    def how_far_behind(self, row: int) -> str:
        """In words, for a row in which the robot is too far from the belt."""
        allowed = self.belt.conveyor.max_lag / MM
        return f"the robot is {self._lags[row] / MM:.2f} mm from the belt, {allowed:g} mm are allowed"

    def commit(self, count: int) -> None:
        """The first so many rows were sent."""
        if not self._states:
            return
        self._now = self._states[count - 1]
        self.lag = max(self.lag, float(self._lags[:count].max(initial=0.0)))
        if self._turns_at is not None and self._turns_at[0] == count:
            self.phase = self._turns_at[1]
        self._states, self._turns_at = [], None

    def where(self, tick: int) -> str:
        """The belt's place, in words."""
        return f"conveyor {self.index}, {self.way(tick) / MM:.1f} mm behind its latch,"

    def way(self, tick: int) -> float:
        """m that the belt has travelled since its latch."""
        latch = 0.0 if self._following is None else self._following.latch
        return float(self.belt.travel(np.array([tick]))[0]) - latch

    def _chase(self, following: Following, first: int, count: int) -> list[Follower]:
        """What the encoder said one tick before decides each tick."""
        places, speeds = self.belt.measured(first - 1, count + 1)
        targets = (places - following.latch - following.reference).tolist()
        rates = speeds.tolist()
        coupling = self.phase is Phase.COUPLING
        chase = following.couple if coupling else following.follow
        states, now = [], self._now
        for k in range(count):
            now = chase.step(now, targets[k], rates[k])
            states.append(now)
            lag, closing = now.position - targets[k + 1], now.speed - rates[k + 1]
            if coupling and abs(lag) + following.follow.overshoot(closing, now.acceleration) < _COUPLED:
                self._turns_at = (k + 1, Phase.COUPLED)
                break
        return states

    def _brake(self, count: int) -> list[Follower]:
        assert self._following is not None, "only while a belt is followed"
        leaving = self.phase is Phase.DECOUPLING
        states, now, stop = [], self._now, self._stopping.stop
        moving = self.moves
        for k in range(count):
            now = stop(now)
            states.append(now)
            if now.speed == 0.0 and now.acceleration == 0.0 and (moving or leaving):
                self._turns_at = (k + 1, Phase.LEFT if leaving else Phase.COUPLING)
                break
        return states

    def _parts(self, first: int, count: int) -> np.ndarray:
        """(N,): the part to be taken in each tick; −1: none. The next one is, as soon as it may be."""
        conveyor: Conveyor = self.belt.conveyor
        parts = conveyor.parts
        assert parts is not None, "a belt without parts is followed from where it is"
        low, high = parts.window
        place = self.belt.travel(np.arange(first, first + count)) + parts.trigger
        # part k is at place − k·pitch: the largest one that is not yet behind the window, from the next on
        oldest = np.ceil((place - high) / parts.pitch - 1e-9)
        k = np.maximum(np.maximum(oldest, self._taken[self.index] + 1), 0).astype(np.int64)
        some, where = np.unique(k, return_inverse=True)
        free = [self._parts_taken.next_free(self.index, part) for part in some.tolist()]
        k = np.asarray(free, dtype=np.int64)[where]
        there = place - k * parts.pitch
        return np.where((there >= low) & (there <= high + 1e-9) & (there >= parts.trigger), k, -1)
