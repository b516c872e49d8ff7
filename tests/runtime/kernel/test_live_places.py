"""Points and frames that the application moves while a program runs: read when the path has arrived."""

from __future__ import annotations

import numpy as np
import pytest

from session_runs import cell
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.session import Session, compile_text

CELL = """
[robot]
model = "frigeni6"
[[frames]]
index = 1
name = "table"
xyz = [1400, -300, 1400]
live = true
[[frames]]
index = 2
xyz = [1400, -300, 1400]
[points]
P1 = { x = 1500, y = -300, z = 1500, a = 0, b = 90, c = 0 }
P2 = { name = "pick", x = 1500, y = -200, z = 1500, a = 0, b = 90, c = 0, live = true }
P3 = { x = 1500, y = -100, z = 1500, a = 0, b = 90, c = 0 }
P4 = { x = 100, y = 100, z = 100, a = 0, b = 90, c = 0 }
"""
TEXT = "MJ P1 F90\nML P2 F300\nML P3\nML pick R20\nML P1\n"


def place() -> Cell:
    return parse_cell(CELL)


def run_with(text: str, moves: dict[float, tuple[str, tuple[float, ...]]], window: int = 20) -> Session:
    """A run in which points and frames are moved at times, s."""
    where = place()
    session = Session(where, compile_text(text, cell=where), window=1)
    left = sorted(moves.items())
    for _ in session.run():
        while left and session.kernel.tick >= round(left[0][0] * 1000):
            which, pose = left.pop(0)[1]
            (session.set_frame if which == "table" else session.set_point)(which, pose)
        session.set_window(1 if left else window)
    assert session.status.value == "finished", session.failure
    return session


def ends(session: Session) -> dict[int, float]:
    return {e.line: e.data["s0_mm"] + e.data["length_mm"] for e in session.events if e.kind == "block"}


def test_a_live_point_is_read_in_the_tick_of_arrival_each_time() -> None:
    still = run_with(TEXT, {})
    reads = [e for e in still.events if e.kind == "place_read"]
    blocks = {e.line: e for e in still.events if e.kind == "block"}
    assert [(e.line, e.data["place"]) for e in reads] == [(2, "P2"), (4, "P2")]
    assert [e.t for e in reads] == [pytest.approx(blocks[line].data["t_end"]) for line in (1, 3)]
    last = reads[1].t
    for window in (1, 20, 1024):
        moves = {last - 0.05: ("pick", (1500.0, -150.0, 1520.0, 0.0, 90.0, 0.0))}
        moved = run_with(TEXT, moves, window)
        assert ends(moved)[3] == pytest.approx(ends(still)[3])
        (there,) = [e for e in moved.events if e.kind == "block" and e.line == 4]
        assert there.data["length_mm"] == pytest.approx(np.hypot(50.0, 20.0), abs=2.0)  # less the round edge
    late = run_with(TEXT, {last + 0.05: ("pick", (1500.0, -150.0, 1520.0, 0.0, 90.0, 0.0))})
    assert ends(late) == ends(still)


def test_a_live_frame_takes_its_points_along() -> None:
    text = "MJ P1 F90\nML P4 Z1 F300\nML P4 Z2\nML P4 Z1\n"
    session = run_with(text, {0.1: ("table", (1400.0, -250.0, 1430.0, 0.0, 0.0, 0.0))})
    X = session.cell.robot.fk(session.kernel.telemetry.joints)
    assert np.abs(X[:3, 3] - [1.5, -0.15, 1.53]).max() < 1e-8
    assert [e.data["place"] for e in session.events if e.kind == "place_read"] == ["Z1", "Z1"]


def test_what_is_live_stops_the_path_and_the_compiler_says_so() -> None:
    where = place()
    loaded = compile_text("MJ P1 F90\nML P3 R20\nML P2 F300\n", cell=where)
    (warning,) = [d for d in loaded.diagnostics if d.code == "W505"]
    assert "P2" in warning.message


def test_only_live_places_can_be_moved() -> None:
    where = place()
    session = Session(where, compile_text(TEXT, cell=where))
    for wrong in (1, "nothing", 99):
        with pytest.raises(ValueError, match="live"):
            session.set_point(wrong, (0, 0, 0, 0, 0, 0))
    with pytest.raises(ValueError, match="live"):
        session.set_frame(2, (0, 0, 0, 0, 0, 0))
    for pose in ((0, 0, 0), (0, 0, 0, 0, 0, float("nan"))):
        with pytest.raises(ValueError, match="six numbers"):
            session.set_point("pick", pose)
    assert cell().live_place((1, None), 1) is None
