"""Signals over ticks: when a write is seen, when the scenario acts and answers, what can still come."""

from __future__ import annotations

import random

import pytest

from viapoint.runtime.cell import Cell, Signal, SignalKind, parse_cell
from viapoint.runtime.signals import Change, MFlag, SignalWorld, parse_scenario

CELL = """\
[robot]
model = "frigeni6"
[io]
digital_inputs = 8
digital_outputs = 8
names = { gripper = "DO1", closed = "DI2", pressure = "AI1" }
process_outputs = ["DO5"]
"""


@pytest.fixture(name="cell", scope="module")
def fixture_cell() -> Cell:
    return parse_cell(CELL)


def world_of(cell: Cell, text: str, **options: bool) -> SignalWorld:
    world = SignalWorld(cell, parse_scenario(text, cell), cell.tick, **options)
    world.advance(0)
    return world


def closing(delay: float, value: str = "true") -> str:
    return (
        f'[[when]]\nsignal = "gripper"\nbecomes = {value}\nafter_s = {delay}\nset = {{ closed = {value} }}\n'
    )


def test_an_output_is_seen_in_the_next_tick(cell: Cell) -> None:
    world = SignalWorld(cell, None, cell.tick)
    world.write_output(3, True, 10)
    world.advance(10)
    assert not world.read_output(3)
    assert world.next_change(10) == 11
    world.advance(11)
    assert world.read_output(3)
    assert world.next_change(11) is None


def test_timed_sets_happen_at_their_tick(cell: Cell) -> None:
    world = world_of(
        cell, "[[at]]\nt_s = 0.0\nset = { DI1 = true }\n[[at]]\nt_s = 0.3\nset = { closed = true }\n"
    )
    assert world.read_input(1)
    assert world.next_change(0) == 300
    world.advance(299)
    assert not world.read_input(2)
    world.advance(300)
    assert world.read_input(2)
    assert not world.pending()


@pytest.mark.parametrize(
    ("delay", "seen"), [(0.0, 101), (0.0004, 101), (0.001, 101), (0.0025, 103), (0.3, 400)]
)
def test_an_answer_comes_its_delay_after_the_write(cell: Cell, delay: float, seen: int) -> None:
    world = world_of(cell, closing(delay))
    world.advance(100)
    world.write_output(1, True, 100)
    assert world.pending()
    ticks = []
    for tick in range(101, 500):
        world.advance(tick)
        if world.read_input(2):
            ticks.append(tick)
    assert ticks[0] == seen


def test_only_an_edge_is_answered(cell: Cell) -> None:
    world = world_of(cell, closing(0.01))
    world.write_output(1, False, 5)
    world.advance(6)
    assert not world.pending()
    world.write_output(1, True, 10)
    world.advance(30)
    world.set_input("closed", False, 30)
    world.advance(31)
    world.write_output(1, True, 40)
    world.advance(100)
    assert not world.read_input(2)


def test_answers_chain_and_cannot_run_in_circles_within_a_tick(cell: Cell) -> None:
    text = (
        '[[when]]\nsignal = "DI1"\nset = { DI1 = false, DI3 = true }\n'
        '[[when]]\nsignal = "DI1"\nbecomes = false\nset = { DI1 = true }\n'
        "[[at]]\nt_s = 0.0\nset = { DI1 = true }\n"
    )
    world = world_of(cell, text)
    values = []
    for tick in range(6):
        world.advance(tick)
        values.append(world.read_input(1))
    assert values == [True, False, True, False, True, False]
    assert world.read_input(3)
    assert world.pending()
    assert not world.pending(Change(Signal(SignalKind.DIGITAL_INPUT, 7), True))
    assert world.pending(Change(Signal(SignalKind.DIGITAL_INPUT, 1), True))


