"""Recordings: same bytes, nothing lost, readable when cut off, readable by others."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import random
import sys
from dataclasses import replace
from pathlib import Path
from types import FrameType

import numpy as np
import pytest

from viapoint.runtime import core
from viapoint.runtime.recording import Recorder, RecordingError, load_recording
from viapoint.runtime.records import Window

ARRAYS = [name for name in Window.__dataclass_fields__ if name != "first_tick"]


def test_reads_back_what_was_written(run, tmp_path: Path) -> None:
    run.record(tmp_path / "run.mcap")
    recording = load_recording(tmp_path / "run.mcap")
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(recording.trace, name), getattr(run.window, name), err_msg=name)
    assert recording.events == tuple(run.events)
    assert recording.info == run.info
    assert recording.result == {"status": "finished"}
    assert recording.problem is None


@pytest.mark.parametrize("size", [300, 2500])
def test_reads_back_drives_that_lag_auxiliary_axes_and_torques(
    make_run, size: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, rng = make_run(4700), np.random.default_rng(2)
    moved = np.asfortranarray(run.window.joints)
    lagging = moved.copy()
    lagging[3000:3200] -= 1e-3
    more = {"auxiliary": rng.normal(size=(4701, 1)), "torque": rng.normal(size=(4701, 8))[:, 1:7]}
    run = replace(run, window=replace(run.window, joints=moved, actual=lagging, **more))
    written = []
    for name in ("python", "auto"):
        monkeypatch.setattr(core, "asked", name)
        run.record(tmp_path / name, size)
        written.append((tmp_path / name).read_bytes())
    trace = load_recording(tmp_path / "auto").trace
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(trace, name), getattr(run.window, name), err_msg=name)
    assert written[0] == written[1]


@pytest.mark.parametrize("size", [1, 7, 512, 1024, 5000])
def test_same_run_same_bytes_whatever_the_window(run, size: int, tmp_path: Path) -> None:
    run.record(tmp_path / "a.mcap")
    run.record(tmp_path / "b.mcap", size)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


@pytest.mark.parametrize("share", [0.8, 0.85, 0.9, 0.95])
def test_cut_off_recording_reads_up_to_the_last_chunk(run, share: float, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    run.record(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * share)])
    recording = load_recording(path)
    count = len(recording.trace)
    assert count == 2000
    np.testing.assert_array_equal(recording.trace.joints, run.window.joints[:count])
    assert recording.problem is not None
    assert "read up to t =" in recording.problem


def test_process_killed_in_the_middle_leaves_whole_blocks(run, tmp_path: Path) -> None:
    recorder = run.record(tmp_path / "run.mcap", close=False)
    copy = tmp_path / "copy.mcap"
    copy.write_bytes((tmp_path / "run.mcap").read_bytes())
    recorder.close()
    recording = load_recording(copy)
    assert len(recording.trace) == 2000
    assert recording.result == {}


@pytest.mark.parametrize("seed", range(20))
def test_interrupted_anywhere_it_is_whole_once_closed(make_run, seed: int, tmp_path: Path) -> None:
    """A second Ctrl-C may come between any two lines of the recorder; whole blocks before it stay."""
    run, path = make_run(6500), tmp_path / "run.mcap"
    recorder, windows = Recorder(path, run.info), run.windows(500)
    for window in itertools.islice(windows, 6):
        recorder.window(replace(window, actual=window.joints))
    lines = random.Random(seed).randint(1, 700)
    print(f"seed {seed}: after {lines} lines")

    def count(frame: FrameType, event: str, _: object) -> object:
        nonlocal lines
        lines -= event == "line"
        if lines == 0:
            raise KeyboardInterrupt
        return count

    sys.settrace(lambda frame, *_: count if "recording" in frame.f_code.co_filename else None)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            for window in windows:
                recorder.window(window)
    finally:
        sys.settrace(None)
    assert lines == 0
    recorder.close({"status": "stopped"})
    recording = load_recording(path)
    assert recording.problem is None
    assert recording.result == {"status": "stopped"}
    joints, actual = recording.trace.joints, recording.trace.actual
    assert len(joints) >= 2000
    np.testing.assert_array_equal(joints, run.window.joints[: len(joints)])
    np.testing.assert_array_equal(actual, joints)
    assert len(decoded(path)["/trace"]) == math.ceil(len(joints) / 2000)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not an MCAP recording"),
        (b"hello world", "not an MCAP recording"),
        (b"\x89MCAP0\r\n", "was not written by viapoint"),
        (b"\x89MCAP0\r\n" + b"\xff" * 100, "was not written by viapoint"),
    ],
)
def test_other_files_are_refused_in_a_sentence(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=message):
        load_recording(path)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"cannot read .*No such file"):
        load_recording(tmp_path / "none.mcap")


@pytest.mark.parametrize("seed", range(40))
def test_mangled_recordings_never_crash_the_reader(run, seed: int, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    run.record(path)
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(seed)
    for at in rng.integers(8, len(data), size=3):
        data[at] = rng.integers(256)
    path.write_bytes(data)
    with contextlib.suppress(RecordingError):
        load_recording(path)


def decoded(path: Path) -> dict[str, list[tuple[int, object]]]:
    """Every message by topic, decoded with the schemas in the file, by code that is not ours."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    topics: dict[str, list[tuple[int, object]]] = {}
    factory = DecoderFactory()
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if channel.message_encoding == "json":
                value: object = json.loads(message.data)
            else:
                value = factory.decoder_for("protobuf", schema)(message.data)
            topics.setdefault(channel.topic, []).append((message.log_time, value))
    return topics


