"""Torques by inverse dynamics against Lagrange's equations, worked out here without the library used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import viapoint as via
from viapoint.runtime.records import Floats
from viapoint.runtime.robots.dynamics import Dynamics, Load
from viapoint.serving.monitor import monitors
from weighed_arm import ARM, MASSES

ROBOT = f"{ARM}[coupling]\nJ4_J5 = 0.1\n"
AXES = np.array([[0, 0, 1], [0, 1, 0], [0, -1, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0.0]])
POINTS = np.array(  # one of each axis, all joints at 0
    [[0, 0, 0], [0.15, 0, 0.5], [0.15, 0, 1.1], [0.15, 0, 1.22], [0.8, 0, 1.22], [0.8, 0, 1.22]]
)
FLANGE = np.array([0.89, 0.0, 1.22])
MASS = np.array([35, 20, 12, 6, 3, 0.5])
COM = (
    np.array(
        [[50, 10, 380], [160, -40, 800], [210, 20, 1190], [600, 5, 1210], [800, -3, 1222], [850, 2, 1218]]
    )
    / 1000.0
)
GIVEN = [
    [0.9, 0.8, 0.5, 0.02, -0.01, 0.03],
    [1.1, 1.2, 0.3, 0.0, 0.05, 0.0],
    [0.2, 0.25, 0.2, 0.01, 0.0, 0.0],
    [0.04, 0.12, 0.11, 0, 0, 0],
    [0.01, 0.012, 0.011, 0, 0, 0],
    [0.0004, 0.0003, 0.0003, 0, 0, 0],
]
INERTIA = np.array([[[a, d, e], [d, b, f], [e, f, c]] for a, b, c, d, e, f in GIVEN])


class Oracle:
    """The arm as turns about lines, with its masses and a load on the flange; Lagrange's equations."""

    def __init__(
        self, gravity: Floats, mass: float = 0.0, com: Floats = FLANGE, inertia: Floats | None = None
    ):
        """The load as it lies in the base with all joints at 0."""
        self.gravity = gravity
        self.bodies = [(i, MASS[i], COM[i], INERTIA[i]) for i in range(6)]
        self.bodies.append((5, mass, com, np.zeros((3, 3)) if inertia is None else inertia))

    @staticmethod
    def frames(q: Floats) -> list[tuple[Floats, Floats]]:
        """Rotation and shift of every link against all joints at 0."""
        R, t, found = np.eye(3), np.zeros(3), []
        for axis, point, angle in zip(AXES, POINTS, q, strict=True):
            turn = Rotation.from_rotvec(axis * angle).as_matrix()
            t = t + R @ (point - turn @ point)
            R = R @ turn
            found.append((R, t))
        return found

    def energy(self, q: Floats) -> tuple[Floats, float]:
        """Mass matrix (6, 6) and potential energy."""
        frames, M, V = self.frames(q), np.zeros((6, 6)), 0.0
        lines = [(np.eye(3), np.zeros(3)), *frames[:-1]]
        z = [R @ axis for (R, _), axis in zip(lines, AXES, strict=True)]
        p = [R @ point + t for (R, t), point in zip(lines, POINTS, strict=True)]
        for link, mass, com, inertia in self.bodies:
            R, t = frames[link]
            c = R @ com + t
            linear, angular = np.zeros((3, 6)), np.zeros((3, 6))
            for j in range(link + 1):
                linear[:, j], angular[:, j] = np.cross(z[j], c - p[j]), z[j]
            M += mass * linear.T @ linear + angular.T @ R @ inertia @ R.T @ angular
            V -= mass * float(self.gravity @ c)
        return M, V

    def torques(self, q: Floats, v: Floats, a: Floats, step: float = 1e-5) -> Floats:
        slopes = []
        for i in range(6):
            dq = step * np.eye(6)[i]
            (up, high), (down, low) = self.energy(q + dq), self.energy(q - dq)
            slopes.append(((up - down) / (2 * step), (high - low) / (2 * step)))
        change = sum(v[i] * slopes[i][0] for i in range(6))
        pull = np.array([slope[1] - 0.5 * v @ slope[0] @ v for slope in slopes])
        return self.energy(q)[0] @ a + change @ v + pull


