"""Unions of safe zones, the robot's capsules, and that few looks see what looking everywhere sees."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from viapoint.runtime import core
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.runtime.records import Floats, Ints
from viapoint.runtime.rotations import abc_to_matrix
from viapoint.runtime.workspace import TOUCH, Monitor, Rule, Ticks, Watch, grid
from viapoint.runtime.workspace.boxes import Boxes, Union
from viapoint.runtime.workspace.distances import point_segment

SEED = 6050
CLOUD_SPACING = 0.15  # m; no ball of this radius is left without a point
REACHING = [-100, -20, -50, -90, -90, -90], [130, 40, 30, 90, 90, 90]  # deg, joints of arms stretched forward
ROBOT = '[robot]\nmodel = "frigeni6"\n'
BODILESS = '[robot]\nmodel = "irb140"\n'
ZONES = """
[[tools]]
index = 1
xyz = [380, 0, 0]
capsule = { to = [380, 0, 0], radius = 40 }
[[frames]]
index = 1
xyz = [1200, 0, 400]
abc = [0, 0, 40]
[[zones]]
name = "fence"
kind = "forbidden"
frame = 1
corner_1 = [0, -200, 0]
corner_2 = [400, 200, 800]
[[zones]]
name = "post"
kind = "forbidden"
corner_1 = [300, 1200, 0]
corner_2 = [500, 1400, 2500]
[[zones]]
name = "cage"
kind = "safe"
corner_1 = [-2500, -2500, -500]
corner_2 = [2500, 0, 3500]
[[zones]]
name = "annexe"
kind = "safe"
corner_1 = [-2500, 0, -500]
corner_2 = [2000, 2500, 3200]
[[zones]]
name = "shared"
kind = "exclusive"
corner_1 = [700, 600, 800]
corner_2 = [1800, 1500, 2600]
[orientation_cone]
axis = [1, 0, 0]
half_angle_deg = 150
"""


def cell(text: str, robot: str = ROBOT) -> Cell:
    return parse_cell(robot + text)


def boxes(*given: tuple[list[float], list[float], list[float]]) -> Boxes:
    """Cuboids by centre, half extents and A, B, C in deg."""
    R = np.array([abc_to_matrix(np.radians(abc)) for _, _, abc in given])
    centre, half = np.array([c for c, _, _ in given]), np.array([h for _, h, _ in given])
    return Boxes(tuple(f"box {k}" for k in range(len(given))), R, centre, half)


def depth(union: Union, start: list[float], end: list[float], radius: float = 0.0) -> float:
    """Of the axis of a capsule; exact to where the capsule has 20 mm to spare."""
    return float(union.clearance(np.array([start]), np.array([end]), np.array([radius]))[0]) + radius


ADJOINING = boxes(
    ([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0, 0, 0]), ([2.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0, 0, 0])
)
GAPING = boxes(([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0, 0, 0]), ([2.01, 0.0, 0.0], [1.0, 1.0, 1.0], [0, 0, 0]))
OVERLAPPING = boxes(
    ([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0, 0, 0]), ([1.5, 0.0, 0.0], [1.0, 1.0, 1.0], [0, 0, 30])
)


@pytest.mark.parametrize("union", [ADJOINING, OVERLAPPING], ids=["adjoining", "overlapping"])
def test_a_border_inside_a_union_is_no_border(union: Boxes) -> None:
    assert depth(Union(union), [-0.4, 0.0, 0.0], [2.0, 0.0, 0.0], 0.55) == pytest.approx(0.58, abs=0.03)
    assert depth(Union(union), [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]) > 0.0


@pytest.mark.parametrize("angle", [0.0, 17.0])
def test_a_link_through_a_gap_leaves_the_union(angle: float) -> None:
    """Both ends are inside, and the gap of 10 mm is hit by no round figure."""
    R = abc_to_matrix(np.radians([angle, angle, angle]))
    turned = Boxes(GAPING.names, np.array([R, R]), GAPING.centre @ R.T, GAPING.half)
    start, end = np.array([[-0.431, 0.0, 0.0]]) @ R.T, np.array([[2.117, 0.1, 0.0]]) @ R.T
    assert Union(turned).clearance(start, end, np.zeros(1))[0] == pytest.approx(-0.005, abs=1e-4)


def test_depth_in_a_single_zone() -> None:
    single = Union(boxes(([0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [0, 0, 0])))
    assert depth(single, [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]) == pytest.approx(0.5)
    assert depth(single, [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]) == pytest.approx(0.0)
    assert depth(single, [0.0, 0.0, 0.0], [3.0, 0.0, 0.0]) == pytest.approx(-2.0)
    assert depth(single, [4.0, 6.0, 0.0], [5.0, 2.0, 0.0]) == pytest.approx(-5.0)


@pytest.mark.parametrize("seed", range(SEED, SEED + 8))
def test_clearance_in_a_union_agrees_with_dense_sampling(seed: int) -> None:
    """A link is as deep inside as the nearest of many points that are in none of the cuboids."""
    print("seed", seed)
    rng = np.random.default_rng(seed)
    group = boxes(*(random_box(rng) for _ in range(int(rng.integers(2, 5)))))
    cloud = rng.uniform(-1.6, 1.6, (50_000, 3))
    outside = cloud[group.of_point(cloud).min(axis=1) > 0.0]
    start, end = rng.uniform(-1.0, 1.0, (2, 60, 3))
    radius = rng.choice([0.0, 0.05, 0.2], 60)
    ours = Union(group).clearance(start, end, radius)
    sampled = np.array([point_segment(outside, a, b).min() for a, b in zip(start, end, strict=True)]) - radius
    assert (ours <= sampled + 1e-9).all()
    measured = ours < 0.02
    assert measured.sum() > 10
    assert (sampled[measured & (ours > -radius)] - ours[measured & (ours > -radius)] < CLOUD_SPACING).all()
    assert (sampled[ours <= -radius] < -radius[ours <= -radius] + CLOUD_SPACING).all()


def random_box(rng: np.random.Generator) -> tuple[list[float], list[float], list[float]]:
    angles = rng.choice([0.0, 90.0, rng.uniform(-180.0, 180.0)], 3)
    return rng.uniform(-0.5, 0.5, 3).tolist(), rng.uniform(0.3, 0.9, 3).tolist(), angles.tolist()


@pytest.mark.parametrize("name", ["python", "auto"])
def test_few_looks_see_what_looking_everywhere_sees(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Random joint paths: first violation and every crossing, also when the path comes in parts."""
    print("seed", SEED + 1)
    monkeypatch.setattr(core, "asked", name)
    rng = np.random.default_rng(SEED + 1)
    monitor = Monitor(cell(ZONES))
    violations = crossings = looks = 0
    for _ in range(120):
        ends = np.radians(rng.uniform(*REACHING, (2, 6)))
        u = np.linspace(0.0, 1.0, int(rng.integers(2, 600)))[:, None]
        q = ends[0] + u * (ends[1] - ends[0]) * float(rng.choice([0.02, 0.3, 1.0]))
        every, exclusive = monitor.clearances(q, 1)
        broken = np.flatnonzero((every < -TOUCH).any(axis=1))
        first = int(broken[0]) if len(broken) else None
        inside = exclusive[: first if first is not None else None, 0] < -TOUCH
        changes = np.flatnonzero(np.diff(inside, prepend=False)).tolist()
        seen, met, asked = followed(
            Watch(monitor), monitor, q, sorted(rng.integers(1, len(q) + 1, 2).tolist())
        )
        assert seen == first
        assert met == changes
        violations, crossings, looks = (
            violations + (first is not None),
            crossings + len(changes),
            looks + asked,
        )
    assert violations > 20
    assert crossings > 10
    print(f"{looks} looks")


