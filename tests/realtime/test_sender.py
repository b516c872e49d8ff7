"""The sending process: every tick once, in order, at its time; what ends early ends cleanly."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from viapoint.realtime import Sender, SenderError
from viapoint.realtime.sender import raise_priority
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.records import Window
from viapoint.session import Session, compile_text

CELL = '[robot]\nmodel = "frigeni6"\n'
TARGET = "VIAPOINT_TEST_SINK"


def write_down(tick: int, joints: tuple[float, ...]) -> None:
    """Sink of the tests, in the sending process."""
    with Path(os.environ[TARGET]).open("a") as out:
        out.write(f"{tick} {time.perf_counter()!r} {' '.join(map(repr, joints))}\n")


def die(tick: int, joints: tuple[float, ...]) -> None:
    """A sink that ends its process."""
    os._exit(3)


def send_all(sender: Sender, windows: list[Window]) -> None:
    for window in windows:
        sender.send(window)
    sender.close()


def moving() -> Session:
    cell = parse_cell(CELL)
    return Session(cell, compile_text("MJ J1=10 F60\n", cell=cell), window=40)


def test_every_tick_once_in_order_at_its_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(TARGET, str(tmp_path / "ticks"))
    windows = []
    with Sender(1e-3, sink=write_down, lead_s=0.1) as sender:
        for window in moving().run():
            windows.append(window)
            sender.send(window)
        kept = sender.close()
    rows = np.loadtxt(tmp_path / "ticks")
    joints = np.concatenate([window.joints for window in windows])
    np.testing.assert_array_equal(rows[:, 0], np.arange(len(joints)))
    np.testing.assert_array_equal(rows[:, 2:], joints)
    assert np.diff(rows[:, 1]).min() > 0.4e-3
    assert rows[-1, 1] - rows[0, 1] == pytest.approx((len(joints) - 1) * 1e-3 + kept.slip_s, abs=2e-3)
    assert kept.ticks == len(joints)
    assert kept.late_us["p50"] <= kept.late_us["p99"] <= kept.late_us["max"]
    assert kept.missed >= kept.starved


def test_whoever_computes_is_held_back_at_the_lead() -> None:
    session = moving()
    with Sender(1e-3, lead_s=0.1) as sender:
        begin = time.perf_counter()
        for window in session.run():
            sender.send(window)
        handed_over = time.perf_counter() - begin
    seconds = session.kernel.tick * 1e-3
    assert seconds - 0.15 < handed_over
    assert sender.punctuality is not None


def test_a_run_shorter_than_the_lead_is_sent_too() -> None:
    with Sender(1e-3, lead_s=5.0) as sender:
        sender.send(next(iter(moving().run())))
        assert sender.close().ticks == 1


def test_a_sending_process_that_dies_is_an_error() -> None:
    windows = list(moving().run())
    with Sender(1e-3, sink=die, lead_s=0.02) as sender, pytest.raises(SenderError, match="has ended"):
        send_all(sender, windows)


def test_priority_is_asked_for_and_never_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*what: object) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refuse, raising=False)
    monkeypatch.setattr(os, "nice", refuse, raising=False)
    assert raise_priority() == "normal"
    monkeypatch.setattr(os, "nice", lambda change: change, raising=False)
    assert raise_priority() == "raised"
    monkeypatch.delattr(os, "sched_setscheduler", raising=False)
    assert raise_priority() == "raised"
