"""Cell files: what they give in SI, and everything that can be wrong with one, all at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viapoint.language.catalogue import CATALOGUE
from viapoint.language.diagnostics import Diagnostic
from viapoint.runtime.cell import CellError, Signal, SignalKind, default_cell, load_cell, parse_cell
from viapoint.runtime.robots import load_robot, robot_names

ROBOT = '[robot]\nmodel = "frigeni6"\n'
FULL = Path(__file__).with_name("full.toml")


def faults(text: str) -> list[Diagnostic]:
    with pytest.raises(CellError) as caught:
        parse_cell(text, "cell.toml")
    return list(caught.value.diagnostics)


def codes(text: str) -> list[tuple[str, int | None, str | None]]:
    return [(each.code, each.line, each.key) for each in faults(text)]


def test_smallest_cell_has_the_defaults() -> None:
    cell = parse_cell(ROBOT)
    robot = load_robot("frigeni6")
    assert cell.tick == 0.001
    assert cell.lookahead == 1024
    assert cell.home.tolist() == [0.0] * 6
    assert cell.default_speed.path == pytest.approx(0.1)
    assert cell.default_speed.joint == pytest.approx(np.radians(20))
    assert cell.path_tolerance == pytest.approx(2e-5)
    assert cell.path_limits.speed == pytest.approx(2.0)
    assert cell.path_limits.deceleration == pytest.approx(10.0)
    assert cell.path_limits.jerk == pytest.approx(100.0)
    assert cell.path_limits.angular_jerk == pytest.approx(np.radians(18000))
    np.testing.assert_array_equal(cell.robot.limits.speed, robot.limits.speed)
    np.testing.assert_array_equal(cell.tools[0].X_flange_tool, np.eye(4))
    np.testing.assert_array_equal(cell.frames[0].X_base_frame, np.eye(4))
    assert cell.io.digital_inputs == 32
    assert cell.source.text == ROBOT


def test_every_key_is_taken() -> None:
    cell = load_cell(FULL)
    assert cell.path_limits.acceleration == pytest.approx(9.0)
    assert cell.path_limits.deceleration == pytest.approx(8.0)
    np.testing.assert_allclose(np.degrees(cell.robot.limits.upper), [170, 150, 70, 350, 130, 350])
    np.testing.assert_allclose(np.degrees(cell.robot.limits.jerk[0]), 4000)
    assert cell.tools[1].name == "torch"
    np.testing.assert_allclose(cell.tools[1].X_flange_tool[:3, 3], [0.38, 0, 0])
    assert cell.tools[1].capsule is not None
    assert cell.tools[1].capsule.radius == pytest.approx(0.04)
    np.testing.assert_allclose(cell.frames[1].X_base_frame[:3, 0], [0, 1, 0], atol=1e-12)
    point = cell.points[7]
    assert (point.name, point.auxiliary, point.live) == ("pick", (0.5,), True)
    assert point.pose is not None
    np.testing.assert_allclose(point.pose[:3, 2], [1, 0, 0], atol=1e-12)
    taught = cell.points[1].joints
    assert taught is not None
    assert taught[0] == pytest.approx(np.radians(-100))
    assert cell.io.names["gripper"] == Signal(SignalKind.DIGITAL_OUTPUT, 1)
    assert cell.io.process_outputs == {5}
    assert cell.m_functions == {5: False, 6: True}
    assert cell.variables == {"count": 0.0, "ready": True}
    assert cell.conveyors[1].counts_per_metre == pytest.approx(1e5)
    assert cell.zones[0].lower.tolist() == [0.5, -0.2, 0.0]
    assert cell.orientation_cone is not None
    assert cell.auxiliary_axes[1].upper == pytest.approx(3.0)
    assert cell.drives.gear is not None
    assert cell.robot.coupling[4, 3] == 0.01
    names = cell.names()
    assert (names.joints, names.digital_inputs, set(names.tools)) == (6, 32, {0, 1})
    assert (names.point_names, set(names.joint_points)) == ({"pick": 7}, {1})
    assert (set(names.asynchronous), set(names.auxiliary)) == ({5}, {1})


def test_zero_frame_makes_frame_0_the_world() -> None:
    text = '[robot]\nmodel = "frigeni6"\nzero_frame = { xyz = [1000, 0, 0], abc = [0, 0, 90] }\n'
    cell = parse_cell(text + "[[frames]]\nindex = 1\nxyz = [1000, 2000, 0]\n")
    np.testing.assert_allclose(cell.X_world_base @ cell.frames[0].X_base_frame, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(cell.frames[1].X_base_frame[:3, 3], [2.0, 0.0, 0.0], atol=1e-12)


def test_default_cell_reaches_its_points() -> None:
    cell = default_cell()
    robot = cell.robot
    for point in cell.points.values():
        if point.pose is not None:
            for tool in cell.tools.values():
                X = point.pose @ np.linalg.inv(tool.X_flange_tool)
                assert robot.solutions(X), (point.index, tool.index)
    home = cell.points[0].pose
    np.testing.assert_allclose(home, robot.fk(cell.home), atol=1e-12)


def test_all_faults_at_once_each_at_its_line() -> None:
    text = """\
