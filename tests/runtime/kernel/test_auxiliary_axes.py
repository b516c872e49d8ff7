"""Auxiliary axes: in step with the robot, alone, through corners and splines, within limits; on a track."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import ruckig

from viapoint.report import limits_report, run_report
from viapoint.runtime.cell import Cell, CellError, load_cell
from viapoint.runtime.path import Reason
from viapoint.session import CompileError, Session, Status, compile_text

Floats = npt.NDArray[np.float64]

CELL = """\
[robot]
model = "frigeni6"
[[frames]]
index = 1
xyz = [1000, 200, 400]
abc = [0, 0, 30]
[points]
P1 = { x = 1500, y = 0, z = 1800, a = 0, b = 90, c = 0, e = [700] }
P2 = { j = [20, 0, 10, 0, 60, 0], e = [900, -30] }
P3 = { x = 1500, y = 200, z = 1800, a = 0, b = 90, c = 0 }
[auxiliary_axes.E1]
kind = "linear"
range = [0, 3000]
speed = 1000
acceleration = 3000
[auxiliary_axes.E2]
kind = "rotary"
range = [-720, 720]
speed = 180
acceleration = 600
jerk = 9000
"""
TRACK = CELL.replace('kind = "linear"', 'kind = "linear"\ncarries_robot = true')
START = "MJ X=1500 Y=0 Z=1800 A=0 B=90 C=0 F80\n"
STANDING = "X=1500 Y=0 Z=1800 A=0 B=90 C=0"

JERK_ALLOWED = 1.05
"""KERNEL: jerk as differenced over ticks may pass its limit by this factor."""


class Run:
    """A program run to its end, with its ticks as whole arrays."""

    def __init__(self, tmp_path: Path, text: str, cell: str = CELL, **options: float) -> None:
        file = tmp_path / "cell.toml"
        file.write_text(cell)
        self.cell: Cell = load_cell(file)
        self.session = Session(self.cell, compile_text(text, cell=self.cell), **options)
        windows = list(self.session.run())
        self.e: Floats = np.concatenate([w.auxiliary for w in windows]) / [1e-3, np.pi / 180.0]
        self.s: Floats = np.concatenate([w.s for w in windows]) / 1e-3
        self.line = np.concatenate([w.line for w in windows])
        self.position: Floats = np.concatenate([w.position for w in windows]) / 1e-3
        self.joints: Floats = np.concatenate([w.joints for w in windows])
        self.report = run_report(self.session, [])

    def block(self, line: int) -> slice:
        """Ticks from the start of a block to its end, both included."""
        event = next(e for e in self.session.events if e.kind == "block" and e.line == line)
        return slice(event.tick, round(float(event.data["t_end"]) / self.cell.tick) + 1)  # type: ignore[arg-type]

    def check_limits(self) -> None:
        assert self.session.status is Status.FINISHED, self.session.failure
        for name, value in limits_report(self.session).items():
            assert np.max(value) <= (JERK_ALLOWED if name.endswith("jerk") else 1.0 + 1e-9), name


def moving(values: Floats) -> tuple[int, int]:
    """First and last tick of a change."""
    ticks = np.flatnonzero(np.abs(np.diff(values)) > 1e-9)
    return int(ticks[0]), int(ticks[-1])


@pytest.mark.parametrize(
    "motion",
    [
        "ML Y=300 E1=600 E2=-90 F300",
        "MJ X=1300 Y=300 E1=600 E2=-90 F60",
        "MJ J1=30 J3=10 E1=600 E2=-90 F60",
        "MC X=1300 Y=300 QX=1450 QY=200 QZ=1800 E1=600 E2=-90 F300",
        "MC X=1300 Y=300 QX=1450 QY=200 QZ=1800 H-120 E1=600 E2=-90 F300",
        "MS Y=300 E1=600 E2=-90 F300",
        "ML B=60 E1=600 E2=-90 F300",
    ],
)
def test_every_motion_takes_its_auxiliary_axes_along(tmp_path: Path, motion: str) -> None:
    run = Run(tmp_path, START.replace("F80", "F80 R0") + motion)
    run.check_limits()
    ticks = run.block(2)
    assert run.e[ticks][0] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert run.e[-1] == pytest.approx([600.0, -90.0], abs=1e-9)
    robot = np.linalg.norm(run.joints[ticks] - run.joints[ticks][0], axis=1)
    for axis in run.e[ticks].T:
        assert np.abs(np.subtract(moving(axis), moving(robot))).max() <= 3  # the same start and end
    if "MC" not in motion and "MS" not in motion and "J" not in motion and "B" not in motion:
        share = (run.s[ticks] - run.s[ticks][0]) / np.ptp(run.s[ticks])
        assert run.e[ticks, 0] == pytest.approx(600.0 * share, abs=1e-6)  # in step with the TCP


def test_what_a_motion_leaves_out_stays(tmp_path: Path) -> None:
    run = Run(tmp_path, "MJ P1 F80\nML P3 F200\nMJ P2 E1=100 F80\nHOME F80\n")
    run.check_limits()
    ends = [run.e[run.block(line)][-1] for line in (1, 2, 3, 4)]
    assert np.array(ends) == pytest.approx(np.array([[700, 0], [700, 0], [100, -30], [100, -30]]), abs=1e-9)
    assert run.report["final"]["auxiliary"] == pytest.approx([100.0, -30.0])


def test_an_axis_alone_takes_its_own_limits(tmp_path: Path) -> None:
    """F means nothing to it; the time is that of Ruckig on one axis, also between other motions."""
    run = Run(tmp_path, f"{START}ML {STANDING} E1=1500 F1\nMJ {STANDING} E1=0\nML Y=100 F200\n")
    run.check_limits()
    ask, found = ruckig.InputParameter(1), ruckig.Trajectory(1)
    ask.target_position, ask.max_velocity = [1.5], [1.0]
    ask.max_acceleration, ask.max_jerk = [3.0], [30.0]
    ruckig.Ruckig(1).calculate(ask, found)
    for line in (2, 3):
        ticks = run.block(line)
        assert (ticks.stop - ticks.start - 1) * run.cell.tick == pytest.approx(found.duration, abs=2e-3)
        assert np.ptp(run.joints[ticks], axis=0).max() < 1e-12
        assert np.ptp(run.s[ticks]) == pytest.approx(0.0, abs=1e-9)
    blocks = {e.line: e.data["limited_by"] for e in run.session.events if e.kind == "block"}
    assert blocks[2] == "E1"
    reasons = [corner.transition.reason for corner in run.session.corners]
    assert reasons[:3] == [Reason.AUXILIARY] * 3


def test_axes_alone_in_a_singular_pose(tmp_path: Path) -> None:
    run = Run(tmp_path, "MJ J1=0 E1=300 F50\nMJ J1=0 E2=20\nML X=1500 F100\n")
    run.check_limits()
    assert run.e[-1] == pytest.approx([300.0, 20.0], abs=1e-9)


def test_a_slow_axis_slows_the_robot(tmp_path: Path) -> None:
    quick = Run(tmp_path, START + "ML Y=300 F2000")
    slow = Run(tmp_path, START + "ML Y=300 E2=360 F2000")
    slow.check_limits()
    assert slow.session.kernel.tick > quick.session.kernel.tick + 1500
    assert slow.report["limits"]["auxiliary_speed"][1] == pytest.approx(1.0, abs=1e-3)


CORNERS = {
    "lines, R": "ML Y=200 E1=200 E2=90 R40 F300\nML X=1300 E1=900 E2=0\n",
    "a line straight on, E not": "ML Y=150 E1=200 F300\nML Y=300 E1=210 E2=10\n",
    "line into arc": "ML Y=200 E1=200 F300\nMC X=1400 Y=300 QX=1470.7107 QY=270.7107 QZ=1800 E1=500 E2=60\n",
    "line into joint move": "ML Y=200 E1=200 R40 F300\nMJ J1=25 J2=5 E1=900 F60\n",
    "joint move into line": "MJ J1=20 J2=5 E1=400 R40 F60\nML X=1300 E1=900 F300\n",
    "joint moves": "MJ J1=20 J2=5 E1=400 R10 F60\nMJ J1=10 J3=20 E1=900\n",
    "splines": "MS Y=150 E1=300 F300\nMS X=1400 Y=300 E1=500 E2=30\nMS X=1300 Y=250 E1=900 E2=0\n",
}


@pytest.mark.parametrize("name", CORNERS)
def test_corners_are_smooth_in_the_auxiliary_axes_too(tmp_path: Path, name: str) -> None:
    """Value, first and second derivative by the path parameter agree on both sides of every piece's end."""
    run = Run(tmp_path, START + CORNERS[name])
    run.check_limits()
    route = run.session.kernel.planner.route
    assert not any(c.transition.stop for c in run.session.corners[1:-1]), run.session.corners
    n = run.cell.robot.joint_count
    inner = [s for s in route.ends if s not in route.stops]
    assert inner
    everywhere = np.concatenate([np.linspace(*piece, 50) for piece in pairwise([0.0, *route.ends])])
    scale = np.abs(route.axes.derivatives(everywhere)[1][:, n : n + 2]).max() + 1.0
    for s in inner:
        around = np.array([np.nextafter(s, 0.0), np.nextafter(s, np.inf)])
        value = route.axes.everything(around)[:, n : n + 2]
        first, second, _ = (d[:, n : n + 2] for d in route.axes.derivatives(around))
        assert np.abs(value[1] - value[0]).max() < 1e-12
        assert np.abs(first[1] - first[0]).max() < 1e-8
        assert np.abs(second[1] - second[0]).max() < 1e-7 * scale


