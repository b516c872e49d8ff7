"""Which MCAP writer the recorder takes, measured: its own, foxglove-sdk's, and that of the mcap package.

All get the same bytes, as the recorder makes them: per second of robot time one block of 1000 ticks, 50
transform messages and 50 joint messages. Printed per writer and compression: microseconds of CPU per tick
of 1 ms, file size, and whether two runs wrote the same bytes. Then the whole recorder, encoding included.

Run: .venv/bin/python benchmarks/recording.py
"""

from __future__ import annotations

import hashlib
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from viapoint.runtime.recording import Axis, Recorder, RunInfo
from viapoint.runtime.recording.mcapwriter import McapWriter, Topic
from viapoint.runtime.records import Window

SECONDS = 60
TICKS = 1000
RATE = 50
Messages = list[tuple[int, bytes, int]]


def messages() -> Messages:
    """(topic index, bytes, log time) of a minute of smooth motion; no random numbers, no clock."""
    out: Messages = []
    columns = np.arange(25)[:, None]
    for second in range(SECONDS):
        time_s = second + np.arange(TICKS) / TICKS
        block = np.sin(time_s * (0.1 + 0.05 * columns)).tobytes()
        out.append((0, block, second * 10**9))
        for i in range(RATE):
            out.append((1, block[i * 320 : i * 320 + 640], second * 10**9 + i * 10**9 // RATE))
            out.append((2, block[i * 160 : i * 160 + 320], second * 10**9 + i * 10**9 // RATE))
    return out


def with_mcap(compression: str) -> Callable[[Path, Messages], None]:
    def write(path: Path, payload: Messages) -> None:
        from mcap.writer import CompressionType, Writer

        with path.open("wb") as stream:
            writer = Writer(stream, compression=CompressionType[compression], chunk_size=1 << 20)
            writer.start()
            schema = writer.register_schema("bench", "protobuf", b"")
            channels = [writer.register_channel(f"/{i}", "protobuf", schema) for i in range(3)]
            for topic, data, at in payload:
                writer.add_message(channels[topic], at, data, at)
            writer.finish()

    return write


def with_foxglove(compression: str) -> Callable[[Path, Messages], None]:
    def write(path: Path, payload: Messages) -> None:
        import foxglove
        from foxglove.mcap import MCAPCompression, MCAPWriteOptions

        context = foxglove.Context()
        chosen = None if compression == "NONE" else getattr(MCAPCompression, compression.capitalize())
        writer = foxglove.open_mcap(
            path, context=context, writer_options=MCAPWriteOptions(compression=chosen, chunk_size=1 << 20)
        )
        schema = foxglove.Schema(name="bench", encoding="protobuf", data=b"")
        channels = [
            foxglove.Channel(f"/{i}", schema=schema, message_encoding="protobuf", context=context)
            for i in range(3)
        ]
        for topic, data, at in payload:
            channels[topic].log(data, log_time=at)
        writer.close()

    return write


def with_ours(path: Path, payload: Messages) -> None:
    """As the recorder hands its messages over: those of a kind together, a chunk per second."""
    with McapWriter(path, [Topic(f"/{i}", "bench", "protobuf", b"") for i in range(3)]) as writer:
        for second in range(SECONDS):
            part = payload[second * (1 + 2 * RATE) : (second + 1) * (1 + 2 * RATE)]
            writer.message("/0", part[0][1], part[0][2])
            for topic in (1, 2):
                alike = [(data, at) for number, data, at in part if number == topic]
                rows = np.frombuffer(b"".join(data for data, _ in alike), np.uint8).reshape(RATE, -1)
                writer.room(f"/{topic}", rows.shape[1], np.array([at for _, at in alike]))[:] = rows
            writer.flush()


def measure(name: str, write: Callable[[Path, Messages], None], payload: Messages, folder: Path) -> None:
    digests, elapsed, size = set(), [], 0
    for attempt in range(3):
        path = folder / f"{name}-{attempt}.mcap".replace(" ", "-")
        started = time.process_time()
        write(path, payload)
        elapsed.append(time.process_time() - started)
        size = path.stat().st_size
        digests.add(hashlib.sha256(path.read_bytes()).hexdigest())
    per_tick = min(elapsed) / (SECONDS * TICKS) * 1e6
    same = "same bytes" if len(digests) == 1 else "bytes differ"
    print(f"{name:16} {per_tick:6.2f} µs/tick  {size / 1e6:6.1f} MB  {same}")


def skeleton(joints: np.ndarray) -> np.ndarray:
    """Seven points in fixed places: the cost of kinematics is the robot's, not the recorder's."""
    return np.broadcast_to(np.arange(21.0).reshape(7, 3) % 5, (len(joints), 7, 3))


def record(path: Path, prepared: list[Window]) -> None:
    """A minute of windows through the recorder."""
    axes = tuple(
        Axis(name=f"J{i}", kind="revolute", lower=-3, upper=3, speed=2, acceleration=10, jerk=100)
        for i in range(1, 7)
    )
    info = RunInfo(program_name="bench.via", program_source="", tick_s=1 / TICKS, axes=axes)
    with Recorder(path, info, skeleton=skeleton) as recorder:
        for window in prepared:
            recorder.window(window)


def windows(size: int = 512) -> list[Window]:
    out = []
    for first in range(0, SECONDS * TICKS, size):
        time_s = np.arange(first, first + size) / TICKS
        joints = np.sin(time_s[:, None] * np.arange(1, 7) / 7)
        count = np.full(size, first // size)
        out.append(
            Window(
                first_tick=first,
                time=time_s,
                line=count,
                interpreter_line=count + 5,
                s=time_s / 5,
                speed=np.cos(time_s),
                override=np.ones(size),
                buffer_fill=count,
                joints=joints,
                actual=joints,
                auxiliary=np.zeros((size, 0)),
                position=joints[:, :3],
                quaternion=np.tile([1.0, 0, 0, 0], (size, 1)),
                torque=np.zeros((size, 0)),
                deviation=np.zeros(size),
            )
        )
    return out


def main() -> None:
    payload = messages()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for compression in ("NONE", "LZ4", "ZSTD"):
            measure(f"mcap {compression}", with_mcap(compression), payload, folder)
            measure(f"foxglove {compression}", with_foxglove(compression), payload, folder)
        measure("ours LZ4", with_ours, payload, folder)
        prepared = windows()
        measure("whole recorder", lambda path, _: record(path, prepared), payload, folder)


if __name__ == "__main__":
    main()
