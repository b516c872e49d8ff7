"""Starting from a line: what holds there is restored, nothing above is done, the rest is as it would be."""

from __future__ import annotations

import math

import pytest

from session_runs import cell
from viapoint.session import Loaded, Session, Status, compile_text
from viapoint.starting import APPROACH, LineStart, StartError, start_at
from viapoint.vm.ports import Speed, SpeedKind

PROGRAM = """T 2
MJ P1 F60
ROW:
ML P2 F250
SET DO1
ML P3
IF DI3
  RESET DO1
  ML P4
ENDIF
GOTO ROW 3
WAIT 0.1
MS P1
MS P2
MS P4
SUB S
END
S:
ML P3
ML X=1700
END
"""


def program(text: str = PROGRAM) -> Loaded:
    return compile_text(text, cell=cell())


def session(first_line: int, text: str = PROGRAM) -> Session:
    return Session(cell(), program(text), first_line=first_line)


def start_of(first_line: int, text: str = PROGRAM) -> LineStart:
    return start_at(program(text).program, cell(), first_line)


def blocks(run: Session) -> list[tuple[int, str]]:
    return [(event.line, str(event.data["command"])) for event in run.events if event.kind == "block"]


@pytest.mark.parametrize("line", [4, 6, 11, 12, 13, 16])
def test_the_rest_is_what_the_whole_run_does(line: int) -> None:
    """The same joints at the end, hence the same configurations and turns on the way."""
    whole = Session(cell(), program())
    assert whole.finish() is Status.FINISHED
    run = session(line)
    assert run.finish() is Status.FINISHED
    assert run.kernel.telemetry.joints == pytest.approx(whole.kernel.telemetry.joints, abs=1e-9)
    assert run.kernel.tool == whole.kernel.tool == 2
    done = blocks(run)
    assert done[1:] == blocks(whole)[len(blocks(whole)) - len(done) + 1 :]
    assert done[0] == (line, "MJ")


def test_the_approach_is_slow_and_ends_at_rest_at_the_target() -> None:
    run = session(6)
    windows = list(run.run())
    first = next(event for event in run.events if event.kind == "block")
    last = round(float(first.data["t_end"] or 0.0) / 1e-3)
    joints = [row for window in windows for row in window.joints]
    speeds = [v for window in windows for v in window.speed]
    assert math.dist(joints[0], joints[last]) / (last * 1e-3) <= math.radians(APPROACH.value)
    assert speeds[last] < 1e-4
    whole = Session(cell(), program(), last_line=6)
    whole.finish()
    assert joints[last] == pytest.approx(whole.kernel.telemetry.joints, abs=1e-9)


def test_nothing_above_is_done() -> None:
    run = session(11)
    assert [(each.index, each.value, each.line) for each in start_of(11).skipped] == [(1, True, 5)]
    next(iter(run.run()))
    assert {event.kind for event in run.events} <= {"block"}
    run.finish()
    assert [event.line for event in run.events if event.kind == "output"] == [5, 5]


def test_what_is_restored_is_shown_before_it_moves() -> None:
    start = session(9).start
    assert start is not None
    assert start.tool == 2
    assert start.speed == Speed(SpeedKind.GENERIC, 250.0)
    assert [(read.line, read.what, read.value) for read in start.assumed] == [(7, "DI3", True)]
    assert start.counters == ()


def test_counters_are_those_of_the_arrival() -> None:
    text = "MJ P1 F60\nA:\nML P2\nIF DI1\nML P3\nENDIF\nGOTO A 5\nML P4\n"
    assert start_of(5, text).counters == ()
    text = "GOTO B\nA:\nML P2 F60\nB:\nML P3\nGOTO A 5\n"
    assert start_of(3, text).counters == (("A", 2),)


def test_an_action_begins_where_the_motion_above_ends() -> None:
    run = session(5)
    run.finish()
    kinds = [(event.kind, event.line) for event in sorted(run.events, key=lambda each: each.tick)]
    assert kinds[:2] == [("block", 5), ("output", 5)]


def test_before_the_first_motion_there_is_no_approach() -> None:
    run = session(2, "SET DO1\nSET DO2\nML P1 F100\n")
    assert run.start is not None
    assert run.start.approach is None
    run.finish()
    assert [(event.kind, event.line) for event in run.events] == [("output", 2), ("block", 3)]