class Counted(Ticks):
    """Counts the rows that are looked at."""

    looks = 0

    def joints(self, rows: Ints) -> Floats:
        self.looks += len(rows)
        return super().joints(rows)

    def march(self, rules: Any, room: float) -> Any:
        looked = super().march(rules, room)
        self.looks += len(looked[0])
        return looked


def followed(watch: Watch, monitor: Monitor, q: Floats, cuts: list[int]) -> tuple[int | None, list[int], int]:
    """First violation and crossings of a path (N, 6) taken in three parts; how many rows were looked at."""
    met: list[int] = []
    asked = 0
    before = q[0]
    for begin, end in zip([0, *cuts], [*cuts, len(q)], strict=True):
        part = q[begin:end]
        if not len(part):
            continue

        ticks = Counted(part, before, monitor.pace(1))
        seen = watch.look(ticks, 1)
        asked += ticks.looks
        met += [begin + crossing.row for crossing in seen.crossings]
        if seen.violation is not None:
            return begin + seen.violation.row, met, asked
        watch.advance(len(part) - 1)
        before = part[-1]
    return None, met, asked


UNION = ZONES.replace("half_angle_deg = 150", "half_angle_deg = 60").replace(
    "[orientation_cone]",
    """
[[frames]]
index = 2
xyz = [300, 200, 1500]
abc = [20, 30, 40]
[[zones]]
name = "turned"
kind = "safe"
frame = 2
corner_1 = [0, 0, 0]
corner_2 = [2500, 2500, 2500]
[orientation_cone]""",
)


