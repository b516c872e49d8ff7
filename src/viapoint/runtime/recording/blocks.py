"""Blocks of ticks: windows joined and cut to one size, and each as a TraceBlock message and back.

A block ends every `BLOCK_TICKS` ticks, whatever the windows: a recording does not show their size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields
from typing import Any

import numpy as np
import numpy.typing as npt

from ..records import Window
from .info import Floats
from .mcapwriter import Buffer
from .schemas import ANY, AXES, COLUMNS, FIRST_TICK
from .wire import LENGTH, WireError, read_fields, tag, varint, varint_field

# Two seconds at 1 ms: what a crash may cost, and little enough overhead per tick.
BLOCK_TICKS = 2000

Columns = dict[str, Floats]

ARRAYS = tuple(f.name for f in dataclass_fields(Window) if f.name != "first_tick")


@dataclass(frozen=True, slots=True, kw_only=True)
class Joined(Window):
    """A window with what stood before it, for derivatives and lines that go on."""

    earlier_joints: Floats  # (0…2, n) the rows before
    earlier_actual: Floats  # (0…2, n)
    last_position: Floats | None  # (3,) the row before

    def derivatives(self, rows: npt.NDArray[np.intp], tick_s: float) -> tuple[Floats, Floats]:
        """(K, n) speeds and accelerations of the actual joints in some rows (K,), backward differences.

        0 before t = 0.
        """
        missing = 2 - len(self.earlier_actual)
        first = self.earlier_actual[:1] if len(self.earlier_actual) else self.actual[:1]
        joints = np.concatenate((*[first] * missing, self.earlier_actual, self.actual))
        before = joints[rows + 1]
        speed, earlier = (joints[rows + 2] - before) / tick_s, (before - joints[rows]) / tick_s
        return speed, (speed - earlier) / tick_s

    def joint_steps(self) -> Floats:
        """(N,) how far the set points are from those of the tick before, all joints together."""
        before = self.earlier_joints[-1:] if len(self.earlier_joints) else self.joints[:1]
        steps = np.diff(np.concatenate((before, self.joints)), axis=0)
        length: Floats = np.sqrt(np.einsum("ij,ij->i", steps, steps))
        return length

    def encode(self) -> list[Buffer]:
        """As a viapoint.TraceBlock, in parts that follow each other."""
        parts: list[Buffer] = [
            varint_field(FIRST_TICK, self.first_tick) + varint_field(AXES, self.joints.shape[1])
        ]
        same = self.actual is self.joints or np.array_equal(self.actual, self.joints)
        for column in COLUMNS:
            if column.name != "actual" or not same:
                values = np.ascontiguousarray(getattr(self, column.name), column.type)
                if column.width == ANY and not values.size:
                    continue
                parts += (tag(column.number, LENGTH) + varint(values.nbytes), values.data)
        return parts


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
    if not len(columns["deviation"]):  # written before there was one
        columns["deviation"] = np.zeros(len(columns["time"]))
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
    return Window(
        first_tick=windows[0].first_tick,
        **_each(lambda name: np.concatenate([getattr(window, name) for window in windows]), windows),
    )


def _rows_of(window: Window, rows: slice) -> dict[str, Any]:
    return _each(lambda name: getattr(window, name)[rows], (window,))


def _each(made: Callable[[str], Any], windows: Sequence[Window]) -> dict[str, Any]:
    """Every array as it is made of its name; where the drives report what was sent, it is made once."""
    arrays = {name: made(name) for name in ARRAYS if name != "actual"}
    ideal = all(window.actual is window.joints for window in windows)
    arrays["actual"] = arrays["joints"] if ideal else made("actual")
    return arrays


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
        joined = self._waiting[0] if len(self._waiting) == 1 else join(self._waiting)
        block = Joined(
            first_tick=joined.first_tick,
            earlier_joints=self._earlier("joints", joined.joints),
            earlier_actual=self._earlier("actual", joined.actual),
            last_position=None if self._before is None else self._before.position[-1],
            **_rows_of(joined, slice(count)),
        )
        self._waiting = []
        if len(joined) > count:
            rest = Window(first_tick=joined.first_tick + count, **_rows_of(joined, slice(count, None)))
            self._waiting.append(rest)
        self._count -= count
        self._before = block
        return block

    def _earlier(self, name: str, like: Floats) -> Floats:
        rows: Floats = like[:0] if self._before is None else getattr(self._before, name)[-2:]
        return rows
