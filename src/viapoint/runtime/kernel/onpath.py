"""Actions at places of a motion: where on the route they stand, and in which tick each is due.

A place counts along the TCP's path as it is run, round edges included. A time before the end is taken from
the law in force; below an override of 100 % it is as much longer as the override is lower, so that the
place stays about the same.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.kernel.buffer import Entry
from viapoint.runtime.kernel.failure import ExecutionError, PlanningError
from viapoint.runtime.kernel.motion import Mover
from viapoint.runtime.kernel.route import Route
from viapoint.vm.ports import Motion, Origin, PathAction

_SAME: Final = 1e-9
"""m of TCP path within which two places are one, and a motion has no length."""

_INSIDE: Final = 1e-6
"""m by which a place may lie outside its motion: rounding of what was programmed in mm."""

_TICK_ROUNDING: Final = 1e-6
"""Part of a tick by which an action may be late and count as in it."""


class Begin(NamedTuple):
    """Where a motion begins: tick, s of the route, TCP length travelled (m)."""

    tick: int
    s: float
    travelled: float


def check_places(actions: tuple[PathAction, ...], length: float) -> None:
    """Raise PlanningError where an action stands outside its motion of `length` m."""
    for action in actions:
        if action.origin in (Origin.START, Origin.END) and action.value * MM > length + _INSIDE:
            raise PlanningError(
                "E321",
                f"{action} lies outside the motion, whose length is {length / MM:.3f} mm",
                action.call.line,
                "choose a place on the motion, or one in percent",
            )


class Due(NamedTuple):
    """An action and where it is due: a place s of the route, or a tick."""

    action: PathAction
    s: float | None
    tick: int | None


class OnPath:
    """The actions of the motion the robot is in, or enters next."""

    def __init__(self, route: Route, mover: Mover, tick_s: float) -> None:
        self._route = route
        self._mover = mover
        self._tick_s = tick_s
        self._number = -1  # of the entry whose actions these are
        self._waiting: list[PathAction] = []
        self._places: dict[PathAction, float] = {}
        self._timed: set[PathAction] = set()  # by time before the end, and a law has been there for them

    def upcoming(self, entry: Entry, begin: Begin) -> list[Due]:
        """The actions of `entry`, which begins at `begin`, as far as it is known where they are due.

        Raises ExecutionError for a time before the end that is longer than the motion.
        """
        call = entry.call
        assert isinstance(call, Motion), "only motions have actions"
        if entry.number != self._number:
            self._number, self._waiting = entry.number, list(call.actions)
            self._places, self._timed = {}, set()
        found = []
        for action in self._waiting:
            timed = action.origin is Origin.TIME
            s = None if timed else self._place(action, entry.number, begin)
            tick = self._tick(action, entry.number, begin) if timed else None
            if s is not None or tick is not None:
                found.append(Due(action, s, tick))
        return sorted(found, key=lambda due: np.inf if due.s is None else due.s)

    def leave(self, entry: Entry) -> list[PathAction]:
        """The motion has ended: what stands at its very end, and was not due before."""
        if entry.number != self._number:
            return []
        left, self._waiting = self._waiting, []
        end = self._route.place(entry.number)
        assert end is not None, "a motion that has ended has a place"
        return [a for a in left if a.origin is Origin.TIME or self._places.get(a, np.inf) <= end + _SAME]

    def drop(self) -> None:
        """The motion ends where it is: what stood further on does not happen."""
        self._waiting = []

    def relay(self) -> None:
        """The motion is laid anew: where its actions stand is not known any more."""
        self._places, self._timed = {}, set()

    def done(self, action: PathAction) -> None:
        """The action has taken effect."""
        self._waiting.remove(action)

    def _place(self, action: PathAction, number: int, begin: Begin) -> float | None:
        """s of an action; None while its motion's end is not known, or the path not so far."""
        known = self._places.get(action)
        if known is not None:
            return known
        end = self._route.place(number)
        if action.origin is Origin.START:
            place = self._along(begin, action.value * MM, self._route.end if end is None else end)
        elif end is None:
            return None
        else:
            place = self._before(action, begin, end)
        if place is not None:
            self._places[action] = place
        return place

    def _before(self, action: PathAction, begin: Begin, end: float) -> float | None:
        length = self._route.travelled(end) - begin.travelled
        if action.origin is Origin.END:
            return self._along(begin, length - action.value * MM, end)
        if length < _SAME:  # the TCP stays where it is: what counts is the turn
            return begin.s + action.value / 100.0 * (end - begin.s)
        return self._along(begin, length * action.value / 100.0, end)

    def _along(self, begin: Begin, distance: float, end: float) -> float | None:
        """s at which the TCP has gone `distance` m from the begin; None if that lies beyond the end."""
        length = self._route.travelled(end) - begin.travelled
        if distance <= _SAME:
            return begin.s if distance >= -_INSIDE else None
        if abs(distance - length) <= _INSIDE:
            return end
        return self._route.reaching(begin.travelled + distance, begin.s, end) if distance < length else None

    def _tick(self, action: PathAction, number: int, begin: Begin) -> int | None:
        """Tick of an action before the end by time; None while the law does not reach that end."""
        law, end = self._mover.law, self._route.place(number)
        if law is None or end is None or self._mover.direction < 0.0 or end > law.s_end + _SAME:
            return None
        last = float(law.time_of(np.array([min(end, law.s_end)]))[0]) / self._tick_s
        tick = math.ceil(last - action.value / self._mover.scale / self._tick_s - _TICK_ROUNDING)
        if action not in self._timed and tick < begin.tick:
            self._waiting.remove(action)
            what = (
                f"{action} lies before the motion begins: it takes {(last - begin.tick) * self._tick_s:.3f} s"
            )
            raise ExecutionError("E405", what, action.call.line, "choose a shorter time, or `AT D0`")
        self._timed.add(action)
        return tick
