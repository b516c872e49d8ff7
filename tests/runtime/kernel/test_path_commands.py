"""Override, halt, resume, emergency stop and going back: at any tick, on the path, within the limits."""

from __future__ import annotations

import numpy as np
import pytest
from command_runs import CommandRun
from path_oracle import PathOracle

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


@pytest.mark.parametrize("seed", range(40))
def test_random_commands(seed: int) -> None:
    """On the path of the undisturbed run, within the limits, to the same end with the same events."""
    run = CommandRun(seed)
    wrong = run.check().wrong
    assert not wrong, f"seed {seed}: {wrong}\n{run.describe()}"


HARD_TO_SLOW = """\
MJ X=1500 Y=0 Z=1700 A=0 B=90 C=0 F80
MC X=1479.2 Y=-162.4 Z=1669.6 QX=1389.2 QY=-92.4 QZ=1709.6 F200
MJ X=1363.3 Y=121.0 Z=1637.0 F60
ML X=1549.0 Y=-134.6 Z=1679.0 F251 R38.4
SET DO8
MJ X=1580.8 Y=-34.6 Z=1735.9 F60 R7.7
"""
SLOWED = {400: 0.05, 720: 1.0, 1265: 0.2, 1665: 1.0, 1791: 0.8, 1871: 0.5, 2431: 0.37, 2511: 0.05, 2671: 0.8}


def test_no_trial_law_crawls(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where an override is lowered and no law slows down at once."""
    looked_at = []
    values = AxisPath.values

    def counted(path: AxisPath, s: Floats) -> Floats:
        looked_at.append(len(s))
        return values(path, s)

    monkeypatch.setattr(AxisPath, "values", counted)
    session = Session(default_cell(), compile_text(HARD_TO_SLOW), window=40)
    left = dict(SLOWED)
    for _ in session.run():
        for tick in [tick for tick in left if session.kernel.tick >= tick]:
            session.set_override(left.pop(tick))
    assert not left
    assert looked_at
    assert max(looked_at) < 50_000


def test_the_distance_from_the_path_is_seen() -> None:
    """The judge of random commands tells a set point on the path from one 1e-7 rad beside it."""
    session = Session(default_cell(), compile_text(PROGRAM), window=64)
    oracle = PathOracle(session)
    joints = np.concatenate([window.joints for window in session.run()])[::40]
    assert max(oracle.deviations(joints)) < 1e-11
    off = joints.copy()
    off[len(off) // 2, 1] += 1e-7
    distance, angle = oracle.deviations(off)
    assert 1e-8 < distance < 1e-6
    assert angle < 1e-6


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


def test_a_block_in_which_the_robot_halted_began_before_the_halt() -> None:
    """Also where an action stands between it and the motion before."""
    text = "MJ X=1500 Y=0 Z=1800 A=0 B=90 C=0 F60\nML Y=300 F200\nSET DO1\nML Y=-300\n"
    cell = default_cell()
    session = Session(cell, compile_text(text, cell=cell), window=16)
    halted = False
    for window in session.run():
        if not halted and window.position[-1][1] < 0.0 and session.kernel.line == 4:
            assert session.halt() is None
            halted = True
        if session.kernel.state is State.HALTED:
            session.resume()
    blocks = {event.line: event for event in session.events if event.kind == "block"}
    assert halted
    assert blocks[4].t == pytest.approx(float(str(blocks[2].data["t_end"])), abs=1e-9)
