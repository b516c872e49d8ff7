"""Override, halt, resume, emergency stop and going back: at any tick, on the path, within the limits."""

from __future__ import annotations

import numpy as np
import pytest
from command_runs import CommandRun

from viapoint.runtime.cell import default_cell
from viapoint.runtime.kernel import State
from viapoint.runtime.kernel.axispath import AxisPath
from viapoint.runtime.records import Floats
from viapoint.session import Session, Status, compile_text

PROGRAM = """\
MJ X=1500 Y=0 Z=1800 A=0 B=90 C=0 F60
ML X=1500 Y=300 R40 F400
SET DO1
ML X=1300 Y=300 R40
ML X=1300 Y=0
"""


@pytest.mark.parametrize("seed", range(24))
def test_random_commands(seed: int) -> None:
    run = CommandRun(seed)
    wrong = run.check()
    assert not wrong, f"seed {seed}: {wrong}\n{run.describe()}"


def test_no_trial_law_crawls(monkeypatch: pytest.MonkeyPatch) -> None:
    looked_at = []
    values = AxisPath.values

    def counted(path: AxisPath, s: Floats) -> Floats:
        looked_at.append(len(s))
        return values(path, s)

    monkeypatch.setattr(AxisPath, "values", counted)
    CommandRun(16).disturbed()  # an override is lowered where no law slows down at once
    assert looked_at
    assert max(looked_at) < 50_000


def session_at(tick: int) -> Session:
    cell = default_cell()
    session = Session(cell, compile_text(PROGRAM, cell=cell), window=10)
    for _ in session.run():
        if session.kernel.tick >= tick:
            break
    return session


def until(session: Session, state: State) -> int:
    """Ticks until the kernel is in `state`."""
    start = session.kernel.tick
    for _ in session.run():
        if session.kernel.state is state:
            break
    assert session.kernel.state is state
    return session.kernel.tick - start


def test_a_halt_stands_on_the_path_and_goes_on() -> None:
    session = session_at(2000)
    session.halt()
    assert until(session, State.HALTED) < 300
    where = session.kernel.mover.s
    for _, window in zip(range(20), session.run(), strict=False):
        assert np.ptp(window.joints, axis=0).max() == 0.0
    assert session.kernel.mover.s == where
    session.resume()
    assert session.finish() is Status.FINISHED


def test_an_emergency_stop_is_quicker_and_latched() -> None:
    usual, quick = session_at(2000), session_at(2000)
    usual.halt()
    quick.emergency_stop()
    assert until(quick, State.EMERGENCY) < until(usual, State.HALTED)
    quick.resume()
    assert quick.kernel.state is State.EMERGENCY
    quick.reset()
    quick.resume()
    assert quick.finish() is Status.FINISHED


def test_a_stop_ends_the_run_on_the_path() -> None:
    session = session_at(2000)
    session.stop()
    assert session.finish() is Status.STOPPED
    assert np.isfinite(session.kernel.telemetry.joints).all()


def test_override_scales_the_speed_and_says_so() -> None:
    session = session_at(2200)
    session.set_override(0.25)
    speeds = [window.speed for window in session.run()]
    assert np.concatenate(speeds)[400:].max() <= 0.25 * 0.4 + 1e-9
    assert [e.data["value"] for e in session.events if e.kind == "override"] == [0.25]


def test_going_back_writes_nothing_again() -> None:
    session = session_at(3000)
    assert [e.line for e in session.events if e.kind == "output"] == [3]
    session.set_override(-1.0)
    until(session, State.HALTED)
    assert session.kernel.mover.s == 0.0
    session.set_override(1.0)
    assert session.finish() is Status.FINISHED
    assert [e.line for e in session.events if e.kind == "output"] == [3]
    assert [e.line for e in session.events if e.kind == "block"] == [1, 2, 4, 5]


@pytest.mark.parametrize("override", [-1.01, 1.01, float("nan")])
def test_an_impossible_override_is_refused(override: float) -> None:
    session = session_at(10)
    with pytest.raises(ValueError, match="override"):
        session.set_override(override)
