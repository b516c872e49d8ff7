"""Exclusive zones between robots: who has one, and where on its path a robot waits for one.

A robot asks for a zone when it would else begin to brake for it. A free zone goes to the robot that the
zone prefers, if it asks; then to the higher priority, then to who asked first, then to the lower number.
It is kept until the path has left it. Not here: where the zones are on the path (`guard`), nor the waiting.
"""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass, field
from typing import Final

from viapoint.runtime.cell import Cell

_HERE: Final = 1e-9
"""m of path within which a place is reached: rounding of summed lengths."""


@dataclass(frozen=True, slots=True, order=True)
class _Request:
    """Sorted in the order in which they are granted."""

    rank: tuple[bool, int]  # whether the zone prefers another robot; minus the robot's priority
    tick: int
    robot: int


class ExclusiveZones:
    """Who has which zone. Robots ask and release within a tick; `decide` follows once, after all of them."""

    def __init__(self) -> None:
        self._holders: dict[str, int] = {}
        self._asked: dict[str, dict[int, _Request]] = {}

    def holder(self, zone: str) -> int | None:
        """The robot that has the zone."""
        return self._holders.get(zone)

    def take(self, zone: str, robot: int) -> int | None:
        """A robot stands in the zone from the start; returns who has it already, if anybody has."""
        holder = self._holders.setdefault(zone, robot)
        return None if holder == robot else holder

    def ask(self, zone: str, robot: int, rank: tuple[bool, int], tick: int) -> None:
        """A robot wants the zone; asking again changes nothing."""
        if self._holders.get(zone) != robot:
            self._asked.setdefault(zone, {}).setdefault(robot, _Request(rank, tick, robot))

    def release(self, zone: str, robot: int) -> None:
        """A robot has left the zone."""
        if self._holders.get(zone) == robot:
            del self._holders[zone]

    def decide(self) -> set[int]:
        """Give free zones to those who asked; the robots that got one."""
        lucky = set()
        for zone, requests in self._asked.items():
            if requests and zone not in self._holders:
                first = min(requests.values())
                del requests[first.robot]
                self._holders[zone] = first.robot
                lucky.add(first.robot)
        return lucky


@dataclass(frozen=True, slots=True, order=True)
class Passage:
    """The route enters, or leaves, a zone at s."""

    s: float
    zone: str = field(compare=False)
    enters: bool = field(compare=False)


class ZoneAccess:
    """The zones as they lie on the route of one robot."""

    def __init__(self, zones: ExclusiveZones, cell: Cell) -> None:
        self._zones = zones
        self._robot = cell.number
        self._rank = {zone.name: (zone.priority != cell.number, -cell.priority) for zone in cell.zones}
        self._passages: list[Passage] = []  # by s

    def lay(self, passage: Passage) -> None:
        """The route has grown by a piece that enters or leaves a zone; in order."""
        self._passages.append(passage)

    def closed_gate(self, s: float) -> Passage | None:
        """Where, from s on, the route first enters a zone that the robot does not have."""
        first = bisect.bisect_left(self._passages, Passage(s - _HERE, "", True))
        ahead = self._passages[first:]
        return next((p for p in ahead if p.enters and not self._has(p.zone)), None)

    def next_place(self, s: float, direction: float) -> float | None:
        """Where the robot has to stop for a zone, from s on, forward or back; None: nowhere."""
        if direction > 0.0:
            gate = self.closed_gate(s)
            return None if gate is None else gate.s
        last = bisect.bisect_right(self._passages, Passage(s + _HERE, "", True))
        behind = self._passages[:last][::-1]
        return next((p.s for p in behind if not p.enters and not self._has(p.zone)), None)

    def ask(self, s: float, tick: int) -> None:
        """Ask for the zone whose closed gate is at s, if there is one."""
        zone = self.blocked(s)
        if zone is not None:
            self._zones.ask(zone, self._robot, self._rank[zone], tick)

    def blocked(self, s: float) -> str | None:
        """The zone that keeps the robot from going on at s; None if none does."""
        gate = self.closed_gate(s)
        return gate.zone if gate is not None and gate.s <= s + _HERE else None

    def next_exit(self, s: float) -> float:
        """s of the next place beyond s at which a zone of the robot's is left; inf where there is none."""
        first = bisect.bisect_right(self._passages, Passage(s, "", True))
        return next((p.s for p in self._passages[first:] if not p.enters and self._has(p.zone)), math.inf)

    def holder(self, zone: str) -> int | None:
        """The robot that has a zone."""
        return self._zones.holder(zone)

    def take(self, zone: str) -> int | None:
        """The robot stands in the zone from the start; returns who has it already, if anybody has."""
        return self._zones.take(zone, self._robot)

    def pass_to(self, s: float, planned: float) -> None:
        """The path has come to s, and is certain up to `planned`: zones left before it are given back.

        One that is entered again before `planned` is kept.
        """
        here = bisect.bisect_right(self._passages, Passage(s + _HERE, "", True))
        last = {p.zone: p for p in self._passages[:here]}
        again = {p.zone for p in self._passages[here:] if p.enters and p.s <= planned + _HERE}
        for zone, passage in last.items():
            if not passage.enters and zone not in again:
                self._zones.release(zone, self._robot)

    def forget(self, s: float) -> None:
        """Drop the passages before s, but for the last of each zone."""
        here = bisect.bisect_left(self._passages, Passage(s, "", True))
        last = {p.zone: p for p in self._passages[:here]}
        self._passages = sorted([*last.values(), *self._passages[here:]])

    def part(self, s: float) -> None:
        """What was laid beyond s is not travelled."""
        self._passages = [passage for passage in self._passages if passage.s <= s]

    def _has(self, zone: str) -> bool:
        return self._zones.holder(zone) == self._robot
