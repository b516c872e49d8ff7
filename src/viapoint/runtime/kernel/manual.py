"""Jogging by hand: the robot moves while it is asked to, off any path; and being told where it stands.

A jog begins and ends at rest, with no program under way. Afterwards the path begins anew where the robot
stands: whoever owns the kernel makes another one. Not here: how the robot is kept within its limits.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

import numpy as np

from viapoint.runtime.kernel.breaks import Start
from viapoint.runtime.kernel.jogger import Demand, Jogger
from viapoint.runtime.kernel.motion import Rows
from viapoint.runtime.kernel.outlet import Present
from viapoint.runtime.kernel.referencing import out_of_range
from viapoint.runtime.kernel.states import Command, Hold, State
from viapoint.runtime.kernel.telemetry import Told
from viapoint.runtime.kernel.tracking import Tracking
from viapoint.runtime.records import Window
from viapoint.runtime.signals import SignalWorld


class Manual(Tracking):
    """The side of a kernel that a jog key sees."""

    world: SignalWorld
    by_hand = False
    """The robot was moved off its path: it takes no program any more."""
    _jogger: Jogger | None = None
    _lets_go: int | None = None  # the tick with which the demand runs out
    _jogged = 0.0  # m of the TCP's way of this jog that were sent

    @property
    @abstractmethod
    def _now(self) -> Present:
        """What holds in all ticks of a window."""

    @property
    @abstractmethod
    def _told(self) -> Told:
        """What is told of the present tick."""

    def jog(self, demand: Demand, ticks: int | None = None) -> str | None:
        """Move as demanded from the next tick on, for so many ticks, or until `let_go`.

        Another demand takes the place of the one before; the same one is held longer. Answers why it is
        refused: then nothing changes.
        """
        refused = self.refusal(Command.JOG)
        if refused is None and self.outlet.feed.displaces:
            refused = "corrections are at work"
        if refused is None and self._jogging_share == 0.0:
            refused = "the override is 0"
        if refused is not None:
            return refused
        self._lets_go = None if ticks is None else self.trace.tick + ticks
        jogger = self._jogger
        if jogger is None:
            axes = self.telemetry.columns[:-4].copy()
            jogger = Jogger(self.cell, self.planner.monitor, axes, self.execution.tool)
        before = jogger.demand
        if before is not None and before.name == demand.name and (before.rates == demand.rates).all():
            return None
        obstacle = jogger.ask(demand, self._jogging_share)
        if obstacle is not None:
            return obstacle.reason
        self._jogger, self.state, self.by_hand = jogger, State.JOGGING, True
        self.trace.emit("jog", 0, axis=demand.name, action="held")
        return None

    def let_go(self) -> str | None:
        """End the demand: the robot comes to rest within its limits."""
        refused = self.refusal(Command.LET_GO)
        if refused is None:
            self._release_jog("let go")
        return refused

    @property
    def here(self) -> Start:
        """Where and when the robot stands."""
        joints, auxiliary = self.telemetry.joints.copy(), self.telemetry.auxiliary.copy()
        return Start(self.trace.tick, joints, auxiliary, self.execution.tool)

    def refuses_to_stand(self, there: Start) -> str | None:
        """Why the robot cannot be said to stand there now; None if it can."""
        refused = self.refusal(Command.REFERENCE)
        if refused is None and self.outlet.feed.displaces:
            refused = "corrections are at work"
        refused = refused or out_of_range(self.cell, there)
        if refused is None and (error := self.guard.standing(there.joints, there.tool, 0)) is not None:
            refused = error.message
        return refused

    def tell_reference(self, axes: Mapping[str, float]) -> None:
        """The robot was said to stand here: the axes named, deg or mm."""
        self.trace.emit("reference", 0, tick=None, **{name: float(value) for name, value in axes.items()})

    @property
    def _jogging_share(self) -> float:
        """Of the rates: the way back along a path is no way of a jog."""
        return 0.0 if self._paused else self.mover.override

    @property
    def _moving_by_hand(self) -> Jogger:
        assert self._jogger is not None, "only while it jogs"
        return self._jogger

    def _release_jog(self, action: str) -> None:
        jogger = self._moving_by_hand
        if jogger.demand is not None:
            self.trace.emit("jog", 0, axis=jogger.demand.name, action=action)
            jogger.ask(None, self._jogging_share)

    def _jog(self, ticks: int) -> Window:
        """At least one and at most so many ticks of a jog."""
        jogger, first = self._moving_by_hand, self.trace.tick + 1
        if self._lets_go is not None and jogger.demand is not None:
            ticks = min(ticks, max(self._lets_go - self.trace.tick, 1))
        if (pulse := self.execution.pulses.next_end) is not None:
            ticks = min(ticks, max(pulse - self.trace.tick, 1))
        if jogger.at_rest:  # let go before it had set out
            window = self.telemetry.standing(first, 1, self._told, self._now.status)
            self.trace.tick = first
            self.world.advance(first)
            self._stand_still()
            return window
        axes, lengths = jogger.look(ticks)
        columns = np.tile(self.telemetry.columns, (len(axes), 1))
        columns[:, :-4] = axes
        columns[:, -2] += lengths - self._jogged
        rows = self.guard.watch(
            Rows(np.full(len(axes), self.mover.s), columns, arrived=False),
            self.telemetry.joints,
            self.execution.tool,
            0,
        )
        used = len(rows.s)
        jogger.commit(used)
        window = self.telemetry.window(first, rows.columns, [(0, self._told)], self._now.status)
        self._jogged = float(lengths[used - 1])
        self.trace.tick = first + used - 1
        self.world.advance(self.trace.tick)
        self.execution.end_pulses()
        self.guard.sent(used, 0)
        if jogger.at_rest:
            self._stand_still()
        elif self._lets_go == self.trace.tick:
            self._release_jog("let go")
        return window

    def _stand_still(self) -> None:
        """The jog has come to rest: by itself, or because it was told to."""
        jogger, self._jogger, self._jogged = self._moving_by_hand, None, 0.0
        if jogger.obstacle is not None and jogger.demand is not None:
            code, reason, _ = jogger.obstacle
            name = jogger.demand.name
            self.trace.emit("jog", 0, axis=name, action="stopped", code=code, reason=reason)
        ended = {Hold.STOP: State.STOPPED, Hold.EMERGENCY: State.EMERGENCY}
        self.state = ended.get(self._hold, State.READY)

    def reset(self) -> str | None:
        refused = super().reset()
        if refused is None and self.by_hand:  # there is nothing to go on with
            self._hold, self.state = Hold.NONE, State.READY
        return refused

    def _hold_back(self, hold: Hold, deceleration_factor: float = 1.0) -> None:
        if self.state is not State.JOGGING:
            super()._hold_back(hold, deceleration_factor)
        elif hold.value > self._hold.value:
            self._hold = hold
            jogger = self._moving_by_hand
            if jogger.demand is not None:
                self.trace.emit("jog", 0, axis=jogger.demand.name, action="let go")
            jogger.brake(deceleration_factor)

    def _scale(self, override: float) -> None:
        super()._scale(override)
        if self.state is State.JOGGING:
            jogger = self._moving_by_hand
            if self._jogging_share == 0.0:
                self._release_jog("let go")
            elif jogger.demand is not None:
                jogger.ask(jogger.demand, self._jogging_share)
