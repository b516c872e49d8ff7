"""Actions at places of a motion, pulses and levels: the tick is that of the path, at any override."""

from __future__ import annotations

import numpy as np
import pytest

from session_runs import Run, at, cell, run
from viapoint.session import Session, compile_text

ROUNDING = 1e-6
"""mm; a place may be rounded by so much."""

LINES = "MJ P1 F90\nML P2 F400 R60\n{actions}ML P3 R50\nML P4\n"
ARC = "MJ P1 F90\nML P3 F300 R40\n{actions}MC P1 QX=1450 QY=0 QZ=1500 R30\nML P4\n"
JOINTS = "MJ P1 F90\nMJ P7 R20\n{actions}MJ P2 R10\nMJ P6\n"
SPLINE = "MJ P1 F90\nMS P2 F300\n{actions}MS P3\nMS P4\n"


def acted(done: Run, line: int) -> int:
    """Tick of the one action of a line."""
    (event,) = [e for e in done.session.events if e.kind in ("output", "m") and e.line == line]
    return event.tick


def block(done: Run, line: int) -> tuple[float, float]:
    """Where the motion of a line begins and how long it is, mm of TCP path."""
    (event,) = done.events("block", line)
    return event.data["s0_mm"], event.data["length_mm"]


def passes(done: Run, s_mm: float) -> int:
    """The first tick in which the TCP has travelled so far."""
    return int(np.searchsorted(done.column("s") * 1e3, s_mm - ROUNDING))


@pytest.mark.parametrize("text", [LINES, ARC, JOINTS, SPLINE])
@pytest.mark.parametrize("override", [1.0, 0.37])
def test_places_in_mm_and_percent_are_passed_in_their_tick(text: str, override: float) -> None:
    actions = (
        "AT D-20 RESET DO1\nAT D20 SET DO1\nAT 50% SET AO2 = 2.5\nAT D0 M5\nAT 100% SET DO3\nAT D-0 SET DO4\n"
    )
    done = run(text.format(actions=actions), override=override)
    assert done.status == "finished", done.session.failure
    start, length = block(done, 9)
    places = {3: length - 20, 4: 20, 5: length / 2, 6: 0, 7: length, 8: length}
    assert {line: acted(done, line) for line in places} == {
        line: passes(done, start + place) for line, place in places.items()
    }
    plain = run(text.format(actions=""), override=override)
    assert np.array_equal(done.joints, plain.joints)


@pytest.mark.parametrize("override", [1.0, 0.37, 0.05])
@pytest.mark.parametrize("seconds", [0.1, 0.0, 0.033])
def test_seconds_before_the_end_are_those_of_the_law(override: float, seconds: float) -> None:
    done = run(LINES.format(actions=f"AT S-{seconds} SET DO1\n"), override=override)
    end = done.events("block", 4)[0].data["t_end"]
    early = end - seconds / override - acted(done, 3) * 1e-3
    assert -1e-3 - 1e-9 <= early <= 1e-9 + 1e-3


@pytest.mark.parametrize("lookahead", [1, 2, 3, 5, 8, 1024])
def test_a_short_motion_buffer_delays_no_action(lookahead: int) -> None:
    where = cell(controller=f"lookahead = {lookahead}")
    done = run(LINES.format(actions="AT D-200 SET DO1\nAT 30% RESET DO1\nAT D5 SET DO2\n"), where)
    start, length = block(done, 6)
    places = {3: length - 200, 4: 0.3 * length, 5: 5}
    assert {line: acted(done, line) for line in places} == {
        line: passes(done, start + place) for line, place in places.items()
    }


@pytest.mark.parametrize("override", [1.0, 0.37])
def test_windows_change_nothing(override: float) -> None:
    actions = "AT D-20 PULSE DO1 0.05\nAT S-0.2 SET DO2\nAT 25% PULSE DO3 0.4\nAT D20 SET AO1 = -1\n"
    text = f"{LINES.format(actions=actions)}PULSE DO5 0.7\nIF AHEAD DI1\nML P1\nENDIF\nML P2\n"
    histories = [run(text, override=override, window=window).history for window in (1, 7, 1024)]
    assert histories[0] == histories[1] == histories[2]


