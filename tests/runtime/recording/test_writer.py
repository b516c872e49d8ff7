"""The writer of MCAP files, judged by the mcap package: index, summary, checksums; and the compiled core."""

from __future__ import annotations

import random
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from mcap import records
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from viapoint.runtime import core
from viapoint.runtime.recording.mcapwriter import McapWriter, Topic
from viapoint.runtime.recording.scene import frame_values
from viapoint.runtime.recording.wire import Template, bytes_field, double_field, message_field, time_field

TOPICS = (Topic("/a", "A", "jsonschema", b"{}"), Topic("/b", "B", "protobuf", b"\x01\x02"))
Told = list[tuple[str, int, bytes]]


def write(path: Path, seed: int) -> Told:
    """A file of several chunks at random; its messages in file order."""
    draw = random.Random(seed)
    told: Told = []
    with McapWriter(path, TOPICS) as writer:
        writer.metadata("first", {"key": "value", "empty": ""})
        for block in range(draw.randint(1, 5)):
            at = block * 1000
            for _ in range(draw.randint(1, 4)):
                topic = draw.choice(TOPICS).name
                if draw.random() < 0.5:
                    data = draw.randbytes(draw.randint(0, 300))
                    writer.message(topic, data, at)
                    told.append((topic, at, data))
                else:
                    rows = np.frombuffer(draw.randbytes(40), np.uint8).reshape(4, -1)
                    stamps = at + np.arange(4) * 7
                    writer.alike(topic, 10, stamps, partial(np.copyto, src=rows))
                    told += [(topic, int(t), d.tobytes()) for t, d in zip(stamps, rows, strict=True)]
                if draw.random() < 0.3:
                    data, spare = draw.randbytes(draw.randint(0, 90_000)), draw.randint(0, 90_000)
                    room = writer.begin(len(data) + spare)
                    room[: len(data)] = np.frombuffer(data, np.uint8)
                    writer.end(topic, len(data), at)
                    told.append((topic, at, data))
            writer.attach(f"text{block}", "text/plain", "ä" * block)
            writer.flush()
    return told


@pytest.mark.parametrize("seed", range(10))
def test_the_mcap_package_reads_it_with_and_without_the_index(seed: int, tmp_path: Path) -> None:
    print(f"seed {seed}")
    path = tmp_path / "x.mcap"
    told = write(path, seed)
    with path.open("rb") as stream:
        indexed = [
            (channel.topic, message.log_time, message.data)
            for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages()
        ]
    assert sorted(indexed) == sorted(told)
    assert [at for _, at, _ in indexed] == sorted(at for _, at, _ in told)
    with path.open("rb") as stream:
        streamed = list(StreamReader(stream, validate_crcs=True).records)
    assert [m.data for m in streamed if isinstance(m, records.Message)] == [data for _, _, data in told]
    for number in (1, 2):
        sequence = [m.sequence for m in streamed if isinstance(m, records.Message) and m.channel_id == number]
        assert sequence == list(range(len(sequence)))


@pytest.mark.parametrize("seed", range(10))
def test_index_and_summary_are_right(seed: int, tmp_path: Path) -> None:
    print(f"seed {seed}")
    path = tmp_path / "x.mcap"
    told = write(path, seed)
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        attached = [a.data.decode() for a in reader.iter_attachments()]
        assert [m.metadata for m in reader.iter_metadata()] == [{"key": "value", "empty": ""}]
    assert summary is not None
    statistics = summary.statistics
    assert statistics is not None
    assert statistics.message_count == len(told)
    assert statistics.message_start_time == min(at for _, at, _ in told)
    assert statistics.message_end_time == max(at for _, at, _ in told)
    assert attached == ["ä" * k for k in range(len(attached))]
    assert statistics.chunk_count == len(summary.chunk_indexes) == statistics.attachment_count
    names = {number: channel.topic for number, channel in summary.channels.items()}
    for number, count in statistics.channel_message_counts.items():
        assert count == sum(topic == names[number] for topic, _, _ in told)
    whole = path.read_bytes()
    for index in summary.chunk_indexes:
        for channel, offset in index.message_index_offsets.items():
            assert whole[offset] == 0x07
            assert int.from_bytes(whole[offset + 9 : offset + 11], "little") == channel


def test_every_message_stands_where_the_index_says(tmp_path: Path) -> None:
    write(tmp_path / "x.mcap", 3)
    with (tmp_path / "x.mcap").open("rb") as stream:
        items = list(StreamReader(stream, emit_chunks=True).records)
    import lz4.frame

    checked, raw = 0, b""
    for item in items:
        if isinstance(item, records.Chunk):
            raw = lz4.frame.decompress(item.data)
        elif isinstance(item, records.MessageIndex):
            for at, offset in item.records:
                assert raw[offset] == 0x05
                assert int.from_bytes(raw[offset + 9 : offset + 11], "little") == item.channel_id
                assert int.from_bytes(raw[offset + 15 : offset + 23], "little") == at
                checked += 1
    assert checked > 3


def test_the_compiled_core_writes_the_same_bytes(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = []
    for name in ("python", "auto"):
        monkeypatch.setattr(core, "asked", name)
        run.record(tmp_path / name)
        written.append((tmp_path / name).read_bytes())
    assert written[0] == written[1]


def test_frames_of_random_frames_are_the_same_in_both_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    points = rng.normal(size=(200, 7, 3))
    points[:50, 3] = points[:50, 2]  # links of no length
    points[50:90, 4] = points[50:90, 3] - [0.0, 0.0, 0.3]  # straight down
    tcp = rng.normal(size=(200, 3)), rng.normal(size=(200, 4))
    values = []
    for name in ("python", "auto"):
        monkeypatch.setattr(core, "asked", name)
        values.append(frame_values(points, *tcp))
    np.testing.assert_allclose(values[0], values[1], rtol=0.0, atol=1e-14)


def test_templates_are_the_same_in_both_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    axis = message_field(2, [bytes_field(1, b"J1"), *double_field(2), *double_field(3)])
    template = Template([*time_field(1), *axis, *double_field(7)])
    stamps, values = np.arange(20) * 123_456_789_012, np.random.default_rng(1).normal(size=(20, 3))
    rows = []
    for name in ("python", "auto"):
        monkeypatch.setattr(core, "asked", name)
        rows.append(np.empty((20, 5 + template.size), np.uint8)[:, 5:])
        template.encode(stamps, values, rows[-1])
    assert np.array_equal(rows[0], rows[1])
