"""Two recordings side by side: where they first part, and what each statement costs in both.

Data only; the command line prints it.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from viapoint.language.units import MM

from ..records import Event
from .info import Floats
from .reader import Recording

# m; TCP positions nearer than this are the same path: a tenth of a nanometre above the 1e-9 that a
# change of the window size may make.
SAME_POSITION = 1e-8
# s and mm: shorter than any tick and finer than any drawing; equal runs print equal digits.
SAME_TIME, SAME_LENGTH = 1e-9, 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class EventDifference:
    """The first event that differs; None on the side that has no more events."""

    index: int
    a: Event | None
    b: Event | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PathDifference:
    """Where the geometry of the path first differs, at the same length along it."""

    s_mm: float
    line_a: int
    line_b: int
    t_a: float
    t_b: float
    distance_mm: float
    largest_mm: float  # over the length both have


@dataclass(frozen=True, slots=True, kw_only=True)
class StatementTime:
    """One executed motion statement in both runs; None where one of them lacks it."""

    text: str
    line_a: int | None
    line_b: int | None
    seconds_a: float | None
    seconds_b: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    event: EventDifference | None
    path: PathDifference | None
    length_a_mm: float
    length_b_mm: float
    seconds_a: float
    seconds_b: float
    statements: tuple[StatementTime, ...]

    @property
    def same(self) -> bool:
        """Same events and same path; durations are judged by the events' times."""
        return self.event is None and self.path is None


def compare(a: Recording, b: Recording) -> Comparison:
    return Comparison(
        event=first_event_difference(a, b),
        path=first_path_difference(a, b),
        length_a_mm=float(a.trace.s[-1]) / MM,
        length_b_mm=float(b.trace.s[-1]) / MM,
        seconds_a=float(a.time[-1]),
        seconds_b=float(b.time[-1]),
        statements=tuple(_statements(a, b)),
    )


def first_event_difference(a: Recording, b: Recording) -> EventDifference | None:
    for index, (left, right) in enumerate(zip_longest(a.events, b.events)):
        if left is None or right is None or not _same_event(left, right):
            return EventDifference(index=index, a=left, b=right)
    return None


def _same_event(a: Event, b: Event) -> bool:
    if (a.kind, a.line, a.robot, a.data.keys()) != (b.kind, b.line, b.robot, b.data.keys()):
        return False
    if abs(a.t - b.t) > SAME_TIME:
        return False
    return all(_same_value(a.data[key], b.data[key]) for key in a.data)


def _same_value(a: object, b: object) -> bool:
    if isinstance(a, float) and isinstance(b, (int, float)):
        return abs(a - b) <= SAME_LENGTH
    return a == b


def first_path_difference(a: Recording, b: Recording) -> PathDifference | None:
    """Compares positions at equal lengths along the path, so that speed makes no difference.

    Where one path is longer, the shared length is compared, then the end of the shorter is the difference.
    """
    s_a, s_b = np.maximum.accumulate(a.trace.s), np.maximum.accumulate(b.trace.s)
    shared = min(s_a[-1], s_b[-1])
    s = np.unique(np.concatenate((s_a[s_a <= shared], s_b[s_b <= shared])))
    distance: Floats = np.linalg.norm(_at(a, s_a, s) - _at(b, s_b, s), axis=-1)
    # Between ticks the position is interpolated: a curve may lie off its chord by the larger sagitta.
    allowed = SAME_POSITION + _sagitta(a) + _sagitta(b)
    apart = np.flatnonzero(distance > allowed)
    if len(apart):
        first = int(apart[0])
        at, found = float(s[first]), float(distance[first])
    elif abs(s_a[-1] - s_b[-1]) > allowed:
        at, found = float(shared), float(abs(s_a[-1] - s_b[-1]))
    else:
        return None
    row_a = min(int(np.searchsorted(s_a, at)), len(s_a) - 1)
    row_b = min(int(np.searchsorted(s_b, at)), len(s_b) - 1)
    return PathDifference(
        s_mm=at / MM,
        line_a=int(a.line[row_a]),
        line_b=int(b.line[row_b]),
        t_a=float(a.time[row_a]),
        t_b=float(b.time[row_b]),
        distance_mm=found / MM,
        largest_mm=float(distance.max(initial=0.0)) / MM,
    )


def _at(recording: Recording, s: Floats, wanted: Floats) -> Floats:
    """(K, 3) positions at the lengths `wanted`; `s` never falls."""
    moved = np.concatenate(([True], np.diff(s) > 0.0))
    known, points = s[moved], recording.trace.position[moved]
    return np.stack([np.interp(wanted, known, points[:, i]) for i in range(3)], axis=-1)


def _sagitta(recording: Recording) -> float:
    """m, how far a chord between ticks can lie off the path: an eighth of the second difference."""
    points = recording.trace.position
    if len(points) < 3:
        return 0.0
    return float(np.linalg.norm(np.diff(points, n=2, axis=0), axis=-1).max()) / 8.0


def _statements(a: Recording, b: Recording) -> Iterator[StatementTime]:
    """A's motions in order of execution, then those that only B has.

    The k-th execution of a statement in A belongs to the k-th in B with the same text, for lines may have
    moved; what is left over belongs together where the line is the same: there the text has changed.
    """
    blocks_a, blocks_b = a.events_of("block"), b.events_of("block")
    partners = _pair(blocks_a, blocks_b, lambda event, run: _text(run, event), a, b)
    paired = {id(partner) for partner in partners.values()}
    left_a = [event for event in blocks_a if id(event) not in partners]
    left_b = [event for event in blocks_b if id(event) not in paired]
    partners |= _pair(left_a, left_b, lambda event, run: str(event.line), a, b)
    paired = {id(partner) for partner in partners.values()}
    for event in blocks_a:
        yield _times(a, event, b, partners.get(id(event)))
    for event in blocks_b:
        if id(event) not in paired:
            yield StatementTime(
                text=_text(b, event),
                line_a=None,
                line_b=event.line,
                seconds_a=None,
                seconds_b=_seconds(event),
            )


def _pair(
    left: Sequence[Event],
    right: Sequence[Event],
    key: Callable[[Event, Recording], str],
    a: Recording,
    b: Recording,
) -> dict[int, Event]:
    """id of an event of `left` → its partner in `right`, the k-th with a key to the k-th with the same."""
    waiting: dict[str, deque[Event]] = defaultdict(deque)
    for event in right:
        waiting[key(event, b)].append(event)
    queues = ((event, waiting.get(key(event, a))) for event in left)
    return {id(event): queue.popleft() for event, queue in queues if queue}


def _times(a: Recording, event: Event, b: Recording, partner: Event | None) -> StatementTime:
    text = _text(a, event)
    if partner is not None and _text(b, partner) != text:
        text = f"{text} → {_text(b, partner)}"
    return StatementTime(
        text=text,
        line_a=event.line,
        line_b=None if partner is None else partner.line,
        seconds_a=_seconds(event),
        seconds_b=None if partner is None else _seconds(partner),
    )


def _text(recording: Recording, event: Event) -> str:
    """The statement as written, without comment; where the source is missing its command and line."""
    code = recording.source_line(event.line).partition("//")[0]
    return " ".join(code.split()) or f"{event.data.get('command', '')} line {event.line}"


def _seconds(event: Event) -> float:
    end = event.data.get("t_end")
    return float(end) - event.t if isinstance(end, (int, float)) else 0.0