def test_an_action_before_its_motion_stops_the_robot_in_the_same_tick_whatever_the_window() -> None:
    runs = [run(LINES.format(actions="AT S-5 SET DO1\n"), window=window) for window in (1, 9, 1024)]
    assert {(done.code, done.failed_line, done.session.kernel.tick) for done in runs} == {
        ("E405", 3, runs[0].session.kernel.tick)
    }
    assert runs[0].column("speed")[-1] < 1e-5
    assert not runs[0].over_limits()


def test_a_motion_that_only_turns_has_percent() -> None:
    done = run("MJ P1 F90\nAT 50% SET DO1\nML C=40 F30\n")
    (turn,) = done.events("block", 3)
    middle = 0.5 * (turn.t + turn.data["t_end"])
    assert acted(done, 2) * 1e-3 == pytest.approx(middle, abs=2e-3)


def test_actions_of_motions_without_length_happen_where_they_are() -> None:
    done = run("MJ P1 F90\nAT D0 SET DO1\nAT 100% SET DO2\nAT S-0 SET DO3\nML P1\nML P2 F300\n")
    assert [acted(done, line) for line in (2, 3, 4)] == [done.end_of(1)] * 3


@pytest.mark.parametrize(
    ("actions", "code", "line"),
    [
        ("AT D601 SET DO1\n", "E321", 3),
        ("AT D-299.9 SET DO1\nAT D-300.1 RESET DO1\n", "E321", 4),
        ("AT S-5 SET DO1\n", "E405", 3),
        ("AT D5 SET DO99\n", "E314", 3),
        ("AT D5 SET AO99 = 1\n", "E314", 3),
    ],
)
def test_a_place_outside_the_motion_is_an_error(actions: str, code: str, line: int) -> None:
    session = Session(cell(), compile_text(LINES.format(actions=actions)))  # compiled without the cell
    session.finish()
    failure = session.failure
    assert failure is not None
    assert (failure.code, failure.line) == (code, line)
    assert not [e for e in session.events if e.kind == "output" and e.line == line]


def test_a_place_on_the_line_but_not_on_the_rounded_path_is_an_error() -> None:
    done = run(LINES.format(actions="AT D295 SET DO1\n"))
    assert (done.code, done.failed_line) == ("E321", 3)
    assert done.column("speed")[-1] < 1e-5


def test_an_action_is_not_repeated_on_the_way_back_and_forth() -> None:
    where = cell()
    text = LINES.format(actions="AT 50% PULSE DO1 0.05\n")
    session = Session(where, compile_text(text, cell=where), window=5)
    turned = False
    for window in session.run():
        outputs = [e for e in session.events if e.kind == "output"]
        if outputs and not turned and window.time[-1] > outputs[0].t + 0.1:
            turned = True
            session.set_override(-0.5)
            back = window.time[-1] + 1.0
        elif turned and window.time[-1] > back:
            session.set_override(1.0)
            back = np.inf
    assert session.status.value == "finished"
    assert [e.data["value"] for e in session.events if e.kind == "output"] == [True, False]


# --- pulses -----------------------------------------------------------------------------------------


def edges(done: Run, signal: str) -> list[tuple[int, bool, int]]:
    return [
        (e.tick, bool(e.data["value"]), e.line) for e in done.events("output") if e.data["signal"] == signal
    ]


@pytest.mark.parametrize("override", [1.0, 0.37])
def test_a_pulse_ends_after_its_time_whatever_the_path_does(override: float) -> None:
    done = run("MJ P1 F90\nPULSE DO1 0.25\nML P2 F300\nPULSE DO2 5\n", override=override)
    begin, end = edges(done, "DO1")
    assert begin == (done.end_of(1), True, 2)
    assert end == (begin[0] + 250, False, 2)
    assert done.session.kernel.tick == done.end_of(3) + 5000


def test_a_pulse_gives_way_to_what_comes_after_it() -> None:
    done = run("PULSE DO1 0.5\nWAIT 0.1\nPULSE DO1 0.5\nWAIT 0.1\nRESET DO1\nWAIT 1\n")
    assert edges(done, "DO1") == [(0, True, 1), (100, True, 3), (200, False, 5)]


def test_a_pulse_is_seen_and_answered() -> None:
    scenario = '[[when]]\nsignal = "DO1"\nbecomes = false\nafter_s = 0.1\nset = { DI1 = true }\n'
    done = run("PULSE DO1 0.2\nWAIT DI1\n", scenario=scenario)
    assert done.events("wait")[0].data["t_end"] == pytest.approx(0.3)


