"""Dynamic parameters from motions and torques: of an arm whose masses are known.

The torques come from recursive Newton–Euler, which the identification does not use; friction, motor inertia
and noise are added here.
"""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import viapoint as via
from viapoint.cli import main
from viapoint.runtime.robots.dynamics import Dynamics
from weighed_arm import ARM, MASSES

ROBOT = ARM + MASSES
POINTS = np.array(  # of each axis the one nearest to the flange, all joints at 0: from the sizes above
    [[0, 0, 1.22], [0.15, 0, 0.5], [0.15, 0, 1.1], [0.89, 0, 1.22], [0.8, 0, 1.22], [0.89, 0, 1.22]]
)
ROTOR = np.array([1.2, 1.5, 0.9, 0.2, 0.15, 0.1])
COULOMB = np.array([12.0, 15.0, 9.0, 3.0, 2.5, 1.5])
VISCOUS = np.array([8.0, 9.0, 5.0, 1.5, 1.0, 0.6])
NOISE = np.array([1.5, 2.0, 1.0, 0.3, 0.25, 0.2])
DOWN = np.array([0.0, 0.0, -9.80665])


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> via.Robot:
    path = tmp_path_factory.mktemp("robot") / "weighed.toml"
    path.write_text(ROBOT)
    return via.load_robot(path)


def standard(robot: via.Robot) -> np.ndarray:
    """All parameters, true ones: of the links about the points of their axes, then of the joints."""
    masses, found = robot.masses, []
    assert masses is not None
    for m, com, inertia, point in zip(masses.mass, masses.com, masses.inertia, POINTS, strict=True):
        c = com - point
        I = inertia + m * (c @ c * np.eye(3) - np.outer(c, c))  # noqa: E741
        found += [m, *(m * c), I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]]
    return np.array([*found, *ROTOR, *COULOMB, *VISCOUS])


