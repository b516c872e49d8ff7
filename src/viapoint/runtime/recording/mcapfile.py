"""MCAP files: the one module that knows the container format.

Written with foxglove-sdk (half the time of the mcap package's writer: `benchmarks/recording.py`), read
record by record with the mcap package, so that a file cut off by a crash gives all it holds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

# A chunk is what a crash can cost; the recorder also ends one with every block it writes.
CHUNK_SIZE = 1 << 20


@dataclass(frozen=True, slots=True)
class Topic:
    """What is declared of a topic before its first message."""

    name: str
    schema: str
    schema_encoding: str  # protobuf or jsonschema
    schema_data: bytes

    @property
    def message_encoding(self) -> str:
        return "json" if self.schema_encoding == "jsonschema" else self.schema_encoding


class McapWriter:
    """Writes messages, attachments and metadata; `flush` makes all so far readable after a crash."""

    def __init__(self, path: Path, topics: tuple[Topic, ...]) -> None:
        """Overwrites `path`; raises OSError where it cannot be written."""
        import foxglove
        from foxglove.mcap import MCAPCompression, MCAPWriteOptions

        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("wb")
        context = self._context = foxglove.Context()  # its channels close when it is collected
        self._channels = {
            topic.name: foxglove.Channel(
                topic.name,
                schema=foxglove.Schema(
                    name=topic.schema, encoding=topic.schema_encoding, data=topic.schema_data
                ),
                message_encoding=topic.message_encoding,
                context=context,
            )
            for topic in topics
        }
        self._writer = foxglove.open_mcap(
            self._file,
            context=context,
            writer_options=MCAPWriteOptions(compression=MCAPCompression.Lz4, chunk_size=CHUNK_SIZE),
        )

    def message(self, topic: str, data: bytes, nanoseconds: int) -> None:
        self._channels[topic].base.log(data, nanoseconds)

    def attach(self, name: str, media_type: str, text: str) -> None:
        self._writer.attach(
            log_time=0, create_time=0, name=name, media_type=media_type, data=text.encode("utf-8")
        )

    def metadata(self, name: str, entries: dict[str, str]) -> None:
        self._writer.write_metadata(name, entries)

    def flush(self) -> None:
        self._writer.flush()
        self._file.flush()

    @property
    def closed(self) -> bool:
        return self._file.closed

    def close(self) -> None:
        if not self._file.closed:
            self._writer.close()
            for channel in self._channels.values():
                channel.close()
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


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
