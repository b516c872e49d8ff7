"""What a survey says to the user: rows in mm, deg and s, each place told once; and times of whole ways."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from viapoint.belts import tracking
from viapoint.language.units import DEG, MM
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.surveying import ROUNDS
from viapoint.vm.ports import Dwell, End, Motion, MotionKind

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.kernel import Corner
    from viapoint.runtime.kernel.course import Slowdown
    from viapoint.runtime.kernel.forecast import BlockForecast
    from viapoint.surveying import Stretch, Survey

Row = dict[str, Any]

_TANGENTIAL: Final = 1.0 - 1e-6
"""Cosine of the angle between two directions that are one: 0.08 deg."""

_DIGITS: Final = 9
"""Decimals that leave the rounding of the units out."""


@dataclass(frozen=True, slots=True)
class CostlyStop:
    """The path stops behind the motion of `line`, for the statement in `by_line`; it could run through."""

    line: int
    by_line: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Outlook:
    """Rows of the JSON contract of `check`, and what they make worth saying."""

    blends: tuple[Row, ...] = ()
    statements: tuple[Row, ...] = ()
    slowdowns: tuple[Row, ...] = ()
    zones: tuple[Row, ...] = ()
    configurations: tuple[Row, ...] = ()
    tracking: tuple[Row, ...] = ()
    cycle: Row | None = None
    stops: tuple[CostlyStop, ...] = ()


def outlook(survey: Survey, cell: Cell) -> Outlook:
    """All rows of a survey, in the order of lines."""
    return Outlook(
        blends=tuple(_blends(survey)),
        statements=tuple(_statements(survey)),
        slowdowns=tuple(_slowdowns(survey, cell)),
        zones=tuple(_zones(survey)),
        configurations=tuple(_configurations(survey)),
        tracking=tuple(tracking(survey, cell)),
        cycle=_cycle(survey),
        stops=tuple(_costly_stops(survey)),
    )


def _all(survey: Survey) -> Sequence[Stretch]:
    """Those of the program and of what interrupts it."""
    return (*survey.stretches, *survey.beside)


def _tidy(value: float) -> float:
    """Without the rounding noise of the units."""
    return round(value, _DIGITS) + 0.0


# --- corners ------------------------------------------------------------------------------------


def _blends(survey: Survey) -> Iterator[Row]:
    """Rows of the blend report; between two joint moves R is in deg, whatever its key says."""
    corners: dict[tuple[int, int | None], Corner] = {}
    edges: dict[int, float | None] = {}
    joint_lines: set[int] = set()
    for stretch in _all(survey):
        for call in stretch.calls:
            if isinstance(call, Motion):
                edges[call.line] = call.round_edge
                if call.kind in (MotionKind.JOINT, MotionKind.HOME):
                    joint_lines.add(call.line)
        endless = stretch.target is None and not stretch.ends and stretch.planned.failure is None
        for corner in stretch.planned.corners[: -1 if endless else None]:  # it would go on
            corners.setdefault((corner.line, corner.next_line), corner)
    for line, following in sorted(corners, key=lambda key: (key[0], key[1] or 0)):
        corner = corners[line, following]
        passed = corner.transition
        unit = DEG if {line, following} <= joint_lines else MM
        yield {
            "line": line,
            "next_line": following,
            "asked_mm": edges[line],
            "effective_mm": _tidy(passed.effective / unit),
            "stop": passed.stop,
            "forced_by_line": corner.forced_by_line,
            "reason": passed.reason.value,
        }


# --- times --------------------------------------------------------------------------------------


def _statements(survey: Survey) -> Iterator[Row]:
    """What each statement takes: of all ways through it the one that takes longest."""
    longest: dict[int, BlockForecast] = {}
    shortest: dict[int, float] = {}
    waits: dict[int, float] = {}
    for stretch in _all(survey):
        for block in stretch.planned.blocks:
            shortest[block.line] = min(shortest.get(block.line, block.seconds), block.seconds)
            if block.line not in longest or block.seconds > longest[block.line].seconds:
                longest[block.line] = block
        for call in stretch.calls:
            if isinstance(call, Dwell):
                waits[call.line] = call.seconds
    rows = [_moving(block, shortest[line]) for line, block in longest.items()]
    rows += [_waiting(line, seconds) for line, seconds in waits.items()]
    yield from sorted(rows, key=lambda row: row["line"])


def _moving(block: BlockForecast, shortest: float) -> Row:
    return {
        "line": block.line,
        "command": block.command,
        "time_s": _tidy(block.seconds),
        "shortest_s": _tidy(shortest),
        "stopping_s": round(block.starting + block.stopping, 4) + 0.0,
        "length_mm": round(block.length / MM, 6) + 0.0,
        "peak_mm_s": round(block.peak / MM, 4) + 0.0,
        "limited_by": block.limited_by,
    }


def _waiting(line: int, seconds: float) -> Row:
    return {
        "line": line,
        "command": "WAIT",
        "time_s": seconds,
        "shortest_s": seconds,
        "stopping_s": 0.0,
        "length_mm": 0.0,
        "peak_mm_s": 0.0,
        "limited_by": "",
    }


def _cycle(survey: Survey) -> Row | None:
    """Times of the whole program, or of one pass of its endless loop; waits for the world take none.

    `longest_s` is null where a way can go round: there is no longest.
    """
    if survey.failures or survey.cut_at is not None:
        return None
    stretches, middle = survey.stretches, None
    if survey.passes is not None:
        stretches, middle = survey.passes, ROUNDS - 1
    if not any(each.ends for each in stretches):
        return None
    weights = [_weight(each, middle) for each in stretches]
    longest = _longest(stretches, weights)
    return {
        "of": "program" if middle is None else "pass",
        "shortest_s": _tidy(_shortest(stretches, weights)),
        "longest_s": None if longest is None else _tidy(longest),
    }


def _weight(stretch: Stretch, middle: int | None) -> float:
    """Seconds of a stretch, as far as they belong to that pass."""
    often = [
        weight if middle is None or count == middle else 0
        for count, weight in zip(stretch.cycles, stretch.weights, strict=True)
    ]
    moving = sum(often[block.number] * block.seconds for block in stretch.planned.blocks)
    waits = zip(stretch.calls, often, strict=True)
    return moving + sum(times * call.seconds for call, times in waits if isinstance(call, Dwell))


def _shortest(stretches: Sequence[Stretch], weights: Sequence[float]) -> float:
    """Time of the quickest way from the start to an end."""
    leaving = _by_source(stretches)
    queue: list[tuple[float, int]] = [(0.0, 0)]
    done: set[int] = set()
    best = np.inf
    while queue:
        seconds, node = heappop(queue)
        if node in done or seconds >= best:
            continue
        done.add(node)
        for k in leaving.get(node, ()):
            target = stretches[k].target
            if target is None:
                best = min(best, seconds + weights[k])
            else:
                heappush(queue, (seconds + weights[k], target))
    return best


def _longest(stretches: Sequence[Stretch], weights: Sequence[float]) -> float | None:
    """Time of the slowest way from the start to an end; None where ways go round."""
    leaving = _by_source(stretches)
    arriving: dict[int, int] = {}
    for stretch in stretches:
        if stretch.target is not None:
            arriving[stretch.target] = arriving.get(stretch.target, 0) + 1
    if 0 in arriving:
        return None
    latest, ready, passed = {0: 0.0}, [0], 0
    longest = 0.0
    while ready:
        node = ready.pop()
        passed += 1
        for k in leaving.get(node, ()):
            target, seconds = stretches[k].target, latest[node] + weights[k]
            if target is None:
                longest = max(longest, seconds)
                continue
            latest[target] = max(latest.get(target, 0.0), seconds)
            arriving[target] -= 1
            if arriving[target] == 0:
                ready.append(target)
    return longest if passed == len(arriving) + 1 else None


def _by_source(stretches: Sequence[Stretch]) -> dict[int, list[int]]:
    leaving: dict[int, list[int]] = {}
    for k, stretch in enumerate(stretches):
        leaving.setdefault(stretch.source, []).append(k)
    return leaving


def _costly_stops(survey: Survey) -> Iterator[CostlyStop]:
    """Stops that statements force where the path could run through: what stopping and starting loses."""
    leaving = _by_source(survey.stretches)
    worst: dict[tuple[int, int], float] = {}
    for stretch in survey.stretches:
        planned, by = stretch.planned, stretch.calls[-1] if stretch.calls else None
        if not planned.blocks or stretch.target is None or by is None or isinstance(by, (Motion, End)):
            continue
        before = stretch.calls[planned.blocks[-1].number]
        assert isinstance(before, Motion), "blocks are of motions"
        for k in leaving.get(stretch.target, ()):
            after = survey.stretches[k].planned
            if after.blocks and (before.round_edge or _tangential(planned.arrives, after.leaves)):
                key = (before.line, by.line)
                lost = planned.blocks[-1].stopping + after.blocks[0].starting
                worst[key] = max(worst.get(key, 0.0), lost)
    for (line, by_line), seconds in sorted(worst.items()):
        yield CostlyStop(line, by_line, seconds)


def _tangential(arrives: Any, leaves: Any) -> bool:
    return arrives is not None and leaves is not None and float(arrives @ leaves) > _TANGENTIAL


# --- what the robot passes ----------------------------------------------------------------------


def _slowdowns(survey: Survey, cell: Cell) -> Iterator[Row]:
    """The slowest place of each line that an axis slows in its middle."""
    slowest: dict[int, Slowdown] = {}
    for stretch in _all(survey):
        for each in stretch.planned.slowdowns:
            if each.line not in slowest or each.speed < slowest[each.line].speed:
                slowest[each.line] = each
    for line, found in sorted(slowest.items()):
        unit = DEG if found.in_place else MM
        yield {
            "line": line,
            "axis": axis_name(cell, found.axis),
            "place_mm": round(found.place / MM, 3) + 0.0,
            "asked": round(found.speed_asked / unit, 3) + 0.0,
            "slowed_to": round(found.speed / unit, 3) + 0.0,
            "unit": "deg/s" if found.in_place else "mm/s",
            "singular": found.singular,
        }


def axis_name(cell: Cell, axis: int) -> str:
    """As the language says it: J1…, E1…"""
    joints = cell.robot.joint_count
    return f"J{axis + 1}" if axis < joints else AuxiliaryAxes.of(cell).name(axis - joints)


def _zones(survey: Survey) -> Iterator[Row]:
    seen = {
        (each.line, each.zone, each.enters) for stretch in _all(survey) for each in stretch.planned.passings
    }
    for line, zone, enters in sorted(seen):
        yield {"line": line, "zone": zone, "action": "enters" if enters else "leaves"}


def _configurations(survey: Survey) -> Iterator[Row]:
    """Lines that end in another configuration than they began in."""
    seen = {
        (block.line, *block.turned)
        for stretch in _all(survey)
        for block in stretch.planned.blocks
        if block.turned[0] != block.turned[1]
    }
    for line, before, after in sorted(seen):
        yield {"line": line, "from": before, "to": after}