DOWN = np.array([0.0, 0.0, -9.80665])


@pytest.fixture
def robot(tmp_path: Path) -> via.Robot:
    (tmp_path / "weighed.toml").write_text(ROBOT + MASSES)
    return via.load_robot(tmp_path / "weighed.toml")


def test_the_oracle_is_of_this_robot(robot: via.Robot) -> None:
    q = np.random.default_rng(0).uniform(-1.0, 1.0, 6)
    R, t = Oracle.frames(q)[-1]
    np.testing.assert_allclose(R @ FLANGE + t, robot.fk(q)[:3, 3], atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_inverse_dynamics_are_lagranges_equations(robot: via.Robot, seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, v, a = rng.uniform(-1.5, 1.5, 6), rng.uniform(-2.0, 2.0, 6), rng.uniform(-8.0, 8.0, 6)
    down = rng.normal(0.0, 6.0, 3)
    com, inertia = rng.uniform(-0.2, 0.2, 3), np.diag([0.2, 0.3, 0.25])
    R = robot.fk(np.zeros(6))[:3, :3]
    oracle = Oracle(down, 7.5, FLANGE + R @ com, R @ inertia @ R.T)
    found = Dynamics(robot, Load(7.5, com, inertia), down).torques(
        q[None], v[None], a[None], np.zeros((1, 3))
    )
    np.testing.assert_allclose(found[0], oracle.torques(q, v, a), rtol=1e-6, atol=1e-5)


CELL = """
[robot]
model = "weighed.toml"
{zero}
[[tools]]
index = 1
xyz = [0, 0, 120]
mass_kg = 4
com = [10, 0, 60]
inertia_kg_m2 = [0.02, 0.02, 0.01]
{axis}
"""
TRACK = """[auxiliary_axes.E1]
kind = "linear"
carries_robot = true
range = [0, 1000]
speed = 800
acceleration = 3000
"""
PROGRAM = "MJ J1=20 J2=25 J3=-30 J4=15 J5=40 J6=-20 F90\nT 1\nMJ J1=-10 J2=5 J5=60 {more}\nWAIT 0.05\n"


def run(
    tmp_path: Path, window: int, zero: str = "", axis: str = "", more: str = ""
) -> tuple[via.Session, Floats]:
    (tmp_path / "weighed.toml").write_text(ROBOT + MASSES)
    (tmp_path / "cell.toml").write_text(CELL.format(zero=zero, axis=axis))
    cell = via.load_cell(tmp_path / "cell.toml")
    session = via.Session(cell, via.compile_text(PROGRAM.format(more=more), cell=cell), window=window)
    windows = list(session.run())
    assert session.status is via.Status.FINISHED
    names = ("joints", "auxiliary", "torque")
    return session, [np.concatenate([getattr(w, name) for w in windows]) for name in names]


@pytest.mark.parametrize(
    ("zero", "axis", "more"),
    [("", "", ""), ("zero_frame = { abc = [150, 10, 20] }", "", ""), ("", TRACK, "E1=400")],
)
def test_a_run_has_the_torques_of_what_it_sends(tmp_path: Path, zero: str, axis: str, more: str) -> None:
    session, (q, e, torque) = run(tmp_path, 1024, zero, axis, more)
    tick = session.cell.tick
    changed = next(event.tick for event in session.events if event.kind == "tool")
    world = session.cell.X_world_base[:3, :3]
    R = session.cell.robot.fk(np.zeros(6))[:3, :3]
    tool = session.cell.tools[1]
    still = np.isclose(np.abs(np.diff(q, n=1, axis=0, prepend=q[:1])).max(axis=1), 0.0)
    for row in [1, 2, 57, 200, changed - 3, changed + 40, changed + 200, len(q) - 60, len(q) - 1]:
        rows = q[[max(row - 2, 0), max(row - 1, 0), row]]
        v, a = (rows[2] - rows[1]) / tick, (rows[2] - 2 * rows[1] + rows[0]) / tick**2
        down = world.T @ DOWN
        if axis and not still[row]:
            pushed = e[[max(row - 2, 0), max(row - 1, 0), row], 0]
            down = down - [(pushed[2] - 2 * pushed[1] + pushed[0]) / tick**2, 0.0, 0.0]
        load = row > changed
        oracle = (
            Oracle(down, 4.0, FLANGE + R @ tool.com, R @ np.diag(tool.inertia) @ R.T)
            if load
            else Oracle(down)
        )
        expected = oracle.torques(rows[2], v * (not still[row]), a * (not still[row]))
        np.testing.assert_allclose(torque[row], expected, rtol=1e-5, atol=1e-4, err_msg=str(row))


def test_the_window_changes_nothing_and_the_monitor_shows_them(tmp_path: Path) -> None:
    _, (_, _, long) = run(tmp_path, 1024)
    session, (_, _, short) = run(tmp_path, 1)
    np.testing.assert_allclose(long, short, atol=1e-6)
    seen = via.monitor(session, session.advance(1))
    assert seen.torques is not None
    np.testing.assert_allclose(seen.torques, long[-1], atol=1e-9)
    window = session.advance(1)
    np.testing.assert_allclose(monitors(session, window, [0])[0]["torque_nm"], long[-1], atol=1e-6)
    # what the motors do is what the joints do: coupled J5 = motor 5 + 0.1·motor 4
    turned = np.random.default_rng(1).uniform(-1, 1, 6)
    joints = session.cell.robot.motors_to_joints(turned)
    assert seen.motor_torques is not None
    assert seen.motor_torques @ turned == pytest.approx(seen.torques @ joints)


def test_without_masses_there_are_none_rather_than_zeros(tmp_path: Path) -> None:
    for model in ("frigeni6", "irb140", "irb1400"):
        assert via.load_robot(model).masses is None
    cell = via.default_cell()
    session = via.Session(cell, via.compile_text("MJ P1 F60\n", cell=cell))
    for window in session.run():
        seen = via.monitor(session, window)
        assert window.torque.shape == (len(window), 0)
        assert (seen.torques, seen.motor_torques) == (None, None)
        assert "torque_nm" not in monitors(session, window, [0])[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("com_mm = [", "com_mn = ["), "did you mean `com_mm`"),
        (("mass_kg = [30, 35, 20, 12, 6, 3, 0.5]\n", ""), "body.mass_kg is not"),
        (("[0.04, 0.12, 0.11, 0, 0, 0]", "[0.04, 0.32, 0.11, 0, 0, 0]"), "no body has the inertia of link 4"),
        (
            ("[0.04, 0.12, 0.11, 0, 0, 0]", "[0.04, 0.12, -0.11, 0, 0, 0]"),
            "no body has the inertia of link 4",
        ),
    ],
)
def test_masses_that_cannot_be(tmp_path: Path, change: tuple[str, str], words: str) -> None:
    (tmp_path / "wrong.toml").write_text(ROBOT + MASSES.replace(*change))
    with pytest.raises(via.RobotError) as found:
        via.load_robot(tmp_path / "wrong.toml")
    assert any(words in f"{d.message} {d.hint}" for d in found.value.diagnostics)


def test_they_are_recorded_and_exported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from viapoint.cli import main

    _, (_, _, torque) = run(tmp_path, 1024)
    (tmp_path / "part.via").write_text(PROGRAM.format(more=""))
    out = tmp_path / "out.mcap"
    assert (
        main(["run", str(tmp_path / "part.via"), "--cell", str(tmp_path / "cell.toml"), "--record", str(out)])
        == 0
    )
    np.testing.assert_array_equal(via.load_recording(out).trace.torque, torque)
    assert main(["export", str(out), "-o", str(tmp_path / "out.csv")]) == 0
    head, *rows = (tmp_path / "out.csv").read_text().splitlines()
    assert head.endswith("tj1,tj2,tj3,tj4,tj5,tj6")
    np.testing.assert_allclose([float(v) for v in rows[100].split(",")[-6:]], torque[100], atol=1e-9)
