"""Reads a recording back: ticks as whole arrays, events, program, cell, limits. Draws and judges nothing."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..records import Event, Ints, Window
from . import blocks
from .info import Floats, RunInfo
from .mcapfile import Attachment, CutOff, Message, Metadata, NotMcapError, read_items
from .wire import WireError

PACE = "pace"
EVENT_HEAD = frozenset({"t", "tick", "line", "kind", "robot"})


class RecordingError(Exception):
    """The file is no recording of viapoint, or holds no tick; the message is for the user."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """A whole run. `trace` holds all ticks as one window; `problem` says what is missing at the end."""

    info: RunInfo
    trace: Window
    events: tuple[Event, ...]
    result: Mapping[str, str]
    problem: str | None
    paces: tuple[Event, ...] = ()
    """What held each motion back, for pictures."""

    @property
    def time(self) -> Floats:
        return self.trace.time

    @property
    def line(self) -> Ints:
        return self.trace.line

    def events_of(self, kind: str) -> tuple[Event, ...]:
        return tuple(event for event in self.events if event.kind == kind)

    def source_line(self, line: int) -> str:
        """The text of a source line, "" outside of the program."""
        lines = self.info.program_source.splitlines()
        return lines[line - 1].strip() if 0 < line <= len(lines) else ""


class _Collector:
    """What the items of a file add up to."""

    def __init__(self) -> None:
        self.entries: dict[str, dict[str, str]] = {}
        self.texts: dict[str, str | None] = {}
        self.columns: list[blocks.Columns] = []
        self.first_tick = 0
        self.events: list[Event] = []
        self.problem: str | None = None

    def add(self, item: Message | Attachment | Metadata | CutOff) -> None:
        match item:
            case Message(schema="viapoint.TraceBlock", data=data):
                first, columns = blocks.decode(data)
                if not self.columns:
                    self.first_tick = first
                self.columns.append(columns)
            case Message(topic="/events", data=data):
                self.events.append(_event(json.loads(data)))
            case Message():
                pass
            case Attachment(name=name, data=data):
                self.texts[name.partition("/")[0]] = data.decode("utf-8", errors="replace")
            case Metadata(name=name, entries=entries):
                self.entries[name] = entries
            case CutOff(reason=reason):
                self.problem = reason


def _event(data: dict[str, Any]) -> Event:
    rest = {key: value for key, value in data.items() if key not in EVENT_HEAD}
    return Event(
        tick=int(data["tick"]),
        t=float(data["t"]),
        line=int(data["line"]),
        kind=str(data["kind"]),
        robot=int(data["robot"]),
        data=rest,
    )


def load_recording(path: Path) -> Recording:
    """The recording in `path`; of one cut off by a crash, everything up to the last whole chunk.

    Raises `RecordingError` with a sentence for the user.
    """
    collected = _Collector()
    try:
        for item in read_items(Path(path)):
            collected.add(item)
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror or error}") from error
    except NotMcapError as error:
        raise RecordingError(str(error)) from error
    except (WireError, ValueError, KeyError, TypeError) as error:
        collected.problem = str(error)
    try:
        info = RunInfo.from_metadata(collected.entries["viapoint"], collected.texts)
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(_explain(path, collected, "was not written by viapoint")) from error
    if not collected.columns:
        raise RecordingError(_explain(path, collected, "holds no tick"))
    try:
        trace = _join(collected)
    except (ValueError, TypeError) as error:
        raise RecordingError(f"{path}: the blocks of the trace do not fit together") from error
    problem = collected.problem
    if problem is not None:
        end = float(trace.time[-1])
        problem = f"{path} is cut off or damaged ({problem}); read up to t = {end:.3f} s"
    events = sorted(collected.events, key=lambda event: event.tick)
    return Recording(
        info=info,
        trace=trace,
        events=tuple(event for event in events if event.kind != PACE),
        paces=tuple(event for event in events if event.kind == PACE),
        result=collected.entries.get("result", {}),
        problem=problem,
    )


def _explain(path: Path, collected: _Collector, what: str) -> str:
    cause = f" (cut off or damaged: {collected.problem})" if collected.problem else ""
    return f"{path} {what}{cause}"


def _join(collected: _Collector) -> Window:
    arrays: dict[str, Any] = {}
    for name in blocks.ARRAYS:
        values = np.concatenate([columns[name] for columns in collected.columns])
        arrays[name] = values.astype(np.int64) if values.dtype.kind == "i" else values.astype(np.float64)
    return Window(first_tick=collected.first_tick, **arrays)
