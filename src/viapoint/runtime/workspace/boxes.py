"""Cuboids in frames of their own, and the shell of their union. It knows no robot and no rules.

A body inside several overlapping or adjoining cuboids is inside their union although no one of them holds
it. How far it is from leaving is its distance from the shell: the faces without what another cuboid covers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell, Zone
from viapoint.runtime.records import Floats
from viapoint.runtime.workspace.distances import point_box, segment_box, segment_polygon

JOINED: Final = 1e-6
"""m. Cuboids closer than this adjoin: frames and corners in mm leave 1e-12 m of rounding, and no gap that
is meant is so small."""

_SPECK: Final = 1e-12
"""m². Pieces of faces smaller than this are left over by rounding."""

AMPLE: Final = 0.05
"""m. With so much to spare, a cheap bound on the clearance is good enough."""


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """Cuboids: R_base_box (Z, 3, 3), centres (Z, 3) in the base, half extents (Z, 3); m."""

    names: tuple[str, ...]
    R_base_box: Floats
    centre: Floats
    half: Floats

    def __len__(self) -> int:
        return len(self.names)

    def local(self, points: Floats) -> Floats:
        """(..., 3) in the base → (..., Z, 3) in every box's own frame."""
        result: Floats = np.einsum("...zi,zij->...zj", points[..., None, :] - self.centre, self.R_base_box)
        return result

    def clearance(self, start: Floats, end: Floats, radius: Floats) -> Floats:
        """Signed distance (..., Z) of capsules (..., 3), (..., 3), (...) from every box.

        Far away the value may be too small: then it is that of the cuboid in which the axis is the diagonal.
        """
        a, b = self.local(start), self.local(end)
        least = np.maximum(np.minimum(a, b), -np.maximum(a, b)) - self.half
        gaps = np.asarray(np.linalg.norm(np.maximum(least, 0.0), axis=-1)) - radius[..., None]
        near = np.nonzero(gaps < AMPLE)
        gaps[near] = segment_box(a[near], b[near], self.half[near[-1]]) - radius[near[:-1]]
        return gaps

    def of_point(self, point: Floats) -> Floats:
        """Signed distance (..., Z) of points (..., 3) from every box."""
        return point_box(self.local(point), self.half)


def boxes_of(cell: Cell, kind: str) -> Boxes:
    """The zones of one kind in a cell."""
    zones: list[Zone] = [zone for zone in cell.zones if zone.kind == kind]
    frames = [cell.frames[zone.frame].X_base_frame for zone in zones]
    lower = np.array([zone.lower for zone in zones]).reshape(-1, 3)
    upper = np.array([zone.upper for zone in zones]).reshape(-1, 3)
    R = np.array([X[:3, :3] for X in frames]).reshape(-1, 3, 3)
    origin = np.array([X[:3, 3] for X in frames]).reshape(-1, 3)
    centre = origin + np.einsum("zij,zj->zi", R, 0.5 * (lower + upper))
    return Boxes(tuple(zone.name for zone in zones), R, centre, 0.5 * (upper - lower))


class Union:
    """A union of cuboids, and how far inside it segments are."""

    def __init__(self, boxes: Boxes) -> None:
        self.boxes = boxes
        pieces = _shell(boxes) if len(boxes) > 1 else []
        most = max((len(corners) for corners, _ in pieces), default=0)
        self._corners = np.array([_padded(corners, most) for corners, _ in pieces]).reshape(
            -1, max(most, 1), 3
        )
        self._normals = np.array([normal for _, normal in pieces]).reshape(-1, 3)

    @property
    def shell(self) -> tuple[Floats, Floats]:
        """The faces of a union: convex polygons, corners (F, V, 3), and normals (F, 3)."""
        return self._corners, self._normals

    def clearance(self, start: Floats, end: Floats, radius: Floats) -> Floats:
        """How far capsules (M, 3), (M, 3), (M,) are from leaving the union, m (M,); negative where one does.

        Deep inside the value may be too small: then it is what a single cuboid, or a plane, allows. Where an
        axis itself is outside it is by how far, and the radius.
        """
        depth: Floats = self._in_one(start, end)
        ample = radius + AMPLE
        if len(self.boxes) > 1:
            close = np.flatnonzero(depth < ample)
            if len(close):
                in_union = self._in_union(start[close], end[close], ample[close])
                depth[close] = np.maximum(depth[close], in_union)
        outside = np.flatnonzero(depth <= 0.0)
        if len(outside):
            depth[outside] = -self._excursion(start[outside], end[outside])
        return depth - radius

    def _in_one(self, start: Floats, end: Floats) -> Floats:
        """Depth in the cuboid that holds a segment best; the depth in one is concave, so ends decide."""
        both = np.maximum(self.boxes.of_point(start), self.boxes.of_point(end))
        return np.asarray(-both.min(axis=-1))

    def _in_union(self, start: Floats, end: Floats, ample: Floats) -> Floats:
        """Distance (M,) from the shell; 0 for segments that have an end outside.

        Pieces of the shell whose plane is `ample` away (M,) need not be measured.
        """
        first = self._corners[:, 0]
        h0 = np.einsum("mpi,pi->mp", start[:, None] - first, self._normals)
        h1 = np.einsum("mpi,pi->mp", end[:, None] - first, self._normals)
        gaps = np.where((h0 > 0.0) == (h1 > 0.0), np.minimum(np.abs(h0), np.abs(h1)), 0.0)
        segment, piece = np.nonzero(gaps < ample[:, None])
        gaps[segment, piece] = segment_polygon(
            start[segment], end[segment], self._corners[piece], self._normals[piece]
        )
        inside = (self.boxes.of_point(start).min(axis=-1) <= JOINED) & (
            self.boxes.of_point(end).min(axis=-1) <= JOINED
        )
        return np.where(inside, gaps.min(axis=-1, initial=np.inf), 0.0)

    def _excursion(self, start: Floats, end: Floats) -> Floats:
        """How far (M,) a segment is outside of the union: at its ends and amid every gap it passes."""
        middles = _gaps(self.boxes.local(start), self.boxes.local(end), self.boxes.half)
        t = np.concatenate((np.zeros((len(start), 1)), middles, np.ones((len(start), 1))), axis=1)[..., None]
        places = start[:, None] + t * (end - start)[:, None]
        return np.asarray(np.maximum(self.boxes.of_point(places).min(axis=-1), 0.0).max(axis=-1))


