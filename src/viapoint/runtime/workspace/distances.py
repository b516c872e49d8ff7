"""Distances between points, segments, capsules and cuboids as array formulas. Pure arithmetic, no robot.

Every function is batched over its leading axes, which broadcast. A segment is two points (..., 3) m; one
of no length is a point. A capsule is a segment with a radius, a sphere one of no length. A cuboid is given
by its half extents in a frame of its own, in which the segments are given too. Distances are of the
nearest points; where a segment is inside a cuboid they are negative: how deep its deepest point is.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.runtime.records import Floats

_NEAR_PARALLEL: Final = 1e-10
"""sin² of the angle between two segments below which their ends are tried as well: the interior solution
divides by it, and has lost up to six digits there."""

_TINY: Final = 1e-300
"""Squared lengths below this are of points; it only keeps divisions defined."""

_PAIRS: Final = np.triu_indices(6, 1)
"""The pairs of a cuboid's six faces."""


def _dot(a: Floats, b: Floats) -> Floats:
    result: Floats = np.einsum("...i,...i->...", a, b)
    return result


def point_segment(point: Floats, start: Floats, end: Floats) -> Floats:
    """Distance (...) of a point from a segment (F 6-6 … 6-14, clamped; a segment of no length too)."""
    along, towards = end - start, point - start
    t = np.clip(_dot(towards, along) / np.maximum(_dot(along, along), _TINY), 0.0, 1.0)
    distance: Floats = np.linalg.norm(towards - t[..., None] * along, axis=-1)
    return distance


def segment_segment(p0: Floats, p1: Floats, q0: Floats, q1: Floats) -> Floats:
    """Distance (...) of two segments, parallel and degenerate ones included.

    The minimum of F 6-18 over the square 0…1 × 0…1: s of the lines clamped, t for that s clamped, s for that
    t clamped. Near parallel the ends of both are tried as well.
    """
    u, v, between = p1 - p0, q1 - q0, p0 - q0
    a, b, e = _dot(u, u), _dot(u, v), _dot(v, v)
    c, f = _dot(u, between), _dot(v, between)
    area = a * e - b * b
    s = np.clip((b * f - c * e) / np.maximum(area, _TINY), 0.0, 1.0)
    t = np.clip((b * s + f) / np.maximum(e, _TINY), 0.0, 1.0)
    s = np.clip((b * t - c) / np.maximum(a, _TINY), 0.0, 1.0)
    gap = between + s[..., None] * u - t[..., None] * v
    distance = np.asarray(np.sqrt(_dot(gap, gap)))
    near = np.asarray(area <= _NEAR_PARALLEL * a * e)
    if near.any():
        ends = [np.broadcast_to(x, (*near.shape, 3))[near] for x in (p0, p1, q0, q1)]
        distance[near] = np.minimum(distance[near], _from_ends(*ends))
    return distance


def _from_ends(p0: Floats, p1: Floats, q0: Floats, q1: Floats) -> Floats:
    """The least distance of an end of one segment from the other."""
    first = np.minimum(point_segment(p0, q0, q1), point_segment(p1, q0, q1))
    second = np.minimum(point_segment(q0, p0, p1), point_segment(q1, p0, p1))
    nearest: Floats = np.minimum(first, second)
    return nearest


def capsule_capsule(
    p0: Floats, p1: Floats, p_radius: Floats, q0: Floats, q1: Floats, q_radius: Floats
) -> Floats:
    """Clearance (...) of two capsules, negative where they overlap (F 6-15 … 6-24)."""
    clearance: Floats = segment_segment(p0, p1, q0, q1) - p_radius - q_radius
    return clearance


def point_box(point: Floats, half: Floats) -> Floats:
    """Signed distance (...) of a point from a cuboid; inside it is minus the distance to the nearest face."""
    over = np.abs(point) - half
    outside = np.linalg.norm(np.maximum(over, 0.0), axis=-1)
    signed: Floats = np.where(outside > 0.0, outside, over.max(axis=-1))
    return signed


