"""Distance formulas against coal, against dense sampling, and on cases one can tell by looking."""

from __future__ import annotations

from collections.abc import Callable

import coal
import fcl
import numpy as np
import pytest

from viapoint.runtime import core
from viapoint.runtime.records import Floats
from viapoint.runtime.rotations import abc_to_matrix
from viapoint.runtime.workspace.distances import (
    capsule_box,
    capsule_capsule,
    point_box,
    point_segment,
    segment_box,
    segment_polygon,
    segment_segment,
)

SEED = 6018
PAIRS = 100_000
PAIRS_WITH_COAL = 60_000  # of each kind
COAL_TOLERANCE = 1e-6  # m; what coal itself is exact to
EXACT = 1e-12
HULL = 2e-8  # m that two nearly parallel segments may be off by

Segments = tuple[Floats, Floats]
Placed = tuple[coal.ShapeBase, coal.Transform3s]


def random_segments(rng: np.random.Generator, count: int) -> tuple[Floats, Floats]:
    """Segments in a cube of 2 m: short, long and of no length, some along an axis."""
    start = rng.uniform(-1.0, 1.0, (count, 3))
    along = rng.normal(size=(count, 3)) * rng.choice([0.0, 0.05, 0.5, 1.5], (count, 1))
    axis = rng.random(count) < 0.2
    along[axis] *= np.eye(3)[rng.integers(0, 3, int(axis.sum()))]
    return start, start + along


def touching(rng: np.random.Generator, p: Segments, radii: Floats) -> Segments:
    """Segments whose capsules touch those along p (N, 3) in one point: tangent to them, beside them."""
    along = p[1] - p[0]
    out = np.cross(along + 1e-3, rng.normal(size=along.shape))
    away = out / np.linalg.norm(out, axis=1, keepdims=True)
    away -= along * (np.einsum("ij,ij->i", away, along) / np.einsum("ij,ij->i", along, along))[:, None]
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    middle = p[0] + rng.uniform(0.2, 0.8, (len(along), 1)) * along + radii.sum(axis=0)[:, None] * away
    tangent = np.cross(away, rng.normal(size=along.shape))
    before, after = rng.uniform(0.0, 1.0, (2, len(along), 1))
    return middle - before * tangent, middle + after * tangent


def attitudes(start: Floats, end: Floats) -> Floats:
    """Rotations (N, 3, 3) that turn Z along segments (N, 3)."""
    along = end - start
    length = np.linalg.norm(along, axis=1, keepdims=True)
    z = np.where(length > 0.0, along / np.maximum(length, 1e-300), [0.0, 0.0, 1.0])
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z), axis=1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack((x, np.cross(z, x), z), axis=-1)


def coal_capsules(start: Floats, end: Floats, radius: Floats) -> list[Placed]:
    """coal's capsules, which lie along their own Z, from start to end."""
    lengths, middles = np.linalg.norm(end - start, axis=1), 0.5 * (start + end)
    return [
        (coal.Capsule(r, length), coal.Transform3s(R, middle))
        for r, length, R, middle in zip(radius, lengths.tolist(), attitudes(start, end), middles, strict=True)
    ]


def coal_distances(first: list[Placed], second: list[Placed]) -> Floats:
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = 1e-8
    distances = []
    for (a, X_a), (b, X_b) in zip(first, second, strict=True):
        result.clear()
        distances.append(coal.distance(a, X_a, b, X_b, request, result))
    return np.array(distances)


def both_cores(twin: Callable[..., Floats], compiled: str, *arguments: Floats) -> list[Floats]:
    """What the numpy formula says, and what the compiled core does where it was built."""
    module = core.built("workspace._core")
    said = [twin(*arguments)]
    return said if module is None else [*said, getattr(module, compiled)(*arguments)]


def assert_agree(ours: Floats, theirs: Floats) -> None:
    """Where they overlap only that they do is compared: depths may be defined otherwise."""
    apart = ours > 0.0
    assert np.abs(ours - theirs)[apart].max() < COAL_TOLERANCE
    assert (theirs[~apart] < COAL_TOLERANCE).all()
    assert apart.sum() > 1000
    assert (~apart).sum() > 100


