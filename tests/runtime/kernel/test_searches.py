"""UNTIL: a motion ends where its condition comes true, and the pose of that tick can be kept as a point."""

from __future__ import annotations

import numpy as np
import pytest

from session_runs import Run, at, cell, run

SEARCH = (
    "MJ P1 F90\n{command} UNTIL DI1 CAPTURE P3\n"
    "IF FOUND\nSET DO1\nML P3 F50 R0\nELSE\nSET DO2\nENDIF\nML P1 F300\n"
)
COMMANDS = ("ML P2 F100", "MJ P2 F8", "MC P3 QX=1700 QY=0 QZ=1500 F100")


def search(done: Run, line: int = 2) -> tuple[int, bool]:
    (event,) = done.events("search", line)
    return event.tick, bool(event.data["found"])


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("override", [1.0, 0.37])
def test_what_is_found_stops_the_robot_within_its_limits(command: str, override: float) -> None:
    text = SEARCH.format(command=command)
    start = run("MJ P1 F90\n", override=override).end_of(1)
    edge = start + 700
    runs = [
        run(text, scenario=at(edge * 1e-3, DI1=True), override=override, window=window)
        for window in (1, 50, 1024)
    ]
    assert runs[0].history == runs[1].history == runs[2].history
    assert np.abs(runs[0].joints - runs[2].joints).max() < 1e-9
    done = runs[2]
    assert done.status == "finished", done.session.failure
    assert not done.over_limits()
    stopped, found = search(done)
    assert found
    assert edge < stopped < edge + 200
    assert done.end_of(2) == stopped
    reads = [e.tick for e in done.events("input_read") if e.data["signal"] == "DI1"]
    assert reads == [edge]
    assert [e.data["signal"] for e in done.events("output")] == ["DO1"]
    back = done.end_of(5)  # at the point that was kept: the pose of the tick of the edge
    assert np.abs(done.column("position")[back] - done.column("position")[edge]).max() < 1e-8
    turned = np.abs((done.column("quaternion")[back] * done.column("quaternion")[edge]).sum())
    assert turned == pytest.approx(1.0, abs=1e-12)
    assert np.abs(done.column("position")[-1] - [1.5, -0.3, 1.5]).max() < 1e-8


def test_what_is_not_found_leaves_the_motion_and_the_point_as_they_are() -> None:
    done = run("MJ P1 F90\nML P2 F300 UNTIL DI1 CAPTURE P3\nIF NOT FOUND\nML P3\nENDIF\n")
    plain = run("MJ P1 F90\nML P2 F300 \nSYNC\nML P3\n")
    assert np.array_equal(done.joints, plain.joints)
    assert search(done) == (done.end_of(2), False)


def test_what_is_true_already_keeps_the_robot_where_it_is() -> None:
    done = run("MJ P1 F90\nML P2 F300 UNTIL DI1 CAPTURE P3\nML P3\n", scenario=at(0.1, DI1=True))
    assert done.status == "finished"
    assert search(done) == (done.end_of(1), True)
    assert np.abs(done.column("position")[-1] - [1.5, -0.3, 1.5]).max() < 1e-8
    assert done.session.kernel.tick == done.end_of(1)


def test_an_edge_while_the_robot_stops_or_after_it_changes_nothing_more() -> None:
    start = run("MJ P1 F90\n").end_of(1)
    on = (start + 500) * 1e-3
    text = "MJ P1 F90\nML P2 F200 UNTIL DI1\nML P1\n"
    once = run(text, scenario=at(on, DI1=True))
    twice = run(text, scenario=at(on, DI1=True) + at(on + 0.01, DI1=False) + at(on + 0.02, DI1=True))
    assert np.array_equal(once.joints, twice.joints)


def test_actions_behind_the_place_where_it_ends_do_not_happen() -> None:
    start = run("MJ P1 F90\n").end_of(1)
    text = "MJ P1 F90\nAT D20 SET DO1\nAT 90% SET DO2\nAT D-0 SET DO3\nML P2 F200 UNTIL DI1\nML P1\n"
    done = run(text, scenario=at((start + 700) * 1e-3, DI1=True))
    assert [e.data["signal"] for e in done.events("output")] == ["DO1"]
    assert done.status == "finished"


def test_searches_follow_one_another_and_start_from_where_the_last_ended() -> None:
    text = (
        "MJ P1 F90\nROW:\nML Y=300 F200 UNTIL DI1 OR AI1 > 2\nIF NOT FOUND\nGOTO DONE\nENDIF\n"
        "ML Z=1480\nML Z=1500\nWAIT NOT DI1\nGOTO ROW\nDONE:\n"
    )
    pulses = "".join(at(t, DI1=True) + at(t + 0.3, DI1=False) for t in (2.0, 3.6, 4.8))
    runs = [run(text, scenario=pulses, window=window) for window in (1, 1024)]
    assert runs[0].history == runs[1].history
    done = runs[1]
    assert done.status == "finished", done.session.failure
    assert [e.data["found"] for e in done.events("search")] == [True, True, True, False]
    assert not done.over_limits()
    jumps = np.abs(np.diff(done.joints, axis=0)).max(axis=0) / done.session.cell.tick
    assert (jumps <= done.session.cell.robot.limits.speed).all()
    assert np.abs(done.column("position")[-1] - [1.5, 0.3, 1.5]).max() < 1e-8
    s = done.column("s")
    assert (np.diff(s) >= -1e-12).all()


def test_back_over_a_search_it_does_not_lead() -> None:
    """An override below 0 comes to rest where the last search ended: what lay behind was left."""
    from viapoint.runtime.signals import parse_scenario
    from viapoint.session import Session, compile_text

    where = cell()
    start = run("MJ P1 F90\n").end_of(1)
    text = compile_text("MJ P1 F90\nML P2 F200 UNTIL DI1\nML P4 F200\n", cell=where)
    scenario = parse_scenario(at((start + 700) * 1e-3, DI1=True), where)
    session = Session(where, text, scenario=scenario, window=20)
    turned, positions = 0.0, []
    for window in session.run():
        positions.append(window.position)
        found = [e for e in session.events if e.kind == "search"]
        if found and not turned and window.time[-1] > found[0].t + 0.5:
            session.set_override(-1.0)
            turned = window.time[-1]
        elif turned and window.time[-1] > turned + 3.0:
            break
    place = np.concatenate(positions)[found[0].tick]
    assert np.abs(window.position[-1] - place).max() < 1e-6


def test_the_frame_of_the_search_is_that_of_the_point() -> None:
    start = run("MJ P1 F90\n").end_of(1)
    text = "MJ P1 F90\nML X=300 Z1 T2 F100 UNTIL DI1 CAPTURE P3\nML Z=1600\nML P3 Z1 T2\n"
    done = run(text, scenario=at((start + 900) * 1e-3, DI1=True))
    assert done.status == "finished", done.session.failure
    assert np.abs(done.joints[-1] - done.joints[start + 900]).max() < 1e-8
