"""TRK: coupling, the path on the belt, parts, commands, failures; override and windows change nothing."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from session_runs import Floats, Run
from viapoint.report import limits_report
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.runtime.kernel import State
from viapoint.runtime.signals import parse_scenario
from viapoint.session import Session, compile_text

CELL = """[robot]
model = "frigeni6"
[controller]
tick_s = {tick}
[points]
P1 = {{ x = 1500, y = -400, z = 1300, a = 0, b = 90, c = 0 }}
P2 = {{ x = 1500, y = -300, z = 1300, a = 0, b = 90, c = 0 }}
P3 = {{ x = 1400, y = -300, z = 1250, a = 0, b = 90, c = 0 }}
P4 = {{ x = 1500, y = 0, z = 1500, a = 0, b = 90, c = 0 }}
[[conveyors]]
index = 1
xyz = [1400, -1500, 500]
abc = [0, 0, 90]
counts_per_mm = 100.0
max_lag_mm = 2.0
"""
PARTS = "parts = { trigger_mm = 500, window_mm = [900, 1500], pitch_mm = 400 }\n"
PROGRAM = """MJ P1 F60
TRK 1
ML P2 F200
ML P3 R10
SET DO1
WAIT 0.2
ML P1
TRK 0
ML P4 F500
"""
CONSTANT = "[[0, 100]]"
CHANGING = "[[0, 0], [2, 0], [4, 150], [5, 60], [7, -50]]"
BELTS = {"constant": (CONSTANT, 0.0), "jittering": (CONSTANT, 0.5), "changing": (CHANGING, 0.3)}
OVERRIDES = (1.0, 0.37)
Commands = tuple[tuple[int, str], ...]


@cache
def where(parts: bool = False, tick: float = 0.001) -> Cell:
    return parse_cell(CELL.format(tick=tick) + (PARTS if parts else ""))


def run(
    speed: str,
    noise: float = 0.0,
    *,
    window: int = 1024,
    override: float = 1.0,
    program: str = PROGRAM,
    commands: Commands = (),
    cell: Cell | None = None,
) -> Run:
    """A run to its end, with commands given in their ticks."""
    cell = cell or where()
    text = f"seed = 3\n[[conveyor]]\nindex = 1\nspeed_mm_s = {speed}\nnoise_counts = {noise}\n"
    scenario = parse_scenario(text, cell)
    session = Session(
        cell, compile_text(program, cell=cell), scenario=scenario, override=override, max_time=40.0
    )
    windows, left = [session.begin()], list(commands)
    while not session.kernel.over and session.kernel.tick * cell.tick < 40.0:
        windows.append(session.advance(min(window, left[0][0] - session.kernel.tick) if left else window))
        while left and session.kernel.tick == left[0][0]:
            getattr(session, left.pop(0)[1])()
    session.status = session.final_status()
    return Run(session, tuple(windows))


def tracks(done: Run) -> list[tuple[int, str]]:
    return [(event.tick, str(event.data["action"])) for event in done.events("track")]


def travel(done: Run) -> Floats:
    """(N,) m of the belt in every tick."""
    belt = done.session.kernel.outlet.feed.tracker.belts[1]
    return belt.travel(np.arange(len(done.joints)))


@pytest.mark.parametrize("belt", BELTS)
@pytest.mark.parametrize("override", OVERRIDES)
def test_the_length_of_a_window_changes_nothing(belt: str, override: float) -> None:
    slow = where(tick=0.004)
    first, *others = (run(*BELTS[belt], window=w, override=override, cell=slow) for w in (1024, 64, 1))
    assert first.status == "finished"
    for other in others:
        assert other.history == first.history
        assert np.abs(other.joints - first.joints).max() < 1e-9


@pytest.mark.parametrize("belt", BELTS)
def test_the_path_is_run_on_the_belt_within_the_limits(belt: str) -> None:
    """Each motion's end is where it was taught, plus the belt's travel since the latch."""
    done = run(*BELTS[belt])
    assert done.status == "finished"
    assert done.over_limits() == {}
    (latched, _), (coupled, _), (left, _) = tracks(done)
    assert latched < coupled < left
    position, ways = done.column("position"), travel(done)
    for line, place in ((4, (1.4, -0.3, 1.25)), (7, (1.5, -0.4, 1.3))):
        tick = done.end_of(line)
        along = np.array([0.0, ways[tick] - ways[latched], 0.0])
        assert np.linalg.norm(position[tick] - along - place) < 1e-4
    assert position[-1] == pytest.approx([1.5, 0.0, 1.5], abs=1e-9)
    assert done.events("track")[-1].data["lag_mm"] < (0.1 if belt != "changing" else 2.0)


def test_while_it_waits_on_a_constant_belt_the_tcp_is_within_a_tenth_of_a_millimetre() -> None:
    done = run(CONSTANT, 0.5, program="MJ P1 F60\nTRK 1\nWAIT 2\nTRK 0\n")
    (latched, _), (coupled, _), _ = tracks(done)
    on_it = slice(coupled, coupled + 2000)
    along = done.column("position")[on_it] - done.column("position")[latched]
    off = along - np.outer(travel(done)[on_it] - travel(done)[latched], [0.0, 1.0, 0.0])
    assert np.abs(off).max() < 1e-4


def test_coupling_is_time_optimal_for_its_limits() -> None:
    """From rest onto a belt at v, jerk-limited: about as long as reaching v takes at the jerk used."""
    done = run(CONSTANT, program="MJ P1 F60\nTRK 1\nTRK 0\n")
    (latched, _), (coupled, _), (left, _) = tracks(done)
    y = done.column("position")[latched : coupled + 1, 1]
    jerk = np.abs(np.diff(y, n=3)).max() / 1e-9
    to_speed = 2.0 * np.sqrt(0.1 / jerk)
    assert (coupled - latched) * 1e-3 < 2.5 * to_speed
    assert (left - coupled) * 1e-3 < 2.0 * to_speed


def test_each_trk_takes_the_next_part_in_the_window_or_waits() -> None:
    """Parts every 400 mm; 120 mm/s: the third part comes when the first two are taken or gone."""
    program = "MJ P1 F60\nTRK 1\nML P2 F300\nTRK 0\nML P1 F500\nTRK 1\nML P2 F300\nTRK 0\n"
    done = run("[[0, 120]]", 0.2, program=program, cell=where(parts=True))
    assert done.status == "finished"
    assert done.over_limits() == {}
    ways = travel(done)
    latches = [tick for tick, action in tracks(done) if action == "latched"]
    places = [0.5 + ways[tick] - part * 0.4 for part, tick in enumerate(latches)]
    assert len(latches) == 2
    assert places[0] == pytest.approx(0.9, abs=2e-4)  # waited for until it came into the window
    assert 0.9 - 2e-4 <= places[1] <= 1.5
    for part, line in ((0, 3), (1, 7)):
        tick = done.events("block", line)[0]
        end = round(tick.data["t_end"] / 1e-3)
        along = np.array([0.0, ways[end] - part * 0.4, 0.0])
        assert np.linalg.norm(done.column("position")[end] - along - (1.5, -0.3, 1.3)) < 1e-4


def test_a_part_that_never_comes_is_a_wait_that_nothing_can_end() -> None:
    done = run("[[0, 100], [1, 0]]", cell=where(parts=True))
    assert (done.code, done.failed_line) == ("E410", 2)


def test_a_program_that_ends_on_the_belt_leaves_it_first() -> None:
    done = run(CONSTANT, program="MJ P1 F60\nTRK 1\nML P2 F200\n")
    assert [action for _, action in tracks(done)] == ["latched", "coupled", "decoupled"]
    assert np.abs(np.diff(done.joints[-3:], axis=0)).max() < 1e-6
    assert done.over_limits() == {}


@pytest.mark.parametrize("override", OVERRIDES)
def test_15_trk_out_of_reach(override: float) -> None:
    """The belt leads away: a controlled stop that names line, joint, tick and the place of the belt."""
    program = "MJ P1 F60\nTRK 1\nML P2 F200\nWAIT 60\nTRK 0\n"
    slow = where(tick=0.004)
    first, other = (
        run("[[0, 250]]", 0.2, program=program, window=w, override=override, cell=slow) for w in (1024, 1)
    )
    failure = first.session.failure
    assert failure is not None
    assert failure.code in ("E440", "E441")
    assert failure.line == 4
    assert "conveyor 1" in failure.message
    assert "mm behind its latch" in failure.message
    assert "in tick" in failure.message
    assert "J" in failure.message or "reach" in failure.message
    assert first.over_limits() == {}
    assert np.abs(np.diff(first.joints[-3:], axis=0)).max() < 1e-5
    assert other.history == first.history
    assert np.abs(other.joints - first.joints).max() < 1e-9


def test_out_of_reach_at_the_coupling_is_known_before_anything_moves() -> None:
    turned = "xyz = [1400, -1500, 500]\nabc = [0, 0, 180]"
    text = CELL.format(tick=0.001).replace("xyz = [1400, -1500, 500]\nabc = [0, 0, 90]", turned)
    bent = parse_cell(text.replace('"frigeni6"\n', '"frigeni6"\nhome = [0, 0, 69.9, 0, 20, 0]\n'))
    done = run("[[0, 300]]", program="TRK 1\nTRK 0\n", cell=bent)
    assert (done.code, done.failed_line) == ("E440", 1)
    assert np.ptp(done.joints, axis=0).max() == 0.0


def test_a_belt_too_fast_is_refused() -> None:
    done = run("[[0, 9000]]")
    assert (done.code, done.failed_line) == ("E441", 2)
    assert "J" in str(done.session.failure)


def test_a_belt_that_starts_too_suddenly_is_left_behind() -> None:
    done = run("[[0, 0], [2.5, 0], [2.51, 300]]", program="MJ P1 F60\nTRK 1\nWAIT 3\nTRK 0\n")
    assert (done.code, done.failed_line) == ("E442", 3)
    assert done.over_limits() == {}


SCENARIO_16: dict[str, dict[str, Any]] = {
    "halt": {"commands": ((1500, "halt"), (2600, "resume"))},
    "emergency": {"commands": ((1700, "emergency_stop"), (3300, "reset"), (3500, "resume"))},
    "emergency while coupling": {"commands": ((1250, "emergency_stop"), (2300, "reset"), (2500, "resume"))},
}


@pytest.mark.parametrize("override", OVERRIDES)
@pytest.mark.parametrize("what", SCENARIO_16)
def test_16_halt_estop_and_continue_inside_trk(what: str, override: float) -> None:
    """The section is run to its end on the belt; a halted robot stays with the belt, an E-stop stops both."""
    factor = 1.0 if override == 1.0 else 2.2
    commands = tuple((4 * round(tick * factor / 4), each) for tick, each in SCENARIO_16[what]["commands"])
    slow = where(tick=0.004)
    commands = tuple((tick // 4, each) for tick, each in commands)
    first, other = (
        run("[[0, 60]]", 0.3, window=w, override=override, commands=commands, cell=slow) for w in (1024, 1)
    )
    assert first.status == "finished"
    assert other.history == first.history
    assert np.abs(other.joints - first.joints).max() < 1e-9
    bounds = {"speed": 1.0, "acceleration": 2.0, "jerk": 2.1} if "emergency" in what else {}
    for name, values in limits_report(first.session).items():
        kind = name.rsplit("_", 1)[1]
        assert np.max(values) <= bounds.get(kind, 1.05 if kind == "jerk" else 1.0) + 1e-9, name
    position, ways = first.column("position"), travel(first)
    (latched, _), *_ = tracks(first)
    end = first.end_of(7)
    along = np.array([0.0, ways[end] - ways[latched], 0.0])
    assert np.linalg.norm(position[end] - along - (1.5, -0.4, 1.3)) < 1e-4
    (stop, command), last = commands[0], commands[-1][0]
    still = slice((stop + last) // 2, last)
    moved = np.diff(position[still], axis=0)
    expected = np.zeros(3) if command == "emergency_stop" else np.array([0.0, 0.06 * 0.004, 0.0])
    assert np.abs(moved - expected).max() < 2e-5


def test_a_stop_inside_trk_ends_the_run_at_rest() -> None:
    done = run("[[0, 60]]", commands=((1700, "stop"),))
    assert done.session.kernel.state is State.STOPPED
    assert np.abs(np.diff(done.joints[-2:], axis=0)).max() == 0.0
    assert done.over_limits() == {}


def test_tracking_with_a_filter() -> None:
    filtered = parse_cell(CELL.format(tick=0.001).replace("[points]", "filter = { ticks = 16 }\n[points]"))
    done = run(CONSTANT, 0.3, cell=filtered)
    assert done.status == "finished"
    assert done.over_limits() == {}
    assert done.column("position")[-1] == pytest.approx([1.5, 0.0, 1.5], abs=1e-9)


TOWARDS = (
    CELL.format(tick=0.004)
    .replace("xyz = [1400, -1500, 500]\nabc = [0, 0, 90]", "xyz = [2000, 0, 500]\nabc = [0, 0, 180]")
    .replace("tick_s", "tracking_reserve = 0.02\ntick_s")
)
"""The belt comes towards the base: the same motion asks more and more of J1."""


@pytest.mark.parametrize("override", OVERRIDES)
def test_a_path_is_slowed_where_the_joints_could_not_follow_it_on_the_belt(override: float) -> None:
    """And gets faster again where they can; its ends stay where they are on the belt."""
    program = "MJ P1 F90\nTRK 1\nWAIT 6.2\nML Y=300 F1500\nML Y=-300\nTRK 0\n"
    cell = parse_cell(TOWARDS)
    first, *others = (
        run("[[0, 60]]", 0.2, program=program, cell=cell, window=w, override=override) for w in (1024, 9)
    )
    assert first.status == "finished", first.session.failure
    assert first.over_limits() == {}
    told = [(e.data["action"], e.data.get("percent")) for e in first.events("track")]
    assert told[:2] + told[-1:] == [("latched", None), ("coupled", None), ("decoupled", None)]
    assert [action for action, _ in told[2:-1:2]] == ["slowed"] * len(told[2:-1:2])
    assert told[3:-1:2] == [("restored", 100.0)] * len(told[3:-1:2])
    assert len(told) > 4
    for other in others:
        assert other.history == first.history
        assert np.abs(other.joints - first.joints).max() < 1e-9
    (latched, _), *_ = tracks(first)
    for line, y in ((4, 0.3), (5, -0.3)):
        end = first.end_of(line)
        x = 1.5 - (travel(first)[end] - travel(first)[latched])
        assert first.column("position")[end] == pytest.approx([x, y, 1.3], abs=1e-4)
    assert np.all(first.column("override") == override), "the override is as it was set"
    assert first.session.kernel.mover.share == 1.0, "it is left with the belt"


@pytest.mark.parametrize(
    "commands",
    [((1830, "halt"), (1900, "resume")), ((1850, "emergency_stop"), (2000, "reset"), (2010, "resume"))],
)
def test_commands_while_a_path_is_slowed(commands: Commands) -> None:
    program = "MJ P1 F90\nTRK 1\nWAIT 6.2\nML Y=300 F1500\nTRK 0\n"
    runs = [
        run(
            "[[0, 40]]",
            0.2,
            program=program.replace("6.2", "7.6"),
            cell=parse_cell(TOWARDS),
            window=w,
            commands=tuple((t + 340, c) for t, c in commands),
        )
        for w in (1024, 7)
    ]
    assert runs[0].status == "finished", runs[0].session.failure
    assert runs[0].history == runs[1].history
    assert np.abs(runs[0].joints - runs[1].joints).max() < 1e-9
    for name, values in limits_report(runs[0].session).items():
        assert np.max(values) <= (2.1 if name.endswith("jerk") else 2.0) + 1e-9, name


def test_the_loss_of_a_belt_is_an_event_where_the_axes_begin_to_brake() -> None:
    left = run("[[0, 0], [2.5, 0], [2.51, 300]]", program="MJ P1 F60\nTRK 1\nWAIT 3\nTRK 0\n")
    far = run("[[0, 60]]", program="MJ P1 F60\nTRK 1\nWAIT 60\nTRK 0\n", cell=parse_cell(TOWARDS))
    for done, code in ((left, "E442"), (far, "E440")):
        lost = done.events("track")[-1]
        failure = done.session.failure
        assert failure is not None
        assert (lost.data["action"], failure.code) == ("lost", code)
        assert f"in tick {lost.tick + 1} " in failure.message
        ways = travel(done)
        assert lost.data["travel_mm"] == pytest.approx(1e3 * (ways[lost.tick] - ways[tracks(done)[0][0]]))
        assert lost.tick < done.events("error")[0].tick
    assert left.events("track")[-1].data["lag_mm"] == pytest.approx(2.0, abs=0.4)
    assert far.events("track")[-1].data["lag_mm"] < 0.1