[robot]
model = "frigeny6"
home = [0, 0, nan, 0, 0, 0]
[contoller]
x = 1
[controller]
tick_s = "a"
lookahead = -3
[limits.joints]
speed_deg_s = [
  110, 110, 0,
  200, 200, 300]
[[tools]]
index = 1
[[tools]]
index = 2
xyz = [1, 2]
[points]
P1 = { x = 1, y = 2, z = 3, q = 0 }
[[zones]]
name = "fence"
kind = "forbiden"
corner_1 = [0, 0, 0]
corner_2 = [1, 1, 1]
"""
    assert codes(text) == [
        ("E278", 2, "robot.model"),
        ("E275", 3, "robot.home[2]"),
        ("E272", 4, "contoller"),
        ("E274", 7, "controller.tick_s"),
        ("E275", 8, "controller.lookahead"),
        ("E275", 10, "limits.joints.speed_deg_s[2]"),
        ("E276", 17, "tools[1].xyz"),
        ("E272", 19, "points.P1.q"),
        ("E275", 22, "zones[0].kind"),
    ]
    by_key = {each.key: each for each in faults(text)}
    assert by_key["contoller"].hint == "did you mean `controller`?"
    assert by_key["robot.model"].hint == "did you mean `frigeni6`?"


def test_faults_across_tables_come_with_those_inside() -> None:
    text = (
        ROBOT
        + """\
