"""What the prompt shows of a session, as lines: state, source with its two markers, points, signals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from viapoint.interactive import Interactive
from viapoint.language.units import DEG, MM
from viapoint.narration import fixed
from viapoint.report import joints_in_degrees
from viapoint.runtime.cell import Point, SignalKind
from viapoint.runtime.kernel import State
from viapoint.runtime.records import Floats
from viapoint.runtime.rotations import matrix_to_abc

_AROUND: Final = 2
"""Source lines shown above and below a marker."""

_DIGITS: Final = 3
"""Decimals of mm and deg: what a teach pendant shows."""

COORDINATES: Final = "XYZABC"


def figure(value: float) -> str:
    """A number without superfluous zeros."""
    text = fixed(value, _DIGITS).rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def coordinates(X: Floats) -> tuple[float, ...]:
    """X, Y, Z in mm and A, B, C in deg of a pose (4, 4)."""
    return (*(X[:3, 3] / MM).tolist(), *(matrix_to_abc(X[:3, :3]) / DEG).tolist())


def pose_text(X: Floats) -> str:
    """A pose (4, 4) as a statement would give it."""
    return " ".join(f"{name}={figure(v)}" for name, v in zip(COORDINATES, coordinates(X), strict=True))


def joints_text(values: Sequence[float]) -> str:
    """Joints in deg or mm as a statement would give them."""
    return " ".join(f"J{i + 1}={figure(value)}" for i, value in enumerate(values))


def where(session: Interactive) -> str:
    """Where the TCP is, with the tool if there is one."""
    tool = f"T{session.kernel.tool} " if session.kernel.tool else ""
    return f"{tool}{pose_text(session.pose)}"


def joints(session: Interactive) -> str:
    """The joints, and auxiliary axes where there are any."""
    from viapoint.runtime.kernel import AuxiliaryAxes

    values = joints_in_degrees(session.cell, session.kernel.telemetry.joints).tolist()
    axes = AuxiliaryAxes.of(session.cell)
    others = session.kernel.telemetry.auxiliary / axes.units
    return " ".join(
        (joints_text(values), *(f"{axes.name(k)}={figure(float(v))}" for k, v in enumerate(others)))
    )


def state_word(session: Interactive) -> str:
    """What the robot is doing, in a word."""
    state = session.kernel.state
    if session.under_way or state in (State.HALTED, State.JOGGING, State.EMERGENCY):
        return state.value
    return {State.FINISHED: "ready", State.FAILED: "ready after an error"}.get(state, "ready after a stop")


def status(session: Interactive, speed: float = 0.0) -> str:
    """The status line: state, line, time, speed (given in m/s), override, buffer, place."""
    kernel = session.kernel
    line = f"line {session.next_line}" if session.under_way else ""
    parts = (
        state_word(session),
        line,
        f"{fixed(kernel.tick * session.cell.tick, 3)} s",
        f"{fixed(speed / MM, 1)} mm/s",
        f"{figure(kernel.override * 100.0)} %",
        f"buffer {kernel.fill}/{session.cell.lookahead}",
        where(session),
    )
    return " | ".join(part for part in parts if part)


def source(lines: Sequence[str], robot: int, interpreter: int, around: int = _AROUND) -> Iterator[str]:
    """Lines around the robot's (`R>`) and the interpreter's (`I>`), numbered from 1."""
    shown = sorted(
        {n for place in (robot, interpreter) for n in range(place - around, place + around + 1)}
        & set(range(1, len(lines) + 1))
    )
    before = shown[0] if shown else 0
    for number in shown:
        if number > before + 1:
            yield "           …"
        before = number
        yield numbered(number, lines[number - 1], number == robot, number == interpreter)


def numbered(number: int, text: str, robot: bool, interpreter: bool) -> str:
    """One line of source with its markers."""
    marks = f"{'R>' if robot else '  '} {'I>' if interpreter else '  '}"
    return f"{marks} {number:>4}  {text}".rstrip()


def point_text(point: Point, units: Floats) -> str:
    """One point: its number, its values, its name."""
    if point.joints is not None:
        what = joints_text((point.joints / units).tolist())
    else:
        assert point.pose is not None, "a point is taught as a pose or as joints"
        what = pose_text(point.pose)
    return f"P{point.index:<4} {what}{f'  {point.name}' if point.name else ''}"


def joint_units(session: Interactive) -> Floats:
    """What a joint's unit (n,) is: 1 deg in rad, 1 mm in m."""
    return np.where(session.cell.robot.prismatic, MM, DEG)


def signal_lines(session: Interactive) -> Iterator[str]:
    """Signals that have a name, are not at rest, or are forced; variables; M flags that are raised."""
    bank, io = session.signals, session.cell.io
    names = {signal: name for name, signal in io.names.items()}
    for kind in SignalKind:
        for signal in bank.of_kind(kind):
            value, forced = bank.read(signal), signal in bank.forced
            if not (value or forced or signal in names or kind is SignalKind.VARIABLE):
                continue
            said = ("on" if value else "off") if io.is_switch(signal) else figure(float(value))
            name = f"  {names[signal]}" if signal in names else ""
            yield f"{signal!s:<5} {said}{'  forced' if forced else ''}{name}"
    for index in sorted(session.flags):
        yield f"M{index:<4} raised"
