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

BEFORE = "MJ J1=-1 F40\n"
ANSWER = "SET DO1\nEND\nNO:\nSET DO2\n"


def arrival() -> int:
    return run(BEFORE + "SYNC\n", place()).end_of(1)


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


SPAN = range(-20, 21)
"""Ticks around an arrival in which an input changes."""

LATE_S = 0.01
Answer = tuple[str | None, int | None, int | None]
"""The output switched, in which tick, and the tick of the last read (None: it is not asked)."""


class Around:
    """An input that comes on in tick `edge`, for good or for that tick alone, and an arrival in `there`."""

    def __init__(self, edge: int, *, pulse: bool, there: int) -> None:
        self.edge, self.pulse, self.there = edge, pulse, there

    @property
    def scenario(self) -> str:
        on = at(self.edge * 1e-3, DI1=True)
        return on + at((self.edge + 1) * 1e-3, DI1=False) if self.pulse else on

    def on(self, tick: int) -> bool:
        return tick == self.edge if self.pulse else tick >= self.edge

    def first_on(self, first: int, last: int) -> int | None:
        return next((tick for tick in range(first, last + 1) if self.on(tick)), None)

    # --- what the language says comes of it ----------------------------------------------------------

    def read_there(self) -> Answer:
        return "DO1" if self.on(self.there) else "DO2", self.there, self.there

    def read_at_the_start(self) -> Answer:
        return "DO2", self.there, 0

    def wait(self) -> Answer:
        seen = self.first_on(self.there, self.there + 100)
        return (None, None, None) if seen is None else ("DO1", seen, seen)

    def wait_so_long(self) -> Answer:
        deadline = self.there + round(LATE_S * 1000)
        seen = self.first_on(self.there, deadline)
        return ("DO2", deadline, None) if seen is None else ("DO1", seen, seen)


BARRIERS = {
    "IF": ("IF NOT DI1\nGOTO NO\nENDIF\n", Around.read_there),
    "IF AHEAD": ("IF AHEAD NOT DI1\nGOTO NO\nENDIF\n", Around.read_at_the_start),
    "SYNC": ("SYNC\nIF AHEAD NOT DI1\nGOTO NO\nENDIF\n", Around.read_there),
    "WAIT": ("WAIT DI1\n", Around.wait),
    "WAIT TIMEOUT": (f"WAIT DI1 TIMEOUT {LATE_S} GOTO NO\n", Around.wait_so_long),
}


@pytest.mark.parametrize("pulse", [False, True], ids=["edge", "pulse"])
@pytest.mark.parametrize("statement", BARRIERS)
def test_an_input_that_changes_at_any_tick_around_an_arrival(statement: str, pulse: bool) -> None:
    text, expected = BARRIERS[statement]
    program, there = BEFORE + text + ANSWER, arrival()
    for early in SPAN:
        around = Around(there + early, pulse=pulse, there=there)
        output, tick, read = expected(around)
        for window in (1024, 7) if early % 8 else (1024, 7, 1):
            done = run(program, place(), scenario=around.scenario, window=window)
            case = (statement, early, window)
            assert done.code == (None if output else "E410"), case
            switched = [(e.data["signal"], e.tick) for e in done.events("output")]
            assert switched == ([(output, tick)] if output else []), case
            if read is not None:
                assert done.events("input_read")[-1].tick == read, case


@pytest.mark.parametrize("pulse", [False, True], ids=["edge", "pulse"])
@pytest.mark.parametrize("end", [False, True], ids=["begin", "end"])
def test_a_search_and_an_input_that_changes_at_any_tick_around_its_begin_or_end(
    end: bool, pulse: bool
) -> None:
    """It looks in every tick of the motion, the one in which it sets out and the last one included.

    The motion turns back, so that the robot stands where it begins.
    """
    program = BEFORE + "MJ J1=-1.1 F40 UNTIL DI1\nIF NOT FOUND\nGOTO NO\nENDIF\n" + ANSWER
    whole = run(program, place())
    begin, last = whole.end_of(1), whole.end_of(2)
    assert last - begin > len(SPAN)
    for early in SPAN:
        around = Around((last if end else begin) + early, pulse=pulse, there=begin)
        seen = around.first_on(begin, last)
        for window in (1024, 7) if early % 8 else (1024, 7, 1):
            done = run(program, place(), scenario=around.scenario, window=window)
            case = (early, window)
            (output,) = done.events("output")
            (search,) = done.events("search")
            reads = [e.tick for e in done.events("input_read") if e.line == 2]
            assert (output.data["signal"], search.data["found"]) == (
                ("DO2", False) if seen is None else ("DO1", True)
            ), case
            assert reads == ([] if seen is None else [seen]), case
            assert output.tick == search.tick, case
            if seen is None or seen in (begin, last):
                assert search.tick == (last if seen is None else seen), case
            else:
                assert seen < search.tick <= last, case