def test_levels_are_written_and_read() -> None:
    scenario = "[[at]]\nt_s = 1.0\nset = { AI1 = 3.5 }\n"
    text = "SET AO1 = 2.5\nWAIT AI1 > 3 AND AO1 = 2.5 TIMEOUT 5\nSET AO2 = -1\n"
    done = run(text, scenario=scenario)
    assert [(e.data["signal"], e.data["value"]) for e in done.events("output")] == [
        ("AO1", 2.5),
        ("AO2", -1.0),
    ]
    reads = [(e.tick, e.data["signal"], e.data["value"]) for e in done.events("input_read")]
    assert reads == [(0, "AI1", 0.0), (0, "AO1", 0.0), (1000, "AI1", 3.5), (1000, "AO1", 2.5)]


# --- waits ------------------------------------------------------------------------------------------


def test_a_wait_for_a_condition_ends_in_the_tick_in_which_it_comes_true() -> None:
    scenario = at(0.5, DI1=True) + at(0.7, DI1=False, DI2=True) + at(1.25, DI1=True)
    done = run("WAIT DI1 AND DI2\nML P5 F300\n", cell(points=P5), scenario=scenario)
    (wait,) = done.events("wait")
    assert (wait.tick, wait.data["t_end"]) == (0, pytest.approx(1.25))
    assert "timed_out" not in wait.data


P5 = "P5 = { x = 1650, y = 0, z = 1800, a = 0, b = 90, c = 0 }"


@pytest.mark.parametrize("window", [1, 64, 1024])
def test_a_timeout_ends_a_wait_and_says_so(window: int) -> None:
    text = "WAIT DI1 TIMEOUT 0.5 GOTO LATE\nSET DO1\nEND\nLATE:\nSET DO2\n"
    for when, line in ((0.499, 2), (0.5, 2), (0.501, 5)):
        done = run(text, scenario=at(when, DI1=True), window=window)
        (output,) = done.events("output")
        assert (output.line, output.tick) == (line, min(round(when * 1000), 500))
        assert [e.data.get("timed_out") for e in done.events("wait")] == [True if line == 5 else None]


def test_a_wait_that_nothing_can_end_is_an_error_and_one_with_a_limit_is_none() -> None:
    assert run("WAIT DI1 OR DI2\n", scenario=at(1.0, DI3=True)).code == "E410"
    assert run("WAIT DI1 OR DI2\n", scenario=at(1.0, DI2=True)).status == "finished"
    assert run("WAIT DI1 OR DI2 TIMEOUT 2\n").status == "finished"


# --- ahead ------------------------------------------------------------------------------------------


def test_what_is_read_ahead_stops_nothing() -> None:
    read = run(
        "MJ P1 F90\nML P2 F300 R30\nIF AHEAD DI1\nML P4\nELSE\nML P3\nENDIF\n", scenario=at(0.2, DI1=True)
    )
    plain = run("MJ P1 F90\nML P2 F300 R30\nML P3\n")
    assert np.array_equal(read.joints, plain.joints)
    (event,) = read.events("input_read")
    assert (event.tick, event.data["value"], event.data["ahead"], event.data["s_mm"]) == (0, False, True, 0.0)


def test_a_full_buffer_reads_when_a_motion_is_finished() -> None:
    text = "LOOP:\nMJ P1 F90\nML P2 F300\nIF AHEAD DI1\nEND\nENDIF\nML P1\nGOTO LOOP\n"
    histories = []
    for window in (1, 13, 1024):
        done = run(text, cell(controller="lookahead = 3"), scenario=at(6.0, DI1=True), window=window)
        assert done.status == "finished"
        histories.append(done.history)
    reads = [tick for tick, _, kind, _ in histories[0] if kind == "input_read"]
    ends = {round(data["t_end"] * 1000) for _, _, kind, data in histories[0] if kind == "block"}
    assert len(reads) > 2
    assert set(reads[1:]) <= ends
    assert histories[0] == histories[1] == histories[2]


def test_sync_waits_for_the_path() -> None:
    done = run("MJ P1 F90\nSYNC\nIF AHEAD DI1\nML P2\nENDIF\n", scenario=at(0.2, DI1=True))
    (event,) = done.events("input_read")
    assert (event.tick, event.data["value"]) == (done.end_of(1), True)
