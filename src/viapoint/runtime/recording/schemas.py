"""The schemas of viapoint's own topics: one table of the trace's columns, and JSON schemas of the rest.

The schemas of `/tf`, `/scene`, `/joint_states` and `/log` are Foxglove's and come from its library.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

TRACE_SCHEMA = "viapoint.TraceBlock"


@dataclass(frozen=True, slots=True)
class Column:
    """One array of a TraceBlock: `width` values per tick, row by row."""

    number: int
    name: str
    type: str  # numpy type on the wire
    width: int  # 0: one per axis; ANY: however many there are, perhaps none
    doc: str


FIRST_TICK, AXES = 1, 2
ANY = -1
COLUMNS = (
    Column(3, "time", "<f8", 1, "s"),
    Column(4, "line", "<i4", 1, "source line whose statement the path is in"),
    Column(5, "interpreter_line", "<i4", 1, "source line the interpreter has reached"),
    Column(6, "s", "<f8", 1, "m, length of the TCP's path since the start"),
    Column(7, "speed", "<f8", 1, "m/s, of the TCP along its path"),
    Column(8, "override", "<f8", 1, "1.0 = 100 %"),
    Column(9, "buffer_fill", "<i4", 1, "entries in the motion buffer"),
    Column(10, "joints", "<f8", 0, "rad or m, set points as sent"),
    Column(11, "actual", "<f8", 0, "rad or m, as the drives report; absent where equal to the set points"),
    Column(12, "position", "<f8", 3, "m, TCP in the base frame"),
    Column(13, "quaternion", "<f8", 4, "w x y z, TCP in the base frame"),
    Column(14, "auxiliary", "<f8", ANY, "rad or m, auxiliary axes as sent; absent where there are none"),
    Column(16, "torque", "<f8", ANY, "N·m, of the joints; absent where the arm's masses are not known"),
    Column(15, "deviation", "<f8", 1, "m, of the TCP as sent from where the path has it"),
)


def trace_descriptor() -> bytes:
    """The serialized FileDescriptorSet of viapoint.TraceBlock, as MCAP wants it."""
    from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorSet

    wire_types = {"<f8": FieldDescriptorProto.TYPE_DOUBLE, "<i4": FieldDescriptorProto.TYPE_SFIXED32}
    files = FileDescriptorSet()
    package, _, message = TRACE_SCHEMA.partition(".")
    file = files.file.add(name=f"{package}/{message}.proto", package=package, syntax="proto3")
    block = file.message_type.add(name=message)
    for number, name, kind in (
        (FIRST_TICK, "first_tick", FieldDescriptorProto.TYPE_UINT64),
        (AXES, "axes", FieldDescriptorProto.TYPE_UINT32),
    ):
        block.field.add(name=name, number=number, type=kind, label=FieldDescriptorProto.LABEL_OPTIONAL)
    for column in COLUMNS:
        block.field.add(
            name=column.name,
            number=column.number,
            type=wire_types[column.type],
            label=FieldDescriptorProto.LABEL_REPEATED,
        )
    return bytes(files.SerializeToString(deterministic=True))


def _object(title: str, properties: dict[str, object], required: list[str]) -> bytes:
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "type": "object",
        "properties": properties,
        "required": required,
    }
    return json.dumps(schema, separators=(",", ":")).encode()


NUMBER, INTEGER, STRING, BOOLEAN = ({"type": t} for t in ("number", "integer", "string", "boolean"))
STAMP = {
    "type": "object",
    "title": "time",
    "properties": {"sec": INTEGER, "nsec": INTEGER},
}

JSON_SCHEMAS = {
    "viapoint.ProgramState": _object(
        "viapoint.ProgramState",
        {
            "t": NUMBER,
            "line": INTEGER,
            "interpreter_line": INTEGER,
            "state": {"type": "string", "enum": ["moving", "standing"]},
        },
        ["t", "line", "interpreter_line", "state"],
    ),
    "viapoint.Signal": _object(
        "viapoint.Signal",
        {
            "t": NUMBER,
            "signal": STRING,
            "value": BOOLEAN,
            "level": NUMBER,
            "access": STRING,
            "line": INTEGER,
        },
        ["t", "signal", "value", "level", "access", "line"],
    ),
    "viapoint.Event": _object(
        "viapoint.Event",
        {
            "t": NUMBER,
            "tick": INTEGER,
            "line": INTEGER,
            "kind": STRING,
            "robot": INTEGER,
            "t_end": NUMBER,
            "command": STRING,
            "length_mm": NUMBER,
            "s0_mm": NUMBER,
            "s_mm": NUMBER,
            "limited_by": STRING,
            "linear_mm_s": NUMBER,
            "angular_deg_s": NUMBER,
            "joint_deg_s": NUMBER,
            "limits": STRING,
            "signal": STRING,
            "index": INTEGER,
            "part": INTEGER,
            "percent": NUMBER,
            "lag_mm": NUMBER,
            "travel_mm": NUMBER,
            "action": STRING,
            "axis": STRING,
            "reason": STRING,
            "text": STRING,
            "code": STRING,
            "message": STRING,
            "ahead": BOOLEAN,
            "timed_out": BOOLEAN,
            "found": BOOLEAN,
            "place": STRING,
            "label": STRING,
        },
        ["t", "tick", "line", "kind", "robot"],
    ),
    "sensor_msgs/JointState": _object(
        "sensor_msgs/JointState",
        {
            "header": {"type": "object", "properties": {"stamp": STAMP, "frame_id": STRING}},
            "name": {"type": "array", "items": STRING},
            "position": {"type": "array", "items": NUMBER},
            "velocity": {"type": "array", "items": NUMBER},
            "effort": {"type": "array", "items": NUMBER},
        },
        ["header", "name", "position", "velocity", "effort"],
    ),
}
