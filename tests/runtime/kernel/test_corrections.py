"""External corrections: frames, rates, limits, windows, sensors; what happens where they cannot be kept."""

from __future__ import annotations

import numpy as np
import pytest
from command_runs import CommandRun

from session_runs import Floats, Run, cell, cell_text
from session_runs import run as run_text
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.kernel import Sensor
from viapoint.runtime.kernel.letdown import braking, stopping
from viapoint.runtime.rotations import quaternion_to_matrix
from viapoint.runtime.signals import parse_scenario
from viapoint.session import Session, compile_text

PROGRAM = """MJ P1 F60
ML P2 F300 R40
SET DO1
ML P3 F500
WAIT 0.3
ML P4 Z0 F400
ML X=200 Y=300 Z=700 A=0 B=90 C=0 Z1 F400
"""
WINDOWS = (1, 64, 1024)
PEAKS = "[[2, 0], [2.6, 6], [3.5, -4], [5, 2]]"


def correction(frame: str, axes: str, rate: float) -> str:
    return f'[[correction]]\nframe = "{frame}"\n{axes}\nmax_rate_mm_s = {rate}\n'


THREE = (
    correction("tool", f"z_mm = {PEAKS}", 20)
    + correction("base", "x_mm = [[2, 0], [2.5, 3]]\ny_mm = [[3, 0], [3.1, 5]]", 30)
    + correction("frame", f"y_mm = {PEAKS}", 15)
)


def run(scenario: str | None, window: int = 1024, *, controller: str = "", program: str = PROGRAM) -> Run:
    return run_text(program, cell(controller=controller), scenario=scenario, window=window)


@pytest.mark.parametrize("controller", ["tick_s = 0.005", "tick_s = 0.005\nfilter = { ticks = 12 }"])
def test_the_length_of_a_window_changes_nothing(controller: str) -> None:
    short = PROGRAM.partition("WAIT")[0] + "WAIT 0.3\n"
    first, *others = (run(THREE, window, controller=controller, program=short) for window in WINDOWS)
    assert first.status == "finished"
    assert first.column("deviation").max() > 5e-3
    for other in others:
        assert other.history == first.history
        assert np.abs(other.joints - first.joints).max() < 1e-9
        assert np.abs(other.column("deviation") - first.column("deviation")).max() < 1e-9


def test_where_nothing_is_asked_for_rows_pass_untouched() -> None:
    """Bit for bit those of a cell whose joints have so much less of their limits."""
    nothing = run(correction("tool", "z_mm = [[0, 0], [900, 0]]", 20))
    late = run(correction("tool", "z_mm = [[6, 0], [7, 5]]", 20))
    ticks = 6000
    assert (nothing.joints[:ticks] == late.joints[:ticks]).all()
    assert nothing.column("deviation").max() == 0.0
    assert late.column("deviation").max() > 0.0


@pytest.mark.parametrize(("frame", "turn"), [("base", None), ("tool", "tool"), ("frame", "frame")])
def test_the_offset_is_along_the_axes_of_its_frame(frame: str, turn: str | None) -> None:
    """A constant offset, against the path: in the tool it turns with the tool, in a frame with the frame."""
    plain = run(correction("base", "x_mm = [[0, 0]]", 50))
    moved = run(
        correction(
            frame, "x_mm = [[2, 0], [2.1, 2]]\ny_mm = [[2, 0], [2.1, -3]]\nz_mm = [[2, 0], [2.1, 1]]", 50
        )
    )
    offset = np.array([2e-3, -3e-3, 1e-3])
    settled = 3500
    found = (moved.column("position") - plain.column("position"))[settled:]
    if turn is None:
        R = np.eye(3)[None]
    elif turn == "tool":
        R = quaternion_to_matrix(plain.column("quaternion")[settled:])
    else:  # frame 1 from line 7 on: 30 deg about Z; the offset turns into it within its rate
        c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
        R = np.tile(np.eye(3), (1001, 1, 1))
        R[-1] = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
        found = np.concatenate((found[:1000], found[-1:]))
    assert np.abs(found - (R @ offset[:, None])[..., 0]).max() < 1e-9
    assert np.abs(moved.column("quaternion") - plain.column("quaternion")).max() < 1e-9


