"""What happens in which tick: barriers, outputs, waits, M functions and polling."""

from __future__ import annotations

import numpy as np
import pytest

from session_runs import Run, at, cell, run

TICK = 0.001
BRANCH = """\
MJ P1 F80
ML X=1500 Y=-250 F300
IF DI1
SET DO1
ELSE
SET DO2
ENDIF
ML X=1550
"""


def outputs(done: Run) -> list[tuple[int, int, str, bool]]:
    return [(e.tick, e.line, str(e.data["signal"]), bool(e.data["value"])) for e in done.events("output")]


@pytest.fixture(scope="module")
def arrival() -> int:
    return run(BRANCH).events("input_read")[0].tick


@pytest.mark.parametrize("late", range(-3, 4))
@pytest.mark.parametrize("value", [True, False])
def test_the_value_in_the_tick_of_arrival_decides(arrival: int, late: int, value: bool) -> None:
    """An input flips one tick earlier and later: what counts is what it is when the path arrives."""
    before = at(0.0, DI1=not value)
    done = run(BRANCH, scenario=before + at((arrival + late) * TICK, DI1=value))
    read = done.events("input_read")[0]
    seen = value if late <= 0 else not value
    assert (read.tick, read.data["value"], read.data["ahead"]) == (arrival, seen, False)
    assert outputs(done) == [(arrival, 4 if seen else 6, "DO1" if seen else "DO2", True)]
    assert done.end_of(2) == arrival


def test_the_robot_stands_exactly_on_the_barrier() -> None:
    done = run(BRANCH)
    tick = done.events("input_read")[0].tick
    assert np.abs(done.column("position")[tick] - [1.5, -0.25, 1.5]).max() < 1e-9
    assert done.column("speed")[tick + 1] < 1e-3


def test_an_output_between_rounded_motions_is_set_in_the_middle_of_the_edge_without_slowing_down() -> None:
    with_output = run("MJ P1 F80\nML Y=-100 F200 R40\nSET DO1\nML X=1700\nEND\n")
    without = run("MJ P1 F80\nML Y=-100 F200 R40\nML X=1700\nEND\n")
    assert np.array_equal(with_output.joints, without.joints)
    (tick, line, _, _), position = outputs(with_output)[0], with_output.column("position")
    assert line == 3
    # the edge is symmetric: its middle is as far from both straight lines
    beside = [abs(position[k][0] - 1.5) - abs(position[k][1] + 0.1) for k in (tick - 1, tick)]
    assert beside[0] < 0.0 <= beside[1]
    assert with_output.end_of(2) == tick


def test_an_output_after_an_exact_stop_is_set_at_standstill() -> None:
    done = run("MJ P1 F80\nML Y=-250 F300\nSET DO1\nML X=1550\nSET DO2\nRESET DO1\n")
    first, second, third = outputs(done)
    assert first == (done.end_of(2), 3, "DO1", True)
    assert second[0] == third[0] == done.end_of(4) == done.session.kernel.tick
    for tick in (first[0], second[0]):
        assert np.abs(np.diff(done.joints[tick - 1 : tick + 1], axis=0)).max() < 1e-6


def test_a_wait_begins_at_standstill_and_lasts_exactly_its_ticks() -> None:
    done = run("MJ P1 F80\nML Y=-250 F300\nWAIT 0.25\nML X=1550\n")
    wait = done.events("wait")[0]
    assert wait.tick == done.end_of(2)
    assert wait.data["t_end"] == pytest.approx((wait.tick + 250) * TICK, abs=1e-12)
    still = done.joints[wait.tick : wait.tick + 251]
    assert np.ptp(still, axis=0).max() == 0.0
    assert np.abs(done.joints[wait.tick + 251] - still[0]).max() > 0.0


@pytest.mark.parametrize(("seconds", "ticks"), [(0.0, 0), (0.0004, 1), (0.0006, 1), (0.001, 1), (0.0101, 10)])
def test_a_wait_lasts_the_nearest_number_of_ticks_and_at_least_one(seconds: float, ticks: int) -> None:
    assert run(f"WAIT {seconds}\n").session.kernel.tick == ticks


WAIT_FOR = "MJ P1 F80\nML Y=-250 F300\nWAIT DI 1\nSET DO1\n"


def test_an_input_that_is_true_on_arrival_is_not_waited_for() -> None:
    done = run(WAIT_FOR, scenario=at(0.1, DI1=True))
    assert not done.events("wait")
    assert outputs(done)[0][0] == done.end_of(2)


def test_an_input_that_was_true_before_arrival_counts_for_nothing() -> None:
    done = run(WAIT_FOR, scenario=at(0.1, DI1=True) + at(0.2, DI1=False) + at(9.0, DI1=True))
    (wait,) = done.events("wait")
    assert (wait.tick, wait.data["t_end"], wait.data["reason"]) == (done.end_of(2), 9.0, "DI1")
    assert [(e.tick, e.data["value"]) for e in done.events("input_read")] == [
        (wait.tick, False),
        (9000, True),
    ]
    assert outputs(done)[0][0] == 9000


