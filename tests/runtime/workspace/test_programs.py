"""Whole programs in watched cells: what is found before moving, what at a tick, and what is left alone."""

from __future__ import annotations

import re

import numpy as np
import pytest

from viapoint.runtime.cell import parse_cell
from viapoint.runtime.kernel import State
from viapoint.runtime.records import Event, Floats, Window
from viapoint.runtime.workspace import TOUCH, Monitor
from viapoint.session import Session, compile_text

BEFORE = "MJ X=1500 Y=-600 Z=1500 A=0 B=90 C=0 F50\n"
LINE = BEFORE + "ML Y=600 F200\n"
ROBOT = '[robot]\nmodel = "frigeni6"\n'
TOOL = "[[tools]]\nindex = 1\nxyz = [200, 0, 0]\n"
CAPSULE = TOOL + "capsule = { to = [200, 0, 0], radius = 80 }\n"


class Run:
    """A finished run of a program text in a cell text."""

    def __init__(
        self, program: str, cell: str, *, robot: str = ROBOT, window: int = 1024, planned: bool = True
    ) -> None:
        self.cell = parse_cell(robot + cell)
        session = Session(self.cell, compile_text(program), window=window)
        self.kernel = session.kernel
        if not planned:  # as if what is added to the path later led there
            self.kernel.planner.route.axes.inspect = None
        self.windows: list[Window] = list(session.run())
        self.events: list[Event] = session.events
        self.failure = session.failure

    @property
    def message(self) -> str:
        assert self.failure is not None
        return f"{self.failure.code} {self.failure.line}: {self.failure.message}"

    @property
    def joints(self) -> Floats:
        return np.concatenate([window.joints for window in self.windows])

    @property
    def position(self) -> Floats:
        """mm."""
        return np.concatenate([window.position for window in self.windows])[-1] * 1e3


def zone(kind: str, corner_1: list[float], corner_2: list[float], name: str = "post", frame: int = 0) -> str:
    return (
        f'[[zones]]\nname = "{name}"\nkind = "{kind}"\nframe = {frame}\n'
        f"corner_1 = {corner_1}\ncorner_2 = {corner_2}\n"
    )


POST = zone("forbidden", [1400, -100, 0], [1600, 100, 1600])


def test_a_line_through_a_zone_between_two_good_points() -> None:
    """Link 6 points down on the path, 60 mm thick: it touches the zone 440 mm after the start."""
    run = Run(LINE, POST)
    assert run.message.startswith("E330 2: link 6 enters the forbidden zone post after ")
    found = re.search(
        r"after ([\d.]+) of 1200.0 mm \((\d+)%\) of the path, with the TCP at (.*); by up", run.message
    )
    assert found is not None, run.message
    assert float(found[1]) == pytest.approx(440.0, abs=1.0)
    assert found[2] == "37"
    assert re.fullmatch(r"X=1500.0 Y=-(159|160)\.\d Z=1500.0", found[3])
    assert re.search(r"; by up to 1(59.\d|60.0) mm$", run.message), "the axis comes as deep as 100 mm"
    assert run.kernel.state is State.FAILED
    assert run.position == pytest.approx([1500.0, -600.0, 1500.0], abs=1e-3), "it stays where the line begins"


def test_a_zone_in_a_frame() -> None:
    """The same zone, given in a frame that is turned and moved."""
    frame = "[[frames]]\nindex = 3\nxyz = [1500, 0, 800]\nabc = [0, 0, 90]\n"
    run = Run(LINE, frame + zone("forbidden", [-100, -100, -800], [100, 100, 800], frame=3))
    assert "after 440" in run.message or "after 439" in run.message


@pytest.mark.parametrize("height", [1430.0, 1439.9])
def test_passing_close_by_is_passing(height: float) -> None:
    assert Run(LINE, zone("forbidden", [1400, -100, 0], [1600, 100, height])).failure is None


def test_a_touch_is_no_violation() -> None:
    """The flange is a hemisphere of 60 mm about Z = 1500."""
    assert Run(LINE, zone("forbidden", [1400, -100, 0], [1600, 100, 1440])).failure is None
    assert "E330" in Run(LINE, zone("forbidden", [1400, -100, 0], [1600, 100, 1440.1])).message


def test_a_joint_move_sweeping_through_a_zone() -> None:
    """Both ends are clear; the elbow of the way is named."""
    post = zone("forbidden", [1600, -50, 2500], [1700, 50, 2800])
    run = Run("MJ J1=-40 F50\nMJ J1=40\n", post, robot=ROBOT + "home = [-30, 0, 0, 0, 0, 0]\n")
    assert re.match(
        r"E330 2: link [56] enters the forbidden zone post after .* of the joint move", run.message
    )
    assert run.joints[-1] == pytest.approx(np.radians([-40.0, 0, 0, 0, 0, 0]))


