"""ON ERROR: a subroutine decides what becomes of an error; the program goes on where the robot stands."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from everywhere import CELL
from test_interrupts import BACK, TICK, everywhere, finished, place, tick

from session_runs import Run, at
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.signals import parse_scenario
from viapoint.session import Session, compile_text

WAY = "MJ P1 F60\nON ERROR SUB FAULT\nML P2 F200 R20\nSET DO2\n{}\nML P3\nSET DO3\nML P4\n"
FAULT = "END\nFAULT:\n{}\nEND\n"
"""What happens in it begins in line 11."""


def told(done: Run) -> list[tuple[str, Any]]:
    """What happened with errors: triggered with the code, begun, returned with the decision."""
    events = done.events("interrupt")
    return [(str(e.data["action"]), e.data.get("code", e.data.get("reason"))) for e in events]


def lines(done: Run) -> list[int]:
    """Lines of the motions that were made, in their order."""
    return [event.line for event in done.events("block")]


def outputs(done: Run) -> list[str]:
    return [str(event.data["signal"]) for event in done.events("output")]


NEXT = [("triggered", "E302"), ("begun", None), ("returned", "RESUME NEXT")]


def test_resume_next_leaves_the_statement_out() -> None:
    for done in finished((WAY + FAULT).format("ML X=9000", "SET DO1\nRESUME NEXT")):
        assert told(done) == NEXT
        assert lines(done) == [1, 3, 6, 8]
        assert outputs(done) == ["DO2", "DO1", "DO3"]
        (triggered, *_) = done.events("interrupt")
        assert triggered.line == 5
        end = round(done.events("block", 3)[0].data["t_end"] / done.session.cell.tick)
        assert triggered.tick == end, "the robot stands at the last stop that is sure"
        assert done.session.failure is None


def test_retry_does_it_again_when_something_has_changed() -> None:
    """The subroutine waits for somebody who moves the live point to where it can be reached."""
    far = "P9 = { x = 9000, y = 0, z = 1500, a = 0, b = 90, c = 0, live = true }\n"
    cell = parse_cell(CELL.replace("P7 =", f"{far}P7 =") + f"[controller]\ntick_s = {TICK}\n")
    text = (WAY + FAULT).format("ML P9", "WAIT DI1\nRETRY")
    program = compile_text(text, cell=cell)
    scenario = parse_scenario(at(2.0, DI1=True), cell)
    for window in (1, 100):
        session = Session(cell, program, scenario=scenario, window=window)
        for _ in session.run():
            if tick(1.2) <= session.kernel.tick < tick(2.0):
                session.set_point(9, (1600, 50, 1450, 0, 90, 0))
        assert session.status.value == "finished", session.failure
        actions = [e.data["action"] for e in session.events if e.kind == "interrupt"]
        assert actions == ["triggered", "begun", "returned"]
        assert [e.line for e in session.events if e.kind == "block"] == [1, 3, 5, 6, 8]


@pytest.mark.parametrize("decision", ["STOP", "SET DO1", "IF ERRNO <> 302\nRETRY\nENDIF"])
def test_stop_and_no_decision_leave_the_error_as_it_is(decision: str) -> None:
    for done in everywhere((WAY + FAULT).format("ML X=9000", decision)):
        assert (done.status, done.code, done.failed_line) == ("error", "E302", 5)
        assert told(done) == NEXT[:2]
        assert len(done.events("error")) == 1


def test_the_number_of_the_error_decides() -> None:
    body = "IF ERRNO = 303\nSET DO4\nRESUME NEXT\nELSEIF ERRNO >= 302 AND ERRNO < 303\nSET DO5\n"
    body += "RESUME NEXT\nENDIF"
    for statement, output in (("MJ J1=900", "DO4"), ("ML X=9000", "DO5")):
        for done in finished((WAY + FAULT).format(statement, body)):
            assert outputs(done) == ["DO2", output, "DO3"]


def test_outside_of_an_error_its_number_is_zero() -> None:
    asks = "IF ERRNO = 0\nSET DO{}\nENDIF\n"
    text = f"MJ P1 F60\nON ERROR SUB FAULT\n{asks.format(1)}ML X=9000\n{asks.format(2)}"
    for done in finished(text + FAULT.format("RESUME NEXT")):
        assert outputs(done) == ["DO1", "DO2"]


def test_the_robot_comes_back_before_it_goes_on() -> None:
    for done in finished((WAY + FAULT).format("ML X=9000", "ML Z=1400 F200\nT 1\nRESUME NEXT")):
        (_, begun, back) = done.events("interrupt")
        assert np.abs(done.joints[begun.tick] - done.joints[back.tick]).max() < BACK
        assert [e.data["index"] for e in done.events("tool")] == [1, 0]
        assert lines(done) == [1, 3, 11, 13, 6, 8]
        blocks = done.events("block")
        assert blocks[4].data["s0_mm"] == pytest.approx(back.data["s_mm"])
        assert sum(b.data["length_mm"] for b in blocks) == pytest.approx(done.column("s")[-1] * 1e3)


def test_an_error_inside_ends_the_run() -> None:
    for line, code in (("ML Y=9000", "E302"), ("MJ J1=900", "E303")):
        for done in everywhere((WAY + FAULT).format("ML X=9000", line)):
            assert (done.status, done.code, done.failed_line) == ("error", code, 11)


def test_off_and_another_on_error() -> None:
    off = "MJ P1 F60\nON ERROR SUB FAULT\nML P2 F200\nOFF FAULT\nML X=9000\n"
    for done in everywhere(off + FAULT.format("RESUME NEXT")):
        assert (done.code, told(done)) == ("E302", [])
    other = "MJ P1 F60\nON ERROR SUB FAULT\nON ERROR SUB B\nML X=9000\n"
    for done in finished(other + FAULT.format("STOP") + "B:\nRESUME NEXT\nEND\n"):
        assert {e.data["label"] for e in done.events("interrupt")} == {"B"}


def test_what_lies_before_the_error_is_still_run_and_what_was_planned_with_it_again() -> None:
    """The round edge into a motion that cannot be made: the line before it is run to its end, exactly."""
    for done in finished((WAY + FAULT).format("MJ J1=170 J2=200 F50", "RESUME NEXT")):
        assert lines(done) == [1, 3, 6, 8]
        stop = done.events("interrupt")[0].tick
        P2 = np.array([1.5, 0.05, 1.5])
        assert np.linalg.norm(done.column("position")[stop] - P2) < 1e-9


def test_several_errors_one_after_the_other() -> None:
    text = "MJ P1 F60\nON ERROR SUB FAULT\nML X=9000 F200\nMJ J1=900\nML P2\nML Y=9000 R20\nML P3\n"
    for done in finished(text + FAULT.format("WAIT 0.1\nRESUME NEXT")):
        assert [code for action, code in told(done) if action == "triggered"] == ["E302", "E303", "E302"]
        assert lines(done) == [1, 5, 7]


def test_errors_that_nothing_can_cure_are_no_endless_loop() -> None:
    retry = (WAY + FAULT).format("ML X=9000", "RETRY")
    loop = "MJ P1 F60\nON ERROR SUB FAULT\nA:\nML X=9000\nGOTO A\n" + FAULT.format("RESUME NEXT")
    for text, line in ((retry, 5), (loop, 4)):
        for done in everywhere(text):
            assert (done.code, done.failed_line) == ("E414", line)


def test_what_is_no_error_of_planning_is_not_handled() -> None:
    for statement, code in (("WAIT DI5", "E410"), ("A:\nGOTO A", "E401"), ("SUB FAULT", "E413")):
        for done in everywhere((WAY + FAULT).format(statement, "RESUME NEXT")):
            assert (done.code, told(done)) == (code, [])


def test_a_tool_for_which_there_is_no_room_is_no_error_of_planning() -> None:
    """The long tool would reach into the table where the robot stands; what follows is meant for it."""
    for done in everywhere((WAY + FAULT).format("T 3", "RESUME NEXT"), place(TABLE)):
        assert (done.code, done.failed_line, told(done)) == ("E420", 5, [])


TABLE = """[[tools]]
index = 3
xyz = [500, 0, 0]
capsule = { to = [500, 0, 0], radius = 30 }
[[zones]]
name = "table"
kind = "forbidden"
corner_1 = [1000, -800, 900]
corner_2 = [2000, 800, 1150]
"""


def test_interrupts_wait_while_an_error_is_handled() -> None:
    text = (WAY + FAULT).format("ML X=9000", "WAIT 0.5\nRESUME NEXT") + "LOST:\nSET DO6\nEND\n"
    text = text.replace("ON ERROR SUB FAULT\n", "ON ERROR SUB FAULT\nON DI1 SUB LOST\n")
    for done in everywhere(text, scenario=at(0.9, DI1=True)):
        if done.column("override")[3] < 1.0:
            continue
        labels = [(e.data["label"], e.data["action"]) for e in done.events("interrupt")]
        assert labels == [
            ("FAULT", "triggered"),
            ("FAULT", "begun"),
            ("LOST", "triggered"),
            ("FAULT", "returned"),
            ("LOST", "begun"),
            ("LOST", "returned"),
        ]


def test_what_the_interpreter_cannot_do_still_comes_behind_a_handled_error() -> None:
    """It was ahead: the error of the program itself had been found before."""
    for statement, code, line in (("ML P2\nLOOP:\nGOTO LOOP", "E401", 5), ("AT D5 SET DO1\nEND", "E403", 4)):
        text = f"MJ P1 F60\nON ERROR SUB FAULT\nML X=9000\n{statement}\n" + FAULT.format("RESUME NEXT")
        for done in everywhere(text):
            assert (done.code, done.failed_line) == (code, line)
            assert told(done) == NEXT


def test_a_branch_behind_the_error_is_read_where_the_robot_stands_then() -> None:
    text = "MJ P1 F60\nON ERROR SUB FAULT\nML X=9000\nIF DI1\nSET DO6\nENDIF\nML P2\n"
    for done in finished(text + FAULT.format("WAIT 0.5\nRESUME NEXT"), scenario=at(0.6, DI1=True)):
        assert outputs(done) == ["DO6"]
        (read,) = done.events("input_read")
        assert read.tick == done.events("interrupt")[-1].tick
