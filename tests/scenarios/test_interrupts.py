"""ON c SUB L: the robot stops on its path, runs the subroutine, comes back, and goes on as if nothing was."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import everywhere as scenarios
import numpy as np
import pytest
from everywhere import CELL

from session_runs import Floats, Run, at, run
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.runtime.signals import parse_scenario
from viapoint.session import Session, compile_text

TICK = 0.004
"""s: longer than usual, so that runs in windows of one tick are quick."""

PATH_TOLERANCE = 2e-5
"""m between a path and the chords between its ticks."""

LOST = "END\nLOST:\nSET DO1\nML Z=1550 F100\nWAIT 0.05\nRESET DO1\nEND\n"
"""Its ON stands in line 2, its last motion is the joint move back, which belongs to the END."""

BACK = 1e-12
"""rad between where a path was left and where it is taken up."""


@cache
def place(more: str = "") -> Cell:
    """The cell of the scenarios, on that tick."""
    return parse_cell(f"{CELL}[controller]\ntick_s = {TICK}\n{more}")


def everywhere(text: str, where: Cell | None = None, **options: Any) -> Iterator[Run]:
    yield from scenarios.everywhere(text, where or place(), **options)


def finished(text: str, **options: Any) -> Iterator[Run]:
    yield from scenarios.finished(text, place(), **options)


def tick(seconds: float) -> int:
    return round(seconds / TICK)


def interrupts(done: Run, label: str = "LOST") -> list[tuple[str, int]]:
    """What happened with an interrupt, and in which ticks."""
    found = [event for event in done.events("interrupt") if event.data["label"] == label]
    return [(str(event.data["action"]), event.tick) for event in found]


def spans(done: Run) -> list[tuple[int, int]]:
    """Ticks in which a subroutine began, and in which the robot was back."""
    ticks = [event.tick for event in done.events("interrupt") if event.data["action"] != "triggered"]
    return list(zip(ticks[::2], ticks[1::2], strict=True))


def away(done: Run) -> Floats:
    """(N,) m: how much of the way in every tick was made beside the path."""
    s = done.column("s")
    beside = np.zeros(len(s))
    for begin, end in spans(done):
        beside[begin : end + 1] += s[begin : end + 1] - s[begin]
        beside[end + 1 :] += s[end] - s[begin]
    return beside


def off_the_path_of(done: Run, plain: Run) -> float:
    """How far the TCP gets, beside its interrupts, from where it is at the same length in another run, m."""
    on_path = np.ones(len(done.joints), dtype=bool)
    for begin, end in spans(done):
        on_path[begin + 1 : end] = False
    s, position = plain.column("s"), plain.column("position")
    rows = np.flatnonzero(np.diff(s, prepend=-1.0) > 0.0)
    own = (done.column("s") - away(done))[on_path]
    there = np.stack([np.interp(own, s[rows], position[rows, k]) for k in range(3)], axis=1)
    return float(np.linalg.norm(done.column("position")[on_path] - there, axis=1).max())


def own_events(done: Run, lines: int) -> list[tuple[Any, ...]]:
    """What the program itself did, without times; it has so many lines."""
    kinds = ("block", "output", "m", "search", "tool")
    return [
        (
            e.kind,
            e.line,
            e.data.get("signal"),
            e.data.get("value"),
            round(float(e.data.get("length_mm", 0)), 6),
        )
        for e in done.session.events
        if e.kind in kinds and e.line <= lines
    ]


def test_the_path_goes_on_where_it_was_left_as_if_nothing_was() -> None:
    text = "MJ P1 F60\nON DI1 SUB LOST\nML P2 F200 R20\nSET DO2\nML P3 R20\nML P4 R20\nML P1\n"
    plain = run(text + LOST, place())
    for done in finished(text + LOST, scenario=at(0.7, DI1=True)):
        assert [action for action, _ in interrupts(done)] == ["triggered", "begun", "returned"]
        (_, turned), (_, begun), (_, back) = interrupts(done)
        assert turned == tick(0.7)
        assert 5 < begun - turned < 60
        assert np.abs(done.joints[begun] - done.joints[back]).max() < BACK
        assert off_the_path_of(done, plain) < PATH_TOLERANCE
        assert own_events(done, 7) == own_events(plain, 7)
        assert [e.line for e in done.events("block") if begun <= e.tick < back] == [11, 14]
        assert np.diff(done.column("s")).min() >= 0.0, "the way grows, in the subroutine too"
        reads = done.events("input_read")
        assert [(e.tick, e.line, e.data["signal"], e.data["value"]) for e in reads] == [
            (tick(0.7), 2, "DI1", True)
        ]


@pytest.mark.parametrize(
    ("line", "waits"),
    [
        ("WAIT 1.5", 1.5),
        ("WAIT DI2", None),
        ("WAIT DI2 AND NOT DI3", None),
        ("M 3", None),
        ("ASK:\nIF NOT DI2\nGOTO ASK\nENDIF", None),
    ],
)
def test_while_the_robot_waits_the_wait_goes_on_afterwards(line: str, waits: float | None) -> None:
    """Times run on meanwhile; what came meanwhile is there."""
    text = f"MJ P1 F60\nON DI1 SUB LOST\nML P2 F300\n{line}\nML P3\n"
    answers = at(2.5, DI2=True) + (M_RESET if line == "M 3" else "")
    for done in finished(text + LOST, scenario=at(1.8, DI1=True) + answers):
        (_, turned), (_, begun), (_, back) = interrupts(done)
        assert turned == begun == tick(1.8), "at rest it begins at once"
        wait = [e for e in done.events("wait") if e.line == 4]
        if waits is not None:
            left = max(wait[0].tick + tick(waits), back)
        else:
            left = max(tick(2.5), back) if line != "M 3" else max(wait[0].tick + tick(2.0), back)
        (last,) = [e for e in done.events("block") if e.tick >= back]
        assert last.tick == left


M_RESET = "[[when]]\nm = 3\nafter_s = 2.0\nreset_m = 3\n"


def test_in_the_tick_in_which_a_wait_is_over_the_interrupt_comes_first() -> None:
    text = "MJ P1 F60\nON DI1 SUB LOST\nML P2 F300\nWAIT DI2\nSET DO3\n"
    for done in finished(text + LOST, scenario=at(1.8, DI1=True, DI2=True)):
        (*_, (_, back)) = interrupts(done)
        assert [e.tick for e in done.events("output") if e.data["signal"] == "DO3"] == [back]


def test_several_run_one_after_the_other_in_the_order_of_their_on() -> None:
    text = "MJ P1 F60\nON DI1 SUB LOST\nON DI2 SUB B\nML P2 F100\n"
    other = "B:\nWAIT 0.2\nEND\n"
    for done in finished(text + LOST + other, scenario=at(0.4, DI2=True) + at(0.42, DI1=True)):
        first, second = interrupts(done, "LOST"), interrupts(done, "B")
        assert second[0] == ("triggered", tick(0.4))
        assert first[0] == ("triggered", tick(0.42))
        assert second[1] == ("begun", first[2][1]), "it waits for the other, and the path does not move"


def test_what_turns_true_again_meanwhile_runs_again_but_only_once() -> None:
    text = "MJ P1 F60\nON DI1 SUB A\nML P2 F100\nEND\nA:\nWAIT 0.5\nEND\n"
    pulses = "".join(at(0.5 + 0.05 * k, DI1=k % 2 == 0) for k in range(6))
    for done in finished(text, scenario=pulses):
        assert [action for action, _ in interrupts(done, "A")] == [
            *("triggered", "begun", "triggered", "returned", "begun", "returned")
        ]


def test_only_turning_true_counts() -> None:
    text = "MJ P1 F60\nON DI1 SUB A\nML P2 F100\nON DI1 SUB A\nML P3\nEND\nA:\nWAIT 0.1\nEND\n"
    for done in finished(text, scenario=at(0.0, DI1=True)):
        assert interrupts(done, "A") == []
    for done in finished(text, scenario=at(0.0, DI1=True) + at(0.5, DI1=False) + at(0.6, DI1=True)):
        assert interrupts(done, "A")[0] == ("triggered", tick(0.6))


def test_another_condition_for_the_same_subroutine_takes_the_place_of_the_first() -> None:
    text = "MJ P1 F60\nON DI1 SUB A\nML P2 F300\nON DI2 SUB A\nWAIT 3\nEND\nA:\nWAIT 0.1\nEND\n"
    for done in finished(text, scenario=at(2.0, DI1=True) + at(3.0, DI2=True)):
        assert interrupts(done, "A")[0] == ("triggered", tick(3.0))
        assert done.events("interrupt")[0].line == 4


def test_off_ends_it_on_the_path_also_from_inside() -> None:
    text = "MJ P1 F60\nON DI1 SUB A\nML P2 F300\nOFF A\nML P3\nWAIT 3\nEND\nA:\nWAIT 0.1\nEND\n"
    for done in finished(text, scenario=at(3.0, DI1=True)):
        assert interrupts(done, "A") == []
    once = "MJ P1 F60\nON DI1 SUB A\nWAIT 2\nEND\nA:\nWAIT 0.3\nOFF A\nEND\n"
    pulses = (
        at(0.5, DI1=True) + at(0.6, DI1=False) + at(0.65, DI1=True) + at(1.0, DI1=False) + at(1.2, DI1=True)
    )
    for done in finished(once, scenario=pulses):
        assert [action for action, _ in interrupts(done, "A")].count("begun") == 1


def test_off_comes_too_late_for_what_the_robot_stops_for() -> None:
    """At 300 mm/s the place of OFF lies within the way of the stop."""
    text = "MJ P1 F60\nON AO1 > 0.5 SUB A\nAT D95 SET AO1 = 1\nML P2 F400 R5\nOFF A\nML P3\nEND\nA:\nEND\n"
    for done in finished(text):
        actions = interrupts(done, "A")
        assert [action for action, _ in actions] == ["triggered", "begun", "returned"]


def test_the_subroutine_sees_tool_and_speed_of_the_robots_place_and_leaves_them_alone() -> None:
    """The interpreter is ahead: by then it has read F300 and T 2."""
    text = (
        "MJ P1 F60\nON DI1 SUB A\nT 1\nML P2 F100\nT 2\nML P3 F300\nML P4\nEND\n"
        "A:\nML Z=1450\nT 2\nML Z=1440 F50\nEND\n"
    )
    plain = run(text, place())
    for done in finished(text, scenario=at(1.0, DI1=True)):
        ((begun, back),) = spans(done)
        assert own_events(done, 8) == own_events(plain, 8)
        inside = done.events("block", 10)[0]
        if done.column("override")[5] == 1.0:
            ticks = slice(inside.tick, tick(float(inside.data["t_end"])))
            assert done.column("speed")[ticks].max() == pytest.approx(0.1, rel=1e-3), "F100"
        assert np.abs(done.joints[begun] - done.joints[back]).max() < BACK
        assert np.abs(done.joints[-1] - plain.joints[-1]).max() < 1e-9
        assert [e.data["index"] for e in done.events("tool") if begun <= e.tick <= back] == [2, 1]


def test_a_tangential_tool_is_taken_along_and_found_again() -> None:
    text = "MJ P1 F60\nTANG 1\nON DI1 SUB A\nML P2 F100\nML P3\nEND\nA:\nML X=1480\nTANG 0\nML Y=10\nEND\n"
    plain = run(text, place())
    for done in finished(text, scenario=at(1.6, DI1=True)):
        ((begun, back),) = spans(done)
        assert np.abs(done.joints[begun] - done.joints[back]).max() < BACK
        assert np.abs(done.joints[-1] - plain.joints[-1]).max() < 1e-9
        assert own_events(done, 6) == own_events(plain, 6)


def test_a_search_goes_on_with_what_is_true_then() -> None:
    text = "MJ P1 F60\nON DI1 SUB A\nML P2 F100 UNTIL DI2 CAPTURE P3\nEND\nA:\nML Z=1480\nWAIT 1\nEND\n"
    pulse = at(0.6, DI1=True) + at(1.0, DI2=True) + at(1.2, DI2=False)
    for done in finished(text, scenario=pulse):
        assert [e.data["found"] for e in done.events("search")] == [False]
    for done in finished(text, scenario=at(0.6, DI1=True) + at(1.0, DI2=True)):
        ((_, back),) = spans(done)
        assert [(e.data["found"], e.tick) for e in done.events("search")] == [(True, back)]


def test_what_the_subroutine_captures_is_its_own() -> None:
    """What the program has planned by then must not depend on how far it was ahead."""
    text = (
        "MJ P1 F60\nON DI1 SUB A\nML P2 F100\nML P3\nEND\n"
        "A:\nML Z=1450 UNTIL DI2 CAPTURE P3\nML Z=1480\nML P3\nEND\n"
    )
    plain = run(text, place())
    for done in finished(text, scenario=at(0.6, DI1=True) + at(0.8, DI2=True)):
        assert done.events("search")[0].data["found"]
        assert np.abs(done.joints[-1] - plain.joints[-1]).max() < 1e-9


def test_its_own_flag_interrupts_in_the_tick_in_which_it_is_raised() -> None:
    text = "MJ P1 F60\nON M5 SUB A\nAT D20 M5\nML P2 F100\nEND\nA:\nSET DO1\nEND\n"
    for done in finished(text):
        (raised,) = done.events("m")
        assert interrupts(done, "A")[0] == ("triggered", raised.tick)


def test_an_output_interrupts_when_others_see_it() -> None:
    text = "MJ P1 F60\nON DO2 SUB A\nAT D20 SET DO2\nML P2 F100\nEND\nA:\nSET DO1\nEND\n"
    for done in finished(text):
        assert interrupts(done, "A")[0] == ("triggered", done.events("output")[0].tick + 1)


def test_what_goes_wrong_in_the_subroutine_ends_the_run_in_its_line() -> None:
    text = "MJ P1 F60\nON DI1 SUB A\nML P2 F100\nEND\nA:\n{}\nEND\n"
    for line, code in (("ML X=5000", "E302"), ("WAIT DI5", "E410"), ("MJ P9", "E310"), ("SUB A", "E402")):
        session = Session(
            place(), compile_text(text.format(line)), scenario=parse_scenario(at(0.6, DI1=True), place())
        )
        session.finish()
        assert session.failure is not None
        assert (session.failure.code, session.failure.line) == (code, 6)


def test_a_way_back_that_is_barred_ends_the_run_at_the_end_of_the_subroutine() -> None:
    wall = "[[zones]]\nname = 'wall'\nkind = 'forbidden'\ncorner_1 = [1300, -500, 1200]\n"
    wall += "corner_2 = [1700, -300, 1700]\n"
    where = place(wall)
    text = "MJ P1 F60\nON DI1 SUB A\nML P2 F100\nEND\nA:\nMJ J3=0 F90\nMJ J1=-30\nMJ J3=38\nEND\n"
    for done in everywhere(text, where, scenario=at(0.6, DI1=True)):
        assert done.status == "error"
        assert done.code == "E330"


def test_at_the_end_of_the_program_none_is_on_any_more() -> None:
    text = "MJ P1 F60\nON DI1 SUB LOST\nML P2 F300\n"
    for done in everywhere(text + LOST, scenario=at(30.0, DI1=True)):
        assert done.status == "finished"
        assert interrupts(done) == []


def test_a_wait_that_an_interrupt_may_end_is_not_in_vain() -> None:
    """The subroutine sets what the scenario answers; when nothing can come any more it says so."""
    text = "MJ P1 F60\nON DI1 SUB A\nWAIT DI2\nEND\nA:\nSET DO1\nEND\n"
    for done in everywhere(text, scenario=at(1.0, DI1=True) + WHEN_DO1):
        assert done.status == "finished", done.session.failure
    for done in everywhere(text, scenario=at(1.0, DI1=True)):
        assert (done.code, done.failed_line, len(done.joints)) == ("E410", 3, tick(1.0) + 1)


WHEN_DO1 = '[[when]]\nsignal = "DO1"\nbecomes = true\nafter_s = 0.1\nset = { DI2 = true }\n'


def test_steps_run_it_with_the_motion_it_comes_in() -> None:
    text = "MJ P1 F60\nON DI1 SUB LOST\nML P2 F100 R20\nML P3\n"
    for done in finished(text + LOST, scenario=at(0.7, DI1=True), step=True):
        assert [action for action, _ in interrupts(done)] == ["triggered", "begun", "returned"]


def test_a_variable_interrupts_and_the_subroutine_may_write_others() -> None:
    text = "MJ P1 F60\nON $alarm > 2 OR NOT $ready SUB A\nML P2 F100\nWAIT 1\nEND\nA:\nINC $count\nEND\n"
    where = place("[variables]\nalarm = 0\ncount = 0\nready = true\n")
    scenario = '[[at]]\nt_s = 0.6\nset = { "$alarm" = 3 }\n[[at]]\nt_s = 1.0\nset = { "$alarm" = 2.5 }\n'
    for done in everywhere(text, where, scenario=scenario):
        assert [action for action, _ in interrupts(done, "A")] == ["triggered", "begun", "returned"]
        assert interrupts(done, "A")[0] == ("triggered", tick(0.6))
        assert [e.data["value"] for e in done.events("output")] == [1.0]


@pytest.mark.parametrize("command", ["halt", "override 0", "override -1"])
def test_what_turns_true_while_the_robot_is_held_or_goes_back_is_kept(command: str) -> None:
    """It runs when the robot goes on, forward, where the program was left."""
    text = "MJ P1 F60\nON DI1 SUB A\nML P2 F100\nML P3\nEND\nA:\nSET DO1\nEND\n"
    program = compile_text(text, cell=place())
    for window in (1, 50):
        session = Session(place(), program, window=window)
        windows = session.run()
        _until(session, windows, 150)
        if command == "halt":
            session.halt()
        else:
            session.set_override(float(command.split()[1]))
        _until(session, windows, 200)
        session.set_input("DI1", True)
        _until(session, windows, 215)
        session.set_input("DI1", False)
        _until(session, windows, 300)
        told = [e for e in session.events if e.kind == "interrupt"]
        assert [(e.data["action"], e.tick) for e in told] == [("triggered", 201)]
        if command == "halt":
            session.resume()
        else:
            session.set_override(1.0)
        for _ in session.run():
            pass
        assert session.status.value == "finished", session.failure
        _, begun, back = (e for e in session.events if e.kind == "interrupt")
        assert begun.tick == back.tick >= 300
        assert begun.data["s_mm"] >= told[0].data["s_mm"], "not before the program's own place"


def _until(session: Session, windows: Iterator[Any], last: int) -> None:
    """Let ticks pass up to one of them; time goes on where the robot stands."""
    while session.kernel.tick < last:
        session.set_window(min(50, last - session.kernel.tick))
        next(windows)


def test_a_filter_and_corrections_are_as_they_were() -> None:
    text = "MJ P1 F60\nON DI1 SUB LOST\nML P2 F200 R20\nML P3 R20\nML P4\n" + LOST
    filtered = place("filter = { ticks = 8 }\n")
    for done in everywhere(text, filtered, scenario=at(0.7, DI1=True)):
        ((begun, back),) = spans(done)
        assert np.abs(done.joints[begun] - done.joints[back]).max() < BACK
        assert done.status == "finished"
    moved = '[[correction]]\nframe = "base"\nx_mm = [[0.2, 0], [1, 3]]\nmax_rate_mm_s = 20\n'
    for done in everywhere(text, scenario=at(0.7, DI1=True) + moved):
        assert done.status == "finished"
        ((begun, back),) = spans(done)
        plain = run(text, place(), scenario=moved, override=float(done.column("override")[5]))
        assert np.abs(done.joints[-1] - plain.joints[-1]).max() < 1e-6
