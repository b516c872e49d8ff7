"""Reads MCAP files record by record with the mcap package: a file cut off by a crash gives all it holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Message:
    topic: str
    schema: str
    nanoseconds: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Attachment:
    name: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Metadata:
    name: str
    entries: dict[str, str]


@dataclass(frozen=True, slots=True)
class CutOff:
    """The file ends before its end record: what came before is good, what came after is lost."""

    reason: str


Item = Message | Attachment | Metadata | CutOff


class NotMcapError(ValueError):
    """The file does not begin as an MCAP file does."""


def read_items(path: Path) -> Iterator[Item]:
    """All items in file order; a damaged or shortened file ends in a `CutOff`.

    Raises OSError where the file cannot be read, `NotMcapError` where it is something else.
    """
    from mcap.stream_reader import StreamReader

    with path.open("rb") as stream:
        if stream.read(5) != b"\x89MCAP":
            raise NotMcapError(f"{path} is not an MCAP recording")
        stream.seek(0)
        limit = path.stat().st_size  # a mangled length must not ask for more memory than there is file
        yield from _items(StreamReader(stream, validate_crcs=True, record_size_limit=limit))


def _items(reader: object) -> Iterator[Item]:
    from mcap import records

    schemas: dict[int, str] = {}
    topics: dict[int, tuple[str, str]] = {}
    source = iter(reader.records)  # type: ignore[attr-defined]
    while True:
        try:
            record = next(source, None)
        except Exception as error:  # a mangled file breaks the reader anywhere; its type says nothing
            yield CutOff(_reason(error))
            return
        match record:
            case None:
                yield CutOff("it has no end record")
                return
            case records.DataEnd() | records.Footer():
                return
            case records.Schema():
                schemas[record.id] = record.name
            case records.Channel():
                topics[record.id] = (record.topic, schemas.get(record.schema_id, ""))
            case records.Message():
                topic, schema = topics.get(record.channel_id, ("", ""))
                yield Message(topic, schema, record.log_time, record.data)
            case records.Attachment():
                yield Attachment(record.name, record.data)
            case records.Metadata():
                yield Metadata(record.name, dict(record.metadata))
            case _:
                pass


def _reason(error: Exception) -> str:
    from mcap.exceptions import EndOfFile, RecordLengthLimitExceeded
    from mcap.stream_reader import CRCValidationError

    match error:
        case EndOfFile() | RecordLengthLimitExceeded():
            return "it ends in the middle of a record"
        case CRCValidationError():
            return "a checksum is wrong"
        case _:
            return "a record is mangled"
