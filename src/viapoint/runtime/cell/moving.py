"""Points and frames that the application moves while a program runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.cell.model import Cell, Floats, Frame, Point
from viapoint.runtime.rotations import abc_to_matrix


def moved_point(cell: Cell, which: int | str, pose: Sequence[float]) -> Point:
    """A live point at x, y, z (mm), a, b, c (deg). Raises ValueError for one that is not live."""
    point = next((p for i, p in cell.points.items() if which in (i, p.name)), None)
    if point is None or not point.live:
        raise ValueError(f"{which!r} is no point of the cell that is live")
    return replace(point, pose=_pose(pose), joints=None)


def moved_frame(cell: Cell, which: int | str, pose: Sequence[float]) -> Frame:
    """A live frame at a pose in frame 0, as in the cell file. Raises ValueError for one that is not live."""
    frame = next((f for i, f in cell.frames.items() if which in (i, f.name)), None)
    if frame is None or not frame.live:
        raise ValueError(f"{which!r} is no frame of the cell that is live")
    return replace(frame, X_base_frame=cell.frames[0].X_base_frame @ _pose(pose))


def _pose(numbers: Sequence[float]) -> Floats:
    values = np.asarray(numbers, dtype=np.float64)
    if values.shape != (6,) or not np.isfinite(values).all():
        raise ValueError(f"a pose is six numbers: x, y, z in mm, a, b, c in deg, not {numbers!r}")
    X = np.eye(4)
    X[:3, :3] = abc_to_matrix(values[3:] * DEG)
    X[:3, 3] = values[:3] * MM
    return X
