"""Jogging while a key is held: at the speed asked for, past no limit, into no zone, at rest when let go."""

from __future__ import annotations

import itertools
from random import Random

import numpy as np
import pytest

from both_cores import by_both
from viapoint.interactive import Interactive
from viapoint.jogging import COORDINATES, HeldJog, JogError, JogSpace
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.runtime.kernel import State
from viapoint.runtime.records import Event, Floats, Window
from viapoint.runtime.rotations import matrix_to_rotation_vector, quaternion_to_matrix
from viapoint.runtime.signals import parse_scenario
from viapoint.session import Session, Status, compile_text

PLAIN = """
[robot]
model = "frigeni6"

[[tools]]
index = 1
xyz = [250, 40, -30]
abc = [10, 30, -20]

[[frames]]
index = 1
xyz = [1000, 200, 300]
abc = [30, 20, 10]

[auxiliary_axes.E1]
kind = "linear"
range = [0, 500]
speed = 500
acceleration = 2000

[auxiliary_axes.E2]
kind = "rotary"
range = [-90, 90]
speed = 120
acceleration = 600
"""
PRESS = """
[[zones]]
name = "press"
kind = "forbidden"
frame = 0
corner_1 = [1500, 500, 500]
corner_2 = [2600, 900, 2500]
"""
FLOOR = """
[[zones]]
name = "floor"
kind = "forbidden"
frame = 0
corner_1 = [-3000, -3000, -500]
corner_2 = [3000, 3000, 900]
"""
CONE = """
[orientation_cone]
axis = [0, 0, -1]
half_angle_deg = 40
"""
START = "MJ X=1500 Y=-200 Z=1500 A=20 B=70 C=-30 F60\nT {tool}\n"
SPACES = [JogSpace.BASE, JogSpace.FRAME, JogSpace.TOOL, JogSpace.JOINT]


class Ticks:
    """Listener: all windows from tick 0 on."""

    def __init__(self) -> None:
        self.windows: list[Window] = []

    def window(self, window: Window) -> None:
        self.windows.append(window)

    def event(self, event: Event) -> None:
        """The session keeps them."""


class Jogged(Interactive):
    """A session whose ticks are kept."""

    def __init__(self, cell: Cell) -> None:
        self.ticks = Ticks()
        super().__init__(cell, listeners=[self.ticks])


def begun(text: str = PLAIN, *, tool: int = 0, start: str = START, window: int = 1024) -> Jogged:
    session = Jogged(parse_cell(text))
    session.set_window(window)
    session.take_on(compile_text(start.format(tool=tool), cell=session.cell))
    assert session.finish() is Status.FINISHED
    return session


def hold(session: Interactive, *jog: object, **more: object) -> list[Window]:
    """Hold a jog, and let time pass until the robot is at rest by itself."""
    assert session.hold(HeldJog(*jog, **more)) is None  # type: ignore[arg-type]
    return list(session.run())


def said(session: Session) -> list[tuple[object, ...]]:
    return [
        (e.data["axis"], e.data["action"], e.data.get("code"), e.data.get("reason"))
        for e in session.events
        if e.kind == "jog"
    ]


def axes(windows: list[Window]) -> Floats:
    return np.concatenate([np.column_stack((w.joints, w.auxiliary)) for w in windows])


def ratios(cell: Cell, rows: Floats) -> Floats:
    """(3,): peak speed, acceleration and jerk of any axis to its limit; the robot rests on both sides."""
    others = [cell.auxiliary_axes[k] for k in sorted(cell.auxiliary_axes)]
    rows = np.concatenate((rows[:1], rows[:1], rows[:1], rows, rows[-1:], rows[-1:], rows[-1:]))
    result = []
    for order, name in enumerate(("speed", "acceleration", "jerk"), start=1):
        limits = np.append(getattr(cell.robot.limits, name), [getattr(each, name) for each in others])
        result.append((np.abs(np.diff(rows, n=order, axis=0)) / cell.tick**order / limits).max())
    return np.array(result)


