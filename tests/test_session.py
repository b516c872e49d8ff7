"""Sessions: their own state, their arguments, inputs from outside, leaving and going on, stepping."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from session_runs import Run, at, cell, run
from viapoint.runtime.kernel import State
from viapoint.runtime.records import Event, Window
from viapoint.runtime.signals import parse_scenario
from viapoint.session import CompileError, Session, Status, compile_text

PROGRAM = "MJ P1 F90\nML Y=-200 F500 R30\nSET DO1\nML X=1600\nWAIT DI 1\nML P1\nM 2\nSET DO2\n"
SCENARIO = at(3.0, DI1=True) + "[[when]]\nm = 2\nafter_s = 0.1\nreset_m = 2\n"


def session(text: str = PROGRAM, scenario: str | None = SCENARIO, **options: Any) -> Session:
    happenings = None if scenario is None else parse_scenario(scenario, cell())
    return Session(cell(), compile_text(text, cell=cell()), scenario=happenings, **options)


def collect(each: Session) -> Run:
    return Run(each, tuple(each.run()))


def test_two_sessions_share_nothing() -> None:
    """Interleaved window by window, on one cell and one compiled program, they run as if alone."""
    alone, other = collect(session()), collect(session("MJ P7 F90\nT 1\nML X=1500 F300\nSET DO3\n", None))
    a, b = session(), session("MJ P7 F90\nT 1\nML X=1500 F300\nSET DO3\n", None)
    windows: tuple[list[Window], list[Window]] = ([], [])
    iterators = a.run(), b.run()
    while sum(append(windows[k], iterators[k]) for k in (0, 1)):
        pass
    for done, reference in ((Run(a, tuple(windows[0])), alone), (Run(b, tuple(windows[1])), other)):
        assert done.history == reference.history
        assert np.array_equal(done.joints, reference.joints)


def append(windows: list[Window], iterator: Any) -> bool:
    window = next(iterator, None)
    if window is not None:
        windows.append(window)
    return window is not None


def test_one_compiled_program_can_be_run_again_and_again() -> None:
    loaded = compile_text(PROGRAM, cell=cell())
    runs = [collect(Session(cell(), loaded, scenario=parse_scenario(SCENARIO, cell()))) for _ in range(2)]
    assert runs[0].history == runs[1].history
    assert np.array_equal(runs[0].joints, runs[1].joints)


def test_a_run_may_be_left_and_taken_up_again() -> None:
    whole, parts = collect(session()), session(window=40)
    windows: list[Window] = []
    while parts.status is Status.RUNNING:
        for k, window in enumerate(parts.run()):
            windows.append(window)
            if k == 2:
                break
    assert np.abs(np.concatenate([w.joints for w in windows]) - whole.joints).max() < 1e-9
    assert parts.status is Status.FINISHED
    assert list(parts.run()) == []


def test_listeners_hear_everything_once_and_in_order() -> None:
    class Ear:
        def __init__(self) -> None:
            self.windows: list[Window] = []
            self.events: list[Event] = []

        def window(self, window: Window) -> None:
            self.windows.append(window)

        def event(self, event: Event) -> None:
            self.events.append(event)

    ear = Ear()
    each = session(listeners=[ear])
    done = collect(each)
    assert ear.events == each.events
    assert [w.first_tick for w in ear.windows] == [w.first_tick for w in done.windows]


def test_a_run_without_end_keeps_what_it_is_told_to() -> None:
    places = ((1500, 0), (1600, 0), (1600, 100), (1500, 100))
    text = "".join(["MJ P1 F90\nLOOP:\n", *(f"ML X={x} Y={y} F900 R20\n" for x, y in places), "GOTO LOOP\n"])
    each = session(text, None, keep=3, window=50, max_time=12.0)
    heard = 0
    for window in each.run():
        heard += len(window)
        assert len(each.events) <= 3 + 10
        assert len(each.corners) <= 3 + 10
    assert each.status is Status.STOPPED
    assert heard == 12_001
    whole = session(text, None, window=50, max_time=12.0)
    whole.finish()
    assert len(whole.events) > 20
    assert each.events == whole.events[-len(each.events) :]


def test_an_input_set_from_outside_is_waited_for_patiently() -> None:
    each = session("MJ P1 F90\nWAIT DI 1\nSET DO1\n", None, window=100, patient=True)
    for window in each.run():
        if window.first_tick > 6000:
            each.set_input("DI1", True)
            break
    set_at = each.kernel.tick
    assert each.finish() is Status.FINISHED
    assert [e.tick for e in each.events if e.kind == "output"] == [set_at + 1]


def test_an_input_set_before_the_start_is_seen() -> None:
    each = session("WAIT 0.002\nIF DI1\nSET DO1\nENDIF\n", None)
    each.set_input("DI1", True)
    assert each.finish() is Status.FINISHED
    assert [e.data["signal"] for e in each.events if e.kind == "output"] == ["DO1"]


@pytest.mark.parametrize(("name", "error"), [("DI99", KeyError), ("XY1", KeyError), ("DO1", ValueError)])
def test_only_inputs_can_be_set(name: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        session().set_input(name, True)


@pytest.mark.parametrize(
    "options",
    [
        {"override": 0.0},
        {"override": -0.5},
        {"override": 1.01},
        {"override": math.nan},
        {"window": 0},
        {"window": -1},
        {"max_time": math.nan},
        {"max_time": math.inf},
        {"max_time": -1.0},
        {"keep": 0},
    ],
)
def test_arguments_that_make_no_run_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"override|window|run|keep"):
        session(**options)


@pytest.mark.parametrize("seconds", [0.0, 0.0005, 0.5, 1.2345, 3.0])
def test_max_time_is_exact(seconds: float) -> None:
    each = session(max_time=seconds, window=64)
    done = collect(each)
    assert done.status == "stopped"
    assert each.kernel.tick == round(seconds * 1000)
    assert len(done.joints) == each.kernel.tick + 1


def test_max_time_beyond_the_end_changes_nothing() -> None:
    assert collect(session(max_time=100.0)).history == collect(session()).history


@pytest.mark.parametrize("cycles", [1, 3])
def test_cycles_count_the_passes_of_the_main_loop(cycles: int) -> None:
    done = run("L: MJ J1=2 F90\nMJ J1=0\nSET DO1\nGOTO L\n", cycles=cycles)
    assert done.status == "stopped"
    assert len(done.events("output")) == cycles


def test_cycles_do_not_cut_a_program_that_ends() -> None:
    assert run("MJ J1=2 F90\nL: MJ J2=2\nMJ J2=0\nGOTO L 5\n", cycles=1).status == "finished"


def test_stepping_stops_after_every_motion() -> None:
    each = session("MJ P1 F90\nML Y=-250 F500 R30\nSET DO1\nML X=1550\n", None, step=True)
    lines = []
    while each.status is Status.RUNNING:
        for window in each.step()[-1:]:
            assert window.speed[-1] < 1e-3
        lines += [e.line for e in each.events if e.kind == "block"][len(lines) :]
    assert lines == [1, 2, 4]
    assert each.status is Status.FINISHED


def test_a_program_that_does_not_compile_says_everything_that_is_wrong() -> None:
    with pytest.raises(CompileError) as refused:
        compile_text("ML P99\nGOTO NOWHERE\nMJ J9=3\n", cell=cell())
    assert {d.code for d in refused.value.diagnostics if d.is_error} >= {"E201", "E220"}, (
        refused.value.diagnostics
    )


def test_a_step_goes_on_with_the_motion_that_was_halted() -> None:
    """Also in a chain that would be rounded. An override of 0 and an emergency stop end it early."""
    stepped = session("MJ P1 F90\nML Y=0 F500 R30\nML X=1550 R30\nML Y=-300\n", None, step=True, window=10)
    stepped.step()
    for window in stepped.run():
        if window.speed[-1] > 0.2:
            break
    stepped.halt()
    for _ in stepped.run():
        if stepped.kernel.state is State.HALTED:
            break
    middle = stepped.kernel.mover.s
    stepped.step()
    assert [e.line for e in stepped.events if e.kind == "block"] == [1, 2]
    assert stepped.kernel.mover.s > middle
    stepped.emergency_stop()
    stepped.step()
    assert stepped.kernel.state is State.EMERGENCY
    stepped.reset()
    stepped.step()
    assert [e.line for e in stepped.events if e.kind == "block"] == [1, 2, 3]
    stepped.set_override(0.0)
    stepped.step()
    assert stepped.kernel.state is State.HALTED
    stepped.set_override(1.0)
    assert stepped.finish() is Status.FINISHED


@pytest.mark.parametrize("command", ["stop", "emergency_stop", "halt"])
def test_commands_before_the_run_are_heeded_when_it_begins(command: str) -> None:
    session = Session(cell(), compile_text("ML P1\nML P2\n", cell=cell()))
    getattr(session, command)()
    for window in session.run():
        if window.first_tick > 10:
            break
    assert session.kernel.tick == 0 or session.kernel.state in (State.HALTED, State.EMERGENCY)
    assert (session.status is Status.STOPPED) is (command == "stop")
    np.testing.assert_array_equal(session.kernel.telemetry.joints, cell().home)
    session.reset()
    session.resume()
    assert (session.finish() is Status.FINISHED) is (command != "stop")


START = "MJ X=1500 Y=0 Z=1800 A=0 B=90 C=0 F60\n"
ANSWERED = {
    "interrupt": "ON DI2 SUB H\nML Y=100 F200\nSET DO1\nML Y=-300\nEND\nH:\nML Z=1850\nEND\n",
    "search": "ML Y=100 F200 R20\nSET DO1\nML Y=-300 UNTIL DI2\nSET DO2\n",
    "wait": "SET DO1\nWAIT DI2\nSET DO2\n",
}


@pytest.mark.parametrize("what", ANSWERED)
def test_a_listener_answers_in_the_next_tick_whatever_the_window(what: str) -> None:
    class Answering:
        session: Session

        def window(self, window: Window) -> None:
            pass

        def event(self, event: Event) -> None:
            if event.data.get("signal") == "DO1":
                self.session.set_input("DI2", True)

    told = []
    for window in (1, 1024):
        answering = Answering()
        answering.session = each = session(START + ANSWERED[what], None, window=window, listeners=[answering])
        assert each.finish() is Status.FINISHED
        told.append([(e.tick, e.kind, e.line, e.data.get("value")) for e in each.events])
        asked = next(e.tick for e in each.events if e.data.get("signal") == "DO1")
        seen = next(e.tick for e in each.events if e.data.get("signal") == "DI2" and e.data["value"])
        assert seen == asked + 1
    assert told[0] == told[1]
