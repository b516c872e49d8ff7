"""What must not change the result: the window's length, the look-ahead, the numbers of a second run."""

from __future__ import annotations

import numpy as np
import pytest

from session_runs import Run, at, cell, run
from viapoint.runtime.records import EventValue

PROGRAM = """\
MJ J1=-12 J2=22 J3=18 J5=60 F100
ML X=1600 Y=-200 Z=1700 F900 R30
SET DO1
ML Y=0 R30
SET DO2
RESET DO1
IF DI2
MS X=1650 Y=100 F700
MS X=1500 Y=150 Z=1650
ELSE
ML X=1650 Y=100
ENDIF
WAIT DI 1
M 3
MC X=1600 Y=-150 QX=1700 QY=0 QZ=1600 R20
M 5
ML Y=-250 Z=1650
WAIT 0.02
"""
HAPPENINGS = (
    '[[when]]\nsignal = "DO1"\nbecomes = true\nafter_s = 0.25\nset = { DI2 = true }\n'
    "[[when]]\nm = 3\nafter_s = 0.05\nreset_m = 3\n" + at(3.2, DI1=True)
)
COLUMNS = (
    "line",
    "interpreter_line",
    "buffer_fill",
    "s",
    "speed",
    "override",
    "joints",
    "position",
    "quaternion",
)


@pytest.fixture(scope="module")
def reference() -> Run:
    return run(PROGRAM, scenario=HAPPENINGS)


@pytest.mark.parametrize("window", [1, 7, 64, 1000])
def test_the_length_of_the_window_changes_nothing(reference: Run, window: int) -> None:
    done = run(PROGRAM, scenario=HAPPENINGS, window=window)
    assert max(len(each) for each in done.windows) <= window
    assert [e[:3] for e in done.history] == [e[:3] for e in reference.history]
    for mine, theirs in zip(done.history, reference.history, strict=True):
        assert_same(mine[3], theirs[3])
    for name in COLUMNS:
        a, b = reference.column(name), done.column(name)
        assert a.shape == b.shape, name
        assert np.abs(a - b).max() <= 1e-9, (
            f"{name} in tick {np.flatnonzero((a != b).reshape(len(a), -1).any(1))[:5]}"
        )


def assert_same(mine: dict[str, EventValue], theirs: dict[str, EventValue]) -> None:
    """Data of events: numbers to 1e-9, everything else as it is."""
    assert mine.keys() == theirs.keys()
    for key, value in mine.items():
        number = isinstance(value, float)
        assert value == (pytest.approx(theirs[key], rel=0, abs=1e-9) if number else theirs[key]), key


def test_windows_follow_one_another(reference: Run) -> None:
    first = np.array([window.first_tick for window in reference.windows])
    assert first[0] == 0
    assert (np.diff(first) == [len(window) for window in reference.windows[:-1]]).all()
    assert np.abs(reference.column("time") - 0.001 * np.arange(len(reference.joints))).max() < 1e-12


def test_a_second_run_is_the_same_bit_by_bit(reference: Run) -> None:
    again = run(PROGRAM, scenario=HAPPENINGS)
    assert again.history == reference.history
    for name in COLUMNS:
        assert np.array_equal(again.column(name), reference.column(name)), name


CORNERS = """\
MJ P1 F90
ML P2 F300 R50
SET DO1
SET DO2
RESET DO1
ML P3 R30
RESET DO2
MS P4
MS X=1650 Y=0 Z=1800
MS P1
MC P3 QX=1900 QY=100 QZ=1500 R20
MJ J1=10 J5=20 R5
MJ P2 R3
ML P1
"""


@pytest.mark.parametrize("slots", [1, 2, 3, 4, 12])
def test_a_small_buffer_changes_the_time_but_not_the_path(slots: int) -> None:
    small, large = run(CORNERS, cell(controller=f"lookahead = {slots}")), run(CORNERS)
    assert small.status == "finished"
    assert not small.over_limits()
    assert small.reasons == large.reasons
    assert [c.transition for c in small.session.corners] == [c.transition for c in large.session.corners]
    assert small.column("s")[-1] == pytest.approx(large.column("s")[-1], abs=1e-12)
    assert [e[1:3] for e in small.history] == [e[1:3] for e in large.history]
    # never slower with more look-ahead, up to what two solutions of one problem may differ
    assert large.session.kernel.tick <= 1.002 * small.session.kernel.tick


@pytest.mark.parametrize("slots", [1, 5])
def test_the_path_passes_the_same_places_whatever_the_buffer(slots: int) -> None:
    small, large = run(CORNERS, cell(controller=f"lookahead = {slots}")), run(CORNERS)
    s = np.linspace(0.0, large.column("s")[-1], 500)
    a, b = (
        np.stack([np.interp(s, done.column("s"), done.column("position")[:, k]) for k in range(3)])
        for done in (small, large)
    )
    assert np.abs(a - b).max() < 1e-5  # chords between ticks, not the path, differ


@pytest.mark.parametrize("override", [0.37, 0.75])
def test_override_scales_speeds_and_keeps_limits(override: float) -> None:
    full, slow = run(CORNERS), run(CORNERS, override=override)
    assert not slow.over_limits()
    # accelerating to a part of the speed takes less than that part of the time
    assert (
        0.85 * full.session.kernel.tick
        < slow.session.kernel.tick * override
        < 1.01 * full.session.kernel.tick
    )
    line = slow.column("line") == 2
    assert slow.column("speed")[line].max() == pytest.approx(0.3 * override, rel=0.01)
    assert slow.column("speed")[line].max() <= 0.3 * override * (1.0 + 1e-9)
    assert np.abs(slow.joints[-1] - full.joints[-1]).max() < 1e-12
    assert (slow.column("override") == override).all()
    assert [e[1:3] for e in slow.history] == [e[1:3] for e in full.history]


def test_stepping_ends_in_the_same_joints_with_the_same_events() -> None:
    plain, stepped = run(PROGRAM, scenario=HAPPENINGS), run(PROGRAM, scenario=HAPPENINGS, step=True)
    assert np.abs(plain.joints[-1] - stepped.joints[-1]).max() < 1e-9
    assert [e[1:3] for e in plain.history if e[2] != "wait"] == [
        e[1:3] for e in stepped.history if e[2] != "wait"
    ]
    ends = [stepped.end_of(line) for line in (2, 4)]
    assert (stepped.column("speed")[ends] < 1e-3).all()
