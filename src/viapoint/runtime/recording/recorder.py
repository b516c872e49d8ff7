"""The recorder: listens to the windows and events of a run and writes them to an MCAP file.

It computes nothing the kernel should: positions of the links come from the robot, the rest from the
windows. The same run writes the same bytes: time stamps are the run's own, and blocks do not follow
the size of the windows.
"""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from ..records import Event, Window
from . import layouts, scene
from .blocks import Block, BlockBuilder
from .info import Floats, RunInfo, Skeleton
from .mcapwriter import McapWriter, Stamps, Topic
from .schemas import JSON_SCHEMAS, TRACE_SCHEMA, trace_descriptor
from .wire import NANOSECONDS, Template, bytes_field, double_field, message_field, time_field

RATE_HZ = 50.0  # of /tf and /joint_states; viewers complain above 60
STANDING = 1e-9  # m/s and rad per tick; below this nothing moves

TRACE = "/trace"
JOINT_STATES = "/joint_states"
JOINT_STATES_ROS = "/joint_states_ros"
_ENCODER = json.JSONEncoder(separators=(",", ":"), default=float, check_circular=False)
LOG_LEVELS = {"message": "Info", "error": "Error"}


def _topics(*, ros: bool) -> tuple[Topic, ...]:
    from foxglove.messages import FrameTransforms, JointStates, Log, SceneUpdate

    topics = [Topic(TRACE, TRACE_SCHEMA, "protobuf", trace_descriptor())]
    for name, message in (
        ("/tf", FrameTransforms),
        ("/scene", SceneUpdate),
        (JOINT_STATES, JointStates),
        ("/log", Log),
    ):
        schema = message.get_schema()
        topics.append(Topic(name, schema.name, schema.encoding, schema.data))
    told = [
        ("/program", "viapoint.ProgramState"),
        ("/io", "viapoint.Signal"),
        ("/events", "viapoint.Event"),
    ]
    if ros:
        told.append((JOINT_STATES_ROS, "sensor_msgs/JointState"))
    topics += (Topic(name, title, "jsonschema", JSON_SCHEMAS[title]) for name, title in told)
    return tuple(topics)


