"""Interrupts of robots that share a cell: zones are kept, left and waited for as elsewhere."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from station_runs import FACING, StationRun, run
from test_station import LEFT, MIDDLE, RIGHT

from session_runs import at
from viapoint.session import Status

INTERRUPTED = LEFT.replace("\nML Y=-900", "\nON DI1 SUB LOST\nON ERROR SUB FAULT\nML Y=-900", 1)
BESIDE = {
    "stands": "WAIT 0.5",
    "leaves": "ML Y=900 F500\nWAIT 0.2",
    "leaves for long": "ML Y=900 F500\nWAIT 3",
}
"""The robot is in the zone when it is interrupted, and stays there or leaves it."""


def runs(beside: str, window: int) -> StationRun:
    text = f"{INTERRUPTED}END\nLOST:\n{beside}\nEND\nFAULT:\nRESUME NEXT\nEND\n"
    return run(text, RIGHT, cell=MIDDLE + FACING, scenario=at(2.4, DI1=True), window=window)


@pytest.mark.parametrize("beside", BESIDE)
def test_a_robot_comes_back_into_a_zone_when_it_is_free(beside: str) -> None:
    done, other = (runs(BESIDE[beside], window) for window in (1024, 50))
    assert done.station.status is Status.FINISHED, done.failures
    assert done.history == other.history
    for a, b in zip(done.joints, other.joints, strict=True):
        assert np.abs(a - b).max() < 1e-9
    stays = []
    for robot in (1, 2):
        entered, left = (done.ticks_of("zone", robot, action=a) for a in ("entered", "left"))
        assert len(entered) == len(left)
        stays += list(zip(entered, left, strict=True))
    stays.sort()
    assert len(stays) == (4 if beside == "stands" else 5), "in once more behind the way out"
    for (_, end), (begin, _) in itertools.pairwise(stays):
        assert end < begin, "never two of them in it"
    (begun,), (back,) = (done.ticks_of("interrupt", 1, action=a) for a in ("begun", "returned"))
    assert np.abs(done.joints[0][begun] - done.joints[0][back]).max() < 1e-12


@pytest.mark.parametrize("window", [1024, 37])
def test_what_one_robot_writes_interrupts_another_in_the_next_tick(window: int) -> None:
    watcher = "ON DO3 SUB SEEN\nMJ J1=20 F20\nEND\nSEEN:\nSET DO4\nEND\n"
    done = run("MJ J1=30 F60\nSET DO3\n", watcher, window=window)
    (written,) = done.ticks_of("output", 1, signal="DO3")
    assert done.ticks_of("interrupt", 2, action="triggered") == [written + 1]
    assert done.station.status is Status.FINISHED


def test_a_robot_that_may_be_interrupted_does_not_wait_in_vain() -> None:
    """Both wait; only the scenario can still interrupt one of them, and frees the other by it."""
    first = "ON DI1 SUB SEEN\nWAIT DI2\nEND\nSEEN:\nSET DO3\nEND\n"
    scenario = at(1.0, DI1=True)
    done = run(first, "WAIT DO3\nMJ J1=30 F60\n", scenario=scenario)
    assert done.ticks_of("interrupt", 1, action="begun") == [1000]
    assert done.failures[1].startswith("E4"), "when nothing can come any more it is said"
    assert done.station.tick > 1000


@pytest.mark.parametrize("beside", ["WAIT 0.3", "ML Y=-1000 F300"])
def test_a_robot_that_waits_for_a_zone_is_interrupted_there(beside: str) -> None:
    """The zone may be given to it meanwhile; it goes in when it is back."""
    waits = RIGHT.replace("\nML Y=900", "\nON DI1 SUB LOST\nML Y=900", 1) + f"END\nLOST:\n{beside}\nEND\n"
    done, other = (
        run(LEFT, waits, cell=MIDDLE + FACING, scenario=at(2.5, DI1=True), window=window)
        for window in (1024, 50)
    )
    assert done.station.status is Status.FINISHED, done.failures
    assert done.history == other.history
    (begun,), (back,) = (done.ticks_of("interrupt", 2, action=a) for a in ("begun", "returned"))
    assert begun == 2500, "it stood before the zone"
    left, entered = done.ticks_of("zone", 1, action="left")[0], done.ticks_of("zone", 2, action="entered")[0]
    assert max(left, back) < entered < max(left, back) + 60