def test_foreign_decoder_reads_every_topic(run, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    run.record(path)
    topics = decoded(path)
    assert set(topics) == {"/trace", "/tf", "/scene", "/joint_states", "/log", "/program", "/io", "/events"}

    at, joints = topics["/joint_states"][30]
    tick = 30 * 20
    assert at == tick * 1_000_000
    assert (joints.timestamp.seconds, joints.timestamp.nanos) == divmod(at, 10**9)
    assert [j.name for j in joints.joints] == [f"J{i}" for i in range(1, 7)]
    assert [j.position for j in joints.joints] == run.window.joints[tick].tolist()
    speed = np.diff(run.window.joints, axis=0) / 0.001
    np.testing.assert_allclose([j.velocity for j in joints.joints], speed[tick - 1])

    _, frames = topics["/tf"][30]
    names = [(f.parent_frame_id, f.child_frame_id) for f in frames.transforms]
    assert names == [("base", "link1"), ("link1", "link2"), ("base", "tool")]
    angle = run.window.joints[tick, 0]
    first, second, tool = frames.transforms
    assert (first.translation.z, first.rotation.w) == (0, 1)
    np.testing.assert_allclose(second.translation.z, 0.4)
    q = second.rotation
    z = [2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x), 1 - 2 * (q.x**2 + q.y**2)]
    np.testing.assert_allclose(z, [np.cos(angle), np.sin(angle), 0], atol=1e-15)
    assert tool.translation.x == run.window.position[tick, 0]

    _, block = topics["/trace"][1]
    assert block.first_tick == 2000
    assert list(block.s) == run.window.s[2000:].tolist()
    assert len(block.actual) == 0

    assert [v["signal"] for _, v in topics["/io"]] == ["DO1", "DI3"]
    assert [(v["line"], v["interpreter_line"]) for _, v in topics["/program"]][-1] == (5, 6)
    assert topics["/log"][0][1].message == "done"
    assert topics["/log"][0][1].file == "part.via"


def test_viewer_rates_stay_at_50_hz(run, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    run.record(path)
    topics = decoded(path)
    for name in ("/tf", "/joint_states"):
        steps = np.diff([at for at, _ in topics[name]])
        assert set(steps.tolist()) == {20_000_000}


@pytest.mark.parametrize("tick_s", [0.0001, 0.004, 0.01, 0.05])
def test_other_ticks(make_run, tick_s: float, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    run = make_run(1200, tick_s=tick_s)
    run.record(path)
    steps = np.diff([at for at, _ in decoded(path)["/tf"]])
    assert steps.min() >= 1e9 / 60
    np.testing.assert_array_equal(load_recording(path).time, run.window.time)


def test_attachments_hold_program_cell_and_layouts(run, tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "run.mcap"
    run.record(path)
    with path.open("rb") as stream:
        attached = {a.name: a.data.decode() for a in make_reader(stream).iter_attachments()}
    assert attached["program/part.via"] == run.info.program_source
    assert attached["cell/cell.toml"] == run.info.cell_text
    foxglove = json.loads(attached["layout/foxglove.json"])
    assert set(foxglove) == {"version", "content"}
    lichtblick = json.loads(attached["layout/lichtblick.json"])
    assert lichtblick["configById"]["3D!scene"]["topics"]["/scene"] == {"visible": True}
    assert 'name=="J6"' in json.dumps(foxglove).replace("\\", "")


def test_links_chain_back_to_the_wire_frame() -> None:
    from viapoint.runtime.recording.scene import chained, link_frames
    from viapoint.runtime.rotations import quaternion_multiply, quaternion_to_matrix

    points = np.random.default_rng(7).normal(size=(50, 6, 3))
    points[:, 4] = points[:, 3] - [0, 0, 0.5]  # straight down
    points[:, 5] = points[:, 4]  # a link without length
    position, quaternion = chained(*link_frames(points))
    at, turn = np.zeros((50, 3)), np.tile([1.0, 0, 0, 0], (50, 1))
    for i in range(5):
        at = at + (quaternion_to_matrix(turn) @ position[:, i, :, None])[..., 0]
        turn = quaternion_multiply(turn, quaternion[:, i])
        np.testing.assert_allclose(at, points[:, i], atol=1e-12)
        along = points[:, i + 1] - points[:, i]
        tip = quaternion_to_matrix(turn)[..., 2] * np.linalg.norm(along, axis=-1, keepdims=True)
        np.testing.assert_allclose(tip, along, atol=1e-12)


def test_planned_path_is_one_line_that_goes_on(run, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recorder = run.record(path, close=False)
    pieces = [np.array([[0, 0, 0], [1, 0, 0.0]]), np.array([[1, 0, 0], [1, 1, 0.0]])]
    for piece in pieces:
        recorder.programmed_path(piece)
    recorder.close()
    lines = [
        [(p.x, p.y) for p in entity.lines[0].points]
        for _, update in decoded(path)["/scene"]
        for entity in update.entities
        if entity.id.startswith("programmed")
    ]
    assert lines == [[(0, 0), (1, 0), (1, 1)]]