home = [0, 0, 100, 0, 0]
[controler]
[[tools]]
index = 1
name = "a"
[[tools]]
index = 1
[[tools]]
index = 2
name = "a"
[points]
P1 = { x = 1, y = 2, z = 3, a = 0, b = 0 }
P2 = { j = [1, 2] }
P4 = { j = [1, 2, 400, 0, 0, 0], x = 1 }
Q3 = {}
[io]
names = { P1 = "DI99", gripper = "DO1" }
process_outputs = ["DI3", "gripper"]
[[zones]]
name = "flat"
kind = "safe"
frame = 4
corner_1 = [0, 0, 0]
corner_2 = [1, 0, 1]
"""
    )
    assert codes(text) == [
        ("E276", 3, "robot.home"),
        ("E272", 4, "controler"),
        ("E277", 9, "tools[1].index"),
        ("E277", 12, "tools[2].name"),
        ("E273", 14, "points.P1.c"),
        ("E276", 15, "points.P2.j"),
        ("E279", 16, "points.P4"),
        ("E279", 16, "points.P4.j[2]"),
        ("E272", 17, "points.Q3"),
        ("E275", 19, "io.names.P1"),
        ("E278", 19, "io.names.P1"),
        ("E278", 20, "io.process_outputs[0]"),
        ("E278", 24, "zones[0].frame"),
        ("E279", 26, "zones[0].corner_2"),
    ]


def test_a_faulty_entry_of_a_list_does_not_hide_the_others() -> None:
    text = ROBOT + "[[tools]]\nindex = 1\nxyz = [1, 2]\n[[tools]]\nindex = 1\nnam = 1\n"
    assert codes(text) == [
        ("E276", 5, "tools[0].xyz"),
        ("E277", 7, "tools[1].index"),
        ("E272", 8, "tools[1].nam"),
    ]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "E273"),
        ("[robot]\n", "E273"),
        ("[robot", "E271"),
        ("x = " + "[" * 100_000, "E271"),
        ("x = 1" + "0" * 5000, "E271"),
        (ROBOT + "[controller]\ntick_s = 1" + "0" * 400, "E274"),
        (ROBOT + "[controller]\ntick_s = 1.0", "E275"),
        (ROBOT + "[controller]\ntick_s = true", "E274"),
        (ROBOT + "[controller]\nlookahead = 3.5", "E274"),
        (ROBOT + "[limits.path]\nspeed_mm_s = inf", "E275"),
        (ROBOT + "[limits.path]\nspeed_mm_s = 0", "E275"),
        (ROBOT + "[limits.joints]\nrange_deg = [[1, 1]]", "E276"),
        (ROBOT + "[variables]\nx = 1979-05-27", "E274"),
        (ROBOT + "[variables]\nx = nan", "E275"),
        (ROBOT + "[variables]\nx = 1\nX = 2", "E277"),
        (ROBOT + '[variables]\nx = 1\n[io]\nnames = { level = "$x" }', "E278"),
        (ROBOT + '[points]\nP1 = { name = "home", j = [0, 0, 0, 0, 0, 0] }', "E275"),
        (ROBOT + '[points]\nP1 = { name = "A", j = [0, 0, 0, 0, 0, 0] }', "E275"),
        (ROBOT + '[io]\nnames = { wait = "DO1" }', "E275"),
        (
            ROBOT + "[points]\n"
            'P1 = { name = "pick", j = [0, 0, 0, 0, 0, 0] }\nP2 = { name = "PICK", j = [9, 0, 0, 0, 0, 0] }',
            "E277",
        ),
        (ROBOT + "tools = 3", "E272"),
        ("tools = 3\n" + ROBOT, "E274"),
        ('[robot]\nmodel = "arms/none.toml"', "E270"),
        (ROBOT + "[drives.coupling]\nJ4_J9 = 0.1", "E272"),
        (ROBOT + "[auxiliary_axes.A1]\nkind = 'linear'\nrange = [0, 1]\nspeed = 1\nacceleration = 1", "E272"),
        (ROBOT + "[m_functions]\nx = 'async'", "E272"),
        (ROBOT + "[orientation_cone]\naxis = [0, 0, 0]\nhalf_angle_deg = 5", "E275"),
    ],
)
def test_single_faults(text: str, code: str) -> None:
    assert [each.code for each in faults(text)][:1] == [code]


def test_points_in_their_own_file(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text('points = "points.toml"\n' + ROBOT)
    points = tmp_path / "points.toml"
    points.write_text("P3 = { j = [10, 0, 0, 0, 0, 0] }\n")
    cell = load_cell(tmp_path / "cell.toml")
    assert list(cell.points) == [3]
    assert cell.points_source is not None
    points.write_text("\nP3 = { j = [10, 0, 0, 0, 0, nan] }\nP4 = { j = [1] }\n")
    with pytest.raises(CellError) as caught:
        load_cell(tmp_path / "cell.toml")
    places = [(each.file, each.line, each.code) for each in caught.value.diagnostics]
    assert places == [(str(points), 2, "E275"), (str(points), 3, "E276")]
    points.unlink()
    with pytest.raises(CellError, match="cannot read"):
        load_cell(tmp_path / "cell.toml")


def test_unreadable_files(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_bytes(b'name = "\xff"')
    for path in (tmp_path / "none.toml", tmp_path, tmp_path / "bad.toml"):
        with pytest.raises(CellError) as caught:
            load_cell(path)
        assert [each.code for each in caught.value.diagnostics] == ["E270"]


def test_robot_beside_the_cell(tmp_path: Path) -> None:
    text = Path(
        str(load_robot.__globals__["resources"].files("viapoint.stdlib") / "robots/frigeni6.toml")
    ).read_text()
    (tmp_path / "arm.toml").write_text(text.replace("a1z = 650", "a1z = 750"))
    (tmp_path / "cell.toml").write_text('[robot]\nmodel = "arm.toml"\n')
    cell = load_cell(tmp_path / "cell.toml")
    assert cell.robot.fk(np.zeros(6))[2, 3] == pytest.approx(2.76)
    (tmp_path / "arm.toml").write_text(text.replace("a3z = 1100", "a3y = 1100"))
    with pytest.raises(CellError) as caught:
        load_cell(tmp_path / "cell.toml")
    assert [(each.code, Path(each.file or "").name) for each in caught.value.diagnostics] == [
        ("E273", "arm.toml"),
        ("E272", "arm.toml"),
    ]


def test_any_shipped_robot_makes_a_cell() -> None:
    for name in robot_names():
        assert parse_cell(f'[robot]\nmodel = "{name}"\n').robot.name == name


def test_faults_stand_in_the_catalogue() -> None:
    for code, entry in CATALOGUE.items():
        if code.startswith("E27"):
            for example in entry.examples:
                assert example.cell is not None
                assert code in [each.code for each in faults(example.cell)]
