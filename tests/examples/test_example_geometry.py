"""The TCP is where the program says: on lines and circles, and within the tolerance between them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest
from example_geometry import Curve, Floats, Programmed, flange
from example_runs import MANIFEST, Example, Run, run

from viapoint.vm.ports import Motion

ON_CURVE = 1e-9
"""m: a millionth of a millimetre."""


STANDING = [example for example in MANIFEST if example.name != "deburring"]
"""All but the program on a moving belt, whose places are where the belt is: the tests of tracking know it."""


class Passed(NamedTuple):
    """How a corner is passed: over how much of the path beside it (m), and whether R says so."""

    stop: bool
    effective: float
    rounded: bool


STOP = Passed(True, 0.0, False)


class Block(NamedTuple):
    """A motion as programmed, and the TCP's set points (N, 3) in it."""

    motion: Motion
    curve: Curve | None
    X_base_tcp_end: Floats
    before: Passed
    after: Passed
    tcp: Floats


def corners(run: Run) -> dict[int, Passed]:
    """By the number of the motion before the corner. Motions of no length share the corner behind them."""
    own = {motion.line for motion in run.motions().values()}
    transitions = {c.transition.tag: c.transition for c in run.session.corners if c.line in own}
    result = {}
    for tag, transition in transitions.items():
        passed = transition
        while passed.reason.name == "ZERO_LENGTH" and passed.next_tag in transitions:
            passed = transitions[passed.next_tag]
        result[tag] = Passed(passed.stop, passed.effective, passed.reason.name == "ROUNDED")
    return result


def blocks(run: Run) -> Iterator[Block]:
    """All motions of the program that the run finished, without what interrupts them."""
    programmed, passed, before = Programmed(run.cell), corners(run), STOP
    X_base_flange = flange(run.joints)
    beside = run.interrupts()
    own = np.ones(len(run.joints), dtype=bool)
    for begun, back in beside:
        own[begun + 1 : back] = False
    events = [
        event
        for event in run.session.events
        if event.kind == "block"
        and not any(
            begun <= event.tick and float(str(event.data["t_end"])) / run.cell.tick < back + 0.5
            for begun, back in beside
        )
    ]
    left_out = {
        event.line for event in run.session.events if event.kind == "interrupt" and "code" in event.data
    }
    made = ((number, motion) for number, motion in run.motions().items() if motion.line not in left_out)
    for event, (number, motion) in zip(events, made, strict=False):
        assert event.line == motion.line
        curve = programmed.motion(motion)
        X_flange_tool = run.cell.tools[motion.tool].X_flange_tool
        first, last = event.tick, round(float(str(event.data["t_end"])) / run.cell.tick)
        after = passed.get(number, before)
        last -= 0 if after.stop else 1  # the tick that has passed the end lies on what follows
        rows = np.flatnonzero(own[first : last + 1]) + first
        tcp = (X_base_flange[rows] @ X_flange_tool)[:, :3, 3]
        yield Block(motion, curve, programmed.flange @ X_flange_tool, before, after, tcp)
        before = after


@pytest.mark.parametrize("example", STANDING, ids=lambda example: example.name)
def test_tcp_is_on_the_programmed_geometry(example: Example) -> None:
    done = run(example)
    assert done.cell.robot.name == "frigeni6"
    assert (np.diff(done.ticks) == 1).all()
    for block in blocks(done):
        where = f"line {block.motion.line}"
        if block.after.stop:
            miss = np.linalg.norm(block.tcp[-1] - block.X_base_tcp_end[:3, 3])
            assert miss <= ON_CURVE, f"{where} ends {miss / 1e-3} mm off its target"
        if block.curve is None:
            continue
        distance, place = block.curve.locate(block.tcp)
        allowed = np.full(len(distance), ON_CURVE)
        for corner, beside in ((block.before, place), (block.after, block.curve.length - place)):
            near = beside < corner.effective + ON_CURVE
            allowed[near] = np.inf if corner.rounded else done.cell.path_tolerance
            if not corner.stop:
                allowed[beside <= 0.0] = np.inf  # beyond the corner: beside the other motion
        over = distance - allowed
        assert over.max() <= 0.0, f"{where}: {distance[over.argmax()] / 1e-3} mm from its path"


def test_most_set_points_of_the_contour_are_held_to_the_programmed_path() -> None:
    """Guards the test above: it would prove nothing if round edges were everywhere."""
    done = run(next(example for example in MANIFEST if example.name == "contour"))
    exact = total = 0
    for block in blocks(done):
        if block.curve is not None:
            distance, _ = block.curve.locate(block.tcp)
            exact += int((distance <= ON_CURVE).sum())
            total += len(distance)
    assert total > 20_000
    assert exact > 0.7 * total