def test_the_rate_is_kept() -> None:
    """Of the whole offset, with all three axes asked for at once."""
    moved = run(
        correction(
            "base", "x_mm = [[2, 0], [2.01, 9]]\ny_mm = [[2, 0], [2.01, 9]]\nz_mm = [[2, 0], [2.01, -9]]", 20
        )
    )
    plain = run(correction("base", "x_mm = [[0, 0]]", 20))
    offset = moved.column("position") - plain.column("position")
    rate = np.linalg.norm(np.diff(offset, axis=0), axis=1) / 1e-3
    assert rate.max() <= 0.02 * (1 + 1e-6)
    assert rate.max() > 0.9 * 0.02
    acceleration = np.abs(np.diff(offset, n=2, axis=0)).max() / 1e-6
    assert acceleration <= 0.5 / np.sqrt(3) * (1 + 1e-6)  # half of tracking_reserve of 10 m/s²


def test_limits_are_kept() -> None:
    assert run(THREE).over_limits() == {}


def test_a_correction_moves_a_robot_that_waits() -> None:
    done = run(correction("base", "z_mm = [[1, 0], [1.5, 4]]", 20), program="MJ P1 F120\nWAIT 3\n")
    assert done.status == "finished"
    assert done.column("position")[-1, 2] == pytest.approx(1.504, abs=1e-9)
    assert done.column("speed")[-1] == 0.0  # of the path


def test_a_stop_and_an_emergency_stop_stop_it() -> None:
    where = cell()
    scenario = parse_scenario(correction("base", "z_mm = [[2, 0], [22, 100]]", 20), where)
    session = Session(where, compile_text("MJ P1 F60\nWAIT 9\n", cell=where), scenario=scenario, window=50)
    positions: list[Floats] = []
    for window in session.run():
        positions += list(window.position)
        if len(positions) > 5000:
            break
        if session.kernel.tick >= 3000:
            session.emergency_stop()
    heights = np.array(positions)[:, 2]
    assert heights[3000] > 1.504
    assert np.ptp(heights[-1000:]) == 0.0
    session.reset()
    session.resume()
    assert session.finish().value == "finished"
    assert where.robot.fk(session.kernel.telemetry.joints)[2, 3] > heights[-1] + 0.03


@pytest.mark.parametrize("window", [1, 1024])
@pytest.mark.parametrize(
    ("scenario", "code", "says"),
    [
        (correction("base", "x_mm = [[1, 0], [3, 4000]]", 1000), "E43", "mm in tick"),
        (correction("base", "z_mm = [[1, 0], [5, -4000]]", 900), "E43", "mm in tick"),
        (correction("tool", "y_mm = [[1, 0], [5, 9000]]", 1500), "E43", "mm in tick"),
    ],
)
def test_out_of_reach_is_a_controlled_stop(scenario: str, code: str, says: str, window: int) -> None:
    """It names line, joint or reach, and tick; the axes brake within their limits; nothing jumps."""
    done = run(scenario, window, program="MJ P1 F120\nML P2 F100\nWAIT 9\n")
    failure = done.session.failure
    assert failure is not None
    assert failure.code.startswith(code)
    assert says in failure.message
    assert "J" in failure.message or "reach" in failure.message
    assert failure.line in (1, 2, 3)
    assert done.over_limits() == {}
    assert np.abs(np.diff(done.joints[-3:], axis=0)).max() < 1e-6
    again = run(scenario, 64, program="MJ P1 F120\nML P2 F100\nWAIT 9\n")
    assert np.abs(again.joints - done.joints).max() < 1e-9


def test_beside_a_singular_pose_it_is_refused_before_a_joint_runs_away() -> None:
    """HOME has its wrist stretched: a displacement sideways would turn J4 by a right angle at once."""
    done = run(correction("base", "y_mm = [[0, 0], [1, 50]]", 50), program="WAIT 2\n")
    assert done.code == "E431"
    assert "J4 would need" in str(done.session.failure)
    assert np.ptp(done.joints, axis=0).max() == 0.0


def test_a_zone_stops_path_and_correction() -> None:
    corners = "corner_1 = [1300, -600, 1000]\ncorner_2 = [1800, 600, 1400]"
    fence = f'[[zones]]\nname = "fence"\nkind = "forbidden"\n{corners}\n'
    where = cell(more=fence)
    done = run_text(
        "MJ P1 F60\nML P2 F100\nWAIT 3\n",
        where,
        scenario=correction("base", "z_mm = [[2, 0], [6, -400]]", 100),
    )
    assert done.code == "E420"
    assert done.over_limits() == {}
    assert done.column("position")[-1, 2] < 1.5


