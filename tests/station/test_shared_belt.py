"""Two robots on one belt: whose part is whose, bodies that a belt carries, and the same in any window."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from station_runs import StationRun, cells, run

from viapoint.runtime.cell import CellError, parse_cells
from viapoint.runtime.workspace import Encounters
from viapoint.session import Status

CELL = """
[controller]
tick_s = 0.004
[variables]
done = 0
[[conveyors]]
index = 1
xyz = [1450, -1500, 700]
abc = [0, 0, 90]
counts_per_mm = 100
parts = {{ trigger_mm = 700, window_mm = [900, 1200], pitch_mm = {pitch} }}
[[robots]]
name = "left"
priority = {priority}
[robots.robot]
model = "frigeni6"
home = [-20, 0, 0, 0, 60, 0]
[robots.points]
P1 = {{ x = 1450, y = -700, z = 1300, a = 0, b = 90, c = 0 }}
P2 = {{ x = 1450, y = -650, z = 1250, a = 0, b = 90, c = 0 }}
[[robots]]
name = "right"
{belts}
[robots.robot]
model = "frigeni6"
zero_frame = {{ xyz = [2900, {aside}, 0], abc = [0, 0, 180] }}
home = [{turn}, 0, 0, 0, 60, 0]
[robots.points]
P1 = {{ x = 1450, y = {y1}, z = 1300, a = 0, b = 90, c = 180 }}
P2 = {{ x = 1450, y = {y2}, z = 1250, a = 0, b = 90, c = 180 }}
"""
WORK = "MJ P1 F60\n{before}N: TRK 1\nML P2 F300\nML P1\nTRK 0\nINC $done\nMJ P1 F60\nGOTO N {count}\n"
RUNNING = "[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, 100]]\nnoise_counts = 0.3\n"
SAME = "belts = [{ index = 1, window_mm = [900, 1200], taught_mm = 1000 }]"
DOWN = "belts = [{ index = 1, window_mm = [1600, 1900], taught_mm = 1700 }]"


def cell_text(*, apart: bool = True, priority: int = 0, pitch: int = 240) -> str:
    """Two robots whose windows are apart along the belt, or the same one for both (then one stands aside)."""
    places = {"belts": DOWN, "aside": 0, "turn": -10, "y1": 200, "y2": 250}
    if not apart:
        places = {"belts": SAME, "aside": -900, "turn": 20, "y1": -1400, "y2": -1350}
    return CELL.format(priority=priority, pitch=pitch, **places)


def work(count: int = 2, before: str = "") -> str:
    return WORK.format(count=count, before=before)


def parts(done: StationRun) -> list[tuple[int, int]]:
    """Robot and part, in the order in which they were taken."""
    return [(e.robot, e.data["part"]) for e in done.station.events if "part" in e.data]


@cache
def sharing(window: int, override: float) -> StationRun:
    return run(work(), work(), cell=cell_text(), scenario=RUNNING, window=window, override=override)


@pytest.mark.parametrize("override", [1.0, 0.37])
def test_both_take_parts_from_one_queue_and_no_part_twice(override: float) -> None:
    done = sharing(1024, override)
    assert done.station.status is Status.FINISHED, done.failures
    taken = [part for _, part in parts(done)]
    assert len(taken) == len(set(taken)) == 4
    assert {robot for robot, _ in parts(done)} == {1, 2}
    final = done.station.world.bank
    assert final.read(final.resolve("$done")) == 4.0


@pytest.mark.parametrize("override", [1.0, 0.37])
def test_windows_change_nothing(override: float) -> None:
    long, short = sharing(1024, override), sharing(50, override)
    assert short.history == long.history
    for a, b in zip(short.joints, long.joints, strict=True):
        assert np.abs(a - b).max() < 1e-9


def test_tick_by_tick_is_the_same() -> None:
    one, many = (
        run(work(1), work(1), cell=cell_text(), scenario=RUNNING, window=w, max_time=4.0) for w in (1, 1024)
    )
    assert parts(one)
    assert one.history == many.history
    for a, b in zip(one.joints, many.joints, strict=True):
        assert np.abs(a - b).max() < 1e-9


def test_each_follows_its_own_part() -> None:
    """At the end of ML P2 the tool is over its part, where it was taught: 50 mm behind where it is taken."""
    done = sharing(1024, 1.0)
    belt = done.station.sessions[0].kernel.outlet.feed.tracker.belts[1]
    for robot, taught, y_taught in ((1, 700.0, -650.0), (2, 1700.0, 250.0)):
        cell, joints = done.station.sessions[robot - 1].cell, done.joints[robot - 1]
        own = [part for taker, part in parts(done) if taker == robot]
        ends = done.ticks_of("block", robot, command="ML")[::2]
        ticks = [round(e.data["t_end"] / cell.tick) for e in done.station.events
                 if e.kind == "block" and e.robot == robot and e.line == 3]  # fmt: skip
        assert len(own) == len(ends) == len(ticks) == 2
        for part, tick in zip(own, ticks, strict=True):
            place = belt.travel(np.array([tick]))[0] * 1e3 + 700.0 - 240.0 * part
            tcp = cell.X_world_base @ cell.robot.fk(joints[tick])
            assert tcp[1, 3] * 1e3 == pytest.approx(y_taught + place - taught, abs=0.2)


@pytest.mark.parametrize("window", [1024, 100])
@pytest.mark.parametrize(
    ("priority", "delays", "first"),
    [
        (0, ("", ""), 1),
        (-1, ("", ""), 2),
        (1, ("", ""), 1),
        (0, ("WAIT 0.1\n", ""), 2),
        (1, ("WAIT 0.1\n", ""), 1),
    ],
)
def test_who_takes_a_part_that_both_may_take(
    priority: int, delays: tuple[str, str], first: int, window: int
) -> None:
    """The higher priority, then who has waited longer, then the earlier robot; the other takes the next."""
    programs = [f"MJ P1 F60\nWAIT 3\n{delay}TRK 1\nWAIT 0.1\nTRK 0\n" for delay in delays]
    late = "[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, 0], [4.2, 0], [4.4, 100]]\n"
    text = cell_text(apart=False, priority=priority)
    done = run(*programs, cell=text, scenario=late, window=window)
    assert parts(done) == [(first, 0), (3 - first, 1)], done.failures


def test_a_part_already_there_goes_to_who_comes_first() -> None:
    programs = [f"MJ P1 F60\nWAIT {wait}\nTRK 1\nWAIT 0.1\nTRK 0\n" for wait in (3.5, 3.0)]
    done = run(*programs, cell=cell_text(apart=False, priority=1), scenario=RUNNING)
    assert [robot for robot, _ in parts(done)] == [2, 1], done.failures


@pytest.mark.parametrize("window", [1024, 33])
def test_parts_that_never_come_are_told_with_the_lines_of_both(window: int) -> None:
    stops = "[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, 100], [3, 100], [6, 0]]\n"
    done = run(work(1), "\n" + work(1), cell=cell_text(), scenario=stops, window=window)
    assert parts(done) == [(1, 0)]
    assert done.failures == {2: "E410 3 TRK 1 waits for a part, and the belt stands for good"}
    stands = run(work(1), "\n" + work(1), cell=cell_text(), window=window)
    assert stands.failures[1].startswith("E410 2 TRK 1 waits")
    done = run(work(2), "\n" + work(1), cell=cell_text(), scenario=stops, window=window)
    assert {robot: text[:6] for robot, text in done.failures.items()} == {2: "E410 3"}
    assert done.ticks_of("error", 2) == [1500], "the tick in which the belt comes to rest"


@pytest.mark.parametrize("window", [1024, 50])
def test_who_is_interrupted_while_it_waits_for_a_part_takes_none_meanwhile(window: int) -> None:
    """The part that comes while the subroutine runs goes to the other robot, whose claim is the lesser."""
    waiting = "ON $done > 0 SUB ASIDE\nMJ P1 F60\nTRK 1\nWAIT 0.1\nTRK 0\nEND\n"
    waiting += "ASIDE: ML Z=1400 F20\nLET $done = 0\nEND\n"
    other = "MJ P1 F60\nTRK 1\nWAIT 0.1\nTRK 0\n"
    sets = RUNNING + '[[at]]\nt_s = 1.5\nset = { "$done" = 1 }\n'
    text = cell_text(apart=False, priority=1)
    done = run(waiting, other, cell=text, scenario=sets, window=window)
    assert done.station.status is Status.FINISHED, done.failures
    assert done.ticks_of("interrupt", 1, action="begun") == [375]
    (back,) = done.ticks_of("interrupt", 1, action="returned")
    taken = [(e.robot, e.data["part"], e.tick) for e in done.station.events if "part" in e.data]
    assert [each[:2] for each in taken] == [(2, 0), (1, 1)]
    assert taken[0][2] == 500, "the part has come 200 mm"
    assert taken[1][2] >= back > 500


@pytest.mark.parametrize("section", ["WAIT 20", "ML Y=-200 F300\nML Y=400"])
def test_bodies_are_kept_apart_while_the_belt_carries_one_of_them(section: str) -> None:
    """On the belt the left robot is carried towards the right one: both stop before they touch."""
    left = f"MJ P1 F60\nTRK 1\n{section}\nTRK 0\n"
    text = cell_text().replace("window_mm = [900, 1200]", "window_mm = [705, 1200]")
    done, *others = (
        run(left, "MJ P1 F60\nWAIT 20\n", cell=text, scenario=RUNNING, window=w) for w in (1024, 64)
    )
    assert [failure[:5] for failure in done.failures.values()] == ["E451 "] * 2
    assert "would touch" in done.failures[1]
    length = min(map(len, done.joints))
    axes = [joints[:length] for joints in done.joints]
    assert Encounters(cells(text)).first(axes, [0, 0]) is None, "they never touch"
    assert all(np.array_equal(each[-1], each[-2]) for each in axes), "and stand at the end"
    for other in others:
        assert other.history == done.history


@pytest.mark.parametrize("extra", ["filter = { ticks = 12, sigma = 0.4 }", ""])
def test_filter_and_corrections_of_a_station_are_the_same_in_any_window(extra: str) -> None:
    text = cell_text().replace("tick_s = 0.004", f"tick_s = 0.004\n{extra}")
    happens = (
        RUNNING if extra else '[[correction]]\nframe = "base"\nz_mm = [[0, 0], [1, 3]]\nmax_rate_mm_s = 20\n'
    )
    programs = ["MJ P1 F60\nML P2 F200 R20\nAT 50% INC $done\nML P1\n", "WAIT $done > 0\nMJ P1 F60\n"]
    runs = [run(*programs, cell=text, scenario=happens, window=w) for w in (1, 40, 1024)]
    assert runs[0].station.status is Status.FINISHED
    for other in runs[1:]:
        assert other.history == runs[0].history
        for a, b in zip(runs[0].joints, other.joints, strict=True):
            assert np.abs(a - b).max() < 1e-9


def test_what_is_wrong_with_a_robots_belts_is_told_at_its_place() -> None:
    text = cell_text().replace(
        DOWN,
        "belts = [{ index = 2, window_mm = [0, 1] }, { index = 1, window_mm = [5, 5] }]",
    )
    with pytest.raises(CellError) as caught:
        parse_cells(text, "cell.toml")
    lines = text.splitlines()
    found = [(d.code, d.key, lines[(d.line or 1) - 1][:5]) for d in caught.value.diagnostics]
    assert found == [
        ("E278", "robots[1].belts[0].index", "belts"),
        ("E279", "robots[1].belts[1].window_mm", "belts"),
    ]
