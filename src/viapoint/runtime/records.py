"""What a run leaves behind: windows of ticks and events. Plain records, no behaviour.

A listener (session, recording, pictures) gets every window and every event once, in time order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

EventValue = float | int | bool | str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Arrays over N consecutive ticks; SI units, base frame, the active tool's TCP.

    The very first window of a run holds one row, tick 0: where the robot stands at t = 0.
    """

    first_tick: int
    time: Floats  # (N,) s
    line: Ints  # (N,) source line whose statement the path is in
    interpreter_line: Ints  # (N,) source line the interpreter has reached
    s: Floats  # (N,) m, length of the TCP's path since the start of the run
    speed: Floats  # (N,) m/s, of the TCP along its path
    override: Floats  # (N,) 1.0 = 100 %
    buffer_fill: Ints  # (N,) entries in the motion buffer
    joints: Floats  # (N, n) rad or m, set points as sent
    actual: Floats  # (N, n) rad or m, as the drives report
    auxiliary: Floats  # (N, k) rad or m, set points of the auxiliary axes in the order of their numbers
    position: Floats  # (N, 3) m, TCP
    quaternion: Floats  # (N, 4) w x y z
    torque: Floats  # (N, n) N·m, or N at slides: of the joints; (N, 0) where the arm's masses are not known
    deviation: Floats  # (N,) m, of the TCP as sent from where the path has it: filter and corrections

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened in one tick. `data` keys are those of the command line's JSON contract."""

    tick: int
    t: float  # s
    line: int
    kind: str  # block, output, input_read, m, wait, search, tool, track, tangent, message, override, error
    robot: int = 1
    data: Mapping[str, EventValue]
