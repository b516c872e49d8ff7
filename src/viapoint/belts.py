"""How far, and how fast, a belt may travel while a tracked section is worked on: what a survey shows of it.

The section is planned with the belt standing at its latch. Each of its motions is then shifted along the
belt, in the configuration it was planned in, as far as it stays within reach and within the joint ranges,
and the robot out of forbidden zones and off itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import accumulate
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.workspace import TOUCH, Monitor
from viapoint.vm.ports import Dwell, Motion, Track

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.cell.model import Conveyor
    from viapoint.runtime.records import Floats
    from viapoint.surveying import Stretch, Survey

FARTHEST: Final = 5.0
"""m of travel, either way, that are looked at: beyond the reach of most arms, across all of it."""

_STEP: Final = 0.01
"""m of travel between two looks, short enough that joints are followed through their full turns."""

_THIN: Final = 0.005
"""m of way of the robot between two places of a motion that are looked at, at least: of a wire frame."""

_HALVINGS: Final = 20
"""Of a step: 10 nm are left of it."""

_SAME: Final = 6
"""Decimals (rad, m) of joints by which two motions are told apart."""

_MOST_ROUNDS: Final = 1_000
"""Passes over the stretches of a section until its times are known; with more there is a loop in it."""


@dataclass(slots=True)
class _Ride:
    """A motion on the belt: travel (m) it may have, inf where none is too far, and s from TRK to its end."""

    track: Track
    lowest: float = -np.inf
    highest: float = np.inf
    seconds: float = 0.0


def tracking(survey: Survey, cell: Cell) -> Iterator[dict[str, Any]]:
    """One row for each line of a tracked section; of all ways through it the tightest."""
    latest = _latest(survey.stretches)
    rides: dict[tuple[int, int], _Ride] = {}
    known: dict[tuple[int, int, bytes], tuple[float, float]] = {}
    monitor = Monitor(cell)
    for stretch in survey.stretches:
        begin = latest.get(stretch.source, 0.0)
        for block, end in zip(stretch.planned.blocks, _ends(stretch), strict=True):
            if block.track is None or block.joints is None:
                continue
            ride = rides.setdefault((block.line, block.track.line), _Ride(block.track))
            motion = stretch.calls[block.number]
            assert isinstance(motion, Motion), "a block is a motion's"
            key = (block.track.conveyor, motion.tool, np.round(block.joints, _SAME).tobytes())
            if key not in known:
                watched = _Watched(monitor, motion.tool) if monitor.active else None
                known[key] = reach(cell, cell.conveyors[block.track.conveyor], block.joints, watched)
            low, high = known[key]
            ride.lowest, ride.highest = max(ride.lowest, low), min(ride.highest, high)
            ride.seconds = max(ride.seconds, begin + end)
    for (line, _), ride in sorted(rides.items()):
        yield _row(line, ride, _taken(cell.conveyors[ride.track.conveyor]))


def _row(line: int, ride: _Ride, taken: float) -> dict[str, Any]:
    def tidy(value: float) -> float | None:
        return round(value / MM, 3) + 0.0 if np.isfinite(value) else None

    seconds = ride.seconds if np.isfinite(ride.seconds) else np.nan  # it may take any time: no speed is known

    return {
        "line": line,
        "track_line": ride.track.line,
        "conveyor": ride.track.conveyor,
        "from_mm": tidy(ride.lowest),
        "to_mm": tidy(ride.highest),
        "slowest_mm_s": tidy((ride.lowest - taken) / seconds),
        "fastest_mm_s": tidy((ride.highest - taken) / seconds),
    }


def _taken(conveyor: Conveyor) -> float:
    """m behind the latch at which a section begins: where a belt that runs forward brings its part first."""
    parts = conveyor.parts
    return 0.0 if parts is None else max(parts.window[0], parts.trigger) - parts.taught


# --- travel -------------------------------------------------------------------------------------


class _Watched:
    """The rules of the workspace along a motion, with few looks: a clearance vouches for what is as near."""

    def __init__(self, monitor: Monitor, tool: int) -> None:
        self._monitor = monitor
        self._tool = tool
        self._pace = monitor.pace(tool)
        self._step = max(monitor.body(tool).thinnest, _THIN)
        self._seen: tuple[Floats, float] | None = None  # joints (N, n) looked at last, and their clearance

    def allows(self, joints: Floats) -> bool:
        """Whether the robot breaks no rule along a motion, joints (N, n) at places along it."""
        if self._seen is not None:
            before, clearance = self._seen
            if float((np.abs(joints - before) @ self._pace).max()) < clearance:
                return True
        steps = np.ceil(np.abs(np.diff(joints, axis=0)) @ self._pace / self._step).astype(int)
        parts = [
            np.linspace(a, b, max(k, 1), endpoint=False)
            for a, b, k in zip(joints, joints[1:], steps, strict=False)
        ]
        clearances, _ = self._monitor.clearances(np.concatenate((*parts, joints[-1:])), self._tool)
        clearance = float(clearances.min())
        self._seen = joints.copy(), clearance
        return clearance >= -TOUCH


def reach(
    cell: Cell, conveyor: Conveyor, joints: Floats, watched: _Watched | None = None
) -> tuple[float, float]:
    """Travel (m) up to which a motion, joints (N, n), can be run; inf beyond `FARTHEST`."""
    along = conveyor.X_base_belt[:3, 0]
    return -_farthest(cell, -along, joints, watched), _farthest(cell, along, joints, watched)


def _farthest(cell: Cell, along: Floats, joints: Floats, watched: _Watched | None) -> float:
    """Travel along a direction (3,) in the base; the joints are followed from pose to pose."""
    robot = cell.robot
    poses, configurations = robot.fk(joints), robot.configuration(joints)
    shifted = poses.copy()

    def at(travel: float, near: Floats) -> Floats | None:
        shifted[:, :3, 3] = poses[:, :3, 3] + travel * along
        q, reachable = robot.ik_branch(shifted, configurations, near)
        good = bool(reachable.all() and robot.limits.contain(q).all())
        return q if good and (watched is None or watched.allows(q)) else None

    near, travel = joints, 0.0
    for k in range(round(FARTHEST / _STEP)):
        travel = k * _STEP
        found = at(travel + _STEP, near)
        if found is None:
            break
        near = found
    else:
        return np.inf
    step = _STEP
    for _ in range(_HALVINGS):
        step *= 0.5
        if (found := at(travel + step, near)) is not None:
            travel, near = travel + step, found
    return travel


# --- times --------------------------------------------------------------------------------------


def _ends(stretch: Stretch) -> list[float]:
    """When each block is over, s from the stretch's begin; with folded rounds, when the last one is.

    A stretch ends at a wait: there is none before or between its blocks.
    """
    blocks = stretch.planned.blocks
    if any(weight > 1 for weight in stretch.weights):
        return [_seconds(stretch)] * len(blocks)
    return list(accumulate(block.seconds for block in blocks))


def _seconds(stretch: Stretch) -> float:
    moving = sum(stretch.weights[block.number] * block.seconds for block in stretch.planned.blocks)
    waits = zip(stretch.calls, stretch.weights, strict=True)
    return moving + sum(often * call.seconds for call, often in waits if isinstance(call, Dwell))


def _latest(stretches: list[Stretch]) -> dict[int, float]:
    """Node → s since the TRK before it, on the slowest way; inf where a way goes round in the section."""
    latest: dict[int, float] = {}
    for count in range(_MOST_ROUNDS):
        changed = False
        for stretch in stretches:
            target, track = stretch.target, stretch.planned.end.track
            if target is None or track is None:
                continue
            begins = bool(stretch.calls) and isinstance(stretch.calls[-1], Track)
            seconds = 0.0 if begins else latest.get(stretch.source, 0.0) + _seconds(stretch)
            if seconds > latest.get(target, -1.0):
                latest[target] = np.inf if count > len(stretches) else seconds
                changed = True
        if not changed:
            return latest
    return dict.fromkeys(latest, np.inf)
