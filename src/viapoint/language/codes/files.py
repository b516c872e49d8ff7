"""Catalogue entries of files: compiled programs (E25x), cells and robots (E27x, E28x), scenarios (E29x)."""

from __future__ import annotations

import struct
import zlib
from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry


def _code(code: bytes) -> Example:
    """A program file that holds nothing but `code`, its form correct: for the codes of the verifier."""
    sections = {b"NAME": b"", b"HASH": bytes(32), b"TEXT": bytes(4), b"SHPE": bytes(4), b"NUMB": b""}
    sections |= {b"CODE": code, b"LABL": bytes(4), b"SPAN": bytes(4)}
    body = struct.pack("<4sHH", b"VIAC", 1, len(sections))
    for tag, payload in sections.items():
        body += struct.pack("<4sI", tag, len(payload)) + payload
    return Example(data=body + struct.pack("<I", zlib.crc32(body)))


ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "E250",
        "not a program file",
        """A compiled program begins with the letters VIAC. This file is something else: perhaps the source,
        or another kind of file under this name.""",
        Example(data=b"ML P1 F100\n"),
    ),
    entry(
        "E251",
        "program file of another version",
        """The file was written by another version of viapoint, whose instructions this one does not know.
        Compile the source again.""",
        Example(data=b"VIAC\xff\xff\x00\x00\x00\x00\x00\x00"),
    ),
    entry(
        "E252",
        "damaged program file",
        """The checksum at the end of the file does not match its contents: it was cut off or altered on the
        way. Compile or copy it again.""",
        Example(data=b"VIAC\x01\x00\x00\x00\x00\x00\x00\x00"),
    ),
    entry(
        "E253",
        "malformed program file",
        """The sections of the file do not hold what they should. The file was not written by viapoint, or
        was altered afterwards. Compile the source again.""",
        Example(data=b"VIAC\x01\x00\x00\x00\xb7\x89\x13D"),
    ),
    entry(
        "E254",
        "unknown instruction",
        "The code holds bytes that are no instruction, or ends inside one. Compile the source again.",
        _code(b"\xff"),
    ),
    entry(
        "E255",
        "impossible jump",
        """A jump or a label of the code leads to where no instruction starts, or a counted jump does not go
        back to its label. Compile the source again.""",
        _code(b"\x02c\x00\x00\x00"),
    ),
    entry(
        "E256",
        "operand out of range",
        """An instruction refers to something that the file does not hold, or carries a value that no
        statement of the language can have. Compile the source again.""",
        _code(b"$\t\x00\x00\x00\x00"),
    ),
    entry(
        "E257",
        "unsafe code",
        """The stack does not fit the instructions on every way through the code, or the outside world is
        read at a place where the path has not arrived. Compile the source again.""",
        _code(b"A\x00"),
    ),
    entry(
        "E258",
        "code without an end",
        "Execution could run off the end of the code, or there is none. Compile the source again.",
        _code(b""),
    ),
)