class Recorder:
    """Writes one run. Give it every window and event once, in time order; close it at the end."""

    def __init__(
        self,
        path: Path,
        info: RunInfo,
        *,
        skeleton: Skeleton | None = None,
        radii: tuple[float, ...] = (),
        ros: bool = False,
    ) -> None:
        """Overwrites `path`; raises OSError. `skeleton` draws the robot, `radii` (m) its capsules;
        `ros` adds `/joint_states_ros`."""
        self._info = info
        self._skeleton = skeleton
        self._ros = ros
        self._stride = max(1, round(1.0 / (RATE_HZ * info.tick_s)))
        self._events: list[Event] = []
        self._previous = (0, 0, "")  # line, interpreter line and state last told
        self._planned: list[Floats] = []  # pieces of path that wait to be drawn
        self._planned_end: Floats | None = None  # (1, 3) where the path drawn so far ends
        self._file = McapWriter(Path(path), _topics(ros=ros))
        self._blocks = BlockBuilder(self._file.begin)
        self._joint_template = _joint_template(info)
        self._frame_template: Template | None = None
        self._radii = radii
        self._begin()

    def _begin(self) -> None:
        info = self._info
        self._file.metadata("viapoint", info.to_metadata())
        self._file.attach(f"program/{info.program_name}", "text/x-via", info.program_source)
        self._file.attach(f"cell/{info.cell_name or 'cell.toml'}", "application/toml", info.cell_text)
        if info.scenario_text is not None:
            self._file.attach("scenario/scenario.toml", "application/toml", info.scenario_text)
        self._file.attach("layout/foxglove.json", "application/json", layouts.foxglove_layout(info.axes))
        self._file.attach("layout/lichtblick.json", "application/json", layouts.lichtblick_layout(info.axes))
        self._file.flush()

    # --- what happens during the run ---

    def window(self, window: Window) -> None:
        """The next ticks."""
        for block in self._blocks.add(window):
            self._write_block(block)

    def event(self, event: Event) -> None:
        """Something happened; written with the block of its tick."""
        self._events.append(event)

    def programmed_path(self, points: Floats) -> None:
        """(K, 3) m: a piece of the path as planned, drawn beside the travelled one from the next block on."""
        if self._planned and np.array_equal(self._planned[-1][-1], points[0]):
            points = points[1:]
        self._planned.append(points)

    def close(self, result: dict[str, str] | None = None) -> None:
        """Write what is left; `result` becomes the metadata `result` (its absence: the run broke off)."""
        last = self._blocks.rest()
        if last is not None:
            self._write_block(last)
        self._write_events(None)
        if result:
            self._file.metadata("result", result)
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._file.closed:
            self.close()

    # --- one block ---

    def _nanoseconds(self, tick: int) -> int:
        return round(tick * self._info.tick_s * NANOSECONDS)

    def _write_block(self, block: Block) -> None:
        at = self._nanoseconds(block.first_tick)
        self._file.end(TRACE, block.size, at)
        rows = slice(-block.first_tick % self._stride, len(block), self._stride)
        ticks = np.arange(block.first_tick + rows.start, block.first_tick + len(block), self._stride)
        if len(ticks):
            stamps = np.rint(ticks * (self._info.tick_s * NANOSECONDS)).astype(np.int64)
            self._write_joints(block, rows, stamps)
            self._write_frames(block, rows, stamps)
            self._write_travelled(block, rows, self._nanoseconds(block.first_tick + len(block) - 1))
        self._write_planned(at)
        self._write_program(block)
        self._write_events(block.first_tick + len(block))
        self._file.flush()

    def _write_joints(self, block: Block, rows: slice, stamps: Stamps) -> None:
        values = block.motion(rows.start, self._stride, self._info.tick_s)
        self._write_alike(JOINT_STATES, self._joint_template, stamps, values.reshape(len(stamps), -1))
        if self._ros:
            for stamp, row in zip(stamps.tolist(), values.tolist(), strict=True):
                self._file.message(JOINT_STATES_ROS, self._ros_state(stamp, row), stamp)

    def _write_alike(self, topic: str, template: Template, stamps: Stamps, values: Floats) -> None:
        self._file.alike(topic, template.size, stamps, partial(template.encode, stamps, values))

    def _ros_state(self, stamp: int, row: list[list[float]]) -> bytes:
        seconds, rest = divmod(stamp, NANOSECONDS)
        return _json(
            {
                "header": {"stamp": {"sec": seconds, "nsec": rest}, "frame_id": "base"},
                "name": [axis.name for axis in self._info.axes],
                "position": [axis[0] for axis in row],
                "velocity": [axis[1] for axis in row],
                "effort": [],
            }
        )

    def _write_frames(self, block: Block, rows: slice, stamps: Stamps) -> None:
        """Links as a chain from the base; the tool hangs at the base too: it shows the TCP as sent."""
        points = np.zeros((len(stamps), 1, 3))
        if self._skeleton is not None:
            points = np.asarray(self._skeleton(block.column("actual")[rows].copy()))
        if self._frame_template is None:
            self._frame_template = _frame_template(points.shape[1] - 1)
            if self._skeleton is not None:
                entities = scene.link_entities(points[0], self._radii)
                self._file.message("/scene", scene.scene_update(entities), 0)
        values = scene.frame_values(points, block.column("position")[rows], block.column("quaternion")[rows])
        self._write_alike("/tf", self._frame_template, stamps, values)

    def _write_travelled(self, block: Block, rows: slice, at: int) -> None:
        position, before = block.column("position"), block.before.position
        points = np.concatenate(
            (
                position[:0] if before is None else before[None],
                position[: 1 if rows.start > 0 else 0],
                position[rows.start : -1 : rows.step],
                position[-1:],
            )
        )
        if (points.max(axis=0) - points.min(axis=0)).max() < scene.SHORT:
            return
        name = f"travelled{block.first_tick}"
        line = scene.line_update(name, points, nanoseconds=at, programmed=False)
        self._file.message("/scene", line, at)

    def _write_planned(self, at: int) -> None:
        """The path planned since the block before, as one line that goes on from there."""
        if not self._planned:
            return
        before = [] if self._planned_end is None else [self._planned_end]
        points = np.concatenate((*before, *self._planned))
        line = scene.line_update(f"programmed{at}", points, nanoseconds=at, programmed=True)
        self._file.message("/scene", line, at)
        self._planned_end = points[-1:]
        self._planned.clear()

    def _write_program(self, block: Block) -> None:
        for row, line, ahead, moves in block.changes(STANDING):
            told = (line, ahead, "moving" if moves else "standing")
            if told == self._previous:
                continue
            self._previous = told
            t = float(block.column("time")[row])
            data = {"t": t, "line": line, "interpreter_line": ahead, "state": told[2]}
            self._file.message("/program", _json(data), self._nanoseconds(block.first_tick + row))

    def _write_events(self, before: int | None) -> None:
        due = [e for e in self._events if before is None or e.tick < before]
        self._events = [e for e in self._events if before is not None and e.tick >= before]
        for event in due:
            self._write_event(event)

    def _write_event(self, event: Event) -> None:
        at = self._nanoseconds(event.tick)
        head = {
            "t": event.t,
            "tick": event.tick,
            "line": event.line,
            "kind": event.kind,
            "robot": event.robot,
        }
        self._file.message("/events", _json(head | dict(event.data)), at)
        if event.kind in ("output", "input_read"):
            value = event.data["value"]
            signal = {
                "t": event.t,
                "signal": event.data["signal"],
                "value": bool(value),
                "level": float(value) if isinstance(value, float) else int(bool(value)),
                "access": "written" if event.kind == "output" else "read",
                "line": event.line,
            }
            self._file.message("/io", _json(signal), at)
        level = LOG_LEVELS.get(event.kind)
        if level is not None:
            parts = (event.data.get(key) for key in ("code", "message", "text"))
            text = " ".join(str(part) for part in parts if part is not None)
            log = scene.log_message(
                level, text, file=self._info.program_name, line=event.line, nanoseconds=at
            )
            self._file.message("/log", log, at)


def _json(data: object) -> bytes:
    return _ENCODER.encode(data).encode()


def _joint_template(info: RunInfo) -> Template:
    parts = time_field(1)
    for axis in info.axes:
        name = bytes_field(1, axis.name.encode())
        parts += message_field(2, [name, *double_field(2), *double_field(3), *double_field(4)])
    return Template(parts)


def _frame_template(links: int) -> Template:
    chain = [("base" if i == 0 else scene.link_name(i - 1), scene.link_name(i)) for i in range(links)]
    parts = []
    for parent, child in [*chain, ("base", "tool")]:
        names = bytes_field(2, parent.encode()) + bytes_field(3, child.encode())
        translation = message_field(4, double_field(1) + double_field(2) + double_field(3))
        rotation = message_field(5, [p for number in (1, 2, 3, 4) for p in double_field(number)])
        parts += message_field(1, [*time_field(1), names, *translation, *rotation])
    return Template(parts)