def test_splines_keep_the_auxiliary_axes_going(tmp_path: Path) -> None:
    """At the points of a spline they pass through their values without slowing down to nothing."""
    run = Run(tmp_path, START + CORNERS["splines"])
    speed = np.abs(np.diff(run.e[:, 0])) / run.cell.tick
    for line, e in ((2, 300.0), (3, 500.0)):
        end = run.block(line).stop - 1
        assert run.e[end, 0] == pytest.approx(e, abs=2.0)
        assert speed[end] > 50.0


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (START + "ML Y=100 E1=3001 F100\n", "E307"),
        (START + "MJ Y=100 E2=-721 F100\n", "E307"),
    ],
)
def test_a_value_outside_the_range_is_refused_before_moving_there(
    tmp_path: Path, text: str, code: str
) -> None:
    run = Run(tmp_path, text)
    assert run.session.status is Status.ERROR
    assert run.session.failure is not None
    assert (run.session.failure.code, run.session.failure.line) == (code, 2)
    assert run.e[-1] == pytest.approx([0.0, 0.0])


def test_an_axis_the_cell_lacks(tmp_path: Path) -> None:
    text = START + "ML Y=100 E3=10 F100\n"
    with pytest.raises(CompileError) as found:
        Run(tmp_path, text)
    assert [d.code for d in found.value.diagnostics] == ["E227"]
    session = Session(load_cell(tmp_path / "cell.toml"), compile_text(text))
    session.finish()
    assert session.failure is not None
    assert session.failure.code == "E316"