def require_limits(session: Jogged, reproduce: object = "") -> None:
    cell, rows = session.cell, axes(session.ticks.windows)
    peaks = ratios(cell, rows)
    assert (peaks <= np.array([1.0 + 1e-6, 1.0 + 1e-6, 1.05])).all(), (peaks, reproduce)
    limits = cell.robot.limits
    n = len(limits.lower)
    assert (rows[:, :n] >= limits.lower - 1e-9).all(), reproduce
    assert (rows[:, :n] <= limits.upper + 1e-9).all(), reproduce
    for k, number in enumerate(sorted(cell.auxiliary_axes)):
        axis = cell.auxiliary_axes[number]
        assert axis.lower - 1e-9 <= rows[:, n + k].min() <= rows[:, n + k].max() <= axis.upper + 1e-9


# --- what it does ------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", COORDINATES)
@pytest.mark.parametrize("space", SPACES[:3])
def test_straight_along_or_about_an_axis_of_a_space(space: JogSpace, axis: str) -> None:
    session = begun(tool=1)
    before = session.pose
    R = {
        JogSpace.BASE: np.eye(3),
        JogSpace.FRAME: session.frame(1)[:3, :3],
        JogSpace.TOOL: before[:3, :3],
    }[space]
    windows = hold(session, axis, -1, space, frame=1, seconds=0.8)
    require_limits(session)
    k = COORDINATES.index(axis)
    position = np.concatenate([w.position for w in windows])
    turned = quaternion_to_matrix(np.concatenate([w.quaternion for w in windows])) @ before[:3, :3].T
    way = np.column_stack(
        ((position - before[:3, 3]) @ R * 1000.0, np.degrees(matrix_to_rotation_vector(turned)) @ R)
    )
    others = [i for i in range(6) if i != k]
    np.testing.assert_allclose(way[:, others], 0.0, atol=1e-6)
    speed = np.diff(way[:, k]) / session.cell.tick
    wanted = 50.0 if k < 3 else 10.0
    assert speed.max() <= 1e-6
    path, unit = session.cell.path_limits, 1000.0 if k < 3 else np.degrees(1.0)
    limits = (path.acceleration, path.jerk) if k < 3 else (path.angular_acceleration, path.angular_jerk)
    for order, limit in enumerate(limits, start=2):
        assert np.abs(np.diff(way[:, k], n=order)).max() / session.cell.tick**order < limit * unit
    np.testing.assert_allclose(speed.min(), -wanted, rtol=1e-5)
    space_name = "frame 1" if space is JogSpace.FRAME else space.value
    assert said(session) == [
        (f"{space_name} {axis}-", "held", None, None),
        (f"{space_name} {axis}-", "let go", None, None),
    ]


@pytest.mark.parametrize("axis", ["J1", "J4", "J6", "E1", "E2"])
def test_an_axis_at_its_speed(axis: str) -> None:
    session = begun()
    windows = hold(session, axis, 1, JogSpace.JOINT, speed=30.0, seconds=0.6)
    require_limits(session)
    k = ["J1", "J2", "J3", "J4", "J5", "J6", "E1", "E2"].index(axis)
    rates = np.diff(axes(windows), axis=0) / session.cell.tick
    assert not np.delete(rates, k, axis=1).any()
    unit = 0.001 if axis == "E1" else np.radians(1.0)
    np.testing.assert_allclose(rates[:, k].max(), 30.0 * unit, rtol=1e-6)


def test_it_ends_at_rest_and_a_program_begins_there() -> None:
    session = begun()
    hold(session, "Z", 1, speed=120.0, seconds=0.5)
    here = session.pose
    assert (session.kernel.state, session.under_way, session.at_rest) == (State.FINISHED, False, True)
    session.take_on(compile_text("ML X=1600 F200\n", cell=session.cell))
    list(session.run())
    assert session.status is Status.FINISHED
    require_limits(session)
    np.testing.assert_allclose(session.pose[1:3, 3], here[1:3, 3], atol=1e-9)
    np.testing.assert_allclose(session.pose[0, 3], 1.6, atol=1e-9)


