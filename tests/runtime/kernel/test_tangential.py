"""TANG: the tool along the tangent; aligned at rest, through edges and splines, wound up, switched off."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from programs_at_random import FRAMES, TOOLS, Arm, Floats

from session_runs import Run, run

DEG = np.pi / 180.0
ALONG = 2e-6
"""rad between tool and tangent on lines, arcs and splines."""

ON_EDGES = 0.6 * DEG
"""On round edges, where position is C² and the heading, so, only C¹: its rate is smoothed there."""

START = "MJ X=1400 Y=-150 Z=1500 A=0 B=90 C=0 F90\nTANG 1\n"
SHARP = f"{START}ML X=1600 F300\nSET DO1\nML Y=50\nML X=1400\nTANG 0\n"
ROUND = f"{START}ML X=1600 F300 R30\nSET DO1\nML Y=50 R30\nML X=1400\nTANG 0\n"
DOWN = np.asarray(pin.utils.rotate("y", np.pi / 2.0))


def poses(done: Run) -> Floats:
    """X_base_flange (N, 4, 4) by kinematics that are not the kernel's."""
    arm = Arm()
    return np.array([arm.flange(q) for q in done.joints])


def off_tangent(done: Run, offset: float = 0.0, frame: int = 0, tool: int = 0) -> tuple[Floats, Floats]:
    """Ticks in motion, and the angle there between the tool and where the tangent wants it, rad."""
    X = np.linalg.inv(FRAMES[frame]) @ poses(done) @ TOOLS[tool]
    p = X[:, :3, 3]
    v = (p[2:] - p[:-2]) / 2.0
    ticks = np.flatnonzero(np.linalg.norm(v[:, :2], axis=1) > 2e-6) + 1
    away = []
    for k in ticks:
        heading = np.arctan2(v[k - 1, 1], v[k - 1, 0]) + offset
        wanted = pin.utils.rotate("z", heading) @ DOWN
        away.append(float(np.linalg.norm(pin.log3(wanted.T @ X[k, :3, :3]))))
    return ticks, np.array(away)


def moved_along(done: Run, lines: tuple[int, ...]) -> np.ndarray:
    return np.isin(done.column("line"), lines)


def test_at_a_corner_without_R_the_path_stands_while_the_tool_turns() -> None:
    done = run(SHARP)
    assert done.status == "finished"
    assert not done.over_limits()
    ticks, away = off_tangent(done)
    inside = moved_along(done, (3, 5, 6))[ticks]
    assert away[inside].max() < 1e-3  # tangents of chords of a tick
    corner = done.end_of(3)
    p = poses(done)[:, :3, 3]
    turning = np.flatnonzero(np.abs(done.column("speed")) < 1e-9)
    turning = turning[(turning > corner) & (turning < done.end_of(5))]
    assert len(turning) > 100
    assert np.ptp(p[turning], axis=0).max() < 1e-9
    C = np.unwrap(np.arctan2(*poses(done)[turning][:, :2, 2].T[::-1]))
    assert C[-1] - C[0] == pytest.approx(90.0 * DEG, abs=1e-3)


def test_a_round_edge_is_passed_with_the_tool_on_its_tangent() -> None:
    done = run(ROUND)
    assert done.status == "finished"
    assert not done.over_limits()
    ticks, away = off_tangent(done)
    assert away[moved_along(done, (3, 5, 6))[ticks]].max() < ON_EDGES
    assert done.column("speed")[done.end_of(3) - 50 : done.end_of(5)].min() > 0.01
    assert run(ROUND).session.kernel.tick < run(SHARP).session.kernel.tick


@pytest.mark.parametrize("override", [1.0, 0.37])
@pytest.mark.parametrize("text", [SHARP, ROUND], ids=["sharp", "round"])
def test_scenario_18_tang_at_a_corner_with_and_without_R(text: str, override: float) -> None:
    """Equal events and set points for windows of 1 and 1024; the same path at any override."""
    whole = run(text, override=override, window=1024)
    assert not whole.over_limits()
    assert np.abs(whole.joints[-1] - run(text).joints[-1]).max() < 1e-9
    assert [e[1:3] for e in whole.history if e[2] != "override"] == [
        e[1:3] for e in run(text).history if e[2] != "override"
    ]
    single = run(text, override=override, window=1)
    assert single.history == whole.history
    assert np.abs(single.joints - whole.joints).max() < 1e-9


def test_the_offset_is_kept_from_the_tangent() -> None:
    done = run(ROUND.replace("TANG 1", "TANG 1 H45"))
    ticks, away = off_tangent(done, 45.0 * DEG)
    assert away[moved_along(done, (3, 5, 6))[ticks]].max() < ON_EDGES
    assert [(e.data["on"], e.data["offset_deg"]) for e in done.events("tangent")] == [
        (True, 45.0),
        (False, 0.0),
    ]


def test_a_circle_and_a_spline_are_followed() -> None:
    done = run(
        f"{START}ML Y=0 F200\nMC X=1500 Y=100 QX=1429.2893 QY=70.7107 QZ=1500\n"
        "MS X=1600 Y=50\nMS X=1650 Y=-50 Z=1480\n"
    )
    assert not done.over_limits()
    ticks, away = off_tangent(done)
    steady = moved_along(done, (3, 4, 5, 6))[ticks]
    assert np.median(away[steady]) < 1e-4
    assert away[steady].max() < ON_EDGES
    assert {done.reasons[line] for line in (3, 4, 5)} == {"TOLERANCE"}


