"""What held the speed back, in words: for reports, recordings and pictures. It decides nothing."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.timing import PROGRAMMED_SPEED, UNLIMITED, TimeLaw

_ROUNDING: Final = 1e-9
"""Part of a tick by which a law may begin before a tick and count as in it."""


class Limiters:
    """Names what a law's codes stand for, in one cell."""

    def __init__(self, cell: Cell) -> None:
        self._tick = cell.tick
        self._auxiliary = AuxiliaryAxes.of(cell)
        self._joints = cell.robot.joint_count

    def longest(self, law: TimeLaw | None, first_tick: int, last_tick: int) -> str:
        """What held the speed back for most of the time between two ticks, as far as the law covers it."""
        seconds: dict[int, float] = {}
        began = 0 if law is None else math.ceil(law.t0 / self._tick - _ROUNDING)
        for code, span in self._held_back(law, max(first_tick, began), last_tick):
            seconds[code] = seconds.get(code, 0.0) + span
        return self._name(max(seconds, key=seconds.__getitem__)) if seconds else ""

    def pace(self, law: TimeLaw | None, first_tick: int, last_tick: int) -> str:
        """What held the speed back from one tick to another of a law: names with their seconds.

        As in "J2 0.113, programmed speed 0.5"; `-` where nothing does.
        """
        spans = self._held_back(law, first_tick, last_tick)
        return ", ".join(f"{self._name(code) or '-'} {seconds:.6g}" for code, seconds in spans)

    def _held_back(self, law: TimeLaw | None, first_tick: int, last_tick: int) -> list[tuple[int, float]]:
        """Codes of what held the speed back, one after the other, with their seconds."""
        if law is None or last_tick <= first_tick:
            return []
        begin, end = first_tick * self._tick - law.t0, last_tick * self._tick - law.t0
        first = min(max(int(law.t.searchsorted(begin, side="right")) - 1, 0), len(law.limiter) - 1)
        last = min(max(int(law.t.searchsorted(end)), first + 1), len(law.limiter))
        codes = law.limiter[first:last]
        changes = (codes[1:] != codes[:-1]).nonzero()[0]
        edges = [begin, *law.t[first + 1 + changes].tolist(), end]
        held = [*codes[changes].tolist(), int(codes[-1])]
        spans = zip(held, pairwise(edges), strict=True)
        return [(code, until - since) for code, (since, until) in spans if until > since]

    def _name(self, code: int) -> str:
        driven = self._joints + len(self._auxiliary)
        if code == PROGRAMMED_SPEED:
            return "programmed speed"
        if code == UNLIMITED:
            return ""
        if code < self._joints:
            return f"J{code + 1}"
        if code < driven:
            return self._auxiliary.name(code - self._joints)
        return "path" if code == driven else "orientation"
