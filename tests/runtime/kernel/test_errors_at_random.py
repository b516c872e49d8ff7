"""Errors of planning at random places of random programs: left out, they leave what an exact stop would."""

from __future__ import annotations

import numpy as np
import pytest
from command_runs import command_cell, random_program

from session_runs import Run
from viapoint.runtime.cell import Cell
from viapoint.session import Session, compile_text

WRONG = (
    "ML X=9000 R20",
    "MJ J1=900",
    "MC X=1500 Y=0 Z=1700 QX=1500 QY=0 QZ=1700",  # no circle leads through one place twice
    "ML P99",
    "MJ X=5000 Y=0 Z=100 A=0 B=0 C=0",
)
SAME = 5e-6
"""rad between set points: laws that are planned at different times agree so far."""


def program(seed: int, wrong: str) -> str:
    """A random program with a line at a random place of it, errors handled."""
    rng = np.random.default_rng(seed)
    first, *others = random_program(rng).splitlines()
    at = int(rng.integers(1, len(others) + 1))
    lines = [first, "ON ERROR SUB FAULT", *others[:at], wrong, *others[at:], "END", "FAULT:", "RESUME NEXT"]
    return "\n".join(lines) + "\nEND\n"


def finished(text: str, cell: Cell) -> Run:
    """A run of a program that is compiled without its cell: planning finds unknown points."""
    session = Session(cell, compile_text(text))
    return Run(session, tuple(session.run()))


@pytest.mark.parametrize("seed", range(16))
def test_a_statement_left_out_is_an_exact_stop(seed: int) -> None:
    cell, wrong = command_cell(), WRONG[seed % len(WRONG)]
    left_out, stopped = (finished(program(seed, line), cell) for line in (wrong, "WAIT 0"))
    where = f"seed {seed}:\n{program(seed, wrong)}"
    assert stopped.status == "finished", where
    assert left_out.status == "finished", f"{left_out.session.failure}, {where}"
    assert len(left_out.events("interrupt")) == len(stopped.events("interrupt")) + 3, where
    assert left_out.joints.shape == stopped.joints.shape, where
    assert np.abs(left_out.joints - stopped.joints).max() < SAME, where
    assert not left_out.over_limits(), where
