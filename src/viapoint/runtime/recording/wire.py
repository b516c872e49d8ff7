"""Protobuf's wire format, as far as the recorder needs it: arrays as fields, many alike messages at once.

Generated message classes would cost 10 µs per message; here all messages of a window are one numpy
array of bytes. Not a general protobuf library: the schemas are in `schemas.py`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from .. import core

Floats = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]

VARINT, FIXED64, LENGTH = 0, 1, 2
NANOSECONDS = 1_000_000_000
# Seconds and nanoseconds stand as varints padded to five bytes (35 bits), so that every message of a
# kind has the same length; a padded varint is a valid one.
PADDED_VARINT = 5


class WireError(ValueError):
    """The bytes are not a protobuf message."""


def varint(value: int) -> bytes:
    """`value` ≥ 0 in seven-bit groups, lowest first."""
    if value <= 0x7F:
        return bytes((value,))
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


@cache
def tag(number: int, kind: int) -> bytes:
    return varint(number << 3 | kind)


def bytes_field(number: int, data: bytes) -> bytes:
    """A length-delimited field: bytes, a string, a nested message or a packed array."""
    return tag(number, LENGTH) + varint(len(data)) + data


def varint_field(number: int, value: int) -> bytes:
    return tag(number, VARINT) + varint(value)


def read_fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """(number, value) of each field of a message; `WireError` where it is not one."""
    at, end = 0, len(data)
    while at < end:
        key, at = _read_varint(data, at)
        kind = key & 7
        value: int | bytes
        if kind == VARINT:
            value, at = _read_varint(data, at)
        else:
            size, at = (8, at) if kind == FIXED64 else _read_varint(data, at)
            if kind not in (FIXED64, LENGTH) or at + size > end:
                raise WireError(f"field {key >> 3} of wire type {kind} does not fit")
            value, at = data[at : at + size], at + size
        yield key >> 3, value


def _read_varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while at < len(data) and shift < 70:
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at
    raise WireError("a varint does not end")


@dataclass(frozen=True, slots=True)
class Slot:
    """A place for one double in a template."""


@dataclass(frozen=True, slots=True)
class TimeSlot:
    """A place for the content of a google.protobuf.Timestamp in a template."""


Part = bytes | Slot | TimeSlot
SLOT_SIZE = 8
TIME_SLOT_SIZE = 2 * (1 + PADDED_VARINT)


def doubles(first: int, *values: float) -> bytes:
    """Fields of doubles with numbers in a row; those that are 0 are left out, as ever."""
    return b"".join(
        tag(first + k, FIXED64) + struct.pack("<d", value) for k, value in enumerate(values) if value != 0.0
    )


def double_field(number: int) -> list[Part]:
    return [tag(number, FIXED64), Slot()]


def time_field(number: int) -> list[Part]:
    return [tag(number, LENGTH) + varint(TIME_SLOT_SIZE), TimeSlot()]


def message_field(number: int, parts: list[Part]) -> list[Part]:
    """A nested message made of `parts`."""
    return [tag(number, LENGTH) + varint(sum(map(_size, parts))), *parts]


def _size(part: Part) -> int:
    match part:
        case bytes():
            return len(part)
        case Slot():
            return SLOT_SIZE
        case TimeSlot():
            return TIME_SLOT_SIZE


class Template:
    """One message with places for doubles and time stamps; encodes N of them at once."""

    def __init__(self, parts: list[Part]) -> None:
        row, slots, times = bytearray(), [], []
        for part in parts:
            match part:
                case bytes():
                    row += part
                case Slot():
                    slots.append(len(row))
                    row += bytes(SLOT_SIZE)
                case TimeSlot():
                    times.append(len(row))
                    row += varint(1 << 3) + bytes(PADDED_VARINT) + varint(2 << 3) + bytes(PADDED_VARINT)
        self._row = np.frombuffer(bytes(row), dtype=np.uint8)
        self._slots = np.asarray(slots, dtype=np.int64)
        self._times = np.asarray(times, dtype=np.int64)

    @property
    def size(self) -> int:
        """Bytes of a message."""
        return len(self._row)

    def encode(self, nanoseconds: Ints, values: Floats, out: Bytes) -> None:
        """(N,) ns since the start and (N, slots) values → N messages, the rows of `out` (N, size)."""
        values = np.ascontiguousarray(values, dtype="<f8")
        module = core.chosen("recording._core")
        encoded = encode if module is None else module.encode
        encoded(out, self._row, self._slots, values, self._times, nanoseconds)


def encode(out: Bytes, row: Bytes, slots: Ints, values: Floats, times: Ints, nanoseconds: Ints) -> None:
    """Rows (N, L): a template with doubles (N, K) at the bytes `slots` (K,) and a time at each of `times`."""
    out[:] = row
    out[:, (slots[:, None] + np.arange(SLOT_SIZE)).ravel()] = values.view(np.uint8).reshape(len(values), -1)
    if len(times):
        seconds, rest = _padded(nanoseconds // NANOSECONDS), _padded(nanoseconds % NANOSECONDS)
        for at in times.tolist():
            out[:, at + 1 : at + 1 + PADDED_VARINT] = seconds
            out[:, at + 2 + PADDED_VARINT : at + TIME_SLOT_SIZE] = rest


def _padded(values: npt.NDArray[np.int64]) -> Bytes:
    """(N,) → (N, 5): varints of five bytes each, the continuation bit set on all but the last."""
    groups = values[:, None] >> (7 * np.arange(PADDED_VARINT)) & 0x7F
    groups[:, :-1] |= 0x80
    return groups.astype(np.uint8)
