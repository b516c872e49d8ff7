"""A synthetic run: six axes, a straight piece, a stand and an arc, with events; no kernel involved."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from viapoint.runtime.recording import REVOLUTE, Axis, Recorder, RunInfo
from viapoint.runtime.records import Event, Window

SOURCE = "HOME\nML X=1 F100\nSET DO1\nWAIT 0.5\nMC P1 P2\nEND\n"
AXES = tuple(
    Axis(name=f"J{i + 1}", kind=REVOLUTE, lower=-3.0, upper=3.0, speed=2.0, acceleration=10.0, jerk=100.0)
    for i in range(6)
)


@dataclass(frozen=True)
class SyntheticRun:
    info: RunInfo
    window: Window  # all ticks
    events: tuple[Event, ...]

    def windows(self, size: int) -> Iterator[Window]:
        """Tick 0 alone, then windows of `size` ticks, as a session hands them out."""
        edges = [0, 1, *range(1 + size, len(self.window), size), len(self.window)]
        names = [n for n in Window.__dataclass_fields__ if n != "first_tick"]
        for start, end in itertools.pairwise(edges):
            arrays = {n: getattr(self.window, n)[start:end] for n in names}
            yield Window(first_tick=start, **arrays)

    def record(self, path: Path, size: int = 512, *, close: bool = True) -> Recorder:
        recorder = Recorder(path, self.info, skeleton=skeleton)
        pending = list(self.events)
        for window in self.windows(size):
            while pending and pending[0].tick < window.first_tick + len(window):
                recorder.event(pending.pop(0))
            recorder.window(window)
        if close:
            recorder.close({"status": "finished"})
        return recorder


def skeleton(joints: np.ndarray) -> np.ndarray:
    """A column of 0.4 m and an arm of 1 m that turns with J1."""
    points = np.zeros((len(joints), 3, 3))
    points[:, 1:, 2] = 0.4
    points[:, 2, 0], points[:, 2, 1] = np.cos(joints[:, 0]), np.sin(joints[:, 0])
    return points


def synthetic(ticks: int = 2500, *, slower: float = 1.0, tick_s: float = 0.001) -> SyntheticRun:
    time = np.arange(ticks + 1) * tick_s
    half = time[-1] / 2
    law = np.clip(time / half, 0, 1), np.clip(time / half - 1, 0, 1)
    smooth = [x * x * x * (10 - 15 * x + 6 * x * x) for x in law]
    s = (smooth[0] + smooth[1]) / slower
    angle = np.pi * smooth[1]
    position = np.stack((0.5 + 0.5 * smooth[0], np.sin(angle) / 5, 0.4 + 0 * s), axis=-1)
    line = np.where(time < half, 2, 5)
    joints = np.stack([0.3 * (i + 1) * s * (-1) ** i / 2 for i in range(6)], axis=-1)
    window = Window(
        first_tick=0,
        time=time,
        line=line,
        interpreter_line=np.where(time < half, 4, 6),
        s=s,
        speed=np.gradient(s, tick_s),
        override=np.ones_like(s),
        buffer_fill=np.where(time < half, 3, 1),
        joints=joints,
        actual=joints.copy(),
        auxiliary=np.zeros((len(joints), 0)),
        position=position,
        quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (ticks + 1, 1)),
        torque=np.zeros((ticks + 1, 0)),
        deviation=np.zeros(ticks + 1),
    )
    info = RunInfo(
        program_name="part.via",
        program_source=SOURCE,
        cell_name="cell.toml",
        cell_text='[robot]\nmodel = "frigeni6"\n',
        robot="frigeni6",
        tick_s=tick_s,
        axes=AXES,
        command_line="viapoint run part.via",
        versions={"viapoint": "0.1.0"},
    )
    mid, end = ticks // 2, float(time[-1])
    t_mid = float(time[mid])
    events = (
        _event(0, 0.0, 2, "block", command="ML", t_end=t_mid, length_mm=500.0, s0_mm=0.0, limited_by="F"),
        _event(mid, t_mid, 3, "output", signal="DO1", value=True, s_mm=500.0),
        _event(mid, t_mid, 4, "input_read", signal="DI3", value=False, s_mm=500.0, ahead=False),
        _event(
            mid, t_mid, 5, "block", command="MC", t_end=end, length_mm=628.0, s0_mm=500.0, limited_by="J2"
        ),
        _event(ticks, end, 6, "message", text="done"),
    )
    return SyntheticRun(info, window, events)


def _event(tick: int, t: float, line: int, kind: str, **data: float | bool | str) -> Event:
    return Event(tick=tick, t=t, line=line, kind=kind, data=data)


@pytest.fixture
def run() -> SyntheticRun:
    return synthetic()


@pytest.fixture
def make_run() -> Callable[..., SyntheticRun]:
    return synthetic