def test_capsules_agree_with_coal() -> None:
    """At random, parallel, touching, of no length."""
    print("seed", SEED)
    rng, count = np.random.default_rng(SEED), PAIRS_WITH_COAL
    p0, p1 = random_segments(rng, count)
    q0, q1 = random_segments(rng, count)
    radii = rng.uniform(0.001, 0.2, (2, count))
    kind = rng.random(count)
    parallel = kind < 0.1
    q1[parallel] = q0[parallel] + (p1 - p0)[parallel] * rng.normal(size=(int(parallel.sum()), 1))
    tangent = (kind > 0.9) & (np.linalg.norm(p1 - p0, axis=1) > 0.01)
    q0[tangent], q1[tangent] = touching(rng, (p0[tangent], p1[tangent]), radii[:, tangent])
    theirs = coal_distances(coal_capsules(p0, p1, radii[0]), coal_capsules(q0, q1, radii[1]))
    for distance in both_cores(segment_segment, "segment_segments", p0, p1, q0, q1):
        ours = distance - radii[0] - radii[1]
        assert ours == pytest.approx(capsule_capsule(p0, p1, radii[0], q0, q1, radii[1]), abs=EXACT)
        assert np.abs(ours[tangent]).max() < EXACT
        assert tangent.sum() > 3000
        assert_agree(ours, theirs)


def test_capsules_and_boxes_agree_with_coal() -> None:
    """At random, wholly inside, touching a face, along a face, of no length."""
    print("seed", SEED + 1)
    rng, count = np.random.default_rng(SEED + 1), PAIRS_WITH_COAL
    start, end = random_segments(rng, count)
    half, radius = rng.uniform(0.02, 0.8, (count, 3)), rng.uniform(0.001, 0.2, count)
    kind = rng.random(count)
    inside = kind < 0.1
    start[inside], end[inside] = half[inside] * rng.uniform(-1.0, 1.0, (2, int(inside.sum()), 3))
    on_top = kind > 0.9  # an end, or the whole of it, one radius above the upper face
    start[on_top, :2] = half[on_top, :2] * rng.uniform(-1.0, 1.0, (int(on_top.sum()), 2))
    start[on_top, 2] = half[on_top, 2] + radius[on_top]
    end[on_top, 2] = start[on_top, 2] + np.where(kind[on_top] > 0.95, 0.0, np.abs(end[on_top, 2]))
    here = coal.Transform3s()
    cuboids = [(coal.Box(*(2.0 * h)), here) for h in half]
    theirs = coal_distances(coal_capsules(start, end, radius), cuboids)
    for distance in both_cores(segment_box, "segment_boxes", start, end, half):
        ours = distance - radius
        assert ours == pytest.approx(capsule_box(start, end, radius, half), abs=EXACT)
        assert (distance[inside] <= 0.0).all()
        assert np.abs(ours[on_top]).max() < EXACT
        assert_agree(ours, theirs)


def test_boxes_collide_where_fcl_says_so() -> None:
    rng = np.random.default_rng(SEED + 2)
    count = 10_000
    start, end = random_segments(rng, count)
    half, radius = rng.uniform(0.02, 0.8, (count, 3)), rng.uniform(0.01, 0.2, count)
    ours = capsule_box(start, end, radius, half)
    lengths, turns = np.linalg.norm(end - start, axis=1), attitudes(start, end)
    for k in np.flatnonzero(np.abs(ours) > 1e-5):
        X = fcl.Transform(turns[k], 0.5 * (start[k] + end[k]))
        capsule = fcl.CollisionObject(fcl.Capsule(radius[k], lengths[k]), X)
        box = fcl.CollisionObject(fcl.Box(*(2.0 * half[k])))
        hits = fcl.collide(capsule, box, fcl.CollisionRequest(), fcl.CollisionResult())
        assert bool(hits) == (ours[k] < 0.0), (k, ours[k])


