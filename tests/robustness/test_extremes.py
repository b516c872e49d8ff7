"""Extreme settings and long programs: slow, fast, fine, coarse, endless, but never wrong."""

from __future__ import annotations

import gc
from itertools import islice
from types import ModuleType

import numpy as np
import pytest

from session_runs import Run, at, cell, run
from viapoint.session import Session, compile_text

CORNERS = (
    "MJ P1 F90\nML Y=-250 F{speed} R10\nSET DO1\nML X=1560 R5\n"
    "MC X=1560 Y=-300 QX=1590 QY=-270 QZ=1500\nML P1\n"
)


def check(done: Run) -> None:
    assert done.status == "finished", done.session.failure
    assert not done.over_limits()
    assert np.isfinite(done.joints).all()
    assert np.abs(done.column("position")[-1] - [1.5, -0.3, 1.5]).max() < 1e-9


@pytest.mark.parametrize("tick", [1e-4, 2.5e-4, 3e-3, 1e-2])
def test_any_tick_keeps_limits_and_ends_exactly(tick: float) -> None:
    done = run(CORNERS.format(speed=800), cell(controller=f"tick_s = {tick}"))
    check(done)
    usual = run(CORNERS.format(speed=800))
    assert done.column("time")[-1] == pytest.approx(usual.column("time")[-1], rel=0.05, abs=10 * tick)


@pytest.mark.parametrize(
    "limits",
    [
        "speed_mm_s = 1e7\nacceleration_mm_s2 = 1e9\njerk_mm_s3 = 1e12",
        "angular_speed_deg_s = 1e7\nangular_acceleration_deg_s2 = 1e9\nangular_jerk_deg_s3 = 1e12",
        "speed_mm_s = 20",
        "acceleration_mm_s2 = 50\njerk_mm_s3 = 1e9",
        "angular_jerk_deg_s3 = 1",
    ],
)
def test_any_limits_are_kept(limits: str) -> None:
    check(run(CORNERS.format(speed=60000), cell(limits=limits)))


@pytest.mark.parametrize("limits", ["jerk_mm_s3 = 20", "acceleration_mm_s2 = 1e6\njerk_mm_s3 = 50"])
def test_a_tiny_jerk_is_kept(limits: str) -> None:
    check(run("MJ P1 F90\nML Y=-298 F60000 R1\nML X=1502\nML P1\n", cell(limits=limits)))


@pytest.mark.parametrize("speed", [3, 60000])
def test_any_programmed_speed_is_kept(speed: float) -> None:
    check(run(f"MJ P1 F90\nML Y=-296 F{speed} R1\nML X=1502\nML P1\n"))


@pytest.mark.parametrize("distance", [1e-3, 1e-5, 1e-6])
def test_tiny_motions_arrive(distance: float) -> None:
    done = run(
        f"MJ P1 F90\nML Y={-300 + distance:.9f} F500 R1000\nML X={1500 + distance:.9f} R0.0001\nML P1\n"
    )
    check(done)


def test_r_larger_than_everything() -> None:
    done = run("MJ P1 F90\nML Y=-290 F500 R1e9\nML X=1510 R1e9\nMJ J1=-10 R1e9\nMJ P1 R1e9\n")
    check(done)


def test_happenings_in_one_tick_are_taken_in_order() -> None:
    """Two entries of one tick, and an answer due in the very tick in which its question is asked."""
    scenario = at(0.5, DI1=True, DI2=True) + at(0.5, DI2=False)
    done = run("WAIT DI 1\nIF DI2\nSET DO1\nELSE\nSET DO2\nENDIF\n", scenario=scenario)
    assert [(e.tick, e.data["signal"]) for e in done.events("output")] == [(500, "DO2")]
    at_once = '[[when]]\nsignal = "DO1"\nbecomes = true\nafter_s = 0.0\nset = { DI1 = true }\n'
    done = run("SET DO1\nWAIT DI 1\nSET DO2\n", scenario=at_once)
    assert [e.tick for e in done.events("output")] == [0, 1]


def test_ten_thousand_statements() -> None:
    steps = "".join(
        f"ML Y={-300 + 2 * (k % 50)} R0.5\n" if k % 4 else f"SET DO{k // 4 % 32 + 1}\n" for k in range(9_997)
    )
    program = compile_text(f"MJ P1 F90\nML X=1510 F2000\n{steps}END\n", cell=cell())
    session = Session(cell(), program, max_time=3.0)
    sizes = [size_of(session.kernel.planner, session.kernel.mover) for _ in session.run()]
    assert session.failure is None
    assert len(session.events) > 100
    assert max(sizes) < 2.0 * sizes[1]  # what the buffer holds, and the path it is planned to


def test_a_long_run_takes_no_more_memory_than_a_short_one() -> None:
    """An endless path without a stop: what lies behind is forgotten."""
    sides = "ML X=1520 F900 R4\nML Y=-280 R4\nRESET DO1\nML X=1500 R4\nML Y=-300 R4\n"
    square = f"MJ P1 F90\nL: SET DO1\n{sides}GOTO L\n"
    session = Session(cell(), compile_text(square, cell=cell()), window=500)
    sizes = []
    for window in islice(session.run(), 56):
        if window.first_tick > 8_000:
            session.corners.clear()
            sizes.append(size_of(session.kernel.planner, session.kernel.mover))
    # in this time a path that is kept becomes more than three times as long; tables grow by doubling
    assert max(sizes[-5:]) < 2.2 * min(sizes[:5])


def size_of(*roots: object) -> int:
    """Bytes of everything an object refers to, arrays included; types and modules do not count."""
    seen: set[int] = set()
    todo: list[object] = list(roots)
    total = 0
    while todo:
        each = todo.pop()
        if id(each) in seen or isinstance(each, (type, ModuleType)) or callable(each):
            continue
        seen.add(id(each))
        total += each.nbytes if isinstance(each, np.ndarray) else 50
        todo += gc.get_referents(each)
    return total