def test_the_heading_is_that_in_the_plane_of_the_frame() -> None:
    """Frame 1 is turned by 30 deg; tool 1 points to where it did."""
    done = run(
        f"{START}ML Z1 X=150 Y=400 Z=700 A=0 B=90 C=0 F200\nML Z1 X=250 Y=500 R20\nML Z1 X=350 Y=500\n"
    )
    ticks, away = off_tangent(done, frame=1)
    assert away[moved_along(done, (4, 5))[ticks]].max() < ON_EDGES


def test_A_and_B_go_on_as_programmed() -> None:
    """B from 90 to 70 deg along a line: half of it half-way, with the heading of the line all along."""
    done = run(f"{START}ML X=1600 Y=50 B=70 F200\n")
    X = poses(done)[moved_along(done, (3,))]
    moving = np.linalg.norm(np.diff(X[:, :3, 3], axis=0, prepend=X[:1, :3, 3]), axis=1) > 1e-5
    share = np.linalg.norm(X[moving][:, :2, 3] - (1.4, -0.15), axis=1) / np.hypot(0.2, 0.2)
    for part, R in zip(share, X[moving][:, :3, :3], strict=True):
        wanted = pin.utils.rotate("z", 45.0 * DEG) @ pin.utils.rotate("y", (90.0 - 20.0 * part) * DEG)
        assert np.linalg.norm(pin.log3(wanted.T @ R)) < 1e-7


def test_joint_moves_are_not_affected() -> None:
    free = run("MJ X=1400 Y=-150 Z=1500 A=0 B=90 C=0 F90\nMJ X=1500 Y=0 C=20\nMJ J1=10\n")
    tangential = run(f"{START}MJ X=1500 Y=0 C=20\nMJ J1=10\n")
    assert np.abs(free.joints[-1] - tangential.joints[-1]).max() < 1e-9
    mixed = run(f"{START}ML X=1500 F200\nMJ X=1500 Y=0 C=20 R20\nML Y=100\n")
    assert not mixed.over_limits()
    R = poses(mixed)[mixed.end_of(4), :3, :3]
    assert np.linalg.norm(pin.log3((pin.utils.rotate("z", 20.0 * DEG) @ DOWN).T @ R)) < 1e-7


def test_after_TANG_0_the_next_motion_turns_back() -> None:
    aside = ROUND.replace("ML X=1400\n", "ML X=1400 Y=80\n")
    done = run(f"{aside}ML X=1450 Y=100\n")
    assert not done.over_limits()
    before, after = poses(done)[done.end_of(6), :3, :3], poses(done)[-1, :3, :3]
    assert np.linalg.norm(pin.log3(DOWN.T @ before)) > 170.0 * DEG
    assert np.linalg.norm(pin.log3(DOWN.T @ after)) < 1e-7


def test_a_turn_in_place_keeps_the_heading() -> None:
    done = run(f"{START}ML X=1600 Y=50 F200\nML B=75\n")
    wanted = pin.utils.rotate("z", 45.0 * DEG) @ pin.utils.rotate("y", 75.0 * DEG)
    assert np.linalg.norm(pin.log3(wanted.T @ poses(done)[-1, :3, :3])) < 1e-7


def test_a_path_along_Z_has_no_heading() -> None:
    done = run(f"{START}ML X=1600 F200\nML Z=1400\n")
    assert done.code == "E308"
    assert done.failed_line == 4


@pytest.mark.parametrize("after", ["", "ML Y=0\n"])
def test_a_spline_that_ends_along_Z_has_no_heading_there(after: str) -> None:
    """Found when its neighbour is known; the robot stands where the spline would begin."""
    done = run(f"{START}ML X=1600 F200\nMS X=1600 Z=1400\nML Z=1350\n{after}")
    assert done.code == "E308"
    assert done.failed_line in (4, 5)
    assert np.abs(poses(done)[-1, :3, 3] - (1.6, -0.15, 1.5)).max() < 1e-9


def test_turns_add_up_to_the_range_of_the_wrist() -> None:
    """Refused before the circle that would wind it up begins; the message says by how many turns."""
    circle = "MC X=1450 Y=-50 QX=1500 QY=-100 QZ=1500 H360 F300\n"
    done = run(f"{START}ML Y=-120 F200\n" + 2 * circle)
    assert done.code == "E309"
    assert "turns" in done.session.failure.message  # type: ignore[union-attr]
    assert done.failed_line in (4, 5)
    assert not done.over_limits()
    assert run(f"{START}ML Y=-120 F200\n{circle}").code is None
    freed = f"{START}ML Y=-120 F200\n{circle}MJ C=0\n{circle}"
    assert run(freed).code is None


def test_a_step_at_a_time_ends_in_the_same_pose() -> None:
    assert np.abs(run(ROUND, step=True).joints[-1] - run(ROUND).joints[-1]).max() < 1e-9


def test_another_tool_is_tangential_too() -> None:
    done = run(ROUND.replace("TANG 1\n", "T 1\nTANG 1\n").replace("Z=1500", "Z=1900"))
    assert done.status == "finished"
    assert not done.over_limits()
    _, away = off_tangent(done, tool=1)
    assert np.median(away) < ON_EDGES
