"""`check --cell` plans what `run` does: the same times, limits and failures, on every way through."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from viapoint.runtime.cell import Cell, load_cell, parse_cell
from viapoint.runtime.kernel.forecast import BlockForecast
from viapoint.runtime.records import Event
from viapoint.runtime.signals import parse_scenario
from viapoint.runtime.workspace import Monitor
from viapoint.session import Loaded, Session, compile_file, compile_text
from viapoint.surveying import Survey, survey
from viapoint.vm.folding import fold

FILES = Path(__file__).parent / "files"
EXAMPLES = Path(__file__).parents[2] / "examples"
UNHURRIED = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
ARM = '[robot]\nmodel = "frigeni6"\n'


def cell_of(path: Path = FILES / "cell.toml") -> Cell:
    return load_cell(path)


def blocks_of(found: Survey) -> list[BlockForecast]:
    return [block for stretch in found.stretches for block in stretch.planned.blocks]


def blocks_run(session: Session) -> list[Event]:
    session.finish()
    return [event for event in session.events if event.kind == "block"]


def loaded(text: str, cell: Cell) -> Loaded:
    return compile_text(text, cell=cell)


def report(cli, text: str, tmp_path: Path, cell: str | None = None) -> dict:
    program, file = tmp_path / "part.via", FILES / "cell.toml"
    program.write_text(text)
    if cell is not None:
        file = tmp_path / "cell.toml"
        file.write_text(cell)
    return json.loads(cli("check", program, "--cell", file, "--format", "json").out)


def zone_of(kind: str, corner_1: list[float], corner_2: list[float]) -> str:
    return f'[[zones]]\nname = "press"\nkind = "{kind}"\ncorner_1 = {corner_1}\ncorner_2 = {corner_2}\n'


ON_A_TRACK = """[[frames]]
index = 1
xyz = [0, 0, 0]
[auxiliary_axes.E1]
kind = "linear"
range = [0, 3000]
speed = 1000
acceleration = 3000
carries_robot = true
"""


STRAIGHT_ON = {
    "round edges, counted": (FILES / "round.via", FILES / "cell.toml"),
    "a contour": (EXAMPLES / "contour" / "contour.via", EXAMPLES / "contour" / "cell.toml"),
    "splines": (EXAMPLES / "listings" / "splines.via", EXAMPLES / "listings" / "cells" / "arm.toml"),
}


@pytest.mark.parametrize("name", STRAIGHT_ON)
def test_blocks_take_what_they_take_in_a_run(name: str) -> None:
    """Nothing is estimated where nothing is read: the same laws, to the tick."""
    program, cell = STRAIGHT_ON[name]
    ready = compile_file(program, load_cell(cell))
    planned = blocks_of(survey(ready.program, load_cell(cell)))
    run = blocks_run(Session(load_cell(cell), ready))
    assert len(planned) > 2
    for mine, real in zip(planned, run, strict=True):
        assert mine.line == real.line
        assert mine.seconds == pytest.approx(real.data["t_end"] - real.t, abs=1e-9)
        assert mine.length * 1e3 == pytest.approx(real.data["length_mm"], abs=1e-3)
        assert mine.limited_by == real.data["limited_by"]


def test_the_filter_takes_its_time_in_a_check_too(cli, tmp_path: Path) -> None:
    """It settles at every stop, and makes the corners that are run through half its length late."""
    text = (FILES / "cell.toml").read_text() + "\n[controller]\nfilter = { ticks = 60, sigma = 0.4 }\n"
    program = "MJ P1 F60\nML P2 F300 R40\nML P3\nWAIT 0.05\nML P1\n"
    found = report(cli, program, tmp_path, text)
    cell = parse_cell(text)
    session = Session(cell, loaded(program, cell))
    run = blocks_run(session)
    assert found["cycles"][0]["longest_s"] == pytest.approx(session.kernel.tick * cell.tick, abs=1e-9)
    planned = [row["time_s"] for row in found["statements"] if row["command"] != "WAIT"]
    assert planned == pytest.approx([event.data["t_end"] - event.t for event in run], abs=2.5 * cell.tick)


def test_cycle_time_lies_between_the_runs_of_both_branches(cli) -> None:
    cell = cell_of()
    (cycle,) = json.loads(cli("check", "part.via", "--cell", "cell.toml", "--format", "json").out)["cycles"]
    durations = []
    for value in ("true", "false"):
        scenario = parse_scenario(f"[[at]]\nt_s = 0.0\nset = {{ DI3 = {value} }}\n", cell)
        session = Session(cell, compile_file(FILES / "part.via", cell), scenario=scenario)
        session.finish()
        durations.append(session.kernel.tick * cell.tick)
    assert cycle["of"] == "program"
    assert cycle["shortest_s"] == pytest.approx(min(durations), abs=1e-9)
    assert cycle["longest_s"] == pytest.approx(max(durations), abs=1e-9)


def test_ways_that_end_apart_are_planned_on_each(cli, tmp_path: Path) -> None:
    """The branches leave the robot in different places: the motion behind them is planned from each."""
    text = "MJ P1 F100\nIF DI1\nML P2\nELSE\nML P3\nENDIF\nML X=9000\n"
    found = report(cli, text, tmp_path)
    assert [(d["code"], d["line"]) for d in found["diagnostics"]] == [("E302", 7)]
    text = "MJ P1 F100\nIF DI1\nML P2\nELSE\nML P3\nENDIF\nML P1\n"
    (row,) = [row for row in report(cli, text, tmp_path)["statements"] if row["line"] == 7]
    assert row["time_s"] > row["shortest_s"] + 0.01


def test_what_only_the_second_round_meets_is_found(cli, tmp_path: Path) -> None:
    """Through the back edge J6 starts out further turned, and leaves its range."""
    once = "MJ J5=30 F100\nA:\nML A=0 F200\nMJ J6=300\n"
    assert report(cli, once, tmp_path)["diagnostics"][0]["code"] == "W503"
    found = report(cli, f"{once}GOTO A\n", tmp_path)
    assert [(d["code"], d["line"]) for d in found["diagnostics"]] == [("E303", 3)]
    assert found["cycles"] == []


@pytest.mark.parametrize("count", [2, 3, 4, 7, 30])
def test_a_counted_loop_takes_what_its_rounds_take(count: int, cli, tmp_path: Path) -> None:
    """Rounds that are alike are planned once; the time is that of all."""
    text = f"MJ P1 F100\nA:\nML P2 F400 R20\nML P3 R20\nML P1 R20\nGOTO A {count}\n"
    (cycle,) = report(cli, text, tmp_path)["cycles"]
    session = Session(cell_of(), loaded(text, cell_of()))
    session.finish()
    assert cycle["longest_s"] == pytest.approx(session.kernel.tick * 1e-3, abs=1e-3 * count)
    assert len(blocks_of(survey(loaded(text, cell_of()).program, cell_of()))) == 1 + 3 * min(count, 3)


def test_rounds_that_wind_up_are_all_planned() -> None:
    """The calls of each round are the same, the joints are not."""
    text = "MJ J5=40 F100\nA:\nML A=120 F300\nML A=-120\nML A=0\nGOTO A 8\n"
    ranges = "[[-180, 180], [-90, 150], [-210, 70], [-350, 350], [-130, 130], [-350, 2000]]"
    cell = parse_cell(f"{ARM}[limits.joints]\nrange_deg = {ranges}\n")
    found = survey(loaded(text, cell).program, cell)
    ends = [block.end for block in blocks_of(found) if block.line == 5]
    assert len(ends) == len(set(ends)) == 5
    (failure,) = found.failures
    assert failure.code == "E303"


def test_one_pass_of_an_endless_loop(cli) -> None:
    (cycle,) = json.loads(cli("check", "endless.via", "--cell", "cell.toml", "--format", "json").out)[
        "cycles"
    ]
    ready = compile_file(FILES / "endless.via", cell_of())
    ends = []
    for count in (4, 5):
        session = Session(cell_of(), ready, cycles=count)
        session.finish()
        ends.append(session.kernel.tick * 1e-3)
    assert cycle["of"] == "pass"
    assert cycle["shortest_s"] == cycle["longest_s"] == pytest.approx(ends[1] - ends[0], abs=2e-3)


def test_a_poll_has_no_longest_time(cli, tmp_path: Path) -> None:
    (cycle,) = report(cli, "A:\nML P1 F100\nML P2\nIF DI1\nGOTO A\nENDIF\n", tmp_path)["cycles"]
    assert cycle["longest_s"] is None
    assert cycle["shortest_s"] > 1.0


def test_a_line_slowed_near_a_singular_pose(cli, tmp_path: Path) -> None:
    text = "MJ J4=5 J5=5 F100\nML Z=2200 F300\n"
    found = report(cli, text, tmp_path)
    (row,) = found["slowdowns"]
    assert (row["line"], row["axis"], row["singular"], row["unit"]) == (2, "J4", "WRIST", "mm/s")
    session = Session(cell_of(), loaded(text, cell_of()))
    windows = list(session.run())
    speeds = [v for window in windows for v, n in zip(window.speed, window.line, strict=True) if n == 2]
    middle = speeds[len(speeds) // 10 : -len(speeds) // 10]
    assert row["slowed_to"] == pytest.approx(min(middle) * 1e3, rel=0.02)
    (note,) = [d for d in found["diagnostics"] if d["code"] == "I603"]
    assert "J4" in note["message"]
    assert f"to {row['slowed_to']:.3g} mm/s" in note["message"]


def test_a_statement_whose_stop_costs_time_says_so(cli, tmp_path: Path) -> None:
    """As much as the same program without it is quicker."""
    with_stop = "MJ P1 F100\nML P2 F400\nIF DI1\nSET DO1\nENDIF\nML Y=300\n"
    found = report(cli, with_stop, tmp_path)
    (note,) = [d for d in found["diagnostics"] if d["code"] == "I602"]
    through = report(cli, "MJ P1 F100\nML P2 F400\nML Y=300\n", tmp_path)
    lost = found["cycles"][0]["longest_s"] - through["cycles"][0]["longest_s"]
    assert note["line"] == 3
    assert f"about {lost:.1f}" in note["message"]
    at_a_corner = report(cli, "MJ P1 F100\nML P2 F400\nIF DI1\nSET DO1\nENDIF\nML P3\n", tmp_path)
    assert [d["code"] for d in at_a_corner["diagnostics"]] == []


def test_waits_are_statements_too(cli, tmp_path: Path) -> None:
    rows = report(cli, "ML P1 F100\nWAIT 1.5\nML P2\n", tmp_path)["statements"]
    assert [(row["line"], row["command"]) for row in rows] == [(1, "ML"), (2, "WAIT"), (3, "ML")]
    assert rows[1]["time_s"] == 1.5


def test_zones_and_configurations(cli, tmp_path: Path) -> None:
    zone = zone_of("exclusive", [1600, 500, 2300], [1800, 800, 2600])
    cell = (FILES / "cell.toml").read_text() + zone
    found = report(cli, "MJ P1 F100\nML Y=600\nML P1\n", tmp_path, cell)
    assert [(row["line"], row["zone"], row["action"]) for row in found["zones"]] == [
        (2, "press", "enters"),
        (3, "press", "leaves"),
    ]
    (row,) = report(cli, "MJ J5=8 F100\nML Z=2300 F300\n", tmp_path)["configurations"]
    assert row == {"line": 2, "from": "FRONT UP POSITIVE", "to": "FRONT UP NEGATIVE"}


@pytest.mark.parametrize(
    ("more", "code"),
    [
        (zone_of("forbidden", [1600, -50, 2400], [1900, 50, 2800]), "E420"),
        (ON_A_TRACK + zone_of("forbidden", [4000, 4000, 0], [4100, 4100, 100]) + "frame = 1\n", "E392"),
    ],
)
def test_what_keeps_a_run_from_beginning(more: str, code: str, cli, tmp_path: Path) -> None:
    found = report(cli, "MJ J1=10 F20\n", tmp_path, ARM + more)
    assert [d["code"] for d in found["diagnostics"]] == [code]


BELT = EXAMPLES / "conveyor"


def reachable(cell: Cell, joints: np.ndarray, travel_mm: float) -> bool:
    """Whether each pose has a solution of its configuration, with full turns, inside the joint ranges."""
    robot = cell.robot
    for q in joints:
        pose = robot.fk(q)
        pose[:3, 3] += travel_mm * 1e-3 * cell.conveyors[1].X_base_belt[:3, 0]
        found = robot.ik(pose)
        branch = int(robot.configuration(q))
        if not found.valid[branch]:
            return False
        turns = found.q[branch] + 2.0 * np.pi * np.arange(-2, 3)[:, None]
        inside = (turns > robot.limits.lower - 1e-7) & (turns < robot.limits.upper + 1e-7)
        if not inside.any(axis=0).all():
            return False
    return True


def test_belt_travel_of_a_tracked_section_is_that_of_the_inverse_kinematics(cli) -> None:
    """Against each pose by itself: reachable all the way to the limits, and not beyond them."""
    cell = load_cell(BELT / "cell.toml")
    found = json.loads(
        cli("check", BELT / "deburring.via", "--cell", BELT / "cell.toml", "--format", "json").out
    )
    blocks = blocks_of(survey(compile_file(BELT / "deburring.via", cell).program, cell))
    assert [row["line"] for row in found["tracking"]] == [6, 8, 9, 11]
    for row in found["tracking"]:
        joints = next(block.joints for block in blocks if block.line == row["line"])
        low, high = row["from_mm"], row["to_mm"]
        assert low < -1000.0 < 1000.0 < high
        for travel in np.linspace(low + 0.01, high - 0.01, 60):
            assert reachable(cell, joints, travel), (row["line"], travel)
        assert not reachable(cell, joints, low - 0.01)
        assert not reachable(cell, joints, high + 0.01)
    (note,) = [d for d in found["diagnostics"] if d["code"] == "I604"]
    assert note["line"] == 5
    assert f"{max(row['from_mm'] for row in found['tracking']):.1f} to" in note["message"]


@pytest.mark.parametrize("corner", [(0, 900), (-2000, -1000)], ids=["before", "behind"])
def test_belt_travel_ends_where_the_robot_would_come_into_a_zone(
    cli, tmp_path: Path, corner: tuple[int, int]
) -> None:
    """Right before the end of the travel no part of the robot is in the zone, right behind it one is."""
    first, second = corner
    zone = (
        f'[[zones]]\nname = "post"\nkind = "forbidden"\ncorner_1 = [1300, {first}, 1000]\n'
        f"corner_2 = [1800, {second}, 1320]\n"
    )
    moved = (BELT / "cell.toml").read_text() + zone
    (tmp_path / "cell.toml").write_text(moved)
    cell = load_cell(tmp_path / "cell.toml")
    found = json.loads(
        cli("check", BELT / "deburring.via", "--cell", tmp_path / "cell.toml", "--format", "json").out
    )
    blocks = blocks_of(survey(compile_file(BELT / "deburring.via", cell).program, cell))
    monitor = Monitor(cell)

    def breaks(joints: np.ndarray, travel: float) -> bool:
        poses = cell.robot.fk(joints)
        poses[:, :3, 3] += 1e-3 * travel * cell.conveyors[1].X_base_belt[:3, 0]
        q, reached = cell.robot.ik_branch(poses, cell.robot.configuration(joints), joints)
        assert reached.all()
        dense = np.concatenate([np.linspace(a, b, 20) for a, b in itertools.pairwise(q)])
        return monitor.check(dense, 1) is not None

    assert found["tracking"], found["diagnostics"]
    for row in found["tracking"]:
        joints = next(block.joints for block in blocks if block.line == row["line"])
        end = row["to_mm"] if first >= 0 else row["from_mm"]
        outward = 1.0 if first >= 0 else -1.0
        assert 0.0 < outward * end < 900.0
        assert not breaks(joints, end - outward * 0.05)
        assert breaks(joints, end + outward * 0.05)


def test_belt_speeds_are_those_at_which_motions_end_within_the_travel(cli) -> None:
    """The part is taken 20 mm behind its latch; the times are those of the table."""
    found = json.loads(
        cli("check", BELT / "deburring.via", "--cell", BELT / "cell.toml", "--format", "json").out
    )
    times = {row["line"]: row["time_s"] for row in found["statements"]}
    passed = 0.0
    for row in found["tracking"]:
        passed += times[row["line"]]
        assert 20.0 + row["fastest_mm_s"] * passed == pytest.approx(row["to_mm"], abs=0.01)
        assert 20.0 + row["slowest_mm_s"] * passed == pytest.approx(row["from_mm"], abs=0.01)


def test_time_on_the_belt_is_that_of_the_slowest_way(cli, tmp_path: Path) -> None:
    belt = (FILES / "cell.toml").read_text() + "[[conveyors]]\nindex = 1\ncounts_per_mm = 100\n"
    text = "MJ P1 F100\nTRK 1\nIF DI1\nWAIT 2\nENDIF\nML Y=100 F100\nTRK 0\nML P1\n"
    found = report(cli, text, tmp_path, belt)
    (row,) = found["tracking"]
    seconds = 2.0 + next(each["time_s"] for each in found["statements"] if each["line"] == 6)
    assert row["line"] == 6
    assert row["slowest_mm_s"] * seconds == pytest.approx(row["from_mm"], abs=0.01)
    rounds = text.replace("IF DI1\nWAIT 2\nENDIF\n", "A:\n").replace(
        "TRK 0", "ML P1\nIF DI1\nGOTO A\nENDIF\nTRK 0"
    )
    for row in report(cli, rounds, tmp_path, belt)["tracking"]:
        assert row["slowest_mm_s"] is row["fastest_mm_s"] is None
        assert row["from_mm"] < 0.0


def test_text_shows_all_tables(cli, tmp_path: Path) -> None:
    (tmp_path / "part.via").write_text("MJ J4=5 J5=5 F100\nML Z=2200 F300\nIF DI1\nML P1\nENDIF\n")
    said = cli("check", tmp_path / "part.via", "--cell", "cell.toml").out
    for title in ("corners:", "times:", "slowed by an axis:", "reads of the outside world:"):
        assert f"\n{title}\n" in said
    assert "estimated time of the program: " in said
    assert " to " in said.split("estimated time of the program: ")[1]


@UNHURRIED
@given(st.lists(st.integers(0, 2), max_size=60))
def test_folding_counts_everything(items: list[int]) -> None:
    folded = fold(items)
    counts = dict.fromkeys(items, 0)
    for position, weight in zip(folded.kept, folded.weights, strict=True):
        counts[items[position]] += weight
    assert counts == {name: items.count(name) for name in items}
    assert list(folded.kept) == sorted(folded.kept)
    assert all(a < b < len(folded.kept) for a, b in folded.proofs)


@UNHURRIED
@given(st.integers(4, 9), st.integers(4, 9))
def test_folding_nests(inner: int, outer: int) -> None:
    folded = fold((["a"] * inner + ["b"]) * outer)
    assert len(folded.kept) == 12
    assert sum(folded.weights) == (inner + 1) * outer


def test_subroutines_that_interrupt_are_planned_from_the_place_of_their_on(cli, tmp_path: Path) -> None:
    """With the speed and tool that hold there, on both answers; what is wrong with them is said."""
    text = (
        "MJ X=1500 Y=0 Z=1500 A=0 B=90 C=0 F60\nON DI1 SUB LOST\nML Y=300 F200\nML Y=-300 F400\nEND\n"
        "LOST:\nML Z=1600\nIF DI2\nML X=9000\nENDIF\nEND\n"
    )
    found = report(cli, text, tmp_path, ARM)
    assert [(each["code"], each["line"]) for each in found["diagnostics"]] == [("E302", 9)]
    assert found["cycles"] == []
    found = report(cli, text.replace("X=9000", "X=1600"), tmp_path, ARM)
    assert found["diagnostics"] == []
    rows = {row["line"]: row for row in found["statements"]}
    assert rows[7]["length_mm"] == pytest.approx(100.0)
    assert rows[7]["peak_mm_s"] == pytest.approx(60.0, rel=0.02), "F60 holds where ON stands"
    assert rows[9]["length_mm"] == pytest.approx(100.0)
    watched = {"line": 2, "reads": ["DI1"], "barrier": False, "watched": True}
    assert found["decisions"][0] == watched
    without = report(cli, text.partition("ON DI1")[0] + "ML Y=300 F200\nML Y=-300 F400\n", tmp_path, ARM)
    assert found["cycles"] == without["cycles"], "an interrupt is no part of the program's time"


def test_errors_that_the_program_handles_are_advice_and_the_check_goes_on(cli, tmp_path: Path) -> None:
    """In the time of the run that leaves the statement out, and only while ON ERROR is on."""
    begin = "MJ X=1500 Y=0 Z=1500 A=0 B=90 C=0 F60\nON ERROR SUB FAULT\nML Y=300 F200 R20\n"
    end = "ML Z=1600\nML Y=-300\n{}ML Y=9000\nEND\nFAULT:\nRESUME NEXT\nEND\n"
    found = report(cli, f"{begin}ML X=9000\n{end}".format(""), tmp_path, ARM)
    said = [(each["code"], each["line"], each["severity"]) for each in found["diagnostics"]]
    assert said == [("W510", 4, "warning"), ("W510", 7, "warning")]
    assert [row["line"] for row in found["statements"]] == [1, 3, 5, 6]
    cell = parse_cell(ARM)
    session = Session(cell, loaded(f"{begin}ML X=9000\n{end}".format(""), cell))
    session.finish()
    (cycle,) = found["cycles"]
    assert cycle["longest_s"] == pytest.approx(session.kernel.tick * cell.tick, abs=0.01)
    found = report(cli, f"{begin}ML X=9000\n{end}".format("OFF FAULT\n"), tmp_path, ARM)
    assert [each["code"] for each in found["diagnostics"]][-1] == "E302"
    assert found["cycles"] == []


def test_rounds_of_a_loop_whose_errors_are_handled(cli, tmp_path: Path) -> None:
    text = (
        "MJ X=1500 Y=0 Z=1500 A=0 B=90 C=0 F60\nON ERROR SUB FAULT\nROW:\nML Y=300 F200\nML X=9000\n"
        "ML Y=-300\nGOTO ROW 5\nEND\nFAULT:\nRESUME NEXT\nEND\n"
    )
    found = report(cli, text, tmp_path, ARM)
    assert [(each["code"], each["line"]) for each in found["diagnostics"]] == [("W510", 5)]
    (cycle,) = found["cycles"]
    cell = parse_cell(ARM)
    session = Session(cell, loaded(text, cell))
    session.finish()
    assert cycle["longest_s"] == pytest.approx(session.kernel.tick * cell.tick, abs=0.02)


def test_what_handles_errors_is_planned_for_the_errors_it_asks_for(cli, tmp_path: Path) -> None:
    text = (
        "MJ X=1500 Y=0 Z=1500 A=0 B=90 C=0 F60\nON ERROR SUB FAULT\nML Y=300 F200\nEND\n"
        "FAULT:\nIF ERRNO = 302\nML X=9000\nELSEIF ERRNO = 303\nMJ J1=900\nELSE\nML P77\nENDIF\nEND\n"
    )
    found = report(cli, text.replace("ML P77", "MJ J2=900"), tmp_path, ARM)
    assert [(each["code"], each["line"]) for each in found["diagnostics"]] == [
        ("E302", 7),
        ("E303", 9),
        ("E303", 11),
    ]


def test_a_long_program_is_planned_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound is for ways that are too many, not for a program that is long."""
    monkeypatch.setattr("viapoint.surveying.MOST_PLANNED", 5)
    cell = parse_cell(ARM)
    lines = [f"MJ J1={k % 3} J2={k % 5} F90" for k in range(40)]
    found = survey(compile_text("\n".join(lines), "long", cell).program, cell)
    assert found.cut_at is None
    assert [block.line for block in blocks_of(found)] == list(range(1, 41))
