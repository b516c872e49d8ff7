"""External corrections: displacements of the TCP that a scenario or a sensor asks for, tick by tick.

What is asked for is followed within the correction's own rate and within a share of the path's acceleration
and jerk. Here are numbers of a tick only; what they do to the joints is the feed's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.kernel.chase import REST, Chase, Follower
from viapoint.runtime.kernel.failure import ExecutionError
from viapoint.runtime.records import Floats
from viapoint.runtime.signals import CorrectionScript

_SHARE: Final = 0.5
"""Part of the reserve of the path's acceleration and jerk that an offset uses: a joint may need a larger
share of its limits than the path does of its own."""

Frame = Literal["base", "frame", "tool"]


@dataclass(frozen=True, slots=True)
class Sensor:
    """A correction that Python code decides. `read` is called once per tick, in order.

    `read(t, X_base_tcp)` gets the time (s) and the TCP pose (4, 4) as sent in the tick before. It answers the
    offset wanted, three numbers in m along the axes of `frame`: the robot's base, the frame of the motion,
    or the tool. `max_rate` (m/s) bounds how fast the offset changes.
    """

    read: Callable[[float, Floats], Sequence[float]]
    frame: Frame = "tool"
    max_rate: float = 0.05

    def __post_init__(self) -> None:
        if self.frame not in ("base", "frame", "tool"):
            raise ValueError(f"a sensor measures in base, frame or tool, not in {self.frame!r}")
        if not 0.0 < self.max_rate < np.inf:
            raise ValueError(f"a rate of {self.max_rate!r} m/s is not above 0 and finite")


class Place(NamedTuple):
    """Where the ticks of a window are: times (N,), rotations (N, 3, 3) of TCP and of the motion's frame.

    `X_before` (4, 4) is the TCP pose as sent in the tick before the first.
    """

    times: Floats
    R_base_tcp: Floats
    R_base_frame: Floats
    X_before: Floats
    line: int


_States = list[tuple[Follower, Follower, Follower]]


class Correction:
    """One correction under way: its offset in the base (in the tool, if it says so), followed per axis."""

    def __init__(self, source: CorrectionScript | Sensor, cell: Cell) -> None:
        self.frame: Final[Frame] = source.frame
        self.source: Final = source
        axes = 3 if isinstance(source, Sensor) else sum(axis is not None for axis in source.axes)
        axes = 3 if source.frame == "frame" else max(axes, 1)
        each = 1.0 / np.sqrt(axes)  # so that the whole offset keeps the bounds
        share, path = _SHARE * cell.tracking_reserve * each, cell.path_limits
        self._chase = Chase(source.max_rate * each, share * path.acceleration, share * path.jerk, cell.tick)
        self._tick = cell.tick
        self._now = (REST, REST, REST)
        self._states: _States = []

    @property
    def still(self) -> bool:
        """The offset is zero and stays so unless something is asked for."""
        return self._now == (REST, REST, REST)

    def offsets(self, place: Place, *, braking: bool) -> Floats | None:
        """(N, 3) m in the base; None where it is zero all along. Raises ExecutionError for no numbers."""
        if braking:
            self._states = self._brake(len(place.times))
        else:
            # a tick's state is where the chase of the tick before, after the target of then, has led
            targets, rates = self._asked(place)
            if self.still and not targets.any() and not rates.any():
                self._states = []
                return None
            self._states = self._follow(targets, rates)
        offsets = np.array([[axis.position for axis in state] for state in self._states])
        if self.frame == "tool":
            return np.asarray((place.R_base_tcp @ offsets[:, :, None])[:, :, 0])
        return offsets

    def commit(self, count: int) -> None:
        """The first so many ticks were sent."""
        if self._states:
            self._now = self._states[count - 1]
            self._states = []

    def _follow(self, targets: Floats, rates: Floats) -> _States:
        states: _States = []
        now, step = self._now, self._chase.step
        for (x, y, z), (vx, vy, vz) in zip(targets.tolist(), rates.tolist(), strict=True):
            now = (step(now[0], x, vx), step(now[1], y, vy), step(now[2], z, vz))
            states.append(now)
        return states

    def _brake(self, count: int) -> _States:
        states: _States = []
        now, stop = self._now, self._chase.stop
        for _ in range(count):
            now = (stop(now[0]), stop(now[1]), stop(now[2]))
            states.append(now)
        return states

    def _asked(self, place: Place) -> tuple[Floats, Floats]:
        """What is asked for one tick before each of the ticks, (N, 3) m, and how fast it changes, m/s."""
        times = place.times - self._tick
        if isinstance(self.source, Sensor):
            targets, rates = self._read(self.source, float(place.times[0]), place), np.zeros((1, 3))
        else:
            targets, after = (_script(self.source, t) for t in (times, place.times))
            rates = (after - targets) / self._tick
        if self.frame != "frame":
            return targets, rates
        R = place.R_base_frame
        return (R @ targets[:, :, None])[:, :, 0], (R @ rates[:, :, None])[:, :, 0]

    @staticmethod
    def _read(sensor: Sensor, t: float, place: Place) -> Floats:
        answer = np.asarray(sensor.read(t, place.X_before.copy()), dtype=np.float64)
        if answer.shape != (3,) or not np.isfinite(answer).all():
            what = f"a sensor answered {answer.tolist()} at t = {t:.3f} s instead of three finite numbers"
            raise ExecutionError("E432", what, place.line)
        return answer[None]


def _script(script: CorrectionScript, times: Floats) -> Floats:
    """(N, 3) m at times (N,), linear between the breakpoints."""
    return np.stack(
        [np.zeros(len(times)) if axis is None else np.interp(times, *axis) for axis in script.axes], axis=1
    )