def test_an_override_scales_it_also_on_the_way() -> None:
    session = begun()
    session.set_override(0.5)
    assert session.hold(HeldJog("Y", 1, speed=100.0)) is None
    windows = list(session.run(most=500))
    assert session.set_override(1.0) is None
    windows += session.run(most=500)
    assert session.set_override(0.2) is None
    windows += session.run(most=500)
    speeds = [float(np.concatenate([w.speed for w in windows])[row]) * 1000.0 for row in (499, 999, 1499)]
    np.testing.assert_allclose(speeds, [50.0, 100.0, 20.0], rtol=1e-6)
    assert session.set_override(0.0) is None
    windows += session.run()
    require_limits(session)
    assert session.hold(HeldJog("Y", 1)) == "the override is 0"


def test_held_again_it_goes_on_without_a_dip() -> None:
    """The dead-man: the same jog, asked for again before it runs out, is one motion."""
    session = begun()
    windows = []
    for _ in range(8):
        assert session.hold(HeldJog("X", 1, seconds=0.2)) is None
        windows += session.run(most=150)
    windows += session.run()
    assert [each[1] for each in said(session)] == ["held", "let go"]
    speed = np.concatenate([w.speed for w in windows])
    np.testing.assert_allclose(speed[100:1240], 0.05, rtol=1e-6)
    assert session.events[-1].tick - session.events[-2].tick == 7 * 150 + 200
    require_limits(session)


def test_round_a_corner_of_one_space_in_motion_into_another_one_by_a_stop() -> None:
    session = begun()
    fast = {"speed": 100.0}
    windows: list[Window] = []
    slowest = []
    for jog in (
        HeldJog("X", 1, **fast),
        HeldJog("Y", 1, **fast),
        HeldJog("Z", -1, JogSpace.FRAME, frame=1, **fast),
        HeldJog("J1", 1, JogSpace.JOINT),
        HeldJog("X", 1, JogSpace.TOOL, **fast),
    ):
        assert session.hold(jog) is None
        begin = len(windows)
        windows += session.run(most=600)
        slowest.append(min(w.speed.min() for w in windows[begin:]))
    session.let_go()
    windows += session.run()
    assert slowest[1] > 0.05
    assert slowest[2] > 0.02
    assert slowest[3] < 1e-4
    assert slowest[4] < 1e-4
    require_limits(session)


@pytest.mark.parametrize(("command", "factor"), [("stop", 1.0), ("emergency_stop", 2.0)])
def test_a_stop_ends_it_and_an_emergency_stop_is_reset(command: str, factor: float) -> None:
    session = begun()
    assert session.hold(HeldJog("Y", -1, speed=200.0)) is None
    windows = list(session.run(most=700))
    assert session.halt() == "the robot is being jogged"
    assert getattr(session, command)() is None
    assert session.hold(HeldJog("Y", -1)) is not None
    windows += session.run()
    peaks = ratios(session.cell, axes(windows))
    assert (peaks <= np.array([1.0, factor, 1.05 * factor]) * (1.0 + 1e-6)).all(), peaks
    if command == "emergency_stop":
        assert session.kernel.state is State.EMERGENCY
        assert session.hold(HeldJog("Y", 1)) == "the robot is in emergency stop: reset it first"
        assert session.reset() is None
    assert session.kernel.state is State.FINISHED
    hold(session, "Y", 1, seconds=0.3)


def test_an_emergency_stop_is_shorter() -> None:
    ways = []
    for command in ("let_go", "emergency_stop"):
        session = begun()
        session.hold(HeldJog("Y", -1, speed=400.0))
        list(session.run(most=700))
        before = session.pose[1, 3]
        getattr(session, command)()
        list(session.run())
        ways.append(before - session.pose[1, 3])
    assert 0.0 < ways[1] < 0.75 * ways[0]


