"""A run that serves: commanded by real clients, kept up by none."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time

import pytest
from serving_runs import FILES, served

from viapoint.client import Client, ServerError


def test_a_client_process_operates_the_robot() -> None:
    with served("part.via", "--await-client") as run:
        done = subprocess.run(
            [sys.executable, str(FILES / "operator.py"), str(run.port)],
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
        report = run.report()
    said = done.stdout.splitlines()
    assert said[:3] == ["part.via", "standing for DI3", "standing for the reset of M7"]
    assert said[-1] == "finished"
    assert int(said[-2].split()[1]) == report["ticks"] // 100 + 1
    assert report["status"] == "finished"
    logged = [e for e in report["events"] if e["kind"] == "command"]
    assert [(e["do"], e["client"]) for e in logged] == [("set", 1), ("reset_m", 1)]
    waits = [e for e in report["events"] if e["kind"] == "wait"]
    # The output is seen a tick after it is written; then time stands still, however long the client takes.
    assert [round((e["t_end"] - e["t"]) * 1000) for e in waits] == [2, 1]


def test_a_client_shares_variables_with_the_program() -> None:
    with served("count.via", "--await-client", "--cell", "count.toml") as run:
        with Client(port=run.port) as client:
            client.request("subscribe", events=True)
            client.request("start")
            while "standing" not in (told := client.told()):
                pass
            assert told["standing"]["for"] == "$ready AND $count > 2"
            assert client.request("variable", name="COUNT")["value"] == 1.0
            assert client.request("monitor")["monitor"]["signals"] == {"$count": 1.0, "$ready": False}
            client.request("variable", name="ready", value=True)
            client.request("set", signal="$count", value=5)
            while told.get("event", {}).get("signal") != "$count" or told["event"]["kind"] != "output":
                told = client.told()
            assert told["event"]["value"] == 15.0
            while "end" not in told:
                told = client.told()
        report = run.report()
    assert report["status"] == "finished"
    logged = [(e["do"], e.get("name"), e["value"]) for e in report["events"] if e["kind"] == "command"]
    assert logged == [("variable", "ready", True), ("set", None, 5)]


def operate(port: int) -> tuple[list[int], dict[str, object]]:
    """The same commands at the same ticks."""
    ticks = []
    with Client(port=port) as client:
        client.request("lockstep", on=True)
        client.request("start")
        for do, values, count in (
            ("override", {"percent": 60}, 700),
            ("halt", {}, 900),
            ("continue", {}, 333),
            ("estop", {}, 400),
            ("reset", {}, 50),
            ("continue", {}, 100),
            ("force", {"signal": "DI3", "value": True}, 10),
            ("release", {"signal": "DI3"}, 10),
            ("set", {"signal": "DI3", "value": True}, 1),
            ("override", {"percent": 100}, 6000),
        ):
            client.request(do, **values)
            ticks.append(client.request("advance", ticks=count)["tick"])
        last = client.request("monitor")["monitor"]
        client.request("reset_m", index=7)
        client.request("lockstep", on=False)
    return ticks, last


def test_in_lockstep_a_run_repeats() -> None:
    reports, seen = [], []
    for window in ("7", "512"):
        with served("part.via", "--await-client", "--window", window) as run:
            seen.append(operate(run.port))
            report = run.report()
            report.pop("realtime_factor")
            reports.append(report)
    assert seen[0] == seen[1]
    assert seen[0][0] == [700, 1600, 1933, 2333, 2383, 2483, 2493, 2503, 2504, 8504]
    assert seen[0][1]["state"] == "waiting"
    assert seen[0][1]["m"] == [7]
    assert reports[0]["events"] == reports[1]["events"]
    assert reports[0]["final"] == reports[1]["final"]
    assert reports[0]["status"] == "finished"


def test_a_halted_robot_stands_still_and_time_with_it() -> None:
    with served("part.via", "--await-client") as run, Client(port=run.port) as client:
        client.request("subscribe", events=True)
        client.request("halt")
        client.request("start")
        while "standing" not in (told := client.told()):
            pass
        assert told["standing"]["state"] == "halted"
        before = client.request("ping")["tick"]
        time.sleep(0.3)
        assert client.request("ping")["tick"] == before
        client.request("stop")
        while "end" not in (told := client.told()):
            pass
        assert told["end"] == {"status": "stopped", "tick": before}


REFUSED = [
    (b"halt", "not JSON"),
    (b"[1, 2]", "is an object"),
    (b'"halt"', "is an object"),
    (b"{}", "requests are start"),
    (b'{"do": 5}', "not a known request"),
    (b'{"do": "hlat"}', "did you mean `halt`?"),
    (b'{"do": "ping", "now": true}', "takes nothing more, not `now`"),
    (b'{"do": "set", "signal": "DI3"}', "needs `value`"),
    (b'{"do": "set", "signal": "DI3", "value": 1}', "DI3 takes true or false"),
    (b'{"do": "set", "signal": "AI1", "value": true}', "AI1 takes a number"),
    (b'{"do": "set", "signal": "AI1", "value": NaN}', "`value` must be"),
    (b'{"do": "set", "signal": "AI1", "value": null}', "`value` must be"),
    (b'{"do": "set", "signal": "DO1", "value": true}', "DO1 is an output"),
    (b'{"do": "force", "signal": "XX", "value": true}', "no signal `XX`"),
    (b'{"do": "reset_m", "index": -1}', "`index` must be a whole number"),
    (b'{"do": "reset_m", "index": true}', "`index` must be a whole number"),
    (b'{"do": "override", "percent": 101}', "from -100 to 100"),
    (b'{"do": "subscribe", "monitor_hz": -1}', "from 0 to 10000"),
    (b'{"do": "variable", "name": "cuont"}', "no variable `$cuont`; did you mean `$count`?"),
    (b'{"do": "variable", "name": "$count", "value": true}', "$count takes a number"),
    (b'{"do": "variable", "name": "count", "value": null}', "`value` must be"),
    (b'{"do": "set", "signal": "$ready", "value": 3}', "$ready takes true or false"),
    (b'{"do": "read", "signal": "$redy"}', "did you mean `$ready`?"),
    (b'{"do": "continue"}', "nothing is halted"),
    (b'{"do": "reset"}', "there is no emergency stop"),
    (b'{"do": "advance", "ticks": 5}', "ask for `lockstep` first"),
    (b'{"do": "monitor"}', "has not begun"),
    (b'{"id": {}, "do": "ping"}', "`id` is"),
    (b"[" * 50_000, "not JSON"),
    (b"\xff\xfe\x00", "not JSON"),
]


def test_what_is_wrong_is_answered_and_nothing_else_happens() -> None:
    with served("count.via", "--await-client", "--cell", "count.toml") as run:
        with socket.create_connection(("127.0.0.1", run.port), 30) as connection:
            stream = connection.makefile("rb")
            stream.readline()
            for line, why in REFUSED:
                connection.sendall(line + b"\r\n\n")
                answer = json.loads(stream.readline())
                assert answer["ok"] is False, line
                assert why in answer["error"], (line, answer)
            connection.sendall(b'{"id": "x", "do": "hlat"}\n{"id": 7, "do": "ping"}\n')
            assert json.loads(stream.readline())["id"] == "x"
            assert json.loads(stream.readline()) == {"id": 7, "ok": True, "tick": 0}
            connection.sendall(b"x" * 200_000)
            assert "longer than" in json.loads(stream.readline())["error"]
        with Client(port=run.port) as client:
            client.request("start")
            client.request("variable", name="ready", value=True)
            client.request("stop")
        assert run.report()["status"] in ("stopped", "finished")


def test_several_clients_one_of_them_deaf_one_dead() -> None:
    """A client that reads nothing is told less and less; the others, and the robot, do not notice."""
    with served("endless.via", "--await-client", "--max-time", "20") as run:
        deaf = socket.create_connection(("127.0.0.1", run.port), 30)
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.sendall(b'{"do": "subscribe", "monitor_hz": 1000, "events": true}\n')
        dead = socket.create_connection(("127.0.0.1", run.port), 30)
        dead.sendall(b'{"do": "subscribe", "monitor_hz": 1000}\n{"do": "lo')
        dead.close()
        with Client(port=run.port) as client:
            client.request("subscribe", monitor_hz=1, events=False)
            client.request("start")
            ticks = [client.told()["monitor"]["tick"] for _ in range(21)]
            assert ticks == list(range(0, 21_000, 1000))
            assert client.told()["end"]["status"] == "stopped"
        assert run.report()["ticks"] == 20_000
        deaf.close()


def test_the_client_of_a_lockstep_may_leave() -> None:
    with served("part.via", "--await-client", "--max-time", "3") as run:
        with Client(port=run.port) as client:
            client.request("lockstep", on=True)
            with Client(port=run.port) as other, pytest.raises(ServerError, match="another client"):
                other.request("lockstep", on=True)
            client.request("start")
            client.request("advance", ticks=100)
        assert run.report()["status"] == "stopped"


def test_ctrl_c_ends_a_run_that_waits_for_a_client() -> None:
    with served("part.via", "--await-client") as run, Client(port=run.port):
        run.process.terminate()
        report = run.report()
        assert report["status"] == "stopped"
        assert report["ticks"] <= 1
        assert run.process.returncode == 1


def test_ctrl_c_ends_a_run_in_emergency_stop() -> None:
    with served("part.via", "--await-client") as run, Client(port=run.port) as client:
        client.request("subscribe", events=True)
        client.request("start")
        client.request("estop")
        while "standing" not in client.told():
            pass
        run.process.terminate()
        assert run.report()["status"] == "stopped"


def test_with_the_clock_time_waits_for_nobody() -> None:
    with served("part.via", "--await-client", "--realtime", "--max-time", "1.5") as run:
        with Client(port=run.port) as client:
            client.request("subscribe", monitor_hz=50)
            client.request("halt")
            client.request("start")
            ticks = []
            while "end" not in (told := client.told()):
                ticks.append(told["monitor"]["tick"])
        assert ticks == list(range(0, 1501, 20))
        report = run.report()
    assert report["ticks"] == 1500
    assert report["realtime"]


@pytest.mark.parametrize(
    ("words", "code", "why"),
    [
        (["--await-client"], 2, "--await-client belongs to --serve"),
        (["--serve", "70000"], 2, "must be a port or HOST:PORT"),
        (["--serve", "host:x"], 2, "must be a port or HOST:PORT"),
        (["--serve", "192.0.2.1:0"], 1, "cannot serve on 192.0.2.1:0"),
    ],
)
def test_usage(words: list[str], code: int, why: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "viapoint", "run", "part.via", *words],
        cwd=FILES,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == code
    assert why in done.stderr


def to_its_end(client: Client) -> None:
    """Start the run, and give it what it waits for."""
    client.request("subscribe", events=True)
    client.request("start")
    with pytest.raises(ServerError, match="the run has begun"):
        client.request("jog", axis="X", direction=1)
    while "end" not in (told := client.told()):
        if told.get("standing", {}).get("for") == "DI3":
            client.request("set", signal="DI3", value=True)
        elif "standing" in told:
            client.request("reset_m", index=7)


def jog_first(port: int, step: int) -> tuple[str, float]:
    """Jog before the run begins: held by asking again, let go by falling silent. The state, and J5 then."""
    with Client(port=port) as client:
        with Client(port=port) as other:
            client.request("lockstep", on=True)
            for _ in range(4):
                client.request("jog", axis="j5", direction=1, space="joint", speed=20, seconds=0.1)
                for _ in range(80 // step):
                    client.request("advance", ticks=step)
            with pytest.raises(ServerError, match="another client jogs"):
                other.request("jog", axis="X", direction=1)
        with pytest.raises(ServerError, match="the robot is jogging"):
            client.request("start")
        client.request("advance", ticks=600)  # nothing is asked for: it stops, and time with it
        seen = client.request("monitor")["monitor"]
        for bad, words in (
            ({"axis": "J9", "direction": 1, "space": "joint"}, "last joint is J6"),
            ({"axis": "X", "direction": 3}, "`direction` must be 1 or -1"),
            ({"axis": "X", "direction": 1, "seconds": 5}, "`seconds` must be"),
        ):
            with pytest.raises(ServerError, match=words):
                client.request("jog", **bad)
        client.request("lockstep", on=False)
        to_its_end(client)
    return seen["state"], seen["joints_deg"][4]


def test_a_jog_before_the_run_that_begins_where_it_ends() -> None:
    reports, seen = [], []
    for window, step in (("1024", 80), ("1", 20)):
        with served("part.via", "--await-client", "--window", window) as run:
            seen.append(jog_first(run.port, step))
            report = run.report()
        jogs = [(e["axis"], e["action"]) for e in report["events"] if e["kind"] == "jog"]
        assert jogs == [("J5+", "held"), ("J5+", "let go")]
        assert report["status"] == "finished"
        assert max(report["limits"]["joint_speed"]) <= 1.0
        reports.append((report["ticks"], report["final"]))
    assert seen[0] == seen[1]
    assert reports[0] == reports[1]
    # 3·80 + 100 ticks at 20 deg/s, from the first request to the end of the last one
    assert seen[0] == ("ready", pytest.approx(0.34 * 20.0, rel=1e-3))


def test_the_run_begins_where_a_client_says_the_robot_stands() -> None:
    with served("part.via", "--await-client") as run, Client(port=run.port) as client:
        client.request("reference", axes={"j1": 7.5, "J5": -20})
        for bad, words in (
            ({"J9": 1}, "no axis J9"),
            ({"J2": 400.0}, "J2 = 400.0 deg is outside its range"),
            ({"J2": True}, "`axes` must be an object"),
            ({"J2": 10**400}, "`axes` must be an object"),
            ({}, "`axes` must be an object"),
        ):
            with pytest.raises(ServerError, match=words):
                client.request("reference", axes=bad)
        client.request("lockstep", on=True)
        client.request("start")
        seen = client.request("monitor")["monitor"]
        assert seen["tick"] == 0
        assert [seen["joints_deg"][i] for i in (0, 4)] == [7.5, -20.0]
        with pytest.raises(ServerError, match="the run has begun"):
            client.request("reference", axes={"J1": 0})
        client.request("lockstep", on=False)
        to_its_end(client)
        events = [e for e in run.report()["events"] if e["kind"] in ("reference", "command")]
    told = [(e["kind"], e["J1"], e["J5"]) for e in events[:2]]
    assert told == [("reference", 7.5, -20.0), ("command", 7.5, -20.0)]


def test_a_jog_whose_client_leaves_is_let_go() -> None:
    with served("part.via", "--await-client") as run:
        with Client(port=run.port) as client:
            client.request("lockstep", on=True)
            client.request("jog", axis="J1", direction=-1, space="joint", seconds=1)
            client.request("advance", ticks=300)
        with Client(port=run.port) as client:
            while client.request("monitor")["monitor"]["state"] != "ready":
                pass
            to_its_end(client)
        events = [(e["action"], round(e["t"] * 1000)) for e in run.report()["events"] if e["kind"] == "jog"]
    assert events == [("held", 0), ("let go", 300)]
