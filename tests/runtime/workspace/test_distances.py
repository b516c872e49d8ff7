"""Distance formulas against coal, against dense sampling, and on cases one can tell by looking."""

from __future__ import annotations

import coal
import fcl
import numpy as np
import pytest

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
PAIRS_WITH_COAL = 20_000  # it takes one pair at a time
COAL_TOLERANCE = 1e-6  # m; what coal itself is exact to
EXACT = 1e-12
HULL = 2e-8  # m that two nearly parallel segments may be off by


def random_segments(rng: np.random.Generator, count: int) -> tuple[Floats, Floats]:
    """Segments in a cube of 2 m: short, long and of no length, some along an axis."""
    start = rng.uniform(-1.0, 1.0, (count, 3))
    along = rng.normal(size=(count, 3)) * rng.choice([0.0, 0.05, 0.5, 1.5], (count, 1))
    axis = rng.random(count) < 0.2
    along[axis] *= np.eye(3)[rng.integers(0, 3, int(axis.sum()))]
    return start, start + along


def placed(start: Floats, end: Floats) -> coal.Transform3s:
    """Where coal's capsule, along its own Z, must be put to lie from start to end."""
    along = end - start
    length = float(np.linalg.norm(along))
    z = along / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return coal.Transform3s(np.stack((x, np.cross(z, x), z), axis=1), 0.5 * (start + end))


def coal_distance(
    a: coal.ShapeBase, X_a: coal.Transform3s, b: coal.ShapeBase, X_b: coal.Transform3s
) -> float:
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-8
    return float(coal.distance(a, X_a, b, X_b, request, coal.DistanceResult()))


def assert_agree(ours: Floats, theirs: Floats) -> None:
    """Where they overlap only that they do is compared: depths may be defined otherwise."""
    apart = ours > 0.0
    assert np.abs(ours - theirs)[apart].max() < COAL_TOLERANCE
    assert (theirs[~apart] < COAL_TOLERANCE).all()
    assert apart.sum() > 1000
    assert (~apart).sum() > 100


def test_capsules_agree_with_coal() -> None:
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    p0, p1 = random_segments(rng, PAIRS_WITH_COAL)
    q0, q1 = random_segments(rng, PAIRS_WITH_COAL)
    parallel = rng.random(PAIRS_WITH_COAL) < 0.1
    q1[parallel] = q0[parallel] + (p1 - p0)[parallel] * rng.normal(size=(int(parallel.sum()), 1))
    radii = rng.uniform(0.001, 0.2, (2, PAIRS_WITH_COAL))
    theirs = [
        coal_distance(
            coal.Capsule(radii[0, k], float(np.linalg.norm(p1[k] - p0[k]))),
            placed(p0[k], p1[k]),
            coal.Capsule(radii[1, k], float(np.linalg.norm(q1[k] - q0[k]))),
            placed(q0[k], q1[k]),
        )
        for k in range(PAIRS_WITH_COAL)
    ]
    assert_agree(capsule_capsule(p0, p1, radii[0], q0, q1, radii[1]), np.array(theirs))


def test_capsules_and_boxes_agree_with_coal() -> None:
    print("seed", SEED + 1)
    rng = np.random.default_rng(SEED + 1)
    start, end = random_segments(rng, PAIRS_WITH_COAL)
    half = rng.uniform(0.02, 0.8, (PAIRS_WITH_COAL, 3))
    inside = rng.random(PAIRS_WITH_COAL) < 0.1
    start[inside], end[inside] = half[inside] * rng.uniform(-1.0, 1.0, (2, int(inside.sum()), 3))
    radius = rng.uniform(0.001, 0.2, PAIRS_WITH_COAL)
    ours = capsule_box(start, end, radius, half)
    assert (ours[inside] < 0.0).all()
    here = coal.Transform3s()
    theirs = [
        coal_distance(
            coal.Capsule(radius[k], float(np.linalg.norm(end[k] - start[k]))),
            placed(start[k], end[k]),
            coal.Box(*(2.0 * half[k])),
            here,
        )
        for k in range(PAIRS_WITH_COAL)
    ]
    assert_agree(ours, np.array(theirs))


def test_boxes_collide_where_fcl_says_so() -> None:
    rng = np.random.default_rng(SEED + 2)
    count = 10_000
    start, end = random_segments(rng, count)
    half, radius = rng.uniform(0.02, 0.8, (count, 3)), rng.uniform(0.01, 0.2, count)
    ours = capsule_box(start, end, radius, half)
    lengths = np.linalg.norm(end - start, axis=1)
    for k in np.flatnonzero(np.abs(ours) > 1e-5):
        X = placed(start[k], end[k])
        capsule = fcl.CollisionObject(
            fcl.Capsule(radius[k], lengths[k]), fcl.Transform(X.getRotation(), X.getTranslation())
        )
        box = fcl.CollisionObject(fcl.Box(*(2.0 * half[k])))
        hits = fcl.collide(capsule, box, fcl.CollisionRequest(), fcl.CollisionResult())
        assert bool(hits) == (ours[k] < 0.0), (k, ours[k])


def test_segments_agree_with_dense_sampling() -> None:
    rng = np.random.default_rng(SEED + 3)
    count, samples = PAIRS, 65
    p0, p1 = random_segments(rng, count)
    q0, q1 = random_segments(rng, count)
    ours = segment_segment(p0, p1, q0, q1)
    sampled = np.full(count, np.inf)
    for t in np.linspace(0.0, 1.0, samples):
        sampled = np.minimum(sampled, point_segment(p0 + t * (p1 - p0), q0, q1))
    spacing = np.linalg.norm(p1 - p0, axis=1) / (samples - 1)
    assert (ours <= sampled + EXACT).all()
    assert (ours >= sampled - 0.5 * spacing - EXACT).all()


def test_boxes_agree_with_dense_sampling() -> None:
    rng = np.random.default_rng(SEED + 4)
    count, samples = PAIRS, 65
    start, end = random_segments(rng, count)
    half = rng.uniform(0.02, 0.8, (count, 3))
    ours = segment_box(start, end, half)
    sampled = np.full(count, np.inf)
    for t in np.linspace(0.0, 1.0, samples):
        sampled = np.minimum(sampled, point_box(start + t * (end - start), half))
    spacing = np.linalg.norm(end - start, axis=1) / (samples - 1)
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