def motion(robot: via.Robot, seed: int, count: int = 1500) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sums of sines, at random: joints, speeds, accelerations (count, n)."""
    rng, n = np.random.default_rng(seed), robot.joint_count
    t = np.linspace(0.0, 20.0, count)[:, None]
    parts = np.zeros((3, count, n))
    for k in range(1, 6):
        w = 2.0 * np.pi * 0.1 * k * rng.uniform(0.9, 1.1)
        size, phase = rng.uniform(0.1, 0.5, n), rng.uniform(0.0, 2.0 * np.pi, n)
        sine, cosine = np.sin(w * t + phase), np.cos(w * t + phase)
        parts += size * np.array([sine, w * cosine, -w * w * sine])
    return parts[0], parts[1], parts[2]


def torques(
    robot: via.Robot, q: np.ndarray, v: np.ndarray, a: np.ndarray, down: np.ndarray = DOWN
) -> np.ndarray:
    rigid = Dynamics(robot, None, down).torques(q, v, a, np.zeros((len(q), 3)))
    return rigid + a * ROTOR + np.sign(v) * COULOMB + v * VISCOUS


def measured(robot: via.Robot, seed: int, share: float = 1.0, **more: np.ndarray) -> via.MotionSamples:
    q, v, a = motion(robot, seed)
    noise = np.random.default_rng(1000 + seed).normal(0.0, 1.0, q.shape) * NOISE
    return via.MotionSamples(q, v, a, torques(robot, q, v, a, **more) + share * noise)


@pytest.mark.parametrize("seed", range(3))
def test_another_motion_is_predicted_and_deviations_are_honest(robot: via.Robot, seed: int) -> None:
    found = via.identify_dynamics(robot, measured(robot, seed))
    q, v, a = motion(robot, seed + 50)
    off = found.torques(q, v, a) - torques(robot, q, v, a)
    assert (np.sqrt((off**2).mean(axis=0)) < 0.3 * NOISE).all(), seed
    np.testing.assert_allclose(found.residuals, NOISE, rtol=0.1)
    np.testing.assert_allclose(found.left(measured(robot, seed + 50)), NOISE, rtol=0.1)
    z = (found.values - found.grouping @ standard(robot)) / found.uncertainty
    assert np.abs(z).max() < 4.5, seed
    assert 0.75 < np.sqrt((z**2).mean()) < 1.25, seed


def test_without_noise_the_base_parameters_are_the_true_ones(robot: via.Robot) -> None:
    found = via.identify_dynamics(robot, measured(robot, 7, 0.0))
    np.testing.assert_allclose(found.values, found.grouping @ standard(robot), atol=1e-8)
    assert found.residuals.max() < 1e-8 * found.sizes.max()
    # 36 of a six-axis arm's links on a level base, 4 motor inertias apart from theirs, 12 of friction
    assert len(found.names) == 52
    assert {"Fc1", "Fv6", "Ia3"} <= set(found.names)


def test_what_torques_do_not_depend_on_is_not_claimed(robot: via.Robot) -> None:
    """Link 1 turns about the vertical alone: twice its mass is seen nowhere. m3 and m4 come only in sums."""
    assert robot.masses is not None
    heavy = robot.masses.mass.copy()
    heavy[0] *= 2.0
    other = replace(robot, masses=replace(robot.masses, mass=heavy, com=robot.masses.com * [[0], *[[1]] * 5]))
    at_axis = replace(robot, masses=replace(robot.masses, com=robot.masses.com * [[0], *[[1]] * 5]))
    one, two = (via.identify_dynamics(each, measured(each, 3)) for each in (at_axis, other))
    np.testing.assert_allclose(one.values, two.values, atol=1e-9)
    seen = dict(zip(one.parameters, np.abs(one.grouping).sum(axis=0), strict=True))
    assert (seen["m1"], seen["mz1"], seen["Ixx1"]) == (0.0, 0.0, 0.0)
    assert not {"m2", "m3", "m4", "m5", "m6", "Izz2", "Ia1"} & set(one.names)
    assert seen["m4"] > 0.0


def test_a_base_that_leans_shows_more_of_link_1(robot: via.Robot) -> None:
    down = np.array([3.0, -2.0, -9.0])
    found = via.identify_dynamics(robot, measured(robot, 4, 0.0, down=down), gravity=down)
    assert {"mx1", "my1"} <= set(found.names)
    np.testing.assert_allclose(found.values, found.grouping @ standard(robot), atol=1e-8)


def spoilt(samples: via.MotionSamples, name: str, value: float) -> via.MotionSamples:
    part = getattr(samples, name).copy()
    part[17, 2] = value
    return replace(samples, **{name: part})


def test_measurements_that_determine_nothing(robot: via.Robot) -> None:
    good = measured(robot, 5)
    still = replace(good, speeds=good.speeds * [1, 1, 1, 0, 1, 0])
    along = np.sin(np.linspace(0.0, 30.0, 1500))[:, None]
    slope = np.cos(np.linspace(0.0, 30.0, 1500))[:, None]
    ones = np.full(6, 0.4)
    line = via.MotionSamples(along * ones, slope * ones, -along * ones, good.torques)
    for samples, words in (
        (still, "J4, J6 never move: "),
        (good[:8], "48 equations are too few for 52 parameters: at least 104"),
        (good[:0], "never move"),
        (spoilt(good, "torques", np.nan), "torques of sample 17 are not all finite"),
        (spoilt(good, "accelerations", np.inf), "accelerations of sample 17"),
        (replace(good, torques=good.torques[:, :5]), "torques must be samples of 6 joints, not of shape"),
        (replace(good, base=np.zeros((3, 3))), "base must be three finite numbers"),
        (replace(good, torques=0.0 * good.torques), "all torques are 0"),
        (line, "does not tell .* apart"),
    ):
        with pytest.raises(via.IdentificationError, match=words):
            via.identify_dynamics(robot, samples)


CELL = """
[robot]
model = "weighed.toml"
zero_frame = { abc = [150, 10, 20] }
[[tools]]
index = 1
mass_kg = 4
com = [10, 0, 60]
inertia_kg_m2 = [0.02, 0.02, 0.01]
[auxiliary_axes.E1]
kind = "linear"
carries_robot = true
range = [0, 1000]
speed = 800
acceleration = 3000
"""


def program(seed: int) -> str:
    rng = np.random.default_rng(seed)
    lines = [
        f"MJ {' '.join(f'J{i}={x:.0f}' for i, x in enumerate(rng.uniform(-80, 80, 6), start=1))} "
        f"E1={rng.uniform(0, 900):.0f} R30 F90"
        for _ in range(6)
    ]
    return "\n".join(["T 1", *lines]) + "\n"


@pytest.fixture
def recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    """The folder of two recordings, with a track, a base that leans, and a tool from before they move."""
    monkeypatch.chdir(tmp_path)
    Path("weighed.toml").write_text(ROBOT)
    Path("cell.toml").write_text(CELL)
    for name, seed in (("one", 1), ("two", 2)):
        Path(f"{name}.via").write_text(program(seed))
        assert main(["run", f"{name}.via", "--cell", "cell.toml", "--record", f"{name}.mcap"]) == 0
    capsys.readouterr()
    return tmp_path


def test_a_recording_gives_the_masses_of_its_model_back(
    recorded: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = ["identify", "one.mcap", "--cell", "cell.toml", "--against", "two.mcap"]
    assert main([*line, "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    for joint in found["joints"]:
        assert max(joint["left"], joint["left_against"]) < 1e-6 * joint["torque"]
    by_name = {one["name"]: one for one in found["parameters"]}
    assert abs(by_name["Fc2"]["value"]) < 1e-6
    # first moment of the forearm about axis 3 along X: links 3 and 4, and what the wrist carries at its point
    robot = via.load_robot("weighed.toml")
    assert robot.masses is not None
    m, x = robot.masses.mass, robot.masses.com[:, 0]
    true = m[2] * (x[2] - 0.15) + m[3] * (x[3] - 0.15) + (m[4] + m[5] + 4.0) * 0.65
    assert by_name["mx3"]["value"] == pytest.approx(true, abs=1e-6)
    assert by_name["mx3"]["unit"] == "kg·m"
    made = {name: pytest.approx(share) for name, share in by_name["mx3"]["made_of"].items()}
    assert made == {"mx3": 1.0, "m4": 0.74, "mx4": 1.0, "m5": 0.65, "m6": 0.65}
    assert main(line) == 0
    said = capsys.readouterr().out
    assert "made of" in said
    assert "left against" in said


def test_a_table_with_torques_measured_elsewhere(recorded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("level.toml").write_text('[robot]\nmodel = "weighed.toml"\n')
    Path("three.via").write_text("".join(program(3).partition("T 1\n")[2]).replace(" E1=", " // "))
    assert main(["run", "three.via", "--cell", "level.toml", "--record", "three.mcap"]) == 0
    assert main(["export", "three.mcap", "-o", "three.csv"]) == 0
    rows = list(csv.DictReader(io.StringIO(Path("three.csv").read_text())))
    speeds = np.diff([float(row["j5"]) for row in rows], prepend=float(rows[0]["j5"]))
    for row, speed in zip(rows, speeds, strict=True):
        row["tj5"] = str(float(row["tj5"]) + 2.5 * np.sign(speed))
    with Path("three.csv").open("w", newline="") as out:
        table = csv.DictWriter(out, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    capsys.readouterr()
    assert main(["identify", "three.csv", "--robot", "weighed.toml", "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    friction = {one["name"]: one["value"] for one in found["parameters"] if one["name"].startswith("F")}
    assert friction.pop("Fc5") == pytest.approx(2.5, abs=1e-4)
    assert max(abs(value) for value in friction.values()) < 1e-3
    text = Path("three.csv").read_text().splitlines()
    for changed, words in (
        ([*text[:50], *text[60:]], "does not rise by equal steps"),
        ([*text[:50], text[50] + ",1"], "row 51: 23 cells under 22 names"),
        ([*text[:50], "x" + text[50]], "row 51: what should be a number is none"),
        ([text[0].replace("tj4", "torque4"), *text[1:]], "no column tj4"),
        ([*text[:40], text[40].rpartition(",")[0] + ",nan", *text[41:]], "row 41: not a finite number"),
        (text[:1], "never move"),
    ):
        Path("bad.csv").write_text("\n".join(changed))
        assert main(["identify", "bad.csv", "--robot", "weighed.toml"]) == 1
        assert words in capsys.readouterr().err


def test_recordings_that_are_refused(recorded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("tools.via").write_text(program(1) + "T 0\nMJ J1=0\n")
    Path("plain.via").write_text("MJ P5 F60\n")
    for line, words in (
        (["tools.via", "--cell", "cell.toml"], "moved with tools T0 and T1"),
        (["plain.via"], "has no torques"),
    ):
        assert main(["run", *line, "--record", "bad.mcap"]) == 0
        given = ["--cell", "cell.toml"] if len(line) > 1 else ["--robot", "frigeni6"]
        capsys.readouterr()
        assert main(["identify", "bad.mcap", *given]) == 1
        assert words in capsys.readouterr().err
    for given, code, words in (
        (["one.mcap"], 2, "--robot R, or --cell"),
        (["one.mcap", "--robot", "frigeni6"], 1, "of the robot weighed, not of frigeni6"),
        (["one.via", "--robot", "frigeni6"], 1, "one.via"),
    ):
        assert main(["identify", *given]) == code
        assert words in capsys.readouterr().err


def test_where_the_robot_is_said_to_stand_elsewhere_nothing_is_measured(
    recorded: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = [":record jump.mcap", *program(1).splitlines()[1:], ":reference J2=60 J5=-60"]
    lines += [*program(2).splitlines()[1:], ":record off", ":quit"]
    monkeypatch.setattr("sys.stdin", io.StringIO("\n".join(lines) + "\n"))
    assert main(["repl", "--cell", "cell.toml"]) == 0
    jump = via.load_recording(Path("jump.mcap"))
    steps = np.abs(np.diff(jump.trace.joints, axis=0)).max(axis=1)
    assert steps.max() > 0.3
    capsys.readouterr()
    assert main(["identify", "jump.mcap", "--cell", "cell.toml", "--format", "json"]) == 0
    for joint in json.loads(capsys.readouterr().out)["joints"]:
        assert joint["left"] < 1e-6 * joint["torque"]
