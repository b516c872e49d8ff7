"""Variables between the robots of a cell: when what one writes is seen by another, and what adds up."""

from __future__ import annotations

from random import Random

import pytest
from station_runs import FACING, StationRun, run

from viapoint.session import Status

CELL = "[variables]\ncount = 0\nturn = 1\nready = false\n" + FACING
MOVE = "MJ J1=30 F60\n"
WINDOWS = [1, 64, 1024]


def _values(done: StationRun, name: str) -> list[tuple[int, int, float]]:
    return [
        (e.tick, e.robot, e.data["value"])
        for e in done.station.events
        if e.kind == "output" and e.data["signal"] == f"${name}"
    ]


@pytest.mark.parametrize("window", WINDOWS)
def test_what_one_robot_writes_another_sees_in_the_next_tick(window: int) -> None:
    done = run(f"{MOVE}LET $ready = TRUE\n", "WAIT $ready\nSET DO2\n", cell=CELL, window=window)
    ((written, _, _),) = _values(done, "ready")
    assert done.ticks_of("output", 2, signal="DO2") == [written + 1]


@pytest.mark.parametrize("window", WINDOWS)
def test_increments_of_two_robots_in_one_tick_both_count(window: int) -> None:
    count = "L: WAIT 0.01\nINC $count\nGOTO L 3\nWAIT 0.01\nIF $count = 6\nSET DO1\nENDIF\n"
    done = run(count, count, cell=CELL, window=window)
    assert _values(done, "count") == [
        (tick, robot, value)
        for k, tick in enumerate((10, 20, 30))
        for robot, value in ((1, 2.0 * k + 1.0), (2, 2.0 * k + 2.0))
    ]
    assert len([e for e in done.station.events if e.data.get("signal") == "DO1"]) == 2


def test_of_two_values_in_one_tick_that_of_the_later_robot_stays() -> None:
    done = run("LET $count = 5\n", "LET $count = 7\nINC $count\n", cell=CELL)
    assert done.station.world.bank.read(done.station.world.bank.resolve("$count")) == 0.0
    done = run("LET $count = 5\nWAIT 0.01\n", "LET $count = 7\nINC $count\nWAIT 0.01\n", cell=CELL)
    assert [value for _, _, value in _values(done, "count")] == [5.0, 7.0, 8.0]
    assert done.station.world.bank.read(done.station.world.bank.resolve("$count")) == 8.0


@pytest.mark.parametrize("window", WINDOWS)
def test_two_robots_take_turns(window: int) -> None:
    text = "A: WAIT $turn = {mine}\nMJ J1=30 F180\nLET $turn = {other}\nMJ J1=40\nGOTO A 2\n"
    done = run(text.format(mine=1, other=2), text.format(mine=2, other=1), cell=CELL, window=window)
    assert done.station.status is Status.FINISHED
    assert [robot for _, robot, _ in _values(done, "turn")] == [1, 2, 1, 2]


def test_who_waits_for_a_variable_that_nobody_writes_any_more_is_told() -> None:
    done = run(f"WAIT $count >= 2\n{MOVE}", f"{MOVE}INC $count\n", cell=CELL)
    assert done.failures == {
        1: "E410 1 WAIT $count >= 2 waits for signals that nothing in the scenario changes any more"
    }


def test_random_programs_of_two_robots_count_the_same_in_every_window() -> None:
    seed = 20261127
    random = Random(seed)
    for round_number in range(6):
        programs = []
        for _ in range(2):
            lines = [_line(random) for _ in range(6)]
            programs.append("\n".join(lines) + "\n")
        short, middle, long = (run(*programs, cell=CELL, window=w) for w in WINDOWS)
        assert short.history == middle.history == long.history, (seed, round_number, programs)


def _line(random: Random) -> str:
    return random.choice(
        (
            f"WAIT {random.choice((0.001, 0.002, 0.005))}",
            f"INC $count {random.randint(-3, 5)}",
            f"LET $count = {random.randint(0, 9)}",
            "LET $turn = $count",
            f"IF $count > {random.randint(0, 6)}\nINC $turn\nENDIF",
            f"AT {random.randint(0, 100)}% INC $count\nMJ J1={random.randint(30, 50)} F180",
        )
    )
