"""Blocks of ticks: windows joined and cut to one size, and each as a TraceBlock message and back.

A block ends every `BLOCK_TICKS` ticks, whatever the windows: a recording does not show their size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields as dataclass_fields
from functools import lru_cache
from operator import attrgetter
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import core
from ..records import Ints, Window
from .info import Floats
from .mcapwriter import Bytes
from .schemas import ANY, AXES, COLUMNS, FIRST_TICK
from .wire import LENGTH, WireError, read_fields, tag, varint, varint_field

# Two seconds at 1 ms: what a crash may cost, and little enough overhead per tick.
BLOCK_TICKS = 2000

Columns = dict[str, Floats]

ARRAYS = tuple(f.name for f in dataclass_fields(Window) if f.name != "first_tick")

_SENT: Final = tuple(column for column in COLUMNS if column.name != "actual")
_ALL: Final = (*_SENT, *(column for column in COLUMNS if column.name == "actual"))
"""In the order in which they stand in a message: what may be absent for being the same comes last."""
_values_sent: Final = attrgetter(*(column.name for column in _SENT))
_values_all: Final = attrgetter(*(column.name for column in _ALL))


class _Place(NamedTuple):
    """Where the values of a column stand in a message."""

    label: bytes  # tag and length before them
    start: int
    type: str
    shape: tuple[int, ...]


class _Layout(NamedTuple):
    """Where the columns of a message stand, after a head of some bytes."""

    places: dict[str, _Place]
    starts: Ints  # (C,) of the columns in their order
    size_sent: int  # bytes without what the drives report
    size: int


@lru_cache(maxsize=16)
def _layout(head: int, ticks: int, widths: tuple[int, ...]) -> _Layout:
    """`widths` as the columns of `_ALL`; 0: absent."""
    places, at, ends = {}, head, []
    for column, width in zip(_ALL, widths, strict=True):
        size = ticks * width * np.dtype(column.type).itemsize
        label = tag(column.number, LENGTH) + varint(size) if width else b""
        at += len(label)
        shape = (ticks,) if column.width == 1 else (ticks, width)
        places[column.name] = _Place(label, at, column.type, shape)
        at += size
        ends.append(at)
    starts = np.array([place.start for place in places.values()])
    return _Layout(places, starts, ends[-2], ends[-1])


class Before(NamedTuple):
    """What stood before a block, for derivatives and lines that go on: the last ticks of the one before.

    Before t = 0 the robot stood where it begins.
    """

    joints: Floats  # (n,)
    actual: Floats  # (2, n)
    position: Floats | None  # (3,)


class Block:
    """The ticks of a viapoint.TraceBlock, filled in window by window where the message is written.

    The columns are views of the message, good until the next block begins.
    """

    def __init__(self, message: Bytes, first_tick: int, layout: _Layout, before: Before) -> None:
        """`message` begins with its head already; it may have more room than is needed in the end."""
        self.first_tick = first_tick
        self.before = before
        self._message = message
        self._layout = layout
        self._count = 0
        self._apart = False  # whether the drives report anything but what was sent
        for label, start, _, _ in layout.places.values():
            message[start - len(label) : start] = np.frombuffer(label, np.uint8)

    def __len__(self) -> int:
        return self._count

    @property
    def size(self) -> int:
        """Bytes of the message."""
        return self._layout.size if self._apart else self._layout.size_sent

    def column(self, name: str) -> npt.NDArray[Any]:
        """The column so far."""
        return self._stored("joints" if name == "actual" and not self._apart else name)

    def _stored(self, name: str) -> npt.NDArray[Any]:
        _, start, kind, shape = self._layout.places[name]
        return np.ndarray((self._count, *shape[1:]), kind, self._message, start)

    def take(self, window: Window, start: int, count: int) -> None:
        """So many ticks of a window, from its row `start` on."""
        if not self._apart and window.actual is not window.joints:
            self._stored("actual")[:] = self._stored("joints")
            self._apart = True
        values = (_values_all if self._apart else _values_sent)(window)
        module = core.chosen("recording._core")
        filled = fill if module is None else module.fill
        filled(self._message, self._layout.starts, values, self._count, start, count)
        self._count += count

    def end(self) -> None:
        """The block is complete, with fewer ticks than there was room for at the end of a run."""
        if self._apart and np.array_equal(self.column("actual"), self.column("joints")):
            self._apart = False
        ticks, *_ = self._layout.places["time"].shape
        if self._count < ticks:
            self._close_ranks()

    def _close_ranks(self) -> None:
        columns = [self.column(column.name).tobytes() for column in (_ALL if self._apart else _SENT)]
        places = self._layout.places.values()
        widths = tuple(1 if len(place.shape) == 1 else place.shape[1] for place in places)
        head = self._layout.starts[0] - len(self._layout.places[_ALL[0].name].label)
        self._layout = _layout(head, self._count, widths)
        for place, values in zip(self._layout.places.values(), columns, strict=False):
            data = np.frombuffer(place.label + values, np.uint8)
            start = place.start - len(place.label)
            self._message[start : start + len(data)] = data

    @property
    def after(self) -> Before:
        """What the next block has before it."""
        actual = np.concatenate((self.before.actual, self.column("actual")[-2:]))[-2:]
        return Before(self.column("joints")[-1].copy(), actual, self.column("position")[-1].copy())

    def motion(self, first: int, stride: int, tick_s: float) -> Floats:
        """(K, n, 3) actual joints with their speeds and accelerations, in ticks `first`, `first` + `stride` …

        Backward differences.
        """
        actual, before = self.column("actual"), self.before.actual
        module = core.chosen("recording._core")
        found: Floats = (motion if module is None else module.motion)(actual, before, first, stride, tick_s)
        return found

    def changes(self, standing: float) -> list[tuple[int, int, int, bool]]:
        """(row, line, interpreter line, whether it moves) of the first tick and of all unlike the one before.

        It moves where TCP or joints do by more than `standing` (m/s, rad per tick).
        """
        line, ahead = self.column("line"), self.column("interpreter_line")
        speed, joints = self.column("speed"), self.column("joints")
        module = core.chosen("recording._core")
        found: list[tuple[int, int, int, bool]] = (changes if module is None else module.changes)(
            line, ahead, speed, joints, self.before.joints, standing
        )
        return found


def fill(message: Bytes, starts: Ints, values: tuple[Any, ...], at: int, start: int, count: int) -> None:
    """Rows start … start + count of arrays (N, …) into the columns of a message from row `at` on.

    A column begins at its byte of `starts`; lines and counts shrink to four bytes.
    """
    for place, column, array in zip(starts.tolist(), _ALL, values, strict=False):
        row = int(np.prod(array.shape[1:])) * np.dtype(column.type).itemsize
        shape = (count, *array.shape[1:])
        np.ndarray(shape, column.type, message, place + at * row)[:] = array[start : start + count]


def motion(actual: Floats, before: Floats, first: int, stride: int, tick_s: float) -> Floats:
    """(N, n) and the two rows before it → (K, n, 3), as `Block.motion`."""
    joints = np.concatenate((before, actual))
    rows = np.arange(first, len(actual), stride)
    last = joints[rows + 1]
    speed, earlier = (joints[rows + 2] - last) / tick_s, (last - joints[rows]) / tick_s
    return np.stack((joints[rows + 2], speed, (speed - earlier) / tick_s), axis=-1)


def changes(
    line: Ints, ahead: Ints, speed: Floats, joints: Floats, before: Floats, standing: float
) -> list[tuple[int, int, int, bool]]:
    """(N,), (N,), (N,), (N, n) and the row before them → as `Block.changes`."""
    steps = np.diff(np.concatenate((before[None], joints)), axis=0)
    moves = (speed > standing) | (np.sqrt(np.einsum("ij,ij->i", steps, steps)) > standing)
    states = np.stack((line, ahead, moves), axis=-1)
    changed = np.flatnonzero((states[1:] != states[:-1]).any(axis=1)) + 1
    return [(row, int(line[row]), int(ahead[row]), bool(moves[row])) for row in (0, *changed.tolist())]


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
    arrays = {name: np.concatenate([getattr(window, name) for window in windows]) for name in ARRAYS}
    return Window(first_tick=windows[0].first_tick, **arrays)


class BlockBuilder:
    """Fills blocks of `BLOCK_TICKS` with windows of any size."""

    def __init__(self, room: Callable[[int], Bytes]) -> None:
        """`room` gives a message so many bytes; more than it may need in the end."""
        self._room = room
        self._block: Block | None = None
        self._before: Before | None = None

    def add(self, window: Window) -> Iterator[Block]:
        """The blocks that are complete with `window`."""
        start = 0
        while start < len(window):
            block = self._block or self._begin(window, window.first_tick + start)
            count = min(len(window) - start, BLOCK_TICKS - len(block))
            block.take(window, start, count)
            start += count
            if len(block) == BLOCK_TICKS:
                yield self._end(block)

    def rest(self) -> Block | None:
        """The last, incomplete block."""
        return self._end(self._block) if self._block else None

    def _begin(self, window: Window, tick: int) -> Block:
        widths = tuple(1 if values.ndim == 1 else values.shape[1] for values in _values_all(window))
        head = varint_field(FIRST_TICK, tick) + varint_field(AXES, window.joints.shape[1])
        layout = _layout(len(head), BLOCK_TICKS, widths)
        message = self._room(layout.size)
        message[: len(head)] = np.frombuffer(head, np.uint8)
        joints, actual = window.joints[0], window.actual[0]
        before = self._before or Before(joints.copy(), np.stack((actual, actual)), None)
        self._block = Block(message, tick, layout, before)
        return self._block

    def _end(self, block: Block) -> Block:
        block.end()
        self._block, self._before = None, block.after
        return block
