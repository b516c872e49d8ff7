"""Scenarios 1, 2, 5 and 6: when the outside world is read, and what that does to the path."""

from __future__ import annotations

import numpy as np
import pytest
from everywhere import everywhere, finished, place, stands

from session_runs import at, run
from viapoint.session import compile_text

ROUND = "MJ P1 F90\nML P2 F300 R20\nML P3 R15\n"


def test_1_r_before_if_exact_stop_both_lines_named() -> None:
    text = f"{ROUND}IF DI1\nML P4\nENDIF\n"
    (warning,) = [d for d in compile_text(text, cell=place()).diagnostics if d.code == "W505"]
    assert warning.extent is not None
    assert warning.extent[0] == 3
    assert "IF" in warning.message
    for done in finished(text, scenario=at(0.1, DI1=True)):
        (read,) = done.events("input_read")
        assert read.tick == done.end_of(3)
        assert stands(done, read.tick)
        assert np.linalg.norm(done.column("position")[read.tick] - [1.6, 0.05, 1.5]) < 1e-9
        corner = next(each for each in done.session.corners if each.line == 3)
        assert corner.forced_by_line == 4
        assert corner.transition.effective == 0.0


@pytest.mark.parametrize("flip", [0.05, 0.6])
def test_2_di_flips_after_an_ahead_read_decision_latched_and_traced(flip: float) -> None:
    text = f"{ROUND}IF AHEAD DI1\nML P4\nELSE\nML P1\nENDIF\nSYNC\nIF AHEAD DI1\nSET DO1\nENDIF\n"
    for done in finished(text, scenario=at(flip, DI1=True)):
        early, late = done.events("input_read")
        assert (early.tick, early.line, early.data["value"], early.data["ahead"]) == (0, 4, False, True)
        assert early.data["s_mm"] == 0.0
        assert done.events("block", 7)
        assert not done.events("block", 5)
        assert done.reasons[3] == "ROUNDED"
        assert (late.tick, late.data["value"]) == (done.end_of(7), True)


def test_5_wait_di_true_earlier_false_on_arrival_waits() -> None:
    text = f"{ROUND}WAIT DI1\nML P4\n"
    for done in finished(text, scenario=at(0.1, DI1=True) + at(0.5, DI1=False) + at(3.5, DI1=True)):
        (wait,) = done.events("wait")
        assert wait.tick == done.end_of(3)
        assert wait.data["t_end"] == pytest.approx(3.5)
        assert [e.data["value"] for e in done.events("input_read")] == [False, True]
        standing = done.joints[wait.tick : 3501]
        assert np.array_equal(standing, np.tile(standing[0], (len(standing), 1)))


def test_6_m_synchronous_and_asynchronous_between_rounded_moves() -> None:
    scenario = "[[when]]\nm = 9\nafter_s = 0.3\nreset_m = 9\n"
    plain = {}
    for done in finished(f"{ROUND}ML P4\n"):
        plain[done.session.kernel.mover.override] = done
    for done in finished(f"{ROUND}M 5\nML P4\n", scenario=scenario):  # asynchronous in this cell
        (raised,) = done.events("m")
        assert (raised.tick, raised.data["action"]) == (done.end_of(3), "raised")
        assert np.array_equal(done.joints, plain[done.session.kernel.mover.override].joints)
    for done in finished(f"{ROUND}M 9\nML P4\n", scenario=scenario):
        raised, reset = done.events("m")
        assert raised.tick == done.end_of(3)
        assert stands(done, raised.tick)
        assert (reset.tick, reset.data["action"]) == (raised.tick + 300, "reset")
        assert [e.data["reason"] for e in done.events("wait")] == ["M9"]


# --- edges at every tick around a barrier ------------------------------------------------------------

BARRIER = "MJ J1=-1 F40\n{statement}\nSET DO1\nEND\nNO:\nSET DO2\n"


def arrival() -> int:
    return run(BARRIER.format(statement="SYNC"), place()).end_of(1)


@pytest.mark.parametrize("early", [-2, -1, 0, 1, 2])
def test_an_edge_is_seen_from_its_tick_on(early: int) -> None:
    """An input changes so many ticks around the arrival: what the IF, or the WAIT, finds then is exact."""
    there = arrival()
    edge = at((there + early) * 1e-3, DI1=True)
    for statement, late in (("IF NOT DI1\nGOTO NO\nENDIF", None), ("WAIT DI1", 0), ("WAIT DI1 OR M9", 0)):
        for window in (1, 3, 1024):
            done = run(BARRIER.format(statement=statement), place(), scenario=edge, window=window)
            (output,) = done.events("output")
            reads = done.events("input_read")
            assert reads[0].tick == there
            assert reads[0].data["value"] is (early <= 0)
            if late is None:
                assert output.data["signal"] == ("DO1" if early <= 0 else "DO2")
                assert output.tick == there
            else:
                assert (output.data["signal"], output.tick) == ("DO1", there + max(early, 0))


@pytest.mark.parametrize("seed", range(6))
def test_edges_of_many_inputs_around_many_barriers(seed: int) -> None:
    """Random short motions and reads, random edges near them: a model of the order in a tick agrees."""
    rng = np.random.default_rng(seed)
    lines, wanted = [], []
    for k in range(8):
        angle = rng.choice([0.3, -0.3, 0.0]) * (k + 1)
        lines.append(f"MJ J1={angle - 1.5:.2f} F40" if rng.random() < 0.7 else "SYNC")
        number = int(rng.integers(1, 4))
        lines += [f"IF DI{number} AND NOT DI{number % 3 + 1}", f"SET DO{k + 1}", "ENDIF"]
    edges = {n: np.sort(rng.choice(np.arange(1, 400), 40, replace=False)) for n in (1, 2, 3)}
    scenario = "".join(
        at(tick * 1e-3, **{f"DI{n}": bool(k % 2 == 0)})
        for n, ticks in edges.items()
        for k, tick in enumerate(ticks.tolist())
    )
    text = "\n".join(lines) + "\n"
    for done in everywhere(text, scenario=scenario):
        assert done.status == "finished", text
        wanted = done.events("input_read")
        assert len(wanted) == 16
        for read in wanted:
            number = int(str(read.data["signal"])[2:])
            changes = int(np.searchsorted(edges[number], read.tick, side="right"))
            assert read.data["value"] is (changes % 2 == 1), (seed, read)
        for first, second in zip(wanted[::2], wanted[1::2], strict=True):
            switched = any(e.line == first.line + 1 for e in done.events("output"))
            assert first.tick == second.tick
            assert switched is (first.data["value"] and not second.data["value"])
