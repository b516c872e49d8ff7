"""Jogging as the library offers it: every space, the speed asked for, never past limits or into zones."""

from __future__ import annotations

import numpy as np
import pytest

from viapoint.interactive import Interactive
from viapoint.jogging import COORDINATES, Jog, JogError, JogSpace
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.kernel import State
from viapoint.runtime.records import Window
from viapoint.runtime.rotations import matrix_to_rotation_vector
from viapoint.session import Status, compile_text

CELL = """
[robot]
model = "frigeni6"

[[frames]]
index = 1
xyz = [1000, 200, 300]
abc = [30, 20, 10]

[[zones]]
name = "press"
kind = "forbidden"
frame = 0
corner_1 = [1500, 500, 500]
corner_2 = [2600, 900, 2500]

[auxiliary_axes.E1]
kind = "linear"
range = [0, 500]
speed = 500
acceleration = 2000
"""
START = "MJ X=1500 Y=-200 Z=1500 A=20 B=70 C=-30 F60\nT 0\n"
BY = {"X": 30.0, "Y": -20.0, "Z": 25.0, "A": 7.0, "B": -4.0, "C": 5.0}


@pytest.fixture
def session() -> Interactive:
    begun = Interactive(parse_cell(CELL))
    begun.take_on(compile_text(START, cell=begun.cell))
    assert begun.finish() is Status.FINISHED
    return begun


def jog(session: Interactive, each: Jog) -> list[Window]:
    session.jog(each)
    return list(session.run())


def require_limits(session: Interactive, windows: list[Window]) -> None:
    joints = np.concatenate([window.joints for window in windows])
    speed = np.diff(joints, axis=0) / session.cell.tick
    assert (np.abs(speed) <= session.cell.robot.limits.speed * (1.0 + 1e-9)).all()


@pytest.mark.parametrize("axis", BY)
@pytest.mark.parametrize("space", [JogSpace.BASE, JogSpace.FRAME, JogSpace.TOOL])
def test_along_or_about_an_axis_of_a_space(space: JogSpace, axis: str, session: Interactive) -> None:
    before = session.pose
    R = {JogSpace.BASE: np.eye(3), JogSpace.FRAME: session.frame(1)[:3, :3], JogSpace.TOOL: before[:3, :3]}[
        space
    ]
    windows = jog(session, Jog(axis, BY[axis], space, frame=1))
    assert session.status is Status.FINISHED
    moved = R.T @ (session.pose[:3, 3] - before[:3, 3]) * 1000.0
    turned = R.T @ np.degrees(matrix_to_rotation_vector(session.pose[:3, :3] @ before[:3, :3].T))
    expected = np.where(np.array(list(COORDINATES)) == axis, BY[axis], 0.0)
    np.testing.assert_allclose([*moved, *turned], expected, atol=1e-5)
    require_limits(session, windows)


@pytest.mark.parametrize("joint", range(6))
def test_a_joint(joint: int, session: Interactive) -> None:
    before = session.kernel.telemetry.joints.copy()
    windows = jog(session, Jog(f"J{joint + 1}", -6.5, JogSpace.JOINT))
    moved = np.degrees(session.kernel.telemetry.joints - before)
    np.testing.assert_allclose(moved, np.where(np.arange(6) == joint, -6.5, 0.0), atol=1e-9)
    require_limits(session, windows)


def test_an_auxiliary_axis(session: Interactive) -> None:
    jog(session, Jog("E1", 120.0, JogSpace.JOINT))
    np.testing.assert_allclose(session.kernel.telemetry.auxiliary, [0.12])
    jog(session, Jog("E1", 400.0, JogSpace.JOINT))
    assert session.failure is not None
    assert session.failure.code == "E307"
    np.testing.assert_allclose(session.kernel.telemetry.auxiliary, [0.12])


def test_at_the_speed_asked_for_and_the_modal_one_stays(session: Interactive) -> None:
    modal = session.modal
    for speed in (40.0, 120.0):
        windows = jog(session, Jog("Y", -150.0 if speed == 40.0 else 150.0, speed=speed))
        fastest = max(window.speed.max() for window in windows) * 1000.0
        assert 0.999 * speed < fastest <= speed * (1.0 + 1e-9)
        assert session.modal == modal


@pytest.mark.parametrize(
    ("each", "code"),
    [
        (Jog("Y", 900.0), "E330"),
        (Jog("Y", 900.0, JogSpace.FRAME, frame=0), "E330"),
        (Jog("X", 3000.0, JogSpace.TOOL), "E302"),
        (Jog("J1", 200.0, JogSpace.JOINT), "E303"),
    ],
)
def test_into_no_zone_and_past_no_limit(each: Jog, code: str, session: Interactive) -> None:
    before = session.kernel.telemetry.joints.copy()
    jog(session, each)
    assert session.status is Status.ERROR
    assert session.failure is not None
    assert session.failure.code == code
    np.testing.assert_array_equal(session.kernel.telemetry.joints, before)
    jog(session, Jog("Z", 10.0))
    assert session.status is Status.FINISHED


def test_it_can_be_stopped_on_its_line(session: Interactive) -> None:
    before = session.pose
    session.jog(Jog("Z", 300.0, speed=100.0))
    for window in session.run(most=500):
        assert window.line.size
    assert session.stop() is None
    windows = list(session.run())
    assert session.kernel.state is State.STOPPED
    moved = (session.pose[:3, 3] - before[:3, 3]) * 1000.0
    np.testing.assert_allclose(moved[:2], 0.0, atol=1e-5)
    assert 1.0 < moved[2] < 299.0
    require_limits(session, windows)


def test_not_while_a_program_is_under_way(session: Interactive) -> None:
    session.take_on(compile_text("WAIT DI 1", cell=session.cell))
    list(session.run())
    with pytest.raises(RuntimeError, match="waiting"):
        session.jog(Jog("Z", 10.0))


@pytest.mark.parametrize(
    "each",
    [
        Jog("Q", 5.0),
        Jog("J1", 5.0),
        Jog("XY", 5.0),
        Jog("X", 5.0, JogSpace.JOINT),
        Jog("J7", 5.0, JogSpace.JOINT),
        Jog("E2", 5.0, JogSpace.JOINT),
        Jog("X", 5.0, JogSpace.FRAME, frame=7),
        Jog("X", float("nan")),
        Jog("X", 5.0, speed=0.0),
        Jog("X", 5.0, speed=float("inf")),
    ],
)
def test_what_cannot_be_jogged(each: Jog, session: Interactive) -> None:
    tick = session.kernel.tick
    with pytest.raises(JogError):
        session.jog(each)
    assert session.kernel.tick == tick
    assert not session.under_way
