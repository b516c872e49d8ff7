"""The monitor: all that is to be seen of a robot in one tick, as one record in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from viapoint.runtime.kernel import MotionError, State
from viapoint.runtime.kernel.states import Mode
from viapoint.runtime.records import Floats, Window
from viapoint.session import Session
from viapoint.vm.ports import Motion, Target


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Monitor:
    """A robot in the last tick of a window: m, rad, s; poses of the TCP in the base frame."""

    tick: int
    time: float
    state: State
    mode: Mode
    """Which commands are taken."""
    line: int
    interpreter_line: int
    statements: int
    """Statements executed so far."""
    buffer_fill: int
    override: float
    """1 is 100 %; below 0 the path is travelled back."""
    tool: int
    frame: int | None
    """Of the motion under way; None where no motion is."""
    target: Target | None
    """Of the motion under way, as programmed."""
    block_length: float | None
    """TCP length of the motion under way; None while what follows may still change it."""
    block_done: float
    """TCP length of it that is travelled."""
    s: float
    """TCP length since the start of the run."""
    speed: float
    position: Floats  # (3,)
    quaternion: Floats  # (4,), w x y z
    joints: Floats  # (n,), as sent
    actual: Floats  # (n,), as the drives report
    joint_speeds: Floats | None  # (n,), over the last tick; None in a window of one tick
    auxiliary: Floats  # (k,), as sent
    auxiliary_speeds: Floats | None  # (k,), likewise
    motors: Floats  # (n,), motor angles of the joints sent, through the coupling of the wrist
    torques: Floats | None  # (n,) N·m, of the joints; None where the arm's masses are not known
    motor_torques: Floats | None  # (n,) the same, seen at the motors through the coupling of the wrist
    manipulability: float
    singular: tuple[str, ...]
    """The singular poses it stands in."""
    signals: Mapping[str, bool | float]
    flags: frozenset[int]
    """M functions that wait for their reset."""
    failure: MotionError | None


def monitor(session: Session, window: Window) -> Monitor:
    """What is to be seen behind `window`, the last one of a session."""
    kernel, robot = session.kernel, session.cell.robot
    q = window.joints[-1]
    length, done, motion = _block(session)
    torques = window.torque[-1] if window.torque.shape[1] else None
    return Monitor(
        tick=window.first_tick + len(window) - 1,
        time=float(window.time[-1]),
        state=kernel.state,
        mode=kernel.mode,
        line=int(window.line[-1]),
        interpreter_line=int(window.interpreter_line[-1]),
        statements=kernel.statements,
        buffer_fill=int(window.buffer_fill[-1]),
        override=float(window.override[-1]),
        tool=kernel.tool,
        frame=None if motion is None else motion.frame,
        target=None if motion is None else motion.target,
        block_length=length,
        block_done=done,
        s=float(window.s[-1]),
        speed=float(window.speed[-1]),
        position=window.position[-1],
        quaternion=window.quaternion[-1],
        joints=q,
        actual=window.actual[-1],
        joint_speeds=_rate(window.joints, session.cell.tick),
        auxiliary=window.auxiliary[-1],
        auxiliary_speeds=_rate(window.auxiliary, session.cell.tick),
        motors=robot.joints_to_motors(q),
        torques=torques,
        motor_torques=None if torques is None else robot.coupling.T @ torques,
        manipulability=float(robot.manipulability(q)),
        singular=robot.singularity(q).singular,
        signals={str(signal): value for signal, value in session.signals.at_work()},
        flags=session.flags,
        failure=session.failure,
    )


def _rate(rows: Floats, tick: float) -> Floats | None:
    """Over the last tick of rows (N, m); None where there is only one."""
    return (rows[-1] - rows[-2]) / tick if len(rows) > 1 else None


def _block(session: Session) -> tuple[float | None, float, Motion | None]:
    """Length, part travelled and statement of the motion under way."""
    kernel = session.kernel
    entry = kernel.execution.front
    if entry is None or not isinstance(entry.call, Motion):
        return None, 0.0, None
    route, begun = kernel.planner.route, kernel.execution.blocks.begun
    place = route.place(entry.number)
    length = None if place is None else route.travelled(place) - begun
    return length, max(route.travelled(kernel.mover.s) - begun, 0.0), entry.call
