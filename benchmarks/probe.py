"""A session with its planning timed: what each block of a program cost to plan, and what the whole run cost.

Planning a block is its geometry and inverse kinematics, and its share of the time laws: the cost of a call
that plans several blocks at once is divided among those it newly covers; one that covers none counts for
the next. Times are CPU times of this process.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from viapoint.session import Session
from viapoint.vm.ports import Motion

Floats = npt.NDArray[np.float64]


@dataclass
class Planned:
    """What the planning of a run cost: s per block, and s per single call."""

    blocks: Floats
    longest_call: float

    def quantile(self, share: float) -> float:
        """ms per block."""
        return float(np.quantile(self.blocks, share)) * 1e3 if len(self.blocks) else 0.0


@dataclass
class Cost:
    """A run: simulated time, ticks, wall and CPU time, planning."""

    simulated: float
    ticks: int
    wall: float
    cpu: float
    planned: Planned
    session: Session

    @property
    def times_real(self) -> float:
        return self.simulated / self.wall

    @property
    def times_real_cpu(self) -> float:
        return self.simulated / self.cpu


@dataclass
class _Call:
    """One timed call: seconds, and the interval it newly covers (entry numbers or s)."""

    seconds: float
    begin: float
    end: float


@dataclass
class _Log:
    geometry: list[_Call] = field(default_factory=list)
    timing: list[_Call] = field(default_factory=list)
    places: dict[int, float] = field(default_factory=dict)


def machine() -> str:
    """How fast this machine is at what most of a run is: interpreting Python."""
    begin, total = time.perf_counter(), 0
    for k in range(2_000_000):
        total += k
    return (
        f"this machine: {2.0 / (time.perf_counter() - begin):.1f} million turns/s of a loop of one addition"
    )


def run(session: Session) -> Cost:
    """The session to its end, timed. Raises SystemExit if it ends with an error."""
    log = _Log()
    _watch(session, log)
    wall, cpu = time.perf_counter(), time.process_time()
    session.finish()
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    if session.failure is not None:
        raise SystemExit(f"{session.program.source.name}: {session.failure}")
    kernel = session.kernel
    return Cost(kernel.tick * session.cell.tick, kernel.tick, wall, cpu, _planned(log), session)


def _watch(session: Session, log: _Log) -> None:
    kernel = session.kernel
    planner, mover, blocks = kernel.planner, kernel.mover, kernel.execution.blocks
    route = planner.route
    buffer: Any = planner._buffer

    def covered() -> float:
        return max(covered_to[0], mover.law.s_end if mover.law is not None else 0.0)

    covered_to = [0.0]
    planner.plan = _timed(planner.plan, log.geometry, lambda: buffer.planner)  # type: ignore[method-assign]
    for name in ("start", "extend"):
        setattr(mover, name, _timed(getattr(mover, name), log.timing, covered, covered_to))
    finish = blocks.finish

    def finished(motion: Motion, number: int) -> None:
        place = route.place(number)
        log.places[number] = 0.0 if place is None else place
        finish(motion, number)

    blocks.finish = finished  # type: ignore[method-assign]


def _timed(
    work: Callable[..., Any],
    calls: list[_Call],
    reached: Callable[[], float],
    keep: list[float] | None = None,
) -> Callable[..., Any]:
    def timed(*arguments: Any, **named: Any) -> Any:
        begin, start = reached(), time.process_time()
        result = work(*arguments, **named)
        seconds, end = time.process_time() - start, reached()
        if keep is not None:
            keep[0] = end
        calls.append(_Call(seconds, begin, end))
        return result

    return timed


def _planned(log: _Log) -> Planned:
    numbers = np.array(sorted(log.places), dtype=np.float64)
    places = np.array([log.places[int(n)] for n in numbers])
    cost = _shares(log.geometry, numbers + 1.0) + _shares(log.timing, places)
    longest = max((call.seconds for call in (*log.geometry, *log.timing)), default=0.0)
    return Planned(cost, longest)


def _shares(calls: list[_Call], ends: Floats) -> Floats:
    """Seconds (N,) of the blocks with these ends: a call's are divided among the ends in (begin, end]."""
    cost, carried = np.zeros(len(ends)), 0.0
    for call in calls:
        carried += call.seconds
        mine = np.flatnonzero((ends > call.begin + 1e-9) & (ends <= call.end + 1e-9))
        if len(mine):
            cost[mine] += carried / len(mine)
            carried = 0.0
    return cost