def test_axes_start_in_their_range(tmp_path: Path) -> None:
    run = Run(tmp_path, START, CELL.replace("range = [0, 3000]", "range = [200, 3000]").replace("700", "800"))
    assert run.e[0, 0] == pytest.approx(200.0)


@pytest.mark.parametrize("far", ["Y=0.00001", "Y=0.001", "Y=0.1"])
def test_a_hardly_moving_robot_with_a_far_axis(tmp_path: Path, far: str) -> None:
    run = Run(tmp_path, f"{START}ML {far} E1=800 F500\nML Y=100 F500")
    run.check_limits()
    assert run.e[-1, 0] == pytest.approx(800.0, abs=1e-6)
    assert run.session.kernel.tick < 4500


def test_halt_and_going_back_take_them_along(tmp_path: Path) -> None:
    run = Run(tmp_path, START + "ML Y=300 E1=900 R50 F300\nML X=1300 E1=0\n", window=25)
    plain = run.e[run.block(2)]
    session = Session(run.cell, compile_text(START + "ML Y=300 E1=900 R50 F300\nML X=1300 E1=0\n"), window=25)
    seen = []
    for window in session.run():
        seen.append(window.auxiliary)
        match session.kernel.tick // 25:
            case 70:
                session.set_override(-0.5)
            case 90:
                session.set_override(0.7)
            case 110:
                session.halt()
            case 130:
                session.resume()
    assert session.status is Status.FINISHED
    assert max(limits_report(session)["auxiliary_jerk"]) <= JERK_ALLOWED
    assert np.concatenate(seen)[-1] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert len(plain) > 100


# --- a track ------------------------------------------------------------------------------------


def test_frame_0_goes_with_the_track(tmp_path: Path) -> None:
    """The same targets, the same path in the moving base, whatever the track does."""
    text = START + "ML Y=200 {} F200 R20\nML X=1300 {} F200\n"
    standing = Run(tmp_path, text.format("", ""), TRACK)
    riding = Run(tmp_path, text.format("E1=300", "E1=100"), TRACK)
    riding.check_limits()
    assert riding.position[-1] == pytest.approx(standing.position[-1], abs=1e-9)
    assert riding.joints[-1] == pytest.approx(standing.joints[-1], abs=1e-12)
    assert riding.e[-1, 0] == pytest.approx(100.0)


def test_other_frames_stand_beside_the_track(tmp_path: Path) -> None:
    """A target in frame 1 is the same place in the hall wherever the track is; so is one kept from before."""
    run = Run(tmp_path, START + "ML X=700 Y=100 Z=1400 Z1 E1=0 F300\nML X=700 Z1 E1=300 F300\n", TRACK)
    run.check_limits()
    first, second = (run.block(line).stop - 1 for line in (2, 3))
    assert run.position[first][0] - run.position[second][0] == pytest.approx(300.0, abs=1e-6)
    assert run.position[first][1:] == pytest.approx(run.position[second][1:], abs=1e-6)
    between = (run.position[first:second] - run.position[first])[:, 1:]
    assert np.abs(between).max() < 1e-6  # straight in the moving base


def test_joint_motions_on_the_track(tmp_path: Path) -> None:
    run = Run(tmp_path, START + "MJ J1=30 E1=2000 F80\nMJ X=300 Y=100 Z=1400 Z1 E1=100\nHOME\n", TRACK)
    run.check_limits()
    assert run.e[-1, 0] == pytest.approx(100.0)
    assert run.joints[-1] == pytest.approx(np.zeros(6), abs=1e-12)


def test_standing_zones_beside_a_track_are_refused(tmp_path: Path) -> None:
    zone = "[[zones]]\nname = 'fence'\nkind = 'forbidden'\nframe = 1\ncorner_1 = [9000, 0, 0]\n"
    run = Run(tmp_path, START, TRACK + zone + "corner_2 = [9100, 100, 100]\n")
    assert run.session.failure is not None
    assert run.session.failure.code == "E392"


def test_a_cell_with_a_turning_track_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CellError, match="carry"):
        Run(tmp_path, START, CELL.replace('kind = "rotary"', 'kind = "rotary"\ncarries_robot = true'))
