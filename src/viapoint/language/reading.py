"""Program files from disk: text or diagnostics, never an exception.

Refuses what cannot be a program: unreadable files, wrong encodings, NUL characters. Does not parse.
"""

from __future__ import annotations

from codecs import BOM_UTF8
from pathlib import Path
from typing import Final, NamedTuple

from viapoint.language.diagnostics import Diagnostic
from viapoint.language.source import Source, Span

MAX_BYTES: Final = 256 * 1024 * 1024
"""Largest file taken; a program of five million lines is half of it."""


class ReadResult(NamedTuple):
    """The source, or None and what is wrong."""

    source: Source | None
    diagnostics: tuple[Diagnostic, ...]


def read_source(path: str | Path) -> ReadResult:
    """Read a UTF-8 program file, with or without a byte order mark."""
    name = str(path)
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        return _refuse(name, f"cannot read the file: {error.strerror or error}", _advice(error))
    except ValueError as error:
        return _refuse(name, f"cannot read the file: {error}", None)
    if len(data) > MAX_BYTES:
        return _refuse(name, f"the file is larger than {MAX_BYTES >> 20} MiB", "is this a program file?")
    return decode(name, data)


def decode(name: str, data: bytes) -> ReadResult:
    """The source of a file's bytes; its diagnostics point at the first byte that is wrong."""
    data = data.removeprefix(BOM_UTF8)
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        return _undecodable(name, data, error)
    nul = text.find("\0")
    if nul >= 0:
        source = Source(name, text)
        hint = "is this a text file?"
        return _found("E102", "the file holds a NUL character", source, nul, hint)
    return ReadResult(Source(name, text), ())


def _advice(error: OSError) -> str | None:
    if isinstance(error, FileNotFoundError):
        return "check the name and the folder"
    if isinstance(error, IsADirectoryError):
        return "give a file, not a folder"
    return "check its permissions" if isinstance(error, PermissionError) else None


def _refuse(name: str, message: str, hint: str | None) -> ReadResult:
    return ReadResult(None, (Diagnostic(code="E100", message=message, file=name, hint=hint),))


def _undecodable(name: str, data: bytes, error: UnicodeDecodeError) -> ReadResult:
    good = data[: error.start].decode("utf-8")
    source = Source(name, data.decode("utf-8", errors="replace"))
    message = f"byte 0x{data[error.start]:02X} belongs to no UTF-8 character"
    hint = "save the file as UTF-8"
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        hint = "the file is UTF-16; save it as UTF-8"
    return _found("E101", message, source, len(good), hint)


def _found(code: str, message: str, source: Source, at: int, hint: str) -> ReadResult:
    span = Span(at, at + 1)
    return ReadResult(None, (Diagnostic(code=code, message=message, source=source, span=span, hint=hint),))
