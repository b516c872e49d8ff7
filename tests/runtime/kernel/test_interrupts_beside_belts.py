"""Interrupts of a program that follows a belt: they wait until the robot is beside it."""

from __future__ import annotations

import numpy as np
import pytest
from test_tracking import CELL, PARTS

from session_runs import Run, at
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.runtime.signals import parse_scenario
from viapoint.session import Session, compile_text

LINES = """MJ P1 F60
ON DI1 SUB LOST
TRK 1
ML P2 F200
ML P3 R10
WAIT 0.2
ML P1
TRK 0
ML P4 F500
END
LOST:
ML Z=1350 F200
WAIT 0.2
END
"""
TICK = 0.004
BACK = 1e-12
"""rad between where a path was left and where it is taken up."""


def runs(changes: str, belt: str, more: str = "") -> list[Run]:
    """The program in windows of different lengths; what they give has been found equal."""
    cell: Cell = parse_cell(CELL.format(tick=TICK) + more)
    scenario = f"seed = 3\n[[conveyor]]\nindex = 1\nspeed_mm_s = {belt}\n{changes}"
    done = []
    for window in (1024, 64, 1):
        session = Session(
            cell,
            compile_text(LINES, cell=cell),
            scenario=parse_scenario(scenario, cell),
            window=window,
            max_time=40.0,
        )
        done.append(Run(session, tuple(session.run())))
    first, *others = done
    assert first.status == "finished", first.session.failure
    assert first.over_limits() == {}
    for other in others:
        assert other.history == first.history
        assert np.abs(other.joints - first.joints).max() < 1e-9
    return done


def happened(done: Run) -> list[tuple[str, int]]:
    kinds = ("interrupt", "track")
    return [(str(e.data["action"]), e.tick) for e in done.session.events if e.kind in kinds]


@pytest.mark.parametrize("seconds", [1.2, 2.0, 3.0])
def test_on_the_belt_it_waits_until_the_robot_has_left_it(seconds: float) -> None:
    done = runs(at(seconds, DI1=True), "[[0, 100]]")[0]
    actions = happened(done)
    assert [a for a, _ in actions if a != "triggered"] == [
        *("latched", "coupled", "decoupled", "begun", "returned")
    ]
    ticks = dict(actions)
    assert ticks["triggered"] == round(seconds / TICK)
    assert ticks["begun"] == ticks["decoupled"]
    assert np.abs(done.joints[ticks["begun"]] - done.joints[ticks["returned"]]).max() < BACK
    plain = runs("", "[[0, 100]]")[0]
    assert np.abs(done.joints[ticks["begun"]] - plain.joints[ticks["begun"]]).max() < 1e-9
    assert np.abs(done.joints[-1] - plain.joints[-1]).max() < 1e-9


def test_while_the_robot_waits_for_a_part_it_runs_at_once() -> None:
    """Also where the part comes meanwhile: it is taken when the robot is back, if it is still in reach."""
    comes = dict(happened(runs("", "[[0, 100]]", PARTS)[0]))["latched"] * TICK
    for seconds in (2.0, comes - 0.1):
        done = runs(at(seconds, DI1=True), "[[0, 100]]", PARTS)[0]
        ticks = dict(happened(done))
        assert ticks["triggered"] == ticks["begun"] == round(seconds / TICK)
        assert ticks["latched"] == max(ticks["returned"], round(comes / TICK))
        assert np.abs(done.joints[ticks["begun"]] - done.joints[ticks["returned"]]).max() < BACK
