"""What the 3D view shows: one entity per link, sent once, and the paths as lines; and log lines.

Shapes only. Where the links are in each moment is on `/tf`, which the recorder writes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..rotations import matrix_to_quaternion
from .info import Floats
from .wire import NANOSECONDS

if TYPE_CHECKING:
    from foxglove.messages import Color, Pose, SceneEntity

LINK_RADIUS = 0.05  # m, where the robot states no capsule
SHORT = 1e-6  # m; links shorter than this have no direction to draw
LINE_WIDTH = 2.0  # pixels


def link_name(index: int) -> str:
    return f"link{index + 1}"


def _colour(red: float, green: float, blue: float, alpha: float = 1.0) -> Color:
    from foxglove.messages import Color

    return Color(r=red, g=green, b=blue, a=alpha)


def link_entities(frames: Floats, radii: tuple[float, ...]) -> list[SceneEntity]:
    """(m, 4, 4) link frames of one pose → a cylinder from each link's origin to the next one's."""
    from foxglove.messages import CylinderPrimitive, Duration, SceneEntity, Timestamp, Vector3

    entities = []
    origins = np.concatenate((np.zeros((1, 3)), frames[:, :3, 3]))
    poses = np.concatenate((np.eye(4)[None], frames))
    for i in range(len(frames)):
        offset = poses[i, :3, :3].T @ (origins[i + 1] - origins[i])
        length = float(np.linalg.norm(offset))
        if length < SHORT:
            continue
        radius = radii[min(i, len(radii) - 1)] if radii else LINK_RADIUS
        shade = 0.95 if i % 2 else 0.6
        cylinder = CylinderPrimitive(
            pose=_along(offset),
            size=Vector3(x=2 * radius, y=2 * radius, z=length),
            bottom_scale=1.0,
            top_scale=1.0,
            color=_colour(shade, 0.45, 0.15),
        )
        entities.append(
            SceneEntity(
                timestamp=Timestamp(0, 0),
                frame_id="base" if i == 0 else link_name(i - 1),
                id=f"body{i}",
                lifetime=Duration(0, 0),
                frame_locked=True,
                cylinders=[cylinder],
            )
        )
    return entities


def _along(offset: Floats) -> Pose:
    """The pose whose Z axis runs along `offset`, at its middle."""
    from foxglove.messages import Pose, Quaternion, Vector3

    z = offset / np.linalg.norm(offset)
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    w, qx, qy, qz = matrix_to_quaternion(np.stack((x, np.cross(z, x), z), axis=-1)).tolist()
    mx, my, mz = (offset / 2).tolist()
    return Pose(position=Vector3(x=mx, y=my, z=mz), orientation=Quaternion(x=qx, y=qy, z=qz, w=w))


def line_entity(name: str, points: Floats, *, nanoseconds: int, programmed: bool) -> SceneEntity:
    """(K, 3) points in the base frame as a line that stays."""
    from foxglove.messages import (
        Duration,
        LinePrimitive,
        LinePrimitiveLineType,
        Point3,
        Pose,
        Quaternion,
        SceneEntity,
        Timestamp,
        Vector3,
    )

    colour = _colour(0.2, 0.6, 1.0, 0.7) if programmed else _colour(1.0, 0.85, 0.2)
    line = LinePrimitive(
        type=LinePrimitiveLineType.LineStrip,
        pose=Pose(position=Vector3(x=0, y=0, z=0), orientation=Quaternion(x=0, y=0, z=0, w=1)),
        thickness=LINE_WIDTH,
        scale_invariant=True,
        points=[Point3(x=x, y=y, z=z) for x, y, z in points.tolist()],
        color=colour,
    )
    return SceneEntity(
        timestamp=Timestamp(*divmod(nanoseconds, NANOSECONDS)),
        frame_id="base",
        id=name,
        lifetime=Duration(0, 0),
        frame_locked=True,
        lines=[line],
    )


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
