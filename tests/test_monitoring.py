"""The monitor of a tick: what it shows is what the windows and the kernel say."""

from __future__ import annotations

import numpy as np
import pytest

import viapoint as via
from session_runs import cell
from viapoint.runtime.kernel import State
from viapoint.runtime.kernel.states import Mode

PROGRAM = "T 1\nMJ P1 F60\nSET DO1\nML P2 F200 Z0 R20\nML P3\nWAIT 0.2\nML P9\n"


def test_it_agrees_with_the_windows_all_along_a_run() -> None:
    session = via.Session(cell(), via.compile_text(PROGRAM.replace("P9", "P4"), cell=cell()), window=64)
    done, states = [], set()
    for window in session.run():
        seen = via.monitor(session, window)
        states.add(seen.state)
        assert (seen.tick, seen.line) == (session.kernel.tick, window.line[-1])
        np.testing.assert_array_equal(seen.joints, window.joints[-1])
        np.testing.assert_allclose(session.cell.robot.motors_to_joints(seen.motors), seen.joints, atol=1e-12)
        if seen.joint_speeds is not None:
            assert np.all(np.abs(seen.joint_speeds) <= session.cell.robot.limits.speed * (1.0 + 1e-9))
        if len(window) > 1:
            np.testing.assert_array_equal(seen.auxiliary_speeds, np.zeros(0))
        if seen.block_length is not None:
            assert -1e-9 <= seen.block_done <= seen.block_length + 1e-9
            done.append((seen.line, seen.block_done))
        assert seen.mode is (Mode.OVER if session.kernel.over else Mode.RUNNING)
    assert {State.MOVING, State.DWELLING, State.FINISHED} <= states
    blocks = {event.line: event.data["length_mm"] for event in session.events if event.kind == "block"}
    for line, part in done:
        assert part * 1e3 <= float(blocks.get(line) or np.inf) + 1e-6
    assert (seen.tool, seen.signals["DO1"], seen.failure) == (1, True, None)


def test_it_shows_why_a_run_failed() -> None:
    session = via.Session(cell(), via.compile_text("MJ P1 F60\nML X=9000\n", cell=cell()))
    seen = None
    for window in session.run():
        seen = via.monitor(session, window)
    assert seen is not None
    assert (seen.state, seen.mode) == (State.FAILED, Mode.OVER)
    assert seen.failure is not None
    assert seen.failure.code == "E302"
    assert seen.target is None or seen.line == 2


def test_a_window_of_one_tick_has_no_speeds() -> None:
    session = via.Session(cell(), via.compile_text("MJ P1 F60\n", cell=cell()), window=1)
    seen = via.monitor(session, next(session.run()))
    assert seen.joint_speeds is None
    assert seen.tick == 0
    with pytest.raises(AttributeError):
        seen.tick = 1  # type: ignore[misc]