ROOM = zone("safe", [-900, -1200, 0], [1500, 1200, 3200], "cage")
OUT = "MJ X=1300 Y=0 Z=1500 A=0 B=90 C=0 F50\nML X=1750 F200\n"


@pytest.mark.parametrize("begin", [1500, 1400], ids=["adjoining", "overlapping"])
def test_across_the_border_of_two_safe_zones(begin: float) -> None:
    """From one into the other, with the arm in both at once; the home position is in both as well."""
    annexe = zone("safe", [begin, -1200, 0], [2500, 1200, 3200], "annexe")
    assert Run(OUT, ROOM + annexe).failure is None


def test_out_of_a_safe_zone() -> None:
    home = ROBOT + "home = [0, -20, 0, 0, 90, 0]\n"
    run = Run(OUT, ROOM, robot=home)
    assert re.match(r"E331 2: link [56] leaves the safe zone cage after ", run.message)


def test_through_the_gap_between_two_safe_zones() -> None:
    home = ROBOT + "home = [0, -20, 0, 0, 90, 0]\n"
    annexe = zone("safe", [1503, -1200, 0], [2500, 1200, 3200], "annexe")
    run = Run(OUT, ROOM + annexe, robot=home)
    assert re.match(r"E331 2: link [56] leaves the safe zones cage, annexe after ", run.message)


def test_a_robot_that_runs_into_itself() -> None:
    run = Run("MJ J2=20 F50\nMJ J2=-80\n", "")
    assert run.message.startswith("E332 2: link 3 runs into link 1 of the robot itself after ")
    assert run.joints[-1, 1] == pytest.approx(np.radians(20.0))


@pytest.mark.parametrize(("tool", "hits"), [(TOOL, False), (CAPSULE, True)])
def test_a_tool_is_as_thick_as_its_capsule(tool: str, hits: bool) -> None:
    program = "T 1\nMJ X=1500 Y=-600 Z=1300 A=0 B=90 C=0 F50\nML Y=600 F200\n"
    run = Run(program, tool + zone("forbidden", [1570, -100, 0], [1900, 100, 1400]))
    assert (run.failure is not None) == hits
    if hits:
        assert run.message.startswith("E330 3: the tool enters the forbidden zone post after ")


def test_a_tool_without_capsule_is_a_line() -> None:
    program = "T 1\nMJ X=1500 Y=-600 Z=1300 A=0 B=90 C=0 F50\nML Y=600 F200\n"
    run = Run(program, TOOL + zone("forbidden", [1490, -100, 0], [1510, 100, 1350]))
    assert run.message.startswith("E330 3: the tool enters the forbidden zone post after ")


CONE = "[orientation_cone]\naxis = [0, 0, -1]\nhalf_angle_deg = 30\n"
DOWN = ROBOT + "home = [0, 0, 0, 0, 90, 0]\n"


def test_a_tool_that_leans_too_far() -> None:
    run = Run("MJ J6=120 F50\nMJ J5=50\n", CONE, robot=DOWN)
    assert run.message.startswith("E333 2: the X axis of the tool leaves its cone after ")
    assert run.message.endswith("by up to 10.00 deg")
    assert Run("MJ J6=120 F50\nMJ J5=60.01\n", CONE, robot=DOWN).failure is None


def test_a_place_in_a_turn_is_its_share() -> None:
    run = Run("MJ X=1500 Y=0 Z=1500 A=0 B=90 C=0 F50\nML B=50\n", CONE, robot=DOWN)
    assert re.search(r"cone after \d+% of the path, with the TCP at X=1500\.0 ", run.message)


def test_a_round_edge_may_cut_into_a_zone_that_its_lines_avoid() -> None:
    corner = BEFORE + "ML Y=0 R{R} F200\nML X=1900\n"
    cell = zone("forbidden", [1560, -300, 0], [1700, -160, 1540])
    assert Run(corner.format(R=1), cell).failure is None
    run = Run(corner.format(R=380), cell)
    assert "of the round edge" in run.message
    assert run.message.startswith("E330 2")


def test_the_start_inside_a_zone() -> None:
    run = Run("MJ J1=20 F50\n", zone("forbidden", [1700, -100, 2000], [2000, 100, 3000]))
    assert run.message.startswith("E420 0: ")
    assert len(run.joints) == 1


