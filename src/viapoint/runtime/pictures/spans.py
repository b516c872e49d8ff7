"""Motion statements in time, one after the other, as pictures show them."""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from dataclasses import dataclass, replace

from viapoint.runtime.records import Event


@dataclass(frozen=True, slots=True)
class Span:
    """One motion statement, or what an interrupt has left of it in one piece, in time, s."""

    start: float
    end: float
    line: int
    command: str


def spans_of(events: Sequence[Event]) -> list[Span]:
    """The motion statements of a run; one that was interrupted is there before and behind what did it."""
    whole = [
        Span(e.t, float(e.data["t_end"] or e.t), e.line, str(e.data["command"]))
        for e in events
        if e.kind == "block"
    ]
    whole.sort(key=lambda span: span.start)
    starts = [span.start for span in whole]
    pieces: list[Span] = []
    for span in whole:
        within = whole[bisect.bisect_right(starts, span.start) : bisect.bisect_left(starts, span.end)]
        pieces += _uninterrupted(span, [each for each in within if each.end < span.end])
    return sorted(pieces, key=lambda span: (span.start, span.end))


def _uninterrupted(span: Span, inside: Sequence[Span]) -> list[Span]:
    """What of a span is before, between and behind those inside it."""
    if not inside:
        return [span]
    starts = [span.start, *(each.end for each in inside)]
    ends = [*(each.start for each in inside), span.end]
    return [replace(span, start=a, end=b) for a, b in zip(starts, ends, strict=True) if b > a]
