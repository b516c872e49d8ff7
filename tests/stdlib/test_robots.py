"""The robot files that are shipped: complete, and what is derived where they are silent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viapoint.runtime.robots import RobotError, load_robot, robot_names


def test_shipped_robots() -> None:
    assert robot_names() == ("frigeni6", "irb140", "irb1400")


@pytest.mark.parametrize("name", robot_names())
def test_file_gives_a_whole_robot(name: str) -> None:
    robot = load_robot(name)
    limits = robot.limits
    assert robot.name == name
    assert robot.joint_count == 6
    assert (limits.lower < limits.upper).all()
    for each in (limits.speed, limits.acceleration, limits.jerk):
        assert (each > 0).all()
    assert load_robot(name) is robot


def test_limits_that_a_file_leaves_out() -> None:
    limits = load_robot("irb1400").limits
    np.testing.assert_allclose(limits.acceleration, 4 * limits.speed)
    np.testing.assert_allclose(limits.jerk, 10 * limits.acceleration)


def test_unknown_robot() -> None:
    with pytest.raises(RobotError) as caught:
        load_robot("irb14000")
    assert caught.value.diagnostics[0].hint == "did you mean `irb1400`?"
    with pytest.raises(RobotError):
        load_robot("no/such.toml")


def test_faulty_robot_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(
        'name = "arm"\nfamily = "scorpion"\n[joints]\nrange_deg = [[1, 0]]\nspeed_deg_s = [1, 2, 3]\n'
    )
    with pytest.raises(RobotError) as caught:
        load_robot(path)
    found = [(each.code, each.line, each.key) for each in caught.value.diagnostics]
    assert found == [
        ("E273", 1, "parameters_mm"),
        ("E275", 2, "family"),
        ("E276", 4, "joints.range_deg"),
        ("E276", 5, "joints.speed_deg_s"),
    ]