@pytest.mark.parametrize(
    ("line", "message", "nearest"),
    [
        (14, "inside a spline", 13),
        (15, "inside a spline", 16),
        (19, "subroutine that begins in line 18", 16),
        (10, "no statement begins there", 9),
        (99, "no statement begins there", 16),
    ],
)
def test_lines_that_will_not_do(line: int, message: str, nearest: int) -> None:
    with pytest.raises(StartError, match=message) as refused:
        session(line)
    assert refused.value.nearest == nearest
    assert str(refused.value).endswith(f"the nearest line to start from is {nearest}")
    assert session(nearest).finish() is Status.FINISHED


def test_a_wait_ends_a_spline() -> None:
    run = session(3, "MS P1 F100\nMS P2\nWAIT 0.1\nMS P3\n")
    assert run.finish() is Status.FINISHED


def test_a_line_behind_an_end_is_never_reached() -> None:
    with pytest.raises(StartError, match="never reached"):
        session(3, "ML P1 F100\nEND\nML P2\n")


def test_what_cannot_be_planned_above_is_refused() -> None:
    with pytest.raises(StartError, match="line 1 cannot be planned"):
        session(2, "ML X=9000 F100\nML X=1500 Y=0 Z=1500\n")


def test_the_last_line_and_the_cycles_still_hold() -> None:
    run = Session(cell(), program(), first_line=6, last_line=11)
    assert run.finish() is Status.STOPPED
    text = "A:\nML P1 F100\nML P2\nGOTO A\n"
    endless = Session(cell(), program(text), first_line=3, cycles=2)
    assert endless.finish() is Status.STOPPED
    assert [line for line, _ in blocks(endless)] == [3, 2, 3]


def test_a_motion_that_acts_on_its_way_is_run_in_full() -> None:
    run = session(3, "MJ P1 F60\nAT 50% SET DO1\nML P2 F200\nAT D10 SET DO2\nML P3\n")
    assert run.finish() is Status.FINISHED
    assert blocks(run) == [(3, "MJ"), (3, "ML"), (5, "ML")]


def test_a_tangential_tool_is_turned_as_the_whole_run_turns_it() -> None:
    text = "MJ P1 F60\nTANG 1\nML X=1600 Y=100 F200\nML X=1700 Y=-100\nML X=1600 Y=-200\n"
    whole = Session(cell(), program(text))
    assert whole.finish() is Status.FINISHED
    for line in (3, 4, 5):
        run = session(line, text)
        assert run.start is not None
        assert run.start.tangent is not None
        assert run.finish() is Status.FINISHED
        assert run.kernel.telemetry.joints == pytest.approx(whole.kernel.telemetry.joints, abs=1e-8)


INTERRUPTED = """MJ P1 F60
ON DI1 SUB LOST
ON DI2 SUB OTHER
ON ERROR SUB FAULT
ML P2 F250
OFF OTHER
ON DI3 SUB LOST
ML P3
ML X=9000
ML P4
END
LOST:
SET DO1
END
OTHER:
END
FAULT:
RESUME NEXT
END
"""


def test_interrupts_that_are_on_are_switched_on_behind_the_approach() -> None:
    """The last condition of a label holds; what is OFF stays off."""
    start = start_of(8, INTERRUPTED)
    assert [str(each) for each in start.interrupts] == ["DI3 SUB LOST", "ERROR SUB FAULT"]
    assert [each.line for each in start.interrupts] == [7, 4]
    run = session(8, INTERRUPTED)
    windows = run.run()
    next(windows)
    run.set_input("DI3", True)  # true already when it is switched on: it has to turn true
    assert run.finish() is Status.FINISHED
    assert [event.data["label"] for event in run.events if event.kind == "interrupt"] == ["FAULT"] * 3
    assert start_of(5, INTERRUPTED).interrupts[1].handler.label == "OTHER"
    assert start_of(1, INTERRUPTED).interrupts == ()


def test_a_statement_above_whose_error_is_handled_is_left_out() -> None:
    """The robot goes to where the motion before it ends; without ON ERROR the start is refused."""
    run = session(10, INTERRUPTED)
    assert run.finish() is Status.FINISHED
    assert blocks(run) == [(10, "MJ")]
    assert start_of(10, INTERRUPTED).approach is not None
    with pytest.raises(StartError, match="line 9 cannot be planned"):
        start_of(10, INTERRUPTED.replace("OFF OTHER", "OFF FAULT"))


def test_a_run_does_not_start_in_a_subroutine_that_interrupts() -> None:
    with pytest.raises(StartError, match="never reached"):
        start_of(13, INTERRUPTED)
