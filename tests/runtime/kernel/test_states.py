"""Which commands a kernel takes when: one table, and a refused command says why and changes nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from session_runs import cell
from viapoint.interactive import Interactive
from viapoint.jogging import HeldJog, JogSpace
from viapoint.runtime.kernel import State
from viapoint.runtime.kernel.states import REFUSALS, Command, Hold, Mode
from viapoint.session import Session, Status, compile_text

PROGRAM = "MJ P1 F60\nML P2 F200\nML P3\n"

ISSUED: dict[Command, Callable[[Session], str | None]] = {
    Command.HALT: Session.halt,
    Command.RESUME: Session.resume,
    Command.STOP: Session.stop,
    Command.EMERGENCY_STOP: Session.emergency_stop,
    Command.RESET: Session.reset,
    Command.OVERRIDE: lambda session: session.set_override(0.5),
    Command.STEP: lambda session: session.kernel.step(),
    Command.STEP_BACK: lambda session: session.kernel.step_back(),
    Command.JOG: lambda session: session.hold(HeldJog("J1", 1, JogSpace.JOINT)),
    Command.LET_GO: Session.let_go,
    Command.REFERENCE: lambda session: session.reference({"J1": 5.0}),
}


def moving() -> tuple[Session, Iterator[object]]:
    session = Session(cell(), compile_text(PROGRAM, cell=cell()), window=20)
    windows = session.run()
    while session.kernel.tick < 200:
        next(windows)
    return session, windows


def until(session: Session, windows: Iterator[object], state: State) -> Session:
    while session.kernel.state is not state:
        next(windows)
    return session


def between(text: str, state: State) -> Interactive:
    session = Interactive(cell())
    session.take_on(compile_text(text, cell=cell()))
    session.finish()
    assert session.kernel.state is state
    return session


def in_mode(mode: Mode) -> Session:
    """A session brought into a mode by commands."""
    if mode is Mode.FINISHED:
        return between(PROGRAM, State.FINISHED)
    if mode is Mode.BROKEN_OFF:
        return between("ML X=99999 F10\n", State.FAILED)
    if mode is Mode.READY:
        return Session(cell(), compile_text(PROGRAM, cell=cell()))
    if mode is Mode.JOGGING:
        session = Interactive(cell())
        assert session.hold(HeldJog("J1", -1, JogSpace.JOINT)) is None
        session.advance(50)
        return session
    session, windows = moving()
    match mode:
        case Mode.HELD:
            session.set_override(0.0)
            return until(session, windows, State.HALTED)
        case Mode.HALTING:
            assert session.halt() is None
        case Mode.HALTED:
            assert session.halt() is None
            return until(session, windows, State.HALTED)
        case Mode.STOPPING:
            assert session.stop() is None
        case Mode.BRAKING:
            assert session.emergency_stop() is None
        case Mode.LATCHED:
            assert session.emergency_stop() is None
            return until(session, windows, State.EMERGENCY)
        case Mode.OVER:
            assert session.stop() is None
            return until(session, windows, State.STOPPED)
    return session


def test_the_table_covers_every_mode() -> None:
    assert set(REFUSALS) == set(Mode)
    found = {Mode.of(s, hold, goes_on=goes_on) for s in State for hold in Hold for goes_on in (False, True)}
    assert found == set(Mode)


@pytest.mark.parametrize("mode", Mode)
@pytest.mark.parametrize("command", Command)
def test_a_command_is_taken_or_refused_as_the_table_says(mode: Mode, command: Command) -> None:
    session = in_mode(mode)
    assert session.kernel.mode is mode
    expected = REFUSALS[mode].get(command)
    assert session.refusal(command) == expected
    before = (session.kernel.state, session.kernel.held, session.kernel.override, len(session.events))
    assert ISSUED[command](session) == expected
    if expected is not None:
        after = (session.kernel.state, session.kernel.held, session.kernel.override, len(session.events))
        assert after == before


def test_what_is_refused_does_not_change_the_run() -> None:
    """Halt and resume, with everything that is refused on the way, against halt and resume alone."""
    runs = []
    for pester in (False, True):
        session, windows = moving()
        session.halt()
        until(session, windows, State.HALTED)
        if pester:
            assert session.reset() == "there is no emergency stop"
            assert session.halt() == "it is halted already"
        assert session.resume() is None
        if pester:
            assert session.resume() == "nothing is halted"
        session.finish()
        runs.append((session.kernel.tick, session.kernel.telemetry.joints))
    assert runs[0][0] == runs[1][0]
    np.testing.assert_array_equal(runs[0][1], runs[1][1])


def test_a_step_does_not_get_round_an_emergency_stop() -> None:
    session = in_mode(Mode.LATCHED)
    before = session.kernel.telemetry.joints.copy()
    assert session.kernel.step() == "the robot is in emergency stop: reset it first"
    assert session.kernel.step_back() == "the robot is in emergency stop: reset it first"
    session.advance(200)
    assert session.kernel.state is State.EMERGENCY
    np.testing.assert_array_equal(session.kernel.telemetry.joints, before)


def test_an_override_between_programs_is_that_of_the_next() -> None:
    session = Interactive(cell())
    assert session.set_override(0.5) is None
    session.take_on(compile_text(PROGRAM, cell=cell()))
    overrides = {float(window.override[-1]) for window in session.run()}
    assert overrides == {0.5}


@pytest.mark.parametrize("override", [0.0, -0.5])
def test_an_override_that_lets_nothing_go_on_outlasts_an_error(override: float) -> None:
    session = between("ML X=99999 F10\n", State.FAILED)
    before = session.kernel.telemetry.joints.copy()
    assert session.set_override(override) is None
    session.take_on(compile_text(PROGRAM, cell=cell()))
    list(session.run())
    assert (session.kernel.state, session.kernel.override) == (State.HALTED, override)
    np.testing.assert_array_equal(session.kernel.telemetry.joints, before)
    assert session.set_override(1.0) is None
    assert session.finish() is Status.FINISHED


def test_an_emergency_stop_is_reset_then_resumed() -> None:
    session = in_mode(Mode.LATCHED)
    assert session.resume() == "the robot is in emergency stop: reset it first"
    assert session.reset() is None
    assert session.resume() is None
    session.finish()
    assert session.kernel.state is State.FINISHED
