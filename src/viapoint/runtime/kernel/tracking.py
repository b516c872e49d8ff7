"""TRK as the path sees it: when a belt is latched, where the path goes on, when it has to wait.

At a latch the path is moved to where the belt will be when the robot has coupled, and planned on from
there; after decoupling it is planned on from where the robot stands. Both are planning barriers, so that
nothing behind them is planned before. Not here: how the belt is followed.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.kernel.chase import Chase
from viapoint.runtime.kernel.company import Company
from viapoint.runtime.kernel.failure import ExecutionError
from viapoint.runtime.kernel.refusals import FOLLOWING
from viapoint.runtime.kernel.states import Hold
from viapoint.runtime.kernel.tracker import Following, Phase
from viapoint.runtime.records import Floats
from viapoint.runtime.timing import AxisLimits
from viapoint.vm.ports import Call, End, Track

_COUPLING_SHARE: Final = 0.5
"""Part of the joints' limits used to catch the belt: on the way they change with the pose."""

_SAME_PLACE: Final = 0.75
"""Part of the joints' limits for motions on the belt: they are planned where the belt is at the coupling, and
further on the same motion may need that much more of a joint."""

_LOOKED_AHEAD: Final = 0.3
"""s of the path on a belt that are looked at for what the joints can do: longer than slowing down takes."""

_LOOKED_AT_REST: Final = 2.0
"""The same where the path sets out: a motion that is slowed from its beginning need not be slowed later."""

_LOOK_EVERY: Final = 0.06
"""s between two looks."""

_SHARES: Final = (0.85, 0.7, 0.5, 0.35, 0.2, 0.1)
"""Parts of its present speed to which a path is slowed: the first that will do."""

_CALM: Final = 0.6
"""s after a path was slowed before it may get faster again."""

_FASTER: Final = 1.25
"""By so much a path that was slowed gets faster again where it may."""

_LEAST_SPEED: Final = 0.1
"""Part of a joint's speed that is left to the path, whatever the belt needs: what is over is stopped."""