def _gaps(start: Floats, end: Floats, half: Floats) -> Floats:
    """(M, Z): middles, 0 … 1 along segments, of the stretches between the cuboids (M, Z, 3) they pass.

    Between which planes a segment is inside follows as in F 6-2 and 6-3; where it misses a cuboid, or two
    stretches overlap, the figure is just a place on the segment.
    """
    along = end - start
    moves = np.abs(along) > 0.0
    pace = np.where(moves, along, 1.0)
    with np.errstate(over="ignore"):
        first, second = (-half - start) / pace, (half - start) / pace
    enter = np.where(moves, np.minimum(first, second), 0.0).max(axis=-1)
    leave = np.where(moves, np.maximum(first, second), 1.0).min(axis=-1)
    misses = (enter > leave) | (~moves & (np.abs(start) > half)).any(axis=-1)
    enter = np.clip(np.where(misses, 1.0, enter), 0.0, 1.0)
    leave = np.clip(np.where(misses, 0.0, leave), 0.0, 1.0)
    order = np.argsort(enter, axis=-1)
    enter, leave = np.take_along_axis(enter, order, -1), np.take_along_axis(leave, order, -1)
    reached = np.maximum.accumulate(leave, axis=-1)
    following = np.concatenate((enter[:, 1:], np.ones((len(enter), 1))), axis=1)
    return np.asarray(0.5 * (reached + following))


_Piece = tuple[Floats, Floats]  # corners (V, 3), unit normal (3,)


def _shell(boxes: Boxes) -> list[_Piece]:
    """The parts of all faces with no cuboid just outside of them, as convex polygons."""
    pieces: list[_Piece] = []
    for number in range(len(boxes)):
        for corners, normal in _faces(boxes, number):
            left = [corners + JOINED * normal]
            for other in range(len(boxes)):
                if other != number:
                    left = [rest for piece in left for rest in _without(piece, _faces(boxes, other))]
            pieces += [(piece - JOINED * normal, normal) for piece in left if _area(piece) > _SPECK]
    return pieces


def _faces(boxes: Boxes, number: int) -> list[_Piece]:
    """The six faces of a cuboid with outward normals, corners counter-clockwise seen from outside."""
    R, centre, half = boxes.R_base_box[number], boxes.centre[number], boxes.half[number]
    faces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (1.0, -1.0):
            corners = np.zeros((4, 3))
            corners[:, axis] = side * half[axis]
            corners[:, u] = side * half[u] * np.array([1.0, -1.0, -1.0, 1.0])
            corners[:, v] = half[v] * np.array([1.0, 1.0, -1.0, -1.0])
            faces.append((centre + corners @ R.T, side * R[:, axis]))
    return faces


def _without(polygon: Floats, faces: Sequence[_Piece]) -> list[Floats]:
    """What is left of a convex polygon without a cuboid, as convex pieces, cut along face after face."""
    pieces = []
    for corners, normal in faces:
        height = (polygon - corners[0]) @ normal
        outside = _cut(polygon, -height)
        if len(outside):
            pieces.append(outside)
        polygon = _cut(polygon, height)
        if not len(polygon):
            break
    return pieces


def _cut(polygon: Floats, height: Floats) -> Floats:
    """The part (V', 3) of a convex polygon (V, 3) where a linear function of these values is ≤ 0."""
    kept = []
    for k in range(len(polygon)):
        a, b = polygon[k - 1], polygon[k]
        ha, hb = height[k - 1], height[k]
        if (ha > 0.0) != (hb > 0.0):
            kept.append(a + ha / (ha - hb) * (b - a))
        if hb <= 0.0:
            kept.append(b)
    return np.array(kept) if len(kept) > 2 else np.empty((0, 3))


def _area(polygon: Floats) -> float:
    spokes = polygon[1:] - polygon[0]
    return 0.5 * float(np.linalg.norm(np.cross(spokes[:-1], spokes[1:]).sum(axis=0)))


def _padded(corners: Floats, count: int) -> Floats:
    return np.concatenate((corners, np.repeat(corners[-1:], count - len(corners), axis=0)))
