"""What is measured in every tick: peaks of differences, standing still, and the compiled core."""

from __future__ import annotations

import numpy as np
import pytest

from viapoint.runtime import core
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.kernel.peaks import PeakMeter
from viapoint.session import Session, compile_text

TICK = 0.004
CELL = '[robot]\nmodel = "frigeni6"\n[[tools]]\nindex = 1\nxyz = [100, 20, 30]\nabc = [10, 20, 30]\n'


@pytest.mark.parametrize("name", ["python", "auto"])
@pytest.mark.parametrize("size", [1, 2, 3, 7, 400])
def test_peaks_are_those_of_the_whole_run(size: int, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit, whatever the windows: differences of the whole run, which starts at rest."""
    monkeypatch.setattr(core, "asked", name)
    start, steps = np.array([1.0, -2.0, 0.3]), np.random.default_rng(size).normal(size=(400, 3)) * 1e-3
    x = start + steps.cumsum(axis=0)
    x[100:200] = x[99]
    meter = PeakMeter(start, TICK)
    for first in range(0, len(x), size):
        meter.feed(np.concatenate((x, x), axis=1)[first : first + size, :3])
    differences = np.concatenate((np.tile(start, (3, 1)), x))
    for peak in meter.peaks:
        differences = np.diff(differences, axis=0) / TICK
        assert np.array_equal(peak, np.abs(differences).max(axis=0))


@pytest.mark.parametrize("count", [1, 2, 3, 50])
def test_standing_counts_like_rows_that_stay(count: int) -> None:
    rows = np.cumsum(np.random.default_rng(3).normal(size=(10, 2)), axis=0)
    stood, fed = PeakMeter(np.zeros(2), TICK), PeakMeter(np.zeros(2), TICK)
    for meter in (stood, fed):
        meter.feed(rows)
    stood.stand(count)
    fed.feed(np.repeat(rows[-1:], count, axis=0))
    for meter in (stood, fed):
        meter.feed(rows[::-1])
    assert np.array_equal(stood.peaks, fed.peaks)


def test_windows_show_the_tcp_of_the_tool_in_hand() -> None:
    """Moving and standing, before and after a change of tools."""
    cell = parse_cell(CELL)
    program = compile_text("MJ J1=10 F100\nWAIT 0.1\nT 1\nML X=1500 Y=100 Z=1500 F300\nWAIT 0.1\n")
    windows = list(Session(cell, program, window=64).run())
    tools = set()
    for window in windows:
        assert len({len(getattr(window, name)) for name in ("time", "line", "s", "joints", "position")}) == 1
        flange = cell.robot.fk(window.joints)
        offsets = [
            np.abs(flange[:, :3, 3] + flange[:, :3, :3] @ tool.X_flange_tool[:3, 3] - window.position).max()
            for tool in (cell.tools[0], cell.tools[1])
        ]
        assert min(offsets) < 1e-12
        tools.add(int(np.argmin(offsets)))
    assert tools == {0, 1}
    time = np.concatenate([window.time for window in windows])
    assert np.allclose(np.diff(time), cell.tick, rtol=0.0, atol=1e-12)