def segment_box(start: Floats, end: Floats, half: Floats) -> Floats:
    """Signed distance (...) of a segment from a cuboid; inside it is minus the depth of its deepest point.

    The squared distance is convex along the segment, and its derivative piecewise linear with breaks where
    the segment crosses the planes of the faces: its zero lies between the last break where it is not
    positive and the first where it is not negative.
    """
    start, end, half = np.broadcast_arrays(start, end, half)
    along = end - start
    breaks = _breaks(start, along, half)
    x = start[..., None, :] + breaks[..., None] * along[..., None, :]
    excess = x - np.clip(x, -half[..., None, :], half[..., None, :])
    slope = _dot(excess, along[..., None, :])
    down, up = slope <= 0.0, slope >= 0.0
    t_down = np.where(down, breaks, 0.0).max(axis=-1)
    t_up = np.where(up, breaks, 1.0).min(axis=-1)
    g_down = np.where(down, slope, -np.inf).max(axis=-1)
    g_up = np.where(up, slope, np.inf).min(axis=-1)
    inner = np.isfinite(g_down) & np.isfinite(g_up) & (g_up > g_down)
    share = np.where(inner, -g_down, 0.5) / np.where(inner, g_up - g_down, 1.0)
    t = t_down + np.where(np.isfinite(g_down), np.where(np.isfinite(g_up), share, 1.0), 0.0) * (t_up - t_down)
    nearest = start + t[..., None] * along
    gap = nearest - np.clip(nearest, -half, half)
    distance = np.asarray(np.sqrt(_dot(gap, gap)))
    touching = distance <= 0.0
    if touching.any():
        distance[touching] = -_depth(start[touching], along[touching], half[touching])
    return distance


def _breaks(start: Floats, along: Floats, half: Floats) -> Floats:
    """(..., 8): 0, 1 and where the segment crosses the planes of the faces, clamped into 0 … 1."""
    moves = along != 0.0
    pace = np.where(moves, along, 1.0)
    with np.errstate(over="ignore"):  # a crossing astronomically far away is clamped like any other
        planes = np.concatenate(
            (np.where(moves, (-half - start) / pace, 0.0), np.where(moves, (half - start) / pace, 0.0)),
            axis=-1,
        )
    breaks = np.empty((*start.shape[:-1], 8))
    np.clip(planes, 0.0, 1.0, out=breaks[..., :6])
    breaks[..., 6] = 0.0
    breaks[..., 7] = 1.0
    return breaks


def _depth(start: Floats, along: Floats, half: Floats) -> Floats:
    """(M,) depth of the deepest point of segments (M, 3) that meet their cuboid.

    The distances from the six faces are linear along the segment, their least is concave: its maximum is at
    an end or where two of them are equal.
    """
    offset = np.concatenate((half - start, half + start), axis=-1)
    slope = np.concatenate((-along, along), axis=-1)
    first, second = _PAIRS
    steeper = slope[:, first] - slope[:, second]
    crossing = (offset[:, second] - offset[:, first]) / np.where(steeper == 0.0, np.inf, steeper)
    ends = np.broadcast_to(np.array([0.0, 1.0]), (len(start), 2))
    t = np.concatenate((ends, np.clip(crossing, 0.0, 1.0)), axis=-1)
    depths = (offset[:, None, :] + t[..., None] * slope[:, None, :]).min(axis=-1)
    deepest: Floats = depths.max(axis=-1)
    return deepest


def capsule_box(start: Floats, end: Floats, radius: Floats, half: Floats) -> Floats:
    """Clearance (...) of a capsule from a cuboid, negative where they overlap."""
    clearance: Floats = segment_box(start, end, half) - radius
    return clearance


def segment_polygon(start: Floats, end: Floats, corners: Floats, normal: Floats) -> Floats:
    """Distance (...) of a segment from a plane convex polygon.

    corners (..., V, 3) go round counter-clockwise about the unit `normal` (..., 3), and may repeat. The
    nearest points are on an edge, under an end of the segment, or where the segment pierces the polygon.
    """
    following = np.roll(corners, -1, axis=-2)
    edges = segment_segment(start[..., None, :], end[..., None, :], corners, following)
    distance = np.asarray(edges.min(axis=-1))
    inward = np.cross(normal[..., None, :], following - corners)
    h0 = _dot(start - corners[..., 0, :], normal)
    h1 = _dot(end - corners[..., 0, :], normal)
    for point, height in ((start, h0), (end, h1)):
        inside = _over(point, corners, inward)
        distance = np.where(inside, np.minimum(distance, np.abs(height)), distance)
    crosses = (h0 < 0.0) != (h1 < 0.0)
    t = np.where(crosses, h0, 0.0) / np.where(crosses, h0 - h1, 1.0)
    pierces = crosses & _over(start + t[..., None] * (end - start), corners, inward)
    return np.where(pierces, 0.0, distance)


def _over(point: Floats, corners: Floats, inward: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Whether a point (..., 3) is over a polygon: on the inner side of all its edges."""
    sides = _dot(point[..., None, :] - corners, inward)
    return np.asarray((sides >= 0.0).all(axis=-1))