# --- what it does not --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "jog", "code", "words"),
    [
        (PLAIN, HeldJog("J1", 1, JogSpace.JOINT, speed=90.0), "E303", "J1 comes to the end of its range"),
        (PLAIN, HeldJog("E1", 1, JogSpace.JOINT, speed=400.0), "E307", "E1 comes to the end of its range"),
        (PLAIN, HeldJog("X", 1, speed=400.0), "E304", "ELBOW"),
        (PLAIN + PRESS, HeldJog("J1", 1, JogSpace.JOINT, speed=90.0), "E330", "press"),
        (PLAIN + PRESS, HeldJog("Y", 1, JogSpace.FRAME, speed=400.0), "E330", "press"),
        (PLAIN, HeldJog("J2", -1, JogSpace.JOINT, speed=90.0), "E332", "link"),
        (CONE + PLAIN, HeldJog("B", 1, speed=60.0), "E333", "cone"),
    ],
)
def test_it_stops_by_itself_and_says_before_what(text: str, jog: HeldJog, code: str, words: str) -> None:
    start = "MJ X=1700 Y=0 Z=1700 A=0 B=90 C=0 F60\n"
    home = "home = [0, 0, 0, 0, 90, 0]\n"
    text = text.replace('model = "frigeni6"\n', f'model = "frigeni6"\n{home}')
    session = begun(text, start=start)
    assert session.hold(jog) is None
    windows = list(session.run())
    assert said(session)[-1][1:3] == ("stopped", code)
    assert words in str(said(session)[-1][3])
    require_limits(session)
    assert windows[-1].speed[-1] < 1e-3
    assert session.status is Status.FINISHED
    # as far as it could: less than 2 ticks' way is left, or 3 % of the speed where the joints limit it
    for _ in range(2):
        before = session.kernel.telemetry.joints.copy()
        if session.hold(jog) is None:
            list(session.run())
        if code != "E304":
            assert np.abs(session.kernel.telemetry.joints - before).max() < 1e-2
    back = HeldJog(jog.axis, -jog.direction, jog.space, speed=jog.speed, seconds=0.3)
    before = session.kernel.telemetry.columns.copy()
    assert session.hold(back) is None
    windows = list(session.run())
    assert np.abs(session.kernel.telemetry.columns - before).max() > 1e-3
    require_limits(session)


def test_past_a_singular_pose_it_slows_down_and_takes_up_its_speed_again() -> None:
    """The wrist passes within some degrees of its stretched pose: J4 turns by half a turn on the way."""
    session = begun(start="MJ J1=5 J2=10 J3=20 J4=10 J5=15 J6=0 F60\n")
    windows = hold(session, "B", -1, speed=40.0)
    require_limits(session)
    J4, J5 = np.degrees(axes(windows)[:, 3:5]).T
    assert np.ptp(J4) > 150.0
    turned = np.concatenate([w.quaternion for w in windows])
    rate = (
        np.degrees(2.0 * np.arccos(np.minimum(np.abs((turned[1:] * turned[:-1]).sum(axis=1)), 1.0))) * 1000.0
    )
    nearest = int(np.abs(J5).argmin())
    assert rate[nearest - 50 : nearest + 50].max() < 8.0
    assert np.median(rate[-1500:-500]) == pytest.approx(40.0, rel=1e-2)


def test_what_cannot_move_at_all_is_refused() -> None:
    session = begun()
    hold(session, "J1", 1, JogSpace.JOINT, speed=90.0)
    list(session.run())
    for _ in range(6):
        refused = session.hold(HeldJog("J1", 1, JogSpace.JOINT))
        list(session.run())
    assert refused is not None
    assert "J1 comes to the end of its range" in refused
    tick = session.kernel.tick
    assert session.hold(HeldJog("J1", 1, JogSpace.JOINT)) == refused
    assert (session.kernel.tick, session.kernel.state) == (tick, State.FINISHED)


def test_out_of_a_zone_but_not_deeper_into_it() -> None:
    """A robot that stands in a zone, by a scenario or a changed cell, can be jogged out of it."""
    inside = PRESS.replace("1500, 500, 500", "1400, -300, 1000").replace("2600, 900, 2500", "2000, 300, 1510")
    other = begun(PLAIN, start="MJ X=1500 Y=-200 Z=1500 A=0 B=90 C=0 F60\n")
    joints = other.kernel.telemetry.joints
    home = f"home = {np.degrees(joints).tolist()}\n"
    session = Jogged(
        parse_cell((PLAIN + inside).replace('model = "frigeni6"\n', f'model = "frigeni6"\n{home}'))
    )
    assert session.status is Status.ERROR
    before = session.pose[2, 3]
    refused = session.hold(HeldJog("Z", -1))
    assert refused is not None
    assert "press" in refused
    hold(session, "Z", 1, seconds=2.0)
    require_limits(session)
    assert session.pose[2, 3] > before + 0.09
    session.hold(HeldJog("Z", -1))
    list(session.run())
    assert session.pose[2, 3] > 1.51 - 1e-6
    assert said(session)[-1][1:3] == ("stopped", "E330")


