"""What happens around the robot in a simulation: plain records, times in s, lengths in m. No state."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from viapoint.language.source import Source
from viapoint.runtime.cell import Signal

Floats = npt.NDArray[np.float64]
Value = bool | float


@dataclass(frozen=True, slots=True)
class MFlag:
    """The flag of M function `index`; each robot has its own."""

    index: int
    robot: int = 1


@dataclass(frozen=True, slots=True)
class Change:
    """A signal or variable gets a value, or has it added (`adds`); a flag is reset by getting False."""

    target: Signal | MFlag
    value: Value
    adds: bool = False
    by_robot: bool = field(
        default=False, compare=False
    )  # written by a path one tick before it is seen; answers count from there


@dataclass(frozen=True, slots=True)
class Timed:
    """At `time` s after the start of the run."""

    time: float
    changes: tuple[Change, ...]


@dataclass(frozen=True, slots=True)
class Answer:
    """`delay` s after the cause came about (a signal became a value, a flag was raised by all `robots`)."""

    cause: Change
    delay: float
    changes: tuple[Change, ...]
    robots: tuple[int, ...] = (1,)


@dataclass(frozen=True, slots=True, eq=False)
class BeltScript:
    """Speed (m/s) of a conveyor over time (s), linear between breakpoints; encoder noise in counts."""

    index: int
    times: Floats
    speeds: Floats
    noise_counts: float


@dataclass(frozen=True, slots=True, eq=False)
class CorrectionScript:
    """Offset of the TCP over time, in a frame: per axis times (s) and offsets (m); rate limit in m/s."""

    frame: Literal["base", "frame", "tool"]
    axes: tuple[tuple[Floats, Floats] | None, ...]  # x, y, z
    max_rate: float


@dataclass(frozen=True, slots=True, eq=False)
class Scenario:
    """One scenario file."""

    seed: int
    timed: tuple[Timed, ...]
    answers: tuple[Answer, ...]
    belts: tuple[BeltScript, ...]
    corrections: tuple[CorrectionScript, ...]
    source: Source
