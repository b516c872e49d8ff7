"""Jogging: along which axis, by how much, and not where the robot must not go."""

from __future__ import annotations

import numpy as np
import pytest
from repl_sittings import Sitting

from viapoint.jogging import HeldJog
from viapoint.repl import Complaint, Console
from viapoint.repl.jogging import statement
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.kernel import State
from viapoint.runtime.rotations import rotation_vector_to_matrix
from viapoint.session import compile_text

BY = {"X": 30.0, "Y": -20.0, "Z": 25.0, "A": 7.0, "B": -4.0, "C": 5.0}


@pytest.mark.parametrize("axis", BY)
@pytest.mark.parametrize("space", ["", "base ", "tool ", "frame 1 "])
def test_along_an_axis_of_a_space(space: str, axis: str, sitting: Sitting) -> None:
    session = sitting.console.session
    sitting.enter("MJ X=1500 Y=-200 Z=1500 A=20 B=70 C=-30 F60", "T 1")
    before, by = session.pose, BY[axis]
    R = {"": np.eye(3), "tool": before[:3, :3], "frame": session.frame(1)[:3, :3]}.get(
        space.split(" ")[0], np.eye(3)
    )
    sitting.enter(f":jog {space}{axis} {by}")
    direction, after = R[:, "XYZABC".index(axis) % 3], session.pose
    if axis in "XYZ":
        np.testing.assert_allclose(after[:3, 3], before[:3, 3] + direction * by / 1000.0, atol=1e-9)
        np.testing.assert_allclose(after[:3, :3], before[:3, :3], atol=1e-9)
    else:
        turned = rotation_vector_to_matrix(direction * np.radians(by)) @ before[:3, :3]
        np.testing.assert_allclose(after[:3, :3], turned, atol=1e-9)
        np.testing.assert_allclose(after[:3, 3], before[:3, 3], atol=1e-9)


def test_joints_and_speed_stay_as_they_are(sitting: Sitting) -> None:
    sitting.enter("MJ P1 F60")
    session = sitting.console.session
    before, modal = session.kernel.telemetry.joints.copy(), session.modal
    sitting.enter(":jog J4 -12.5", ":jog J6 3")
    np.testing.assert_allclose(
        np.degrees(session.kernel.telemetry.joints - before), [0, 0, 0, -12.5, 0, 3], atol=1e-9
    )
    assert session.modal == modal


def test_an_auxiliary_axis() -> None:
    axis = '[auxiliary_axes.E1]\nkind = "linear"\nrange = [0, 500]\nspeed = 500\nacceleration = 2000\n'
    said: list[str] = []
    console = Console(parse_cell(f'[robot]\nmodel = "frigeni6"\n{axis}'), said.append)
    console.enter(":jog E1 120")
    console.enter(":jog E1 -20")
    np.testing.assert_allclose(console.session.kernel.telemetry.auxiliary, [0.1])
    console.enter(":jog E1 900")
    assert "E307" in said[-1]
    console.enter(":jog E2 1")
    assert "the cell has no axis E2" in said[-1]


def test_not_beyond_ranges_nor_into_zones() -> None:
    zone = '[[zones]]\nname = "press"\nkind = "forbidden"\nframe = 0\n'
    zone += "corner_1 = [1700, -500, 2000]\ncorner_2 = [2600, 500, 2500]\n"
    said: list[str] = []
    console = Console(parse_cell(f'[robot]\nmodel = "frigeni6"\n{zone}'), said.append)
    before = console.session.kernel.telemetry.joints.copy()
    for line, code in ((":jog Z -400", "E330"), (":jog J1 200", "E303"), (":jog J1 1e400", "not a number")):
        console.enter(line)
        assert code in said[-1]
        np.testing.assert_array_equal(console.session.kernel.telemetry.joints, before)
    assert console.session.kernel.tick == 0


def test_what_is_no_axis(sitting: Sitting) -> None:
    for line in ("Q 5", "X", "J0 5", "X 1 2", "frame X 1", "J1 5 at 0"):
        with pytest.raises(Complaint):
            statement(sitting.console.session, line.split())


def held(sitting: Sitting) -> Sitting:
    """A jog in which time was stopped: Ctrl-C, twice."""
    sitting.enter("MJ P1 F60")
    session = sitting.console.session
    assert session.hold(HeldJog("Z", 1)) is None
    list(session.run(most=300))
    return sitting


def test_a_jog_in_which_time_was_stopped_goes_on_or_is_stopped(sitting: Sitting) -> None:
    said = held(sitting).enter(
        "ML P2", ":run", ":halt", ":teach P9", ":status", ":jog X+", ":override 50", ":stop"
    )
    assert said.count("the robot is being jogged") == 3
    assert "jogging | " in said
    assert said.splitlines()[-1].startswith("at X=")
    assert sitting.console.session.kernel.state is State.FINISHED
    said = held(sitting).enter(":continue for 0.2", ":time 0.1", ":stop", "MJ P1", ":status")
    assert said.splitlines()[0].startswith("jogging at X=")
    assert "ready |" in said


def test_an_emergency_stop_of_a_jog_is_reset_before_anything_moves(sitting: Sitting) -> None:
    said = held(sitting).enter(
        ":estop", "MJ P2", ":jog X 5", ":jog X+ for 1", ":calibrate frame 3 P1 P2 P3", ":status"
    )
    assert "emergency stop at X=" in said.splitlines()[0]
    assert said.count("`:reset` first") + said.count("reset it first") == 4
    with pytest.raises(RuntimeError, match="emergency stop"):
        sitting.console.session.take_on(compile_text("MJ P2\n", cell=sitting.console.session.cell))
    assert sitting.enter(":reset", "MJ P1").splitlines()[0] == "ready"
    assert sitting.console.session.kernel.state is State.FINISHED
