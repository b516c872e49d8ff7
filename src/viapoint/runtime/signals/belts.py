"""Conveyors in simulation: how far a belt has travelled, and what its encoder says of it.

Everything is a function of the tick, so that nothing depends on how many are computed at once, or in which
order. The encoder counts whole counts, with noise of its own; position and speed are read off a straight line
through its last samples.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from viapoint.runtime.cell import Conveyor
from viapoint.runtime.signals.scenario import BeltScript, Floats

Ints = npt.NDArray[np.int64]

_SAMPLES: Final = 32
"""Samples of the encoder behind an estimate: noise falls with their number, lateness of changes grows."""

_ROUNDING: Final = 1e-6
"""Part of a tick by which a breakpoint may lie behind it and count as in it."""

_BLOCK: Final = 1024
"""Ticks whose noise is drawn together, from the scenario's seed, the conveyor and the block's number."""


class Belt:
    """One conveyor. It stands where no scenario moves it."""

    def __init__(self, conveyor: Conveyor, script: BeltScript | None, seed: int, tick: float) -> None:
        self.conveyor = conveyor
        self._tick = tick
        self._seed = seed
        self._noise = script.noise_counts if script is not None else 0.0
        self._times: Floats = script.times if script is not None else np.zeros(1)
        self._speeds: Floats = script.speeds if script is not None else np.zeros(1)
        parts = 0.5 * np.diff(self._times) * (self._speeds[1:] + self._speeds[:-1])
        self._ways: Floats = np.concatenate(([0.0], np.cumsum(parts)))
        self._origin = float(self._way(np.zeros(1))[0])
        self._blocks: dict[int, Floats] = {}
        tau = tick * np.arange(1 - _SAMPLES, 1)
        spread = _SAMPLES * (tau @ tau) - tau.sum() ** 2
        self._place_weights: Floats = (tau @ tau - tau.sum() * tau) / spread
        self._speed_weights: Floats = (_SAMPLES * tau - tau.sum()) / spread

    @property
    def rest_tick(self) -> float:
        """Tick from which on the belt never moves again; inf if it does."""
        return math.ceil(self._times[-1] / self._tick - _ROUNDING) if self._speeds[-1] == 0.0 else math.inf

    def travel(self, ticks: Ints) -> Floats:
        """(N,) m since tick 0, in truth."""
        return self._way(ticks * self._tick) - self._origin

    def measured(self, first: int, count: int) -> tuple[Floats, Floats]:
        """Travel (N,) m and speed (N,) m/s as the encoder gives them in ticks first, first + 1, …"""
        ticks = np.arange(first - _SAMPLES + 1, first + count)
        per_metre = self.conveyor.counts_per_metre
        read = np.rint(self.travel(ticks) * per_metre + self._counts_off(ticks)) / per_metre
        last = read[_SAMPLES - 1 :]
        place, speed = last.copy(), np.zeros(count)
        for k in range(_SAMPLES):  # in one order, whatever the number of ticks: same bits
            off = read[k : k + count] - last
            place += self._place_weights[k] * off
            speed += self._speed_weights[k] * off
        return place, speed

    def _way(self, times: npt.NDArray[np.floating]) -> Floats:
        """(N,) m since the first breakpoint: the integral of a speed that is linear between breakpoints."""
        k = np.clip(np.searchsorted(self._times, times, side="right") - 1, 0, len(self._times) - 1)
        dt = times - self._times[k]
        speed = self._speeds[k]
        following = np.minimum(k + 1, len(self._times) - 1)
        gaps = np.maximum(self._times[following] - self._times[k], self._tick)
        slope = np.where(dt > 0.0, (self._speeds[following] - speed) / gaps, 0.0)
        return np.asarray(self._ways[k] + speed * dt + 0.5 * slope * dt * dt)

    def _counts_off(self, ticks: Ints) -> Floats:
        """Noise (N,) in counts; none before the run."""
        if self._noise == 0.0:
            return np.zeros(len(ticks))
        blocks = ticks // _BLOCK
        off = np.zeros(len(ticks))
        for block in range(max(int(blocks[0]), 0), int(blocks[-1]) + 1):
            here = blocks == block
            off[here] = self._noise * self._drawn(block)[ticks[here] - block * _BLOCK]
        return off

    def _drawn(self, block: int) -> Floats:
        if block not in self._blocks:
            for old in [number for number in self._blocks if number < block - 1]:
                del self._blocks[old]
            rng = np.random.default_rng((self._seed, self.conveyor.index, block))
            self._blocks[block] = rng.normal(size=_BLOCK)
        return self._blocks[block]