@pytest.mark.parametrize(
    ("text", "robot"),
    [
        ("", ROBOT),
        ("[body]\nradius_mm = [0, 0, 0, 0, 0, 0]\n", ROBOT),
        (ZONES, ROBOT),
        (UNION, ROBOT),
        (ZONES.replace("[orient", "[body]\nradius_mm = [90, 60, 60, 50, 40, 30]\n[orient"), BODILESS),
    ],
)
def test_the_compiled_core_sees_the_same_clearances(
    text: str, robot: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of every rule and zone, at joints all over the ranges."""
    print("seed", SEED + 3)
    rng = np.random.default_rng(SEED + 3)
    watched, tool = cell(text, robot), 1 if "tools" in text else 0
    limits = watched.robot.limits
    q = rng.uniform(limits.lower, limits.upper, (4_000, 6))
    seen = []
    for name in ("python", "auto"):
        monkeypatch.setattr(core, "asked", name)
        seen.append(Monitor(watched).clearances(q, tool))
    for twin, compiled in zip(*seen, strict=True):
        assert twin.shape == compiled.shape
        assert np.abs(twin - compiled).max(initial=0.0) < 1e-9


@pytest.mark.parametrize("model", ["frigeni6", "irb140", "irb1400"])
def test_a_chain_is_where_the_robot_is(model: str) -> None:
    body = Monitor(cell(ZONES, f'[robot]\nmodel = "{model}"\n')).body(1)
    assert body.chain is not None
    q = np.random.default_rng(SEED).uniform(-4.0, 4.0, (500, 6))
    points, R = body.chain.place(q)
    assert np.abs(points - body.points(q)).max() < 1e-12
    assert np.abs(R - body.robot.fk(q)[:, :3, :3]).max() < 1e-12


def test_a_robot_that_is_no_chain_is_watched_all_the_same() -> None:
    """One whose joints do not turn about fixed lines: the compiled core leaves it to the twin."""
    watched = cell(ZONES)
    fk = watched.robot.kinematics.fk

    class Bent:
        """The same arm, the last joint turning by the square of its angle."""

        def __getattr__(self, name: str) -> Any:
            return getattr(watched.robot.kinematics, name)

        def fk(self, q: Floats) -> Floats:
            return fk(np.concatenate((q[..., :5], q[..., 5:] ** 2), axis=-1))

    bent = replace(watched, robot=replace(watched.robot, kinematics=Bent()))
    monitor = Monitor(bent)
    assert monitor.body(1).chain is None
    assert monitor.rules(1) is None
    q = np.zeros((1, 6))
    assert np.abs(monitor.clearances(q, 1)[0] - Monitor(watched).clearances(q, 1)[0]).max() < 1e-9


def test_clearances_change_by_no_more_than_the_pace() -> None:
    """Of every rule, both for large and for small motions: it is what lets one look vouch for others."""
    print("seed", SEED + 2)
    rng = np.random.default_rng(SEED + 2)
    for text, robot in (
        (ZONES, ROBOT),
        (ZONES.replace("[orient", "[body]\nradius_mm = [90, 60, 60, 50, 40, 30]\n[orient"), BODILESS),
    ):
        monitor = Monitor(cell(text, robot))
        limits = monitor.body(1).robot.limits
        a = rng.uniform(limits.lower, limits.upper, (5_000, 6))
        b = a + rng.normal(size=a.shape) * rng.choice([1e-4, 0.01, 0.3, 2.0], (5_000, 1))
        moved = np.abs(b - a) @ monitor.pace(1)
        (rules_a, zones_a), (rules_b, zones_b) = monitor.clearances(a, 1), monitor.clearances(b, 1)
        assert (rules_b[rules_a > moved[:, None]] > -1e-9).all()
        bounded = monitor.room(rules_a, 1) > moved
        assert bounded.sum() > 100
        assert (rules_b[bounded] > -1e-9).all()
        bounded = np.abs(zones_a[:, 0]) > moved
        assert (np.sign(zones_b[bounded]) == np.sign(zones_a[bounded])).all()


def test_nothing_to_watch_is_not_watched() -> None:
    assert not Monitor(cell("", BODILESS)).active
    assert Monitor(cell("")).active  # frigeni6 has capsules of its own


def test_neighbours_are_no_collision() -> None:
    """Capsules that touch at a common joint, or over a link shorter than they are thick."""
    pairs = {tuple(pair) for pair in Monitor(cell("")).body(0).pairs.tolist()}
    assert {(0, 2), (0, 5), (1, 4)} <= pairs
    assert not {(0, 1), (1, 2), (2, 4), (4, 5)} & pairs


def test_the_arm_folded_onto_itself() -> None:
    monitor = Monitor(cell(""))
    upright = np.zeros(6)
    assert monitor.check(upright[None], 0) is None
    leaning = np.radians([0.0, -80.0, 0.0, 0.0, 0.0, 0.0])
    found = monitor.check(np.stack((upright, leaning)), 0)
    assert found is not None
    assert (found.row, found.rule, found.part, found.other) == (1, Rule.SELF, "link 3", "link 1")


def test_a_cone_holds_the_axis_not_the_turn_about_it() -> None:
    monitor = Monitor(cell("[orientation_cone]\naxis = [0, 0, -1]\nhalf_angle_deg = 30\n"))
    down = np.radians([0.0, 0.0, 0.0, 0.0, 90.0, 0.0])
    turned = down + np.radians([0.0, 0.0, 0.0, 0.0, 0.0, 170.0])
    tilted = down + np.radians([0.0, 0.0, 0.0, 0.0, 29.9, 0.0])
    assert monitor.check(np.stack((down, turned, tilted)), 0) is None
    beyond = down + np.radians([0.0, 0.0, 0.0, 0.0, 30.1, 0.0])
    found = monitor.check(beyond[None], 0)
    assert found is not None
    assert found.rule is Rule.CONE
    assert found.depth == pytest.approx(np.radians(0.1))


def test_a_grid_hides_nothing_thicker_than_its_spacing() -> None:
    assert np.diff(grid(2.5, 0.0004)).max() <= 0.0004 + 1e-15
    assert np.diff(grid(2.5, 0.5)).max() <= 0.001 + 1e-15
    assert grid(0.0, 0.1).tolist() == [0.0]
    assert grid(0.7, 0.1)[-1] == 0.7