def test_a_sensor_is_read_once_per_tick_with_the_pose_before() -> None:
    seen: list[tuple[float, Floats]] = []

    def read(t: float, X: Floats) -> tuple[float, float, float]:
        seen.append((t, X))
        return (0.0, 0.0, 2e-3 if t > 0.8 else 0.0)

    where = cell()
    runs = []
    for window in (1024, 5):
        seen.clear()
        runs.append(
            run_text("MJ P1 F90\nWAIT 0.4\n", where, sensors=[Sensor(read, "base", 0.05)], window=window)
        )
        assert [t for t, _ in seen] == pytest.approx(list(runs[-1].column("time")[1:]))
        poses = np.array([X[:3, 3] for _, X in seen])
        assert np.abs(poses - runs[-1].column("position")[:-1]).max() < 1e-12
    assert (runs[0].joints == runs[1].joints).all()
    assert runs[0].column("deviation").max() == pytest.approx(2e-3)


@pytest.mark.parametrize("answer", [(0.0, np.nan, 0.0), (1.0, 2.0), (np.inf, 0.0, 0.0)])
def test_a_sensor_without_an_answer_stops_the_robot(answer: tuple[float, ...]) -> None:
    where = cell()
    sensor = Sensor(lambda t, X: answer if t > 0.3 else (0.0, 0.0, 0.0))
    done = run_text("MJ P1 F60\n", where, sensors=[sensor])
    assert done.code == "E432"
    assert np.isfinite(done.joints).all()
    assert done.over_limits() == {}


def test_sensors_are_checked_when_they_are_made() -> None:
    for wrong in ({"frame": "world"}, {"max_rate": 0.0}, {"max_rate": np.inf}):
        with pytest.raises(ValueError, match=r"sensor|rate"):
            Sensor(lambda t, X: (0.0, 0.0, 0.0), **wrong)


class CorrectedRun(CommandRun):
    """Random commands while a correction is at work; at the end it stands still."""

    def session(self, window: int) -> Session:
        text = correction("tool", "z_mm = [[0, 0], [0.5, 3], [1.5, -2]]", 15)
        scenario = parse_scenario(text, self.cell)
        program = compile_text(self.text + "WAIT 3\n", cell=self.cell)
        return Session(self.cell, program, scenario=scenario, window=window)

    def may_be_off(self, session: Session) -> tuple[float, float]:
        """By what is asked for, 3 mm at most, and by what it takes to turn at the kink, from 6 to -5 mm/s.

        The orientation is kept, but the nearest place of the path is another one, with one of its own.
        """
        jerk = 0.5 * self.cell.tracking_reserve * self.cell.path_limits.jerk
        most = 3e-3 + 11e-3**1.5 / jerk**0.5
        assert session.kernel.outlet.feed.deviation < most
        return most, np.inf


@pytest.mark.parametrize("seed", range(6))
def test_random_commands_under_correction(seed: int) -> None:
    bent = 'model = "frigeni6"\nhome = [0, 0, 0, 0, 45, 0]\n'  # back at home, too, the wrist is not stretched
    run = CorrectedRun(seed, parse_cell(cell_text().replace('model = "frigeni6"\n', bent)))
    wrong = run.check().wrong
    assert not wrong, f"seed {seed}: {wrong}\n{run.describe()}"


def test_braking_from_random_states() -> None:
    """Rows to rest keep the limits; `stopping` tells how fast and how far, unless a joint must turn back."""
    rng, tick = np.random.default_rng(5), 1e-3
    for _ in range(200):
        a, j = rng.uniform(1, 10, 6), rng.uniform(50, 200, 6)
        v, second = rng.uniform(-2, 2, 6), rng.uniform(-0.9, 0.9, 6) * a
        t = tick * np.array([-2.0, -1.0, 0.0])[:, None]
        last = v * t + 0.5 * second * t * t
        rows = np.concatenate((last, braking(last, a, j, tick)))
        assert (np.abs(np.diff(rows, n=2, axis=0)).max(axis=0) / tick**2 <= a * (1 + 1e-6)).all()
        assert (np.abs(np.diff(rows, n=3, axis=0)).max(axis=0) / tick**3 <= j * (1 + 1e-6)).all()
        top, way = stopping(v, second, a, j)
        turns = (np.sign(v) != np.sign(second)) & (np.abs(v) < 0.5 * second**2 / (0.98 * j))
        speed = np.abs(np.diff(rows[2:], axis=0)).max(axis=0) / tick
        assert (speed <= np.abs(top) + 1e-2)[~turns].all()
        assert rows[-1][~turns] == pytest.approx(way[~turns], abs=2e-3)