def test_beside_a_filter_and_beside_corrections() -> None:
    """A jog is smooth by itself and goes by no filter; while corrections are at work there is none."""
    filtered = PLAIN + "[controller.filter]\nticks = 24\n"
    session = begun(filtered)
    hold(session, "Y", 1, speed=100.0, seconds=0.4)
    session.take_on(compile_text("ML Z=1600 F200\n", cell=session.cell))
    assert session.finish() is Status.FINISHED
    hold(session, "J4", -1, JogSpace.JOINT, seconds=0.4)
    require_limits(session)
    cell = parse_cell(PLAIN)
    text = '[[correction]]\nframe = "base"\nz_mm = [[0, 1]]\nmax_rate_mm_s = 5\n'
    corrected = Interactive(cell, scenario=parse_scenario(text, cell))
    assert corrected.hold(HeldJog("J1", 1, JogSpace.JOINT)) == "corrections are at work"


def test_let_go_before_it_has_set_out() -> None:
    session = begun()
    before = session.kernel.telemetry.joints.copy()
    assert session.hold(HeldJog("X", 1)) is None
    assert session.hold(HeldJog("J1", 1, JogSpace.JOINT)) is None
    assert session.let_go() is None
    assert sum(len(window) for window in session.run()) == 1
    np.testing.assert_array_equal(session.kernel.telemetry.joints, before)
    assert session.kernel.state is State.FINISHED


@pytest.mark.parametrize(
    "jog",
    [
        HeldJog("Q", 1),
        HeldJog("X", 0),
        HeldJog("X", 2),
        HeldJog("J7", 1, JogSpace.JOINT),
        HeldJog("E3", 1, JogSpace.JOINT),
        HeldJog("X", 1, JogSpace.JOINT),
        HeldJog("X", 1, JogSpace.FRAME, frame=4),
        HeldJog("X", 1, speed=-5.0),
        HeldJog("X", 1, speed=float("nan")),
        HeldJog("X", 1, seconds=0.0),
    ],
)
def test_what_cannot_be_held(jog: HeldJog) -> None:
    session = begun()
    with pytest.raises(JogError):
        session.hold(jog)
    assert session.at_rest


def test_not_while_a_program_is_under_way_nor_a_program_while_jogging() -> None:
    session = begun()
    session.take_on(compile_text("WAIT DI 1", cell=session.cell))
    list(session.run())
    assert session.hold(HeldJog("X", 1)) == "<text> is waiting"
    session.stop()
    list(session.run())
    assert session.let_go() == "nothing is being jogged"
    assert session.hold(HeldJog("X", 1)) is None
    list(session.run(most=100))
    with pytest.raises(RuntimeError, match="jogging"):
        session.take_on(compile_text("WAIT 1", cell=session.cell))


def test_before_a_run_begins_and_the_run_begins_where_it_ends() -> None:
    cell = parse_cell(PLAIN)
    session = Session(cell, compile_text("ML X=1500 F200\n", cell=cell), window=64)
    assert session.hold(HeldJog("J5", 1, JogSpace.JOINT, seconds=1.0)) is None
    assert session.hold(HeldJog("J5", 1, JogSpace.JOINT, seconds=1.0)) is None
    windows = list(session.run())
    assert session.status is Status.FINISHED
    assert [w.first_tick for w in windows] == list(
        itertools.accumulate((len(w) for w in windows[:-1]), initial=0)
    )
    turned = np.degrees(axes(windows)[:, 4])
    assert 15.0 < turned[1000] <= 20.0
    assert turned[-1] != turned[1200]
    assert (ratios(cell, axes(windows)) <= np.array([1.0, 1.0, 1.05]) * (1.0 + 1e-6)).all()


