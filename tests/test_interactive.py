"""A session that takes program after program: what carries on, where it halts, how it steps on and back."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from session_runs import cell
from viapoint.interactive import Interactive
from viapoint.runtime.kernel import State
from viapoint.runtime.records import Window
from viapoint.runtime.signals import parse_scenario
from viapoint.session import CompileError, Session, Status, compile_text
from viapoint.vm.ports import Speed, SpeedKind

PART = "ML X=1600 Y=0\nML P2 F300 R50\nML P3 R50\nSET DO1\nML P4 R30\nMJ P1 F40\nML P2 F250\n"
BEGIN = "MJ P1 F60"


class Bench:
    """An interactive session and all its windows."""

    def __init__(self, **settings: object) -> None:
        self.windows: list[Window] = []
        self.session = Interactive(cell(**{k: v for k, v in settings.items() if isinstance(v, str)}))

    def do(self, text: str, **settings: object) -> Interactive:
        program = compile_text(text, cell=self.session.cell)
        self.session.take_on(program, **settings)  # type: ignore[arg-type]
        return self.go()

    def go(self) -> Interactive:
        self.windows += list(self.session.run())
        return self.session

    @property
    def joints(self) -> np.ndarray:
        return self.session.kernel.telemetry.joints


def blocks(session: Session) -> list[tuple[object, ...]]:
    """Line, command and length of every motion executed."""
    found = [event for event in session.events if event.kind == "block"]
    return [(e.line, e.data["command"], round(float(str(e.data["length_mm"])), 6)) for e in found]


def test_statements_carry_on() -> None:
    bench = Bench()
    bench.do(BEGIN)
    bench.do("T 1")
    session = bench.do("ML P2 F200 T2")
    assert session.modal == (Speed(SpeedKind.GENERIC, 200.0), 1)
    session = bench.do("ML X=1600")
    whole = Session(
        session.cell, compile_text(f"{BEGIN}\nT 1\nML P2 F200 T2\nML X=1600\n", cell=session.cell)
    )
    assert whole.finish() is Status.FINISHED
    assert [each[1:] for each in blocks(session)] == [each[1:] for each in blocks(whole)]
    np.testing.assert_allclose(bench.joints, whole.kernel.telemetry.joints, atol=1e-9)
    assert session.kernel.tick == whole.kernel.tick


def test_ticks_and_joints_go_on_without_a_gap() -> None:
    bench = Bench()
    for text in (BEGIN, "ML P2 F200", "ML X=99999", "WAIT 0.2", "ML P3"):
        bench.do(text)
    for before, after in pairwise(bench.windows):
        assert after.first_tick == before.first_tick + len(before)
    joints = np.concatenate([window.joints for window in bench.windows])
    speed = np.diff(joints, axis=0) / bench.session.cell.tick
    assert (np.abs(speed) <= bench.session.cell.robot.limits.speed * (1.0 + 1e-9)).all()


def test_a_refused_motion_leaves_the_robot_where_it_was() -> None:
    bench = Bench()
    bench.do(BEGIN + "\nT 1")
    before, modal = bench.joints.copy(), bench.session.modal
    session = bench.do("ML X=99999 F10")
    assert session.status is Status.ERROR
    assert session.failure is not None
    assert session.failure.code == "E302"
    np.testing.assert_array_equal(bench.joints, before)
    assert bench.do("ML P2").status is Status.FINISHED
    assert session.modal.tool == modal.tool
    assert session.kernel.tool == 1


def test_a_stop_leaves_the_program_and_the_next_statement_starts_there() -> None:
    bench = Bench()
    bench.do(BEGIN)
    bench.session.take_on(compile_text("ML P2 F200\nML P3\n", cell=bench.session.cell))
    for window in bench.session.run():
        if window.time[-1] > 2.0:
            break
    bench.session.stop()
    assert bench.go().status is Status.STOPPED
    x, y, _ = bench.session.cell.robot.fk(bench.joints)[:3, 3]
    assert x == pytest.approx(1.5)
    assert -0.29 < y < 0.29
    assert bench.do("ML P4").status is Status.FINISHED


def test_breakpoints_change_neither_path_nor_events() -> None:
    plain, halted = Bench(), Bench()
    plain.do(BEGIN)
    halted.do(BEGIN)
    plain.do(PART)
    asked: list[int] = []
    session = halted.do(PART, breakpoints={n: lambda n=n: not asked.append(n) for n in (3, 4, 5, 7)})
    places = []
    while session.under_way:
        assert session.kernel.state is State.HALTED
        places.append(session.next_line)
        assert halted.windows[-1].speed[-1] < 0.2e-3
        session.resume()
        halted.go()
    assert places == asked == [3, 4, 5, 7]
    assert blocks(session) == blocks(plain.session)
    np.testing.assert_allclose(halted.joints, plain.joints, atol=1e-9)


def test_a_condition_is_asked_when_the_robot_is_there() -> None:
    bench = Bench()
    bench.do(BEGIN)
    question = bench.session.question("DO1 AND NOT DI2")
    session = bench.do(PART + "SET DO2\n", breakpoints={3: question, 6: question})
    assert session.next_line == 6
    assert not any(event.kind == "input_read" for event in session.events)
    session.resume()
    assert bench.go().status is Status.FINISHED
    with pytest.raises(CompileError, match="E1"):
        session.question("DO1 AND")


def test_steps_are_statements_of_the_robot_on_the_path_of_automatic() -> None:
    plain, stepped = Bench(), Bench()
    plain.do(BEGIN + "\n" + PART)
    session = stepped.do(BEGIN + "\n" + PART, steps=1)
    lines = []
    while session.under_way:
        lines.append(session.next_line)
        session.step_on()
        stepped.go()
    assert lines == [2, 3, 4, 5, 6, 7, 8]
    assert blocks(session) == blocks(plain.session)


def test_back_over_programs_and_on_again() -> None:
    bench = Bench()
    stands = [bench.joints.copy()]
    for text in (BEGIN, "ML P2 F300", "ML P3\nML P4 R20"):
        bench.do(text)
        stands.append(bench.joints.copy())
    session = bench.session
    events = len(session.events)
    for expected in (None, stands[2], stands[1], stands[0]):
        session.step_back()
        bench.go()
        assert session.kernel.state is State.HALTED
        if expected is not None:
            np.testing.assert_allclose(bench.joints, expected, atol=1e-9)
    session.step_back()  # there is nothing further back
    bench.go()
    np.testing.assert_allclose(bench.joints, stands[0], atol=1e-9)
    session.step_on()
    bench.go()
    np.testing.assert_allclose(bench.joints, stands[1], atol=1e-9)
    session.resume()
    bench.go()
    assert session.kernel.state is State.FINISHED
    np.testing.assert_allclose(bench.joints, stands[3], atol=1e-9)
    assert len(session.events) == events


def test_a_statement_after_steps_back_starts_where_the_robot_is() -> None:
    bench = Bench()
    for text in (BEGIN, "ML P2 F300", "ML P3"):
        bench.do(text)
    bench.session.step_back()
    bench.go()
    before = len(bench.windows)
    bench.do("ML P1")
    y = np.concatenate([window.position[:, 1] for window in bench.windows[before:]])
    assert y.max() <= 0.3 + 1e-9
    x = np.concatenate([window.position[:, 0] for window in bench.windows[before:]])
    np.testing.assert_allclose(x, 1.5, atol=1e-6)  # from P2 straight to P1, not by way of P3


def test_it_waits_for_somebody_outside() -> None:
    bench = Bench()
    session = bench.do("WAIT DI 3\nSET DO1\n")
    assert session.under_way
    assert session.at_rest
    session.set_input("DI3", True)
    assert bench.go().status is Status.FINISHED
    assert session.kernel.tick == 2  # DI3 is seen, DO1 written; and what was written can be seen
    assert session.signals.read(session.signals.resolve("DO1"))


def test_the_scenario_goes_on_between_programs() -> None:
    scenario = '[[when]]\nsignal = "DO1"\nbecomes = true\nafter_s = 0.5\nset = { DI3 = true }\n'
    session = Interactive(cell(), scenario=parse_scenario(scenario, cell()))
    session.take_on(compile_text("SET DO1\nWAIT 0.2"))
    list(session.run())
    session.take_on(compile_text("WAIT DI 3"))
    list(session.run())
    assert session.kernel.tick == 500


def test_auxiliary_axes_stay_where_they_are() -> None:
    axes = '\n[auxiliary_axes.E1]\nkind = "linear"\nrange = [0, 3000]\nspeed = 1000\nacceleration = 3000\n'
    bench = Bench(more=axes)
    bench.do("MJ P1 F60 E1=500")
    bench.do("ML X=99999")
    session = bench.do("ML P2 F300")
    np.testing.assert_allclose(session.kernel.telemetry.auxiliary, [0.5])


def test_points_can_be_taught_between_programs() -> None:
    bench = Bench()
    bench.do(BEGIN)
    session = bench.session
    session.points[9] = session.cell.points[3]
    assert bench.do("ML P9 F300").status is Status.FINISHED
    assert bench.do("MJ P3").status is Status.FINISHED
    session.set_input("DI3", True)
    bench.do("ML P4 F300 UNTIL DI3 CAPTURE P2")
    bench.do("ML P3")
    bench.do("ML P2")  # as captured, not as taught
    assert session.pose[0, 3] > 1.51
    session.teach(2)
    bench.do("ML P3")
    bench.do("ML P2")
    np.testing.assert_allclose(session.points[2].pose, session.pose, atol=1e-9)
    assert 9 not in cell().points


def test_one_program_at_a_time() -> None:
    bench = Bench()
    bench.do("WAIT DI 3")
    with pytest.raises(RuntimeError, match="waiting"):
        bench.do("ML P1")