def test_m_flags(cell: Cell) -> None:
    world = world_of(cell, "[[when]]\nm = 5\nafter_s = 0.5\nset = { DI4 = true }\nreset_m = 5\n")
    assert not world.pending()
    world.raise_m(5, 20)
    assert world.read_m(5)
    assert world.pending(Change(MFlag(5), False))
    assert not world.pending(Change(MFlag(6), False))
    world.raise_m(5, 100)  # raised already: nothing new to answer
    world.advance(519)
    assert world.read_m(5)
    world.advance(520)
    assert not world.read_m(5)
    assert world.read_input(4)
    world.advance(2000)
    assert not world.pending()
    world.raise_m(6, 2000)
    world.reset_m(6, 2100)
    world.advance(2100)
    assert world.read_m(6)
    world.advance(2101)
    assert not world.read_m(6)


def test_dry_run_keeps_process_outputs_off(cell: Cell) -> None:
    world = world_of(cell, "", dry_run=True)
    world.write_output(5, True, 0)
    world.write_output(6, True, 0)
    world.advance(1)
    assert not world.read_output(5)
    assert world.read_output(6)


def test_forcing(cell: Cell) -> None:
    world = world_of(cell, closing(0.01))
    world.force("closed", True, 0)
    world.set_input(2, False, 0)
    world.advance(1)
    assert world.read_input(2)
    assert world.bank.forced == {Signal(SignalKind.DIGITAL_INPUT, 2)}
    world.release("closed", 1)
    assert not world.read_input(2)
    world.force("gripper", True, 5)  # a forced edge is answered like any other
    world.advance(15)
    assert world.read_input(2)


def test_analog_inputs(cell: Cell) -> None:
    world = world_of(cell, "[[at]]\nt_s = 0.002\nset = { pressure = 2.5 }\n")
    pressure = Signal(SignalKind.ANALOG_INPUT, 1)
    assert world.bank.read(pressure) == 0.0
    world.advance(2)
    assert world.bank.read(pressure) == 2.5
    world.set_input("AI2", 7, 2)
    world.advance(3)
    assert world.bank.read(Signal(SignalKind.ANALOG_INPUT, 2)) == 7


def test_signals_that_are_not_there(cell: Cell) -> None:
    world = world_of(cell, "")
    for index in (0, 9):
        with pytest.raises(KeyError):
            world.read_input(index)
        with pytest.raises(KeyError):
            world.write_output(index, True, 0)
    with pytest.raises(KeyError):
        world.set_input("nothing", True, 0)
    with pytest.raises(ValueError, match="the program sets it"):
        world.set_input("gripper", True, 0)


@pytest.mark.parametrize("seed", range(5))
def test_how_far_one_advances_at_once_changes_nothing(cell: Cell, seed: int) -> None:
    """Ticks one by one, or only those where something happens: the same values at the same ticks."""
    rng = random.Random(seed)
    times = "".join(
        f"[[at]]\nt_s = {rng.randrange(300) / 1000}\n"
        f"set = {{ DI{rng.randint(1, 4)} = {rng.choice(['true', 'false'])} }}\n"
        for _ in range(20)
    )
    rules = "".join(
        f'[[when]]\nsignal = "{rng.choice(["DI", "DO"])}{rng.randint(1, 4)}"\n'
        f"after_s = {rng.randrange(20) / 1000}\n"
        f"set = {{ DI{rng.randint(1, 8)} = {rng.choice(['true', 'false'])} }}\n"
        for _ in range(8)
    )
    writes = sorted((rng.randrange(300), rng.randint(1, 4), rng.random() < 0.6) for _ in range(30))

    def run(stride: int) -> list[list[bool]]:
        world = world_of(cell, times + rules)
        seen = []
        for start in range(0, 400, stride):
            for tick, index, value in (each for each in writes if start <= each[0] < start + stride):
                world.advance(tick)
                world.write_output(index, value, tick)
            world.advance(start + stride - 1)
            if (start + stride) % 40 == 0:
                seen.append([world.read_input(i) for i in range(1, 9)])
        return seen

    assert run(1) == run(5) == run(40), f"seed {seed}"
