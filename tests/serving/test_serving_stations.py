"""A cell of several robots that serves: one server, each robot addressed, time shared."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import pytest
from serving_runs import FILES, served

from viapoint.client import Client, ServerError

TWO = ("--cell", "two/cell.toml", "--await-client")


def test_a_client_process_operates_both_robots() -> None:
    with served(None, *TWO) as run:
        done = subprocess.run(
            [sys.executable, str(FILES / "two" / "operator.py"), str(run.port)],
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
        report = run.report()
    said = done.stdout.splitlines()
    assert said[0] == "[(1, 'left', 'two/left.via'), (2, 'right', 'two/right.via')]"
    assert said[1:3] == ["robot 1 stands for DI3", "robot 2 stands for $lot > 2"]
    assert said[-1] == "finished"
    assert len({int(word) for word in said[-2].split()[1:]}) == 1, "as many monitors of either"
    assert report["status"] == "finished"
    commands = [(e["robot"], e["do"]) for e in report["events"] if e["kind"] == "command"]
    assert sorted(commands) == [(1, "reset_m"), (1, "set"), (1, "variable"), (2, "reset_m")]
    # Time stands still while both wait, however long the client takes: left only goes on with its input.
    waits = [(e["robot"], e["reason"]) for e in report["events"] if e["kind"] == "wait"]
    assert (2, "WAIT $lot > 2") in waits
    assert [robot for robot, _ in waits].count(1) == 2


def operate(port: int) -> tuple[list[Any], list[Any]]:
    """The same commands at the same ticks; what was answered, and where the robots were then."""
    places, answers = [], []
    with Client(port=port) as client:
        assert [each["name"] for each in client.hello["robots"]] == ["left", "right"]
        assert "program" not in client.hello
        client.request("lockstep", on=True)
        client.request("start")
        for do, values, ticks in (
            ("halt", {"robot": 2}, 300),
            ("continue", {"robot": "right"}, 50),
            ("override", {"percent": 50, "robot": 1}, 50),
            ("halt", {}, 300),
            ("continue", {"robot": 1}, 100),
            ("continue", {}, 20),
            ("estop", {"robot": 2}, 300),
            ("reset", {}, 1),
            ("continue", {}, 1),
            ("override", {"percent": 100}, 1500),
            ("variable", {"name": "lot", "value": 3}, 5),
            ("stop", {"robot": "right"}, 300),
        ):
            answers.append((do, client.request(do, **values)["tick"]))
            client.request("advance", ticks=ticks)
            monitors = [client.request("monitor", robot=robot)["monitor"] for robot in (1, 2)]
            places.append(
                [(m["robot"], m["tick"], m["state"], m["override"], m["joints_deg"]) for m in monitors]
            )
        client.request("set", signal="DI3", value=True)
        client.request("advance", ticks=100)
        client.request("reset_m", index=7, robot=1)
        client.request("advance", ticks=10_000)
    return answers, places


def test_commands_go_to_one_robot_or_to_all_and_a_run_in_lockstep_repeats() -> None:
    runs = []
    for _ in range(2):
        with served(None, *TWO) as run:
            told = operate(run.port)
            report = run.report()
        for robot in report["robots"]:
            robot.pop("realtime_factor")
        runs.append((told, report))
    assert runs[0] == runs[1]
    (_, places), report = runs[0]
    states = [[state for _, _, state, _, _ in pair] for pair in places]
    assert states[0] == ["moving", "halted"]
    assert states[1] == ["moving", "moving"]
    assert [pair[0][3] for pair in places[1:3]] == [100.0, 50.0]
    assert [pair[1][3] for pair in places[1:3]] == [100.0, 100.0]
    assert states[3] == ["halted", "halted"]
    assert states[4] == ["moving", "halted"]
    assert states[6][1] == "emergency stop"
    assert states[-1][1] == "stopped"
    assert places[0][1][4] == pytest.approx([40.0, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-3), "halted as it set out"
    assert report["status"] == "stopped"
    assert [robot["status"] for robot in report["robots"]] == ["finished", "stopped"]


REFUSED = [
    ("monitor", {}, 'say which one, as in "robot": 2'),
    ("reset_m", {"index": 7}, 'say which one, as in "robot": 2'),
    ("reference", {"axes": {"J1": 1}}, 'say which one, as in "robot": 2'),
    ("reference", {"axes": {"J1": 400}, "robot": 1}, "outside its range"),
    ("halt", {"robot": 3}, "no robot 3; its robots are 1, 2"),
    ("halt", {"robot": "rigth"}, "did you mean `right`?"),
    ("halt", {"robot": True}, "`robot` must be the number or name of a robot"),
    ("set", {"signal": "DI1", "value": True, "robot": 1}, "takes signal, value, not `robot`"),
    ("continue", {}, "nothing is halted"),
    ("subscribe", {"robot": 0}, "no robot 0"),
    ("jog", {"axis": "J1", "direction": 1}, "not jogged by a client"),
]


def test_what_is_wrong_is_answered_and_one_robot_can_be_watched() -> None:
    with served(None, *TWO, "--max-time", "0.3") as run:
        with Client(port=run.port) as client:
            for do, values, why in REFUSED:
                with pytest.raises(ServerError) as refused:
                    client.request(do, **values)
                assert why in str(refused.value), do
            client.request("subscribe", monitor_hz=20, robot="right")
            client.request("start")
            told = []
            while "end" not in (line := client.told()):
                told.append(line["monitor"])
        assert [m["robot"] for m in told] == [2] * 7
        assert [m["tick"] for m in told] == list(range(0, 301, 50))
        assert run.report()["status"] == "stopped"


def test_ctrl_c_ends_a_run_of_two_that_wait() -> None:
    with served(None, *TWO) as run, Client(port=run.port) as client:
        client.request("subscribe", events=True)
        client.request("start")
        while "standing" not in client.told():
            pass
        run.process.terminate()
        report = run.report()
        assert report["status"] == "stopped"
        assert run.process.returncode == 1
