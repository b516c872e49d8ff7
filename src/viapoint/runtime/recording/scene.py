"""What the 3D view shows: one entity per link, sent once, and the paths as lines; and log lines.

Shapes only. Where the links are in each moment is on `/tf`, which the recorder writes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import core
from ..rotations import quaternion_conjugate, quaternion_multiply
from .info import Floats
from .wire import (
    NANOSECONDS,
    Template,
    bytes_field,
    double_field,
    doubles,
    message_field,
    varint_field,
)

if TYPE_CHECKING:
    from foxglove.messages import Color, SceneEntity

LINK_RADIUS = 0.05  # m, where the robot states no capsule
SHORT = 1e-6  # m; links shorter than this have no direction to draw
DOWNWARD = 1e-9  # 1 + cos of the angle to upright; below this Z points straight down
LINE_WIDTH = 2.0  # pixels

_POINT = Template(message_field(5, [p for number in (1, 2, 3) for p in double_field(number)]))
_UPRIGHT = bytes_field(1, b"") + bytes_field(2, doubles(4, 1.0))  # a Pose at the origin


def link_name(index: int) -> str:
    return f"link{index + 1}"


def _colour(red: float, green: float, blue: float, alpha: float = 1.0) -> Color:
    from foxglove.messages import Color

    return Color(r=red, g=green, b=blue, a=alpha)


def link_frames(points: Floats) -> tuple[Floats, Floats]:
    """(N, k, 3) wire frame → positions (N, k−1, 3) and quaternions (N, k−1, 4) of the links' frames.

    Link i stands at point i with Z along to point i + 1. The turn about Z is the smallest from upright:
    links are drawn round.
    """
    along = np.diff(points, axis=1)
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    up = np.array([0.0, 0.0, 1.0])
    z = np.where(length > SHORT, along / np.maximum(length, SHORT), up)
    q = np.stack((1.0 + z[..., 2], -z[..., 1], z[..., 0], np.zeros(z.shape[:-1])), axis=-1)
    down = q[..., :1] < DOWNWARD
    q = np.where(down, np.array([0.0, 1.0, 0.0, 0.0]), q)
    return points[:, :-1], q / np.linalg.norm(q, axis=-1, keepdims=True)


def chained(position: Floats, quaternion: Floats) -> tuple[Floats, Floats]:
    """Poses (N, m) in the base frame → each in the frame of the one before it, the first in the base."""
    inverse = quaternion_conjugate(quaternion[:, :-1])
    offset = np.diff(position, axis=1)
    axis, w = inverse[..., 1:], inverse[..., :1]
    twice = 2.0 * np.cross(axis, offset)
    moved = position.copy()
    moved[:, 1:] = offset + w * twice + np.cross(axis, twice)
    turned = quaternion.copy()
    turned[:, 1:] = quaternion_multiply(inverse, quaternion[:, 1:])
    return moved, turned


def frame_values(points: Floats, position: Floats, quaternion: Floats) -> Floats:
    """Wire frames (N, k, 3), the TCP (N, 3) and (N, 4) → (N, 7·k): x y z, qx qy qz qw, links first.

    Links are in the frame of the one before, the first one and the TCP in the base frame.
    """
    module = core.chosen("recording._core")
    if module is not None:
        values: Floats = module.frame_values(
            *(np.ascontiguousarray(x, dtype=np.float64) for x in (points, position, quaternion))
        )
        return values
    p, q = chained(*link_frames(points))
    position = np.concatenate((p, position[:, None]), axis=1)
    quaternion = np.concatenate((q, quaternion[:, None]), axis=1)
    turned = np.concatenate((quaternion[..., 1:], quaternion[..., :1]), axis=-1)  # protobuf: x y z w
    return np.concatenate((position, turned), axis=-1).reshape(len(points), -1)


def link_entities(points: Floats, radii: tuple[float, ...]) -> list[SceneEntity]:
    """(k, 3) wire frame of any pose → a round body per link, fixed to the link's frame."""
    from foxglove.messages import (
        CylinderPrimitive,
        Duration,
        Pose,
        Quaternion,
        SceneEntity,
        Timestamp,
        Vector3,
    )

    entities = []
    for i, length in enumerate(np.linalg.norm(np.diff(points, axis=0), axis=-1).tolist()):
        if length < SHORT:
            continue
        radius = radii[min(i, len(radii) - 1)] if radii else LINK_RADIUS
        shade = 0.95 if i % 2 else 0.6
        cylinder = CylinderPrimitive(
            pose=Pose(position=Vector3(x=0, y=0, z=length / 2), orientation=Quaternion(x=0, y=0, z=0, w=1)),
            size=Vector3(x=2 * radius, y=2 * radius, z=length),
            bottom_scale=1.0,
            top_scale=1.0,
            color=_colour(shade, 0.45, 0.15),
        )
        entities.append(
            SceneEntity(
                timestamp=Timestamp(0, 0),
                frame_id=link_name(i),
                id=link_name(i),
                lifetime=Duration(0, 0),
                frame_locked=True,
                cylinders=[cylinder],
            )
        )
    return entities


def line_update(name: str, points: Floats, *, nanoseconds: int, programmed: bool) -> bytes:
    """A foxglove.SceneUpdate with (K, 3) points in the base frame as a line that stays.

    Encoded here: an object per point would cost more than all else.
    """
    corners = np.empty((len(points), _POINT.size), np.uint8)
    _POINT.encode(np.empty(0, dtype=np.int64), points, corners)
    colour = (0.2, 0.6, 1.0, 0.7) if programmed else (1.0, 0.85, 0.2, 1.0)
    line = (
        bytes_field(2, _UPRIGHT) + doubles(3, LINE_WIDTH) + varint_field(4, 1)
    )  # pose; the same at any zoom
    line += corners.tobytes() + bytes_field(6, doubles(1, *colour))
    seconds, rest = divmod(nanoseconds, NANOSECONDS)
    entity = bytes_field(1, varint_field(1, seconds) + varint_field(2, rest))
    entity += bytes_field(2, b"base") + bytes_field(3, name.encode()) + bytes_field(4, b"")
    entity += varint_field(5, 1) + bytes_field(11, line)  # fixed to its frame
    return bytes_field(2, entity)


def scene_update(entities: list[SceneEntity]) -> bytes:
    from foxglove.messages import SceneUpdate

    return bytes(SceneUpdate(entities=entities).encode())


def log_message(level: str, text: str, *, file: str, line: int, nanoseconds: int) -> bytes:
    """`level`: Info, Warning or Error."""
    from foxglove.messages import Log, LogLevel, Timestamp

    message = Log(
        timestamp=Timestamp(*divmod(nanoseconds, NANOSECONDS)),
        level=getattr(LogLevel, level),
        message=text,
        name="viapoint",
        file=file,
        line=max(line, 0),
    )
    return bytes(message.encode())