class Tracking(Company):
    """The side of a kernel that a belt sees."""

    _untracked: AxisLimits | None = None  # limits of the path where no belt is followed
    _following_next: Track | None = None
    _track_line = 0
    _told_coupled = False
    _aside = False
    """Whether a subroutine has interrupted the program."""
    _waiting_since = 0  # tick in which the TRK that waits for a part was reached
    _slowed_in = 0  # tick in which the share of the path was changed last
    _given = False  # it is this robot's turn to take a part

    def track(self, call: Track) -> None:
        """The path has reached a TRK: the belt followed so far is left, then the new one is taken."""
        tracker = self.outlet.feed.tracker
        self._following_next = call if call.conveyor else None
        if tracker.active:
            tracker.end()
        else:
            tracker.off()
            self._take_next()

    def _take_next(self) -> None:
        """Nothing is followed: begin with the belt that was asked for; without one the path goes on."""
        call, self._following_next = self._following_next, None
        if call is None:
            self.planner.go_on()
        else:
            self.outlet.feed.tracker.begin(call.conveyor)
            self._track_line = call.line
            self._waiting_since = self.trace.tick

    def leaves_belt(self, call: Call) -> bool:
        """At a program's end the belt is left first: True if it has to be."""
        tracker = self.outlet.feed.tracker
        if self._aside or not isinstance(call, End) or tracker.phase is Phase.OFF:
            return False
        self.track(Track(line=call.line, conveyor=0))
        return True

    def belt_keeps(self) -> bool:
        """At rest: what is due with the belt is done. True while the path has to wait for it."""
        feed = self.outlet.feed
        tracker = feed.tracker
        if self._aside:  # the belt is waited for where the program was left
            return False
        stopping = self._hold in (Hold.STOP, Hold.EMERGENCY)
        if tracker.phase is Phase.WAITING and not stopping:
            self._latch()
        if tracker.phase is Phase.LEFT:
            self._leave()
        if tracker.phase is Phase.COUPLED and not self._told_coupled:
            self._told_coupled = True
            self.trace.emit("track", self._track_line, index=tracker.index, action="coupled")
        if stopping:
            return tracker.moves
        return tracker.phase not in (Phase.OFF, Phase.COUPLED)

    def _latch(self) -> None:
        """Take the belt from where it is, or the next part on it if it carries parts and there is one."""
        tracker, tick = self.outlet.feed.tracker, self.trace.tick
        belt = tracker.belt
        part, latch = None, float(belt.travel(np.array([tick]))[0])
        if belt.conveyor.parts is not None:
            found = tracker.part(tick)
            if found is None:
                if tracker.waits_in_vain(tick):
                    what = f"TRK {tracker.index} waits for a part, and the belt stands for good"
                    raise ExecutionError("E410", what, self._track_line)
                return
            if self.access is not None and not self._given:
                return  # whose turn it is says the station, once all robots have come to this tick
            part, since = found
            latch -= since
        self._couple(latch, part)

    @property
    def claim(self) -> tuple[int, int, int] | None:
        """Its rank among the robots that wait for parts, the least goes first; None: it does not wait.

        The higher priority, then who has waited longer, then the earlier robot of the cell.
        """
        stopping = self._hold in (Hold.STOP, Hold.EMERGENCY)
        if self.over or stopping or self._aside or self.outlet.feed.tracker.phase is not Phase.WAITING:
            return None
        return -self.cell.priority, self._waiting_since, self.cell.number

    def take_part(self) -> None:
        """It is the robot's turn: it takes the next part in its window, if there is one."""
        tracker = self.outlet.feed.tracker
        if tracker.part(self.trace.tick) is None and not tracker.waits_in_vain(self.trace.tick):
            return
        self._given = True
        self._settle()
        self._given = False

    def _couple(self, latch: float, part: int | None) -> None:
        feed, tick = self.outlet.feed, self.trace.tick
        belt = feed.tracker.belt
        places, speeds = belt.measured(tick, 1)
        away, speed = float(places[0]) - latch, float(speeds[0])
        along = belt.conveyor.X_base_belt[:3, 0]
        q = self.telemetry.joints
        chase, reference = self._chase(along, q, _COUPLING_SHARE, speed), away
        q_ahead = q
        for _ in range(2):  # where the belt will be decides the limits there, and those how long it takes
            reference = away + speed * chase.duration(-away, -speed)
            q_ahead = self._moved(q, reference * along)
            ahead = self._chase(along, q_ahead, _COUPLING_SHARE, speed)
            chase = chase.within(ahead)
        follow = chase.scaled(self.cell.tracking_reserve / _COUPLING_SHARE)
        feed.tracker.couple(Following(feed.tracker.index, latch, reference, chase, follow), part)
        feed.move_path(q_ahead, along)
        self.planner.rebase(q_ahead, reference * along)
        self._slow_path(along, q_ahead, speed)
        self._told_coupled, self.mover.share = False, 1.0
        more = {} if part is None else {"part": part}
        self.trace.emit("track", self._track_line, index=feed.tracker.index, action="latched", **more)

    @property
    def _ticks_to_look(self) -> int:
        """Ticks up to the next look at what the joints can do on the belt."""
        every = max(1, round(_LOOK_EVERY / self.cell.tick))
        return every - self.trace.tick % every

    @property
    def _looks_now(self) -> bool:
        """Whether a look is due in the present tick."""
        every = max(1, round(_LOOK_EVERY / self.cell.tick))
        return self.trace.tick % every == 0

    def look_out(self, *, setting_out: bool = False) -> None:
        """On a belt: slow the path where the joints could not follow both, let it get faster where they can.

        It is no use where the belt alone is too fast, or leads out of reach.
        """
        mover, tick = self.mover, self.trace.tick
        if self.outlet.feed.tracker.phase is not Phase.COUPLED or self._hold is not Hold.NONE:
            return
        if mover.law is None or mover.direction < 0.0:
            return
        if self.outlet.feed.filters and not setting_out:
            return  # what was sent lags behind the path: beside it every path looks too fast for the joints
        seconds = _LOOKED_AT_REST if setting_out else _LOOKED_AHEAD
        share, clear = mover.share, partial(self._clear, seconds)
        if clear():
            calm = tick - self._slowed_in >= _CALM / self.cell.tick
            if share < 1.0 and calm and mover.take_share(tick, min(1.0, _FASTER * share), clear):
                self._tell_share(share)
        elif any(mover.take_share(tick, part * share, clear) for part in _SHARES):
            self._tell_share(share)

    def _clear(self, seconds: float) -> bool:
        """Whether the joints can do what the path, under its present law, and the belt ask of them."""
        first = self.trace.tick + 1
        rows = self.mover.rows(first, round(seconds / self.cell.tick))
        why = self.outlet.in_the_way(rows, first, self._now)
        return why is None or why.code not in FOLLOWING or FOLLOWING[why.code] != "E441"

    def _tell_share(self, before: float) -> None:
        share, index = self.mover.share, self.outlet.feed.tracker.index
        self._slowed_in = self.trace.tick
        if before == 1.0 or share == 1.0:
            action = "slowed" if share < 1.0 else "restored"
            self.trace.emit("track", self.line, index=index, action=action, percent=100.0 * share)

    def tell_loss(self) -> None:
        """The belt, or the part on it, is lost: the axes begin to brake."""
        tracker = self.outlet.feed.tracker
        if tracker.active:
            lag, way = tracker.lag / MM, tracker.way(self.trace.tick) / MM
            self.trace.emit("track", self.line, index=tracker.index, action="lost", lag_mm=lag, travel_mm=way)

    def _leave(self) -> None:
        """Decoupled: the path begins anew where the robot stands."""
        feed = self.outlet.feed
        lag, index = feed.tracker.lag, feed.tracker.index
        feed.tracker.off()
        q = self.telemetry.joints.copy()
        feed.move_path(q, np.zeros(3))
        self.planner.rebase(q, np.zeros(3))
        if self._untracked is not None:
            self.mover.limits, self._untracked = self._untracked, None
        self.mover.share = 1.0
        self.trace.emit("track", self.line, index=index, action="decoupled", lag_mm=lag / MM)
        self._take_next()

    def _moved(self, q: Floats, offset: Floats) -> Floats:
        """Joints (n,) with the TCP displaced from where it is at q. Raises ExecutionError out of reach."""
        robot = self.cell.robot
        X = robot.fk(q)
        X[:3, 3] += offset
        moved, reachable = robot.ik_branch(X[None], robot.configuration(q), q)
        if not reachable[0] or not robot.limits.contain(moved[0]).all():
            way = float(np.linalg.norm(offset)) / MM
            where = self.outlet.feed.tracker.where(self.trace.tick)
            what = f"{where} would be out of reach when the robot has coupled, {way:.1f} mm on"
            raise ExecutionError("E440", what, self._track_line, "latch earlier, or nearer to the robot")
        return np.asarray(moved[0])

    def _needs(self, along: Floats, q: Floats) -> Floats:
        """|joint speed| (n,) per m/s along the belt at joints q."""
        twist = np.concatenate((along, np.zeros(3)))
        return np.asarray(np.abs(np.linalg.lstsq(self.cell.robot.jacobian(q), twist, rcond=None)[0]))

    def _chase(self, along: Floats, q: Floats, share: float, speed: float) -> Chase:
        """How the belt may be caught with a share of the joints' limits at q. Raises ExecutionError."""
        limits, path = self.cell.robot.limits, self.cell.path_limits
        needs = np.maximum(self._needs(along, q), 1e-9)
        top = min(path.speed, float((limits.speed / needs).min()) * max(share, 0.9))
        if top <= 1.01 * abs(speed):
            index = self.outlet.feed.tracker.index
            k = int(np.argmin(limits.speed / needs))
            what = f"conveyor {index} runs at {speed / MM:.1f} mm/s: J{k + 1} allows {top / MM:.1f} mm/s here"
            raise ExecutionError("E441", what, self._track_line, "slow the belt down, or work further in")
        acceleration = min(path.acceleration, share * float((limits.acceleration / needs).min()))
        jerk = min(path.jerk, share * float((limits.jerk / needs).min()))
        return Chase(top, acceleration, jerk, self.cell.tick)

    def _slow_path(self, along: Floats, q: Floats, speed: float) -> None:
        """Motions while the belt is followed keep free what it needs of the joints, and the reserve."""
        self._untracked = limits = self._untracked or self.mover.limits
        n = self.cell.robot.joint_count
        part = np.ones(len(limits.speed))
        part[:n] = _SAME_PLACE * (1.0 - self.cell.tracking_reserve)
        speeds = limits.speed * part
        need = self._needs(along, q) * abs(speed)
        speeds[:n] = np.maximum(speeds[:n] - need, _LEAST_SPEED * limits.speed[:n])
        self.mover.limits = replace(
            limits,
            speed=speeds,
            acceleration=limits.acceleration * part,
            deceleration=limits.braking * part,
            jerk=limits.jerk * part,
        )
