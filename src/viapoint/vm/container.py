"""The program file (.viac): bytes to and from a Program. Little-endian, deterministic.

Layout: magic "VIAC", version, number of sections; then each section as tag, length, payload; then the
CRC-32 of all before. `load` gives a program only after `verifier.verify` has passed it.
"""

from __future__ import annotations

import struct
import sys
import zlib
from array import array
from collections.abc import Iterable, Sequence

from viapoint.vm.program import Label, Program, SpanMap
from viapoint.vm.refusal import ProgramFileError

MAGIC = b"VIAC"
VERSION = 1

_HEADER = struct.Struct("<4sHH")
_SECTION = struct.Struct("<4sI")
_WORD = struct.Struct("<I")
_CHECKSUM = struct.Struct("<I")
_HASH_SIZE = 32

_TAGS = (b"NAME", b"HASH", b"TEXT", b"SHPE", b"NUMB", b"CODE", b"LABL", b"SPAN")
_SOURCE_TAG = b"SRCE"


def _array_bytes(values: array[int] | array[float]) -> bytes:
    if sys.byteorder == "little":
        return values.tobytes()
    swapped = values[:]
    swapped.byteswap()
    return swapped.tobytes()


def _utf8(text: str) -> bytes:
    """UTF-8; a lone surrogate (from a file name that is not UTF-8) becomes a question mark."""
    return text.encode("utf-8", "replace")


def _strings_bytes(strings: Sequence[str]) -> bytes:
    parts = [_WORD.pack(len(strings))]
    for text in strings:
        encoded = _utf8(text)
        parts += [_WORD.pack(len(encoded)), encoded]
    return b"".join(parts)


def _labels_bytes(labels: Sequence[Label]) -> bytes:
    addresses = array("I", (label.address for label in labels))
    return _strings_bytes([label.name for label in labels]) + _array_bytes(addresses)


def _spans_bytes(spans: SpanMap) -> bytes:
    columns = (spans.addresses, spans.lines, spans.columns, spans.end_columns)
    return _WORD.pack(len(spans.addresses)) + b"".join(map(_array_bytes, columns))


def save(program: Program) -> bytes:
    """The bytes of the program file; the same program gives the same bytes."""
    sections = [
        (b"NAME", _utf8(program.name)),
        (b"HASH", program.source_hash),
        (b"TEXT", _strings_bytes(program.texts)),
        (b"SHPE", _strings_bytes(program.shapes)),
        (b"NUMB", _array_bytes(program.numbers)),
        (b"CODE", program.code),
        (b"LABL", _labels_bytes(program.labels)),
        (b"SPAN", _spans_bytes(program.spans)),
    ]
    if program.source_text is not None:
        sections.append((_SOURCE_TAG, _utf8(program.source_text)))
    return pack_sections(sections)


def pack_sections(sections: Iterable[tuple[bytes, bytes]]) -> bytes:
    """Header, sections and checksum around given payloads."""
    listed = list(sections)
    parts = [_HEADER.pack(MAGIC, VERSION, len(listed))]
    for tag, payload in listed:
        parts += [_SECTION.pack(tag, len(payload)), payload]
    body = b"".join(parts)
    return body + _CHECKSUM.pack(zlib.crc32(body))


