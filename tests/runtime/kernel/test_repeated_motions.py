"""Motions that come again are planned once, and the same as for the first time."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from viapoint.runtime.cell import parse_cell
from viapoint.runtime.kernel.resolver import Resolver
from viapoint.runtime.memo import Memo
from viapoint.runtime.records import Floats
from viapoint.session import Session, compile_text
from viapoint.vm.ports import Motion, MotionKind, Target

CELL = '[robot]\nmodel = "frigeni6"\n'
CYCLE = """
AGAIN:
  ML X=1500 Y=300 Z=1800 A=0 B=90 C=0 F300 R40
  ML Y=-300 Z=1700 R60
  MJ X=1400 Y=0 Z=1500 A=0 B=90 C=0 F60 R20
  MC X=1500 Y=200 Z=1600 QX=1450 QY=100 QZ=1600 F200
  WAIT 0.02
  ML X=1500 Y=0 Z=1800 F400
  WAIT 0.01
"""
START = "MJ X=1500 Y=0 Z=1800 A=0 B=90 C=0 F80\nWAIT 0.01\n"


def run(text: str, window: int = 1024) -> tuple[Floats, list[int]]:
    """Joints (N, n) of all ticks, and the ticks in which the waits begin."""
    session = Session(cell := parse_cell(CELL), compile_text(text, cell=cell), window=window)
    rows = np.concatenate([w.joints for w in session.run()])
    assert session.failure is None
    return rows, [event.tick for event in session.events if event.kind == "wait"]


def test_every_cycle_is_as_the_first() -> None:
    rows, waits = run(START + CYCLE + "GOTO AGAIN 4\n")
    ends = waits[::2]
    cycles = [rows[first:last] for first, last in pairwise(ends)]
    assert len(cycles) == 4
    for cycle in cycles[1:]:
        assert len(cycle) == len(cycles[0])
        assert np.abs(cycle - cycles[0]).max() < 1e-9


@pytest.mark.parametrize("window", [1, 64])
def test_what_is_remembered_does_not_depend_on_windows(window: int) -> None:
    text = START + CYCLE + "GOTO AGAIN 2\n"
    assert np.abs(run(text, window)[0] - run(text)[0]).max() < 1e-9


def test_a_point_that_is_taught_anew_is_gone_to() -> None:
    """The statement is the same, what it names is not."""
    cell = parse_cell(
        CELL + "[points]\nP1 = { x = 1500, y = 0, z = 1800, a = 0, b = 90, c = 0, live = true }\n"
    )
    text = "AGAIN:\nML P1 F300\nML X=1500 Y=0 Z=1900 A=0 B=90 C=0\nGOTO AGAIN 3\nML P1\n"
    text = "MJ X=1500 Y=0 Z=1900 A=0 B=90 C=0 F80\n" + text
    session = Session(cell, compile_text(text, cell=cell))
    told, height = 0, 1800.0
    for window in session.run():
        new, told = session.events[told:], len(session.events)
        if any(event.kind == "block" and event.line == 4 for event in new):
            height -= 50.0
            session.set_point(1, (1500.0, 0.0, height, 0.0, 90.0, 0.0))
        last = window.position[-1]
    assert session.failure is None
    assert last == pytest.approx((1.5, 0.0, 1.7), abs=1e-9)  # moved twice before it was read


def test_a_frame_that_stands_is_not_the_one_that_goes_with_the_base() -> None:
    """Their numbers are the same, and so may be the line: all statements of a prompt have one."""
    track = '[auxiliary_axes.E1]\nkind = "linear"\ncarries_robot = true\nrange = [0, 3000]\nspeed = 1000\n'
    cell = parse_cell(CELL + track + "acceleration = 3000\n")
    cell = replace(cell, frames={0: cell.frames[0], 1: replace(cell.frames[0], index=1)})
    pose = (("X", 1500.0), ("Y", 0.0), ("Z", 1800.0), ("A", 0.0), ("B", 90.0), ("C", 0.0))
    motion = Motion(line=1, kind=MotionKind.JOINT, target=Target(coordinates=pose))
    home = np.asarray(cell.home)
    resolver, reached = Resolver(cell, home), []
    for frame in (0, 1):
        resolver.begin_anew(home, np.array([0.5]))
        end = resolver.resolve(replace(motion, frame=frame), frame).end
        reached.append(float(end.X_base_flange[0, 3]))
    assert reached == pytest.approx([1.5, 1.0])


ZONES = """
[[tools]]
index = 1
xyz = [100, 0, 40]
abc = [0, 20, 0]
[[zones]]
name = "left"
kind = "exclusive"
corner_1 = [1300, 80, 1000]
corner_2 = [1900, 600, 2300]
[[zones]]
name = "low"
kind = "exclusive"
corner_1 = [1300, -600, 900]
corner_2 = [1900, 600, 1640]
"""
TOOLED = """
  ML X=1480 Y=200 Z=1700 T1 F500 R30
  ML X=1400 Y=-250 Z=1650 T1 F700
  MJ X=1500 Y=0 Z=1800 A=0 B=90 C=0 F80
"""


def test_what_is_remembered_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Under overrides that change, with two tools, through exclusive zones."""
    cell = parse_cell(CELL + ZONES)
    program = compile_text(START + CYCLE + TOOLED + "GOTO AGAIN 4\n", cell=cell)
    found = []
    for find in (Memo.find, lambda memo, key: None):
        monkeypatch.setattr(Memo, "find", find)
        session, rows = Session(cell, program, window=50), []
        overrides = [(9000, 0.7), (8500, 0.3), (6000, 1.0), (1000, 0.7)]
        for window in session.run():
            rows.append(window.joints)
            if overrides and session.kernel.tick >= overrides[-1][0]:
                session.set_override(overrides.pop()[1])
        assert not overrides
        assert session.failure is None
        found.append((np.concatenate(rows), [(e.tick, e.line, e.kind) for e in session.events]))
    (remembered, told), (computed, as_computed) = found
    assert told == as_computed
    assert sum(kind == "zone" for *_, kind in told) >= 16
    assert np.abs(remembered - computed).max() < 1e-9


def test_a_memo_forgets_what_was_not_asked_for_lately() -> None:
    computed: list[int] = []

    def compute(n: int) -> int:
        computed.append(n)
        return n * n

    memo: Memo[int] = Memo(2)
    assert [memo.get(n, lambda n=n: compute(n)) for n in (1, 2, 1, 3, 1, 2)] == [1, 4, 1, 9, 1, 4]
    assert computed == [1, 2, 3, 2]