# --- at random ---------------------------------------------------------------------------------------


def clearance(cell: Cell, joints: Floats, low: Floats, high: Floats) -> float:
    """Least distance (m) of any link's surface to a box, by points on the links' axes."""
    assert cell.robot.body_radius is not None
    points = cell.robot.link_points(joints)
    share = np.linspace(0.0, 1.0, 25)[:, None]
    nearest = np.inf
    for k, radius in enumerate(cell.robot.body_radius[1:], start=1):  # the first stands
        along = points[:, None, k] + share * (points[:, None, k + 1] - points[:, None, k])
        outside = np.maximum(np.maximum(low - along, along - high), 0.0)
        nearest = min(nearest, float(np.linalg.norm(outside, axis=2).min()) - float(radius))
    return nearest


LOW, HIGH = np.array([1.5, 0.5, 0.5]), np.array([2.6, 0.9, 2.5])
Order = tuple[HeldJog | str | float, int]


def orders(random: Random) -> list[Order]:
    """What is pressed, let go or changed, and how many ticks later the next thing is."""
    result: list[Order] = []
    for _ in range(14):
        kind = random.random()
        what: HeldJog | str | float = "let go"
        if kind < 0.75:
            space = random.choice(SPACES)
            names = COORDINATES if space is not JogSpace.JOINT else ["J1", "J2", "J3", "J4", "J5", "J6", "E1"]
            speed = random.choice([None, 20.0, 90.0, 400.0])
            seconds = random.choice([None, None, 0.1, 0.4])
            what = HeldJog(random.choice(names), random.choice([1, -1]), space, 1, speed, seconds)
        elif kind < 0.85:
            what = random.choice([0.3, 0.6, 1.0])
        result.append((what, random.choice([1, 2, 17, 60, 200, 500])))
    return result


def obey(seed: int, window: int) -> tuple[Jogged, Floats, list[tuple[object, ...]]]:
    """A session of random orders, its axes tick by tick and what happened."""
    random = Random(seed)
    start = f"MJ J1={random.uniform(-60, 0)} J2={random.uniform(0, 30)} J3={random.uniform(-30, 0)} "
    start += f"J4={random.uniform(-40, 40)} J5={random.uniform(30, 80)} F80\nT 1\n"
    session = begun(PLAIN + PRESS, start=start, window=window)
    for what, ticks in orders(random):
        if isinstance(what, float):
            session.set_override(what)
        elif isinstance(what, str):
            session.let_go()
        else:
            session.hold(what)
        list(session.run(most=ticks))
    session.let_go()
    list(session.run())
    assert session.kernel.state is State.FINISHED
    return (
        session,
        axes(session.ticks.windows),
        [(e.tick, *e.data.values()) for e in session.events if e.kind == "jog"],
    )


@pytest.mark.parametrize("seed", range(8))
def test_whatever_is_pressed_when_limits_hold_and_no_zone_is_entered(seed: int) -> None:
    session, rows, _ = obey(seed, 1024)
    require_limits(session, seed)
    assert clearance(session.cell, rows[::5, :6], LOW, HIGH) > -1e-4, seed


@pytest.mark.parametrize("seed", [0, 3, 7])
def test_the_window_changes_nothing(seed: int) -> None:
    _, long, told_long = obey(seed, 1024)
    _, short, told_short = obey(seed, 1)
    assert told_long == told_short, seed
    np.testing.assert_array_equal(long, short)


@pytest.mark.parametrize("seed", [1, 5])
def test_compiled_modules_and_twins_jog_alike(seed: int) -> None:
    def run() -> tuple[Floats, list[tuple[object, ...]]]:
        _, rows, told = obey(seed, 1024)
        return rows, told

    (twin, told_twin), (built, told_built) = by_both(run, "robots._spherical")
    assert told_twin == told_built, seed
    np.testing.assert_allclose(twin, built, atol=1e-9, err_msg=str(seed))