def test_a_pulse_of_one_tick_ends_a_wait() -> None:
    done = run(WAIT_FOR, scenario=at(9.0, DI1=True) + at(9.001, DI1=False))
    assert outputs(done)[0][0] == 9000


@pytest.mark.parametrize("scenario", [None, at(0.1, DI1=True) + at(0.2, DI1=False), at(9.0, DI2=True)])
def test_a_wait_for_what_never_comes_ends_the_run(scenario: str | None) -> None:
    done = run(WAIT_FOR, scenario=scenario)
    assert (done.code, done.failed_line) == ("E410", 3)
    assert done.events("error")[0].tick == done.end_of(2)


def test_a_synchronous_m_is_raised_at_standstill_and_waits_for_its_reset() -> None:
    answer = "[[when]]\nm = 2\nafter_s = 0.3\nreset_m = 2\n"
    done = run("MJ P1 F80\nML Y=-250 F300 R20\nM 2\nML X=1550\n", scenario=answer)
    raised, reset = done.events("m")
    assert raised.tick == done.end_of(2)
    assert (reset.tick, reset.data["action"]) == (raised.tick + 300, "reset")
    assert np.ptp(done.joints[raised.tick : reset.tick + 1], axis=0).max() == 0.0
    assert np.abs(done.joints[reset.tick + 1] - done.joints[reset.tick]).max() > 0.0


def test_a_synchronous_m_that_nobody_resets_ends_the_run() -> None:
    done = run("MJ P1 F80\nM 2\nHOME\n")
    assert (done.code, done.failed_line) == ("E410", 2)


def test_an_asynchronous_m_is_raised_on_the_way_without_a_dip() -> None:
    rounded = "MJ P1 F80\nML Y=-100 F200 R40\n{}ML X=1700\nEND\n"
    done, without = run(rounded.format("M 5\n")), run(rounded.format(""))
    assert np.array_equal(done.joints, without.joints)
    (raised,) = done.events("m")
    assert raised.tick == done.end_of(2)


POLL = "L: IF DI4\nGOTO OUT\nENDIF\nGOTO L\nOUT: MJ J1=5\n"


@pytest.mark.parametrize("window", [1, 7, 1024])
def test_a_polling_loop_asks_once_a_tick(window: int) -> None:
    done = run(POLL, scenario=at(0.05, DI4=True), window=window)
    assert [e.tick for e in done.events("input_read")] == list(range(51))
    assert [e.data["value"] for e in done.events("input_read")] == [False] * 50 + [True]
    assert done.status == "finished"


def test_a_polling_loop_that_can_never_end_is_told() -> None:
    done = run(POLL, scenario=at(0.05, DI3=True))
    assert (done.code, done.failed_line) == ("E410", 1)
    assert run(POLL, scenario=at(0.05, DI3=True), max_time=0.5, patient=True).status == "stopped"


def test_asking_twice_in_one_tick_is_no_vain_poll() -> None:
    """A subroutine run twice without a motion in between, and a counted loop: both come to an end."""
    for text in ("SUB C 2\nEND\nC: IF DI1\nSET DO1\nENDIF\nEND\n", "L: IF DI1\nSET DO1\nENDIF\nGOTO L 5\n"):
        done = run(text)
        assert done.status == "finished", done.session.failure


def test_a_chain_of_answers_reaches_the_robot_in_the_ticks_it_names() -> None:
    """Output, seen a tick later; the answer counts from the write."""
    answers = '[[when]]\nsignal = "DO1"\nbecomes = true\nafter_s = 0.02\nset = { DI2 = true }\n'
    done = run("SET DO1\nWAIT DI 2\nSET DO2\n", scenario=answers)
    assert outputs(done) == [(0, 1, "DO1", True), (20, 3, "DO2", True)]


def test_an_output_can_be_read_from_the_next_tick_on() -> None:
    done = run("SET DO1\nIF DO1\nSET DO2\nENDIF\nWAIT 0.001\nIF DO1\nSET DO3\nENDIF\n")
    assert [(tick, name) for tick, _, name, _ in outputs(done)] == [(0, "DO1"), (1, "DO3")]


def test_everything_before_the_first_motion_happens_in_tick_0() -> None:
    done = run("SET DO1\nT 1\nIF DI1\nELSE\nSET DO2\nENDIF\n")
    assert {e.tick for e in done.session.events} == {0}
    assert done.session.kernel.tick == 0


def test_a_dry_run_holds_process_outputs_off() -> None:
    where = cell(more='[io]\nprocess_outputs = ["DO1"]\n')
    text = "SET DO1\nWAIT 0.01\nIF DO1\nSET DO2\nENDIF\n"
    assert [name for _, _, name, _ in outputs(run(text, where))] == ["DO1", "DO2"]
    assert [name for _, _, name, _ in outputs(run(text, where, dry_run=True))] == ["DO1"]