def test_segments_agree_with_dense_sampling() -> None:
    rng = np.random.default_rng(SEED + 3)
    count, samples = PAIRS, 65
    p0, p1 = random_segments(rng, count)
    q0, q1 = random_segments(rng, count)
    sampled = np.full(count, np.inf)
    for t in np.linspace(0.0, 1.0, samples):
        sampled = np.minimum(sampled, point_segment(p0 + t * (p1 - p0), q0, q1))
    spacing = np.linalg.norm(p1 - p0, axis=1) / (samples - 1)
    for ours in both_cores(segment_segment, "segment_segments", p0, p1, q0, q1):
        assert (ours <= sampled + EXACT).all()
        assert (ours >= sampled - 0.5 * spacing - EXACT).all()


def test_boxes_agree_with_dense_sampling() -> None:
    rng = np.random.default_rng(SEED + 4)
    count, samples = PAIRS, 65
    start, end = random_segments(rng, count)
    half = rng.uniform(0.02, 0.8, (count, 3))
    sampled = np.full(count, np.inf)
    for t in np.linspace(0.0, 1.0, samples):
        sampled = np.minimum(sampled, point_box(start + t * (end - start), half))
    spacing = np.linalg.norm(end - start, axis=1) / (samples - 1)
    for ours in both_cores(segment_box, "segment_boxes", start, end, half):
        assert (ours <= sampled + EXACT).all()
        assert (ours >= sampled - 0.5 * spacing - EXACT).all()


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4])
def test_nearly_parallel_segments_keep_their_digits(angle: float) -> None:
    """Two segments crossing at a tiny angle, 0.3 m apart at the crossing, in random attitudes."""
    rng = np.random.default_rng(SEED + 5)
    for _ in range(200):
        R = abc_to_matrix(rng.uniform(-np.pi, np.pi, 3))
        a, b = rng.uniform(-2.0, 0.0, 2)
        first = np.array([[a, 0.0, 0.0], [a + 2.0, 0.0, 0.0]])
        other = np.array([np.cos(angle), np.sin(angle), 0.0])
        second = np.outer((b, b + 2.0), other) + np.array([0.0, 0.0, 0.3])
        p, q = first @ R.T, second @ R.T
        assert segment_segment(p[0], p[1], q[0], q[1]) == pytest.approx(0.3, abs=HULL)


ORIGIN = np.zeros(3)
X = np.array([1.0, 0.0, 0.0])
Y = np.array([0.0, 1.0, 0.0])
Z = np.array([0.0, 0.0, 1.0])
UNIT = np.ones(3)

SEGMENTS = {
    "crossing": ((-X, X, -Y, Y), 0.0),
    "crossing above": ((-X, X, -Y + 2 * Z, Y + 2 * Z), 2.0),
    "parallel side by side": ((ORIGIN, X, Y, X + Y), 1.0),
    "parallel, opposite sense": ((ORIGIN, X, X + Y, Y), 1.0),
    "parallel, one past the other": ((ORIGIN, X, 4 * X + 4 * Y, 9 * X + 4 * Y), 5.0),
    "collinear, apart": ((ORIGIN, X, 3 * X, 5 * X), 2.0),
    "collinear, overlapping": ((ORIGIN, 4 * X, 3 * X, 5 * X), 0.0),
    "the same": ((ORIGIN, X, ORIGIN, X), 0.0),
    "a point beside a segment": ((0.5 * X + Y, 0.5 * X + Y, ORIGIN, X), 1.0),
    "a segment beside a point": ((ORIGIN, X, 0.5 * X + Y, 0.5 * X + Y), 1.0),
    "two points": ((ORIGIN, ORIGIN, 3 * X + 4 * Y, 3 * X + 4 * Y), 5.0),
    "the same point": ((X, X, X, X), 0.0),
    "nearest at two ends": ((ORIGIN, X, 2 * X + Y, 3 * X + 5 * Y), np.sqrt(2.0)),
}


@pytest.mark.parametrize("name", SEGMENTS)
def test_segments_one_can_tell_by_looking(name: str) -> None:
    segments, expected = SEGMENTS[name]
    p0, p1, q0, q1 = segments
    for each in ((p0, p1, q0, q1), (p1, p0, q0, q1), (q0, q1, p0, p1), (q1, q0, p1, p0)):
        assert segment_segment(*each) == pytest.approx(expected, abs=EXACT)