def test_a_tool_with_no_room() -> None:
    cell = TOOL + zone("forbidden", [1850, -100, 2000], [2200, 100, 3000])
    run = Run("MJ J1=20 F50\nMJ J1=0\nT 1\nWAIT 1\n", cell)
    assert run.message.startswith("E420 3: the tool enters the forbidden zone post, with the TCP at X=1955.0")


@pytest.mark.parametrize("window", [1024, 37])
def test_what_planning_did_not_see_is_seen_in_the_tick(window: int) -> None:
    """The first tick in the zone is the one in which the robot begins to stop on its path."""
    run = Run(LINE, POST, planned=False, window=window)
    assert run.message.startswith(
        "E420 2: link 6 enters the forbidden zone post, with the TCP at X=1500.0 Y=-1"
    )
    monitor = Monitor(run.cell)
    inside = (monitor.clearances(run.joints, 0)[0] < -TOUCH).any(axis=1)
    y = np.concatenate([w.position for w in run.windows])[:, 1] * 1e3
    assert y[np.argmax(inside)] == pytest.approx(-160.0, abs=0.3)
    assert -160.0 < y[-1] < -145.0, "from 200 mm/s it stops within some millimetres"
    assert np.abs(np.concatenate([w.position for w in run.windows])[inside, 0] - 1.5).max() < 1e-9
    assert y[-1] == pytest.approx(Run(LINE, POST, planned=False).position[1], abs=1e-9), "whatever the window"


@pytest.mark.parametrize("window", [1024, 53])
def test_exclusive_zones_tell_who_is_in_them(window: int) -> None:
    """On the plan and, in the very ticks, in the events."""
    run = Run(LINE, zone("exclusive", [1400, -100, 0], [1600, 100, 1600], "hand over"), window=window)
    assert run.failure is None
    monitor = Monitor(run.cell)
    inside = monitor.clearances(run.joints, 0)[1][:, 0] < -TOUCH
    changes = np.flatnonzero(np.diff(inside)) + 1
    events = [event for event in run.events if event.kind == "zone"]
    assert [(e.tick, e.data["action"]) for e in events] == [(changes[0], "entered"), (changes[1], "left")]
    assert [event.data["zone"] for event in events] == ["hand over", "hand over"]
    crossings = run.kernel.planner.zone_crossings
    assert [(c.line, c.enters) for c in crossings] == [(2, True), (2, False)]
    assert [c.place for c in crossings] == pytest.approx([440 / 1200, 760 / 1200], abs=1e-3)


def test_a_way_that_comes_again_meets_the_same_zones() -> None:
    """Planned once, looked at once; told of every time."""
    again = BEFORE + "AGAIN:\nML Y=600 F200\nWAIT 0.01\nML Y=-600\nWAIT 0.01\nGOTO AGAIN 3\n"
    run = Run(again, zone("exclusive", [1400, -100, 0], [1600, 100, 1600], "hand over"))
    assert run.failure is None
    crossings = run.kernel.planner.zone_crossings
    assert [(c.line, c.enters) for c in crossings] == 3 * [(3, True), (3, False), (5, True), (5, False)]
    assert [c.place for c in crossings[4:]] == pytest.approx([c.place for c in crossings[:-4]], abs=1e-3)
    assert len({c.tag for c in crossings}) == 6
    there, back = [], []
    for event in run.events:
        if event.kind == "zone":
            (there if event.line == 3 else back).append(event.data["action"])
    assert there == back == 3 * ["entered", "left"]


def test_planned_paths_are_clear_at_every_tick() -> None:
    """Random joint moves between random zones: none that was let through meets anything."""
    seed = 606
    print("seed", seed)
    rng = np.random.default_rng(seed)
    through = refused = 0
    for _ in range(12):
        text = ""
        for k in range(6):
            turn, radius = rng.choice([-1, 1]) * rng.uniform(0.2, 1.1), rng.uniform(1300, 2000)
            corner = np.array([radius * np.cos(turn), radius * np.sin(turn), rng.uniform(900, 2800)])
            text += zone("forbidden", corner.tolist(), (corner + rng.uniform(20, 200, 3)).tolist(), f"box{k}")
        angles = rng.uniform([-60, -15, -25, -90, -90], [60, 30, 20, 90, 90], (3, 5)).round(2)
        moves = [" ".join(f"J{j + 1}={a}" for j, a in enumerate(row)) for row in angles]
        run = Run("".join(f"MJ {move} F100\n" for move in moves), text)
        if len(run.joints) == 1 and "E420 0" in run.message:
            continue  # it stands in a zone from the start
        clear = Monitor(run.cell).clearances(run.joints, 0)[0]
        assert clear.min() > -TOUCH, "it stops before"
        through, refused = through + (run.failure is None), refused + (run.failure is not None)
    assert through > 1
    assert refused > 1
