"""Blocks of ticks: windows joined and cut to one size, and each as a TraceBlock message and back.

A block ends every `BLOCK_TICKS` ticks, whatever the windows: a recording does not show their size.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields

import numpy as np

from ..records import Window
from .info import Floats
from .schemas import ANY, AXES, COLUMNS, FIRST_TICK
from .wire import WireError, bytes_field, read_fields, varint_field

# One second at 1 ms: what a crash may cost, and little enough overhead per tick.
BLOCK_TICKS = 1000

Columns = dict[str, Floats]

ARRAYS = tuple(f.name for f in dataclass_fields(Window) if f.name != "first_tick")


@dataclass(frozen=True, slots=True, kw_only=True)
class Joined(Window):
    """A window with what stood before it, for derivatives and lines that go on."""

    earlier_joints: Floats  # (0…2, n) the rows before
    earlier_actual: Floats  # (0…2, n)
    last_position: Floats | None  # (3,) the row before

    def derivatives(self, tick_s: float) -> tuple[Floats, Floats]:
        """(N, n) speeds and accelerations of the actual joints, backward differences; 0 before t = 0."""
        missing = 2 - len(self.earlier_actual)
        first = self.earlier_actual[:1] if len(self.earlier_actual) else self.actual[:1]
        padding = np.repeat(first, missing, axis=0)
        joints = np.concatenate((padding, self.earlier_actual, self.actual))
        speed = np.diff(joints, axis=0) / tick_s
        return speed[1:], np.diff(speed, axis=0) / tick_s

    def joint_steps(self) -> Floats:
        """(N,) largest change of a set point since the tick before."""
        before = self.earlier_joints[-1:] if len(self.earlier_joints) else self.joints[:1]
        steps: Floats = np.abs(np.diff(np.concatenate((before, self.joints)), axis=0)).max(axis=-1)
        return steps

    def encode(self) -> bytes:
        """As a viapoint.TraceBlock."""
        parts = [varint_field(FIRST_TICK, self.first_tick), varint_field(AXES, self.joints.shape[1])]
        for column in COLUMNS:
            values = getattr(self, column.name)
            if column.name == "actual" and np.array_equal(values, self.joints):
                continue
            parts.append(bytes_field(column.number, values.astype(column.type, order="C").tobytes()))
        return b"".join(parts)


def decode(data: bytes) -> tuple[int, Columns]:
    """The first tick and the arrays of a TraceBlock; `WireError` where the bytes are not one."""
    found = dict(read_fields(data))
    axes, first = found.get(AXES), found.get(FIRST_TICK, 0)
    if not isinstance(axes, int) or not isinstance(first, int):
        raise WireError("a trace block without its axes")
    columns: Columns = {}
    for column in COLUMNS:
        raw = found.get(column.number, b"")
        if not isinstance(raw, bytes) or len(raw) % np.dtype(column.type).itemsize:
            raise WireError(f"column {column.name} is mangled")
        values = np.frombuffer(raw, dtype=column.type)
        if column.width == ANY:
            columns[column.name] = _even_rows(values, len(columns["time"]))
        else:
            width = axes if column.width == 0 else column.width
            columns[column.name] = values if width == 1 and column.width else _rows(values, width)
    if not len(columns["actual"]):
        columns["actual"] = columns["joints"]
    if len({len(values) for values in columns.values()}) != 1:
        raise WireError("the columns of a trace block differ in length")
    return first, columns


def _rows(values: Floats, width: int) -> Floats:
    if width == 0 or len(values) % width:
        raise WireError("a column of a trace block is not a whole number of rows")
    return values.reshape(-1, width)


def _even_rows(values: Floats, count: int) -> Floats:
    if len(values) % max(count, 1):
        raise WireError("a column of a trace block is not a whole number of rows")
    return values.reshape(count, len(values) // max(count, 1))


def join(windows: Sequence[Window]) -> Window:
    """One window of consecutive ones, at least one."""
    arrays = {name: np.concatenate([getattr(window, name) for window in windows]) for name in ARRAYS}
    return Window(first_tick=windows[0].first_tick, **arrays)


class BlockBuilder:
    """Joins windows of any size into blocks of `BLOCK_TICKS`."""

    def __init__(self) -> None:
        self._waiting: list[Window] = []
        self._count = 0
        self._before: Joined | None = None

    def add(self, window: Window) -> Iterator[Joined]:
        """The blocks that are complete with `window`."""
        if len(window):
            self._waiting.append(window)
            self._count += len(window)
        while self._count >= BLOCK_TICKS:
            yield self._take(BLOCK_TICKS)

    def rest(self) -> Joined | None:
        """The last, incomplete block."""
        return self._take(self._count) if self._count else None

    def _take(self, count: int) -> Joined:
        joined = {
            name: np.concatenate([getattr(w, name) for w in self._waiting])
            if len(self._waiting) > 1
            else getattr(self._waiting[0], name)
            for name in ARRAYS
        }
        first_tick = self._waiting[0].first_tick
        block = Joined(
            first_tick=first_tick,
            earlier_joints=self._earlier("joints", joined["joints"]),
            earlier_actual=self._earlier("actual", joined["actual"]),
            last_position=None if self._before is None else self._before.position[-1],
            **{name: values[:count] for name, values in joined.items()},
        )
        rest = Window(first_tick=first_tick + count, **{n: v[count:] for n, v in joined.items()})
        self._waiting = [rest] if len(rest) else []
        self._count -= count
        self._before = block
        return block

    def _earlier(self, name: str, like: Floats) -> Floats:
        rows: Floats = like[:0] if self._before is None else getattr(self._before, name)[-2:]
        return rows