BOXES = {
    "wholly inside": ((-0.5 * X, 0.5 * X), -1.0),
    "inside, off the middle": ((0.5 * X, 0.75 * X), -0.5),
    "a point in the middle": ((ORIGIN, ORIGIN), -1.0),
    "through it": ((-5 * X, 5 * X), -1.0),
    "through a corner region": ((np.array([2.0, 0.5, 0.0]), np.array([0.5, 2.0, 0.0])), 0.25 * np.sqrt(2.0)),
    "cutting an edge off": ((np.array([1.5, 0.0, 0.0]), np.array([0.0, 1.5, 0.0])), -0.25),
    "ending inside": ((5 * X, 0.5 * X), -0.5),
    "touching a face": ((X, 2 * X), 0.0),
    "lying on a face": ((X - 0.5 * Y, X + 0.5 * Y), 0.0),
    "touching an edge": ((np.array([2.0, 0.0, 0.0]), np.array([0.0, 2.0, 0.0])), 0.0),
    "along a face, apart": ((2 * X - Y, 2 * X + Y), 1.0),
    "along a face, past it": ((2 * X + 2 * Y, 2 * X + 5 * Y), np.sqrt(2.0)),
    "before a corner": ((2 * UNIT, 3 * UNIT), np.sqrt(3.0)),
    "a point beside": ((3 * X, 3 * X), 2.0),
    "passing by, ends far away": ((np.array([-100.0, 2.0, 0.0]), np.array([100.0, 2.0, 0.0])), 1.0),
}


@pytest.mark.parametrize("name", BOXES)
def test_boxes_one_can_tell_by_looking(name: str) -> None:
    (start, end), expected = BOXES[name]
    for a, b in ((start, end), (end, start), (-start, -end)):
        assert segment_box(a, b, UNIT) == pytest.approx(expected, abs=EXACT)


def test_a_deepest_point_is_as_deep_as_sampling_says() -> None:
    rng = np.random.default_rng(SEED + 6)
    half = rng.uniform(0.1, 1.0, (5000, 3))
    start, end = half * rng.uniform(-1.5, 1.5, (2, 5000, 3))
    places = start[:, None] + np.linspace(0.0, 1.0, 257)[:, None] * (end - start)[:, None]
    deepest = point_box(places, half[:, None]).min(axis=1)
    ours = segment_box(start, end, half)
    hit = ours < 0.0
    assert hit.sum() > 2000
    assert (ours[hit] <= deepest[hit] + EXACT).all()
    assert (ours[hit] >= deepest[hit] - 0.01).all()


def test_distances_from_polygons_agree_with_sampling() -> None:
    """A polygon is the end of what its points are: rectangles, one with a corner given twice."""
    rng = np.random.default_rng(SEED + 7)
    corners = np.array(
        [[1.0, 0.7, 0.0], [-1.0, 0.7, 0.0], [-1.0, -0.7, 0.0], [1.0, -0.7, 0.0], [1.0, -0.7, 0.0]]
    )
    start, end = rng.uniform(-2.0, 2.0, (2, 5000, 3))
    ours = segment_polygon(start, end, corners, Z)
    flat = np.array([1.0, 0.7, 0.0])
    assert ours == pytest.approx(np.maximum(segment_box(start, end, flat), 0.0), abs=1e-9)


def test_clearances_never_change_by_more_than_a_segment_moves() -> None:
    """What lets one look vouch for its neighbourhood."""
    rng = np.random.default_rng(SEED + 8)
    start, end = random_segments(rng, 20_000)
    half = rng.uniform(0.02, 0.8, (20_000, 3))
    step = rng.normal(size=(2, 20_000, 3)) * 0.05
    farthest = np.linalg.norm(step, axis=-1).max(axis=0)
    change = segment_box(start + step[0], end + step[1], half) - segment_box(start, end, half)
    assert (np.abs(change) <= farthest + EXACT).all()