class _Reader:
    """Takes a section apart; every shortage or surplus is refused with the section's name."""

    def __init__(self, tag: bytes, payload: bytes) -> None:
        self._tag = tag.decode("ascii")
        self._payload = payload
        self._at = 0

    def take(self, size: int) -> bytes:
        if size > len(self._payload) - self._at:
            raise ProgramFileError("E253", f"section {self._tag} ends too early")
        taken = self._payload[self._at : self._at + size]
        self._at += size
        return taken

    def word(self) -> int:
        value: int = _WORD.unpack(self.take(_WORD.size))[0]
        return value

    def text(self, size: int) -> str:
        try:
            return self.take(size).decode("utf-8")
        except UnicodeDecodeError:
            raise ProgramFileError("E253", f"section {self._tag} holds bytes that are not UTF-8") from None

    def strings(self) -> tuple[str, ...]:
        count = self.word()
        if count > len(self._payload) // _WORD.size:  # each takes a word at least
            raise ProgramFileError("E253", f"section {self._tag} ends too early")
        return tuple(self.text(self.word()) for _ in range(count))

    def words(self, count: int) -> array[int]:
        values = array("I")
        values.frombytes(self.take(count * values.itemsize))
        if sys.byteorder == "big":
            values.byteswap()
        return values

    def floats(self) -> array[float]:
        values = array("d")
        size = len(self._payload) - self._at
        if size % values.itemsize:
            raise ProgramFileError("E253", f"section {self._tag} ends inside a number")
        values.frombytes(self.take(size))
        if sys.byteorder == "big":
            values.byteswap()
        return values

    def finish(self) -> None:
        if self._at != len(self._payload):
            raise ProgramFileError("E253", f"section {self._tag} holds more than it should")


def _split(data: bytes) -> dict[bytes, bytes]:
    """The sections of a whole file after magic, version and checksum are found right."""
    if data[: len(MAGIC)] != MAGIC:
        raise ProgramFileError("E250", "this is not a program file: it does not begin with VIAC")
    if len(data) < _HEADER.size + _CHECKSUM.size:
        raise ProgramFileError("E252", "the program file is cut off")
    _, version, count = _HEADER.unpack_from(data)
    if version != VERSION:
        raise ProgramFileError("E251", f"program file of version {version}; this machine reads {VERSION}")
    body = memoryview(data)[: -_CHECKSUM.size]
    if zlib.crc32(body) != _CHECKSUM.unpack_from(data, len(body))[0]:
        raise ProgramFileError("E252", "the checksum does not match: the file is cut off or damaged")
    sections: dict[bytes, bytes] = {}
    at = _HEADER.size
    for _ in range(count):
        if at + _SECTION.size > len(body):
            raise ProgramFileError("E253", "the table of sections ends too early")
        tag, size = _SECTION.unpack_from(data, at)
        at += _SECTION.size
        if size > len(body) - at:
            raise ProgramFileError("E253", "a section is longer than the file")
        if tag in sections or tag not in (*_TAGS, _SOURCE_TAG):
            raise ProgramFileError("E253", f"a section {tag!r} does not belong here")
        sections[tag] = data[at : at + size]
        at += size
    if at != len(body):
        raise ProgramFileError("E253", "bytes are left over behind the last section")
    for tag in _TAGS:
        if tag not in sections:
            raise ProgramFileError("E253", f"section {tag.decode('ascii')} is missing")
    return sections


def _labels(reader: _Reader) -> tuple[Label, ...]:
    names = reader.strings()
    return tuple(map(Label, names, reader.words(len(names))))


def _spans(reader: _Reader) -> SpanMap:
    count = reader.word()
    return SpanMap(*(reader.words(count) for _ in range(4)))


def unpack(data: bytes) -> Program:
    """The program in the bytes, its form checked but not its meaning; raises ProgramFileError."""
    sections = _split(data)
    readers = {tag: _Reader(tag, payload) for tag, payload in sections.items()}
    source = readers.get(_SOURCE_TAG)
    program = Program(
        name=readers[b"NAME"].text(len(sections[b"NAME"])),
        code=sections[b"CODE"],
        numbers=readers[b"NUMB"].floats(),
        shapes=readers[b"SHPE"].strings(),
        texts=readers[b"TEXT"].strings(),
        labels=_labels(readers[b"LABL"]),
        spans=_spans(readers[b"SPAN"]),
        source_hash=readers[b"HASH"].take(_HASH_SIZE),
        source_text=None if source is None else source.text(len(sections[_SOURCE_TAG])),
    )
    readers[b"CODE"].take(len(sections[b"CODE"]))
    for reader in readers.values():
        reader.finish()
    return program
