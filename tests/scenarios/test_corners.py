"""Scenarios 3, 4, 10, 11, 12, 13, 14, 17 and 20: corners, what stands at them, and commands on them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from everywhere import (
    OVERRIDES,
    PATH_TOLERANCE,
    SAME,
    everywhere,
    finished,
    nearest_to,
    on_the_path_of,
    place,
    session_of,
    stands,
)

from session_runs import Run, run
from viapoint.runtime.kernel import State
from viapoint.session import Session

P2 = np.array([1.5, 0.05, 1.5])


def test_3_set_do_between_rounded_moves_at_the_place_nearest_the_point_no_slow_down() -> None:
    for override, done in zip(
        OVERRIDES, finished("MJ P1 F90\nML P2 F300 R25\nSET DO1\nML P3\n"), strict=True
    ):
        plain = run("MJ P1 F90\nML P2 F300 R25\nML P3\n", place(), override=override)
        assert np.array_equal(done.joints, plain.joints)
        (output,) = done.events("output")
        nearest = nearest_to(done, P2, done.end_of(1), done.end_of(4))
        assert abs(output.tick - nearest) <= 1
        assert done.column("speed")[output.tick] > 0.1 * override


def test_4_wait_between_rounded_moves_time_starts_at_standstill() -> None:
    for done in finished("MJ P1 F90\nML P2 F300 R25\nWAIT 0.25\nML P3\n"):
        (wait,) = done.events("wait")
        assert wait.tick == done.end_of(2)
        assert stands(done, wait.tick)
        assert not stands(done, wait.tick - 30)
        assert wait.data["t_end"] == pytest.approx(wait.t + 0.25)
        assert done.events("block", 4)[0].tick == wait.tick + 250
        assert np.linalg.norm(done.column("position")[wait.tick] - P2) < 1e-9


def test_10_r_above_half_the_length_is_cut_to_half() -> None:
    for done in finished("MJ P1 F90\nML P2 F300 R5000\nML P3\n"):
        corner = next(each for each in done.session.corners if each.line == 2)
        assert corner.transition.asked == pytest.approx(5.0)
        assert corner.transition.effective == pytest.approx(0.05)  # half of the 100 mm from P2 to P3
        assert done.reasons[2] == "ROUNDED"


@pytest.mark.parametrize("edge", ["R0", "", "R0.000001", "R0.001", "R0.1"])
def test_11_r0_r_missing_tiny_r_no_duplicate_time_stamps(edge: str) -> None:
    for done in finished(f"MJ P1 F90\nML P2 F300 {edge}\nSET DO1\nML P3\n"):
        assert np.array_equal(np.round(done.column("time") / 1e-3), np.arange(len(done.joints)))
        assert len(done.joints) == done.session.kernel.tick + 1
        blocks = sorted(done.events("block"), key=lambda e: e.tick)
        ends = [round(e.data["t_end"] * 1000) for e in blocks]
        assert [e.tick for e in blocks] == [0, *ends[:-1]]
        assert all(e.tick < end for e, end in zip(blocks, ends, strict=True))
        corner_at = done.end_of(2)
        assert done.events("output")[0].tick == corner_at
        if edge in ("R0", ""):
            assert stands(done, corner_at)


def test_12_zero_length_and_rotation_only_ml_with_an_output_on_it() -> None:
    text = "MJ P1 F90\nAT 50% SET DO1\nML P1 F300\nSET DO2\nAT 50% SET DO3\nML C=30 F40\nSET DO4\nML P2\n"
    for done in finished(text):
        turn = done.events("block", 6)[0]
        ticks = {e.data["signal"]: e.tick for e in done.events("output")}
        there, turned = done.end_of(1), done.end_of(6)
        assert (ticks["DO1"], ticks["DO2"], ticks["DO4"]) == (there, there, turned)
        assert turn.data["length_mm"] == pytest.approx(0.0, abs=1e-6)
        R = done.column("quaternion")[[there, ticks["DO3"], turned]]
        half, whole = (2 * np.arccos(min(1.0, abs(float(R[0] @ R[k])))) for k in (1, 2))
        assert half == pytest.approx(whole / 2, abs=np.deg2rad(0.05))


@pytest.mark.parametrize(
    "points",
    [
        "X=1500 Y=50 QX=1500 QY=0 QZ=1500",  # on one line
        "X=1500 Y=-50 QX=1600 QY=0 QZ=1500",  # the target is the start
        "X=1500 Y=50 QX=1500 QY=50 QZ=1500",  # Q is the target
        "X=1500 Y=50 QX=1500 QY=-50 QZ=1500",  # Q is the start
    ],
)
def test_13_collinear_coincident_and_via_at_the_end_are_no_circle(points: str) -> None:
    for done in everywhere(f"MJ P1 F90\nSET DO1\nMC {points} F200\nML P3\n"):
        assert (done.code, done.failed_line) == ("E306", 3)
        assert len(done.events("output")) == 1
        assert done.column("speed")[-1] < 1e-5


def test_14_mj_to_a_pose_takes_the_same_solution_in_step_and_automatic() -> None:
    text = "MJ P7 F90\nMJ P2 R1\nMJ X=1550 Y=0 Z=1550 A=5 B=70 C=10 R1\nML P3 F200 R20\nMJ P4\n"
    for automatic, stepped in zip(finished(text), finished(text, step=True), strict=True):
        assert np.abs(automatic.joints[-1] - stepped.joints[-1]).max() < 1e-9
        for line in (2, 3, 5):
            q = stepped.joints[stepped.end_of(line)]
            nearest = np.abs(automatic.joints - q).max(axis=1).min()
            assert nearest < 0.35, line  # the same arm, wrist and turns; a round edge passes by


def test_17_tool_changed_between_rounded_moves_is_an_exact_stop() -> None:
    for done in finished("MJ P1 F90\nML P2 F300 R25\nT 1\nML P3 R20\nML P4 T2\n"):
        (changed,) = done.events("tool")
        assert changed.tick == done.end_of(2)
        assert stands(done, changed.tick)
        assert stands(done, done.end_of(4))
        forced = {each.line: each.forced_by_line for each in done.session.corners}
        assert (forced[2], forced[4]) == (3, 5)
        assert np.linalg.norm(done.column("position")[changed.tick - 1] - P2) < 1e-5


# --- 20: in the middle of a blend ----------------------------------------------------------------------

BLENDS = "MJ P1 F90\nML P2 F300 R30\nSUB PART\nML P4 R25\nML P1\nEND\nPART:\nML P3 R30\nEND\n"


LONGER = 700
"""Ticks for which another override holds."""


def disturbed(tick: int, command: str, override: float, window: int) -> Run:
    """A run with a command in a tick, and all that goes on from it."""
    session = session_of(BLENDS, override=override)
    windows, due = [session.begin()], [tick]
    if command == "override":
        due.append(tick + LONGER)
    while not session.kernel.over:
        now = session.kernel.tick
        windows.append(session.advance(min(window, due[0] - now) if due else window))
        if due and session.kernel.tick == due[0]:
            act(session, command, 1.37 - override if len(due) == 2 else override)
            del due[0]
        elif session.kernel.state in (State.HALTED, State.EMERGENCY):
            session.reset()
            session.resume()
    session.status = session.final_status()
    return Run(session, tuple(windows))


def act(session: Session, command: str, override: float) -> None:
    match command:
        case "halt":
            session.halt()
        case "emergency stop":
            session.emergency_stop()
        case "override":
            session.set_override(override)
        case "step":
            session.kernel.step()
        case _:
            raise AssertionError(command)


@cache
def automatic(override: float) -> Run:
    return run(BLENDS, place(), override=override)


def in_the_blends(whole: Run, window: int) -> list[int]:
    """Ticks before, in and behind the middles of the three round edges; one each where ticks are costly."""
    shifts = [(-40,), (0,), (40,)] if window == 1 else [(-40, 0, 40)] * 3
    ends = [whole.end_of(line) for line in (2, 8, 4)]
    return [end + shift for end, each in zip(ends, shifts, strict=True) for shift in each]


@pytest.mark.parametrize("override", OVERRIDES)
@pytest.mark.parametrize("command", ["halt", "emergency stop", "override", "step"])
def test_20_commands_in_the_middle_of_a_blend_same_geometry_as_automatic(
    command: str, override: float
) -> None:
    whole, found = automatic(override), {}
    for window in (1024, 1):
        for tick in in_the_blends(whole, window):
            done = disturbed(tick, command, override, window)
            case = (command, override, tick, window)
            assert done.status == "finished", (case, done.session.failure)
            assert on_the_path_of(done, whole) < PATH_TOLERANCE, case
            assert np.abs(done.joints[-1] - whole.joints[-1]).max() < 1e-9, case
            assert [e.line for e in done.events("block")] == [e.line for e in whole.events("block")], case
            if window == 1:
                assert done.history == found[tick].history, case
                assert np.abs(done.joints - found[tick].joints).max() < SAME, case
            found[tick] = done


def test_20_the_end_of_a_subroutine_in_the_middle_of_a_blend_same_geometry_as_without() -> None:
    flat = "MJ P1 F90\nML P2 F300 R30\nML P3 R30\nML P4 R25\nML P1\n"
    for without, done in zip(finished(flat), finished(BLENDS), strict=True):
        assert np.array_equal(without.joints, done.joints)


def test_20_the_end_of_a_program_where_the_next_line_would_have_been_rounded() -> None:
    """END stops exactly at the target of the line before it, on the same path up to the edge."""
    text = "MJ P1 F90\nML P2 F300 R30\nIF AHEAD NOT DI1\nEND\nENDIF\nML P3 R30\n"
    for done, whole in zip(finished(text), finished(BLENDS), strict=True):
        assert np.linalg.norm(done.column("position")[-1] - P2) < 1e-9
        before = done.column("s") < whole.column("s")[whole.end_of(2)] - 0.05
        assert on_the_path_of(done, whole, before) < PATH_TOLERANCE
