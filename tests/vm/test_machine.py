"""The machine's suspensions, limits and what it shows of itself."""

from __future__ import annotations

import pytest
from vm_programs import compiled

from viapoint.vm import CanonicalPort, Machine, ScriptedWorld
from viapoint.vm.frames import ActiveCall
from viapoint.vm.machine import DEPTH_LIMIT
from viapoint.vm.ports import (
    AtBarrier,
    AwaitInput,
    AwaitReset,
    Barrier,
    BufferFull,
    Call,
    Ended,
    Failed,
    Modal,
    Motion,
    RaiseM,
    Speed,
    SpeedKind,
    Suspension,
)


class Room:
    """A motion port with so much room; `take` makes more."""

    def __init__(self, room: int) -> None:
        self.room = room
        self.calls: list[Call] = []

    def submit(self, call: Call) -> bool:
        if self.room == 0:
            return False
        self.room -= 1
        self.calls.append(call)
        return True


def _machine(text: str, room: int = 1000, **world: object) -> tuple[Machine, Room, ScriptedWorld]:
    port = Room(room)
    scripted = ScriptedWorld(**world)  # type: ignore[arg-type]
    return Machine(compiled(text), port, scripted), port, scripted


def test_a_full_buffer_suspends_and_nothing_is_lost_or_done_twice() -> None:
    machine, port, _ = _machine("T 1\nML P1 F100\nSET DO 1\nML P2\nM 5\nML P3\n", room=0)
    outcomes: list[Suspension] = []
    while not outcomes or outcomes[-1] != Ended(6):
        outcomes.append(machine.run())
        port.room = 1
    assert [type(call).__name__ for call in port.calls] == [
        "SelectTool", "Motion", "SetOutput", "Motion", "RaiseM", "Motion", "End",
    ]  # fmt: skip
    assert outcomes.count(BufferFull()) == 6
    assert outcomes.count(AwaitReset(5, 5)) == 1


def test_barrier_then_read_then_branch() -> None:
    machine, port, world = _machine("ML P1 F100\nIF DI3\nML P2\nENDIF\n", inputs={3: [True]})
    assert machine.run() == AtBarrier(2, "IF DI3")
    assert isinstance(port.calls[-1], Barrier)
    assert world.log == [], "nothing is read before the path has arrived"
    assert machine.run() == Ended(4)
    assert world.log == ["   2 DI3 is true"]


def test_wait_input_reads_again_at_each_resumption() -> None:
    machine, _, world = _machine("WAIT DI 2\n", inputs={2: [False, False, True]})
    assert [machine.run() for _ in range(4)] == [
        AtBarrier(1, "WAIT DI 2"), AwaitInput(1, 2), AwaitInput(1, 2), Ended(1),
    ]  # fmt: skip
    assert len(world.log) == 3


def test_waiting_for_long_is_not_endless_work() -> None:
    machine, _, _ = _machine("WAIT DI 2\n")
    machine.run()
    machine._work_limit = 50  # a hundred thousand would take the test too long
    assert all(machine.run() == AwaitInput(1, 2) for _ in range(200))


def test_synchronous_m_waits_for_its_reset() -> None:
    machine, port, _ = _machine("M 5\nML P1 F100\n")
    assert machine.run() == AwaitReset(1, 5)
    assert port.calls == [RaiseM(line=1, index=5, synchronous=True)]
    assert machine.run() == Ended(2)


def test_asynchronous_m_goes_on() -> None:
    machine, port, _ = _machine("M 5\nML P1 F100\n", asynchronous=frozenset({5}))
    assert machine.run() == Ended(2)
    assert port.calls[0] == RaiseM(line=1, index=5, synchronous=False)


def test_after_the_end_it_stays_ended() -> None:
    machine, port, _ = _machine("ML P1 F100\n")
    assert machine.run() == machine.run() == Ended(1)
    assert len(port.calls) == 2


def test_every_arrival_has_its_own_barrier() -> None:
    machine, port, _ = _machine("A:\nIF DI1\nENDIF\nGOTO A 3\n")
    while not isinstance(machine.run(), Ended):
        pass
    barriers = [call for call in port.calls if isinstance(call, Barrier)]
    assert len(barriers) == len({id(barrier) for barrier in barriers}) == 3


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("A:\nGOTO A\n", 2),
        ("ML P1 F100\nA: SET DO 1\nGOTO A\n", 2),
        ("A: WAIT 0\nGOTO A\n", 1),
        ("A: T 1\nTANG 1\nTRK 1\nTRK 0\nGOTO A\n", 1),
        ("A:\nIF 1 < 2\nGOTO A\nENDIF\n", 2),
        ("SUB S 1000000000\nEND\nS:\nEND\n", 1),
        ("A:\nSET DO 1\nGOTO A 1000000000\nML P1 F100\n", 1),
        ("S:\nSUB S 1000000000\nGOTO S\n", 1),
    ],
)
def test_work_without_motion_is_bounded(text: str, line: int) -> None:
    machine, _, _ = _machine(text, room=10**9)
    outcome = machine.run()
    assert isinstance(outcome, Failed)
    assert outcome.code in ("E401", "E402")
    assert line <= outcome.line <= line + 5
    assert machine.run() == outcome


def test_refusals_do_not_make_the_work_less() -> None:
    machine, port, _ = _machine("A: SET DO 1\nGOTO A\n", room=10)
    for _ in range(100_000):
        port.room = 10
        outcome = machine.run()
        if isinstance(outcome, Failed):
            return
        assert outcome == BufferFull()
    raise AssertionError("never stopped")


def test_a_long_program_of_actions_alone_is_no_loop() -> None:
    machine, _, _ = _machine("SET DO 1\n" * 120_000, room=10**9)
    assert machine.run() == Ended(120_000)


def _chain(depth: int) -> str:
    subs = (f"S{number}X:\nSUB S{number + 1}X\nEND\n" for number in range(depth - 1))
    return f"SUB S0X\nEND\n{''.join(subs)}S{depth - 1}X:\nML P1 F100\nEND\n"


def test_subroutines_nest_to_the_limit_and_not_deeper() -> None:
    machine, _, _ = _machine(_chain(DEPTH_LIMIT))
    assert machine.run() == Ended(2)
    machine, port, _ = _machine(_chain(DEPTH_LIMIT + 1))
    outcome = machine.run()
    assert isinstance(outcome, Failed)
    assert outcome.code == "E402"
    assert not port.calls


def test_it_shows_where_it_is() -> None:
    machine, port, _ = _machine("ML P1 FC100\nSUB A 2\nEND\nA:\nT 3\nSUB B\nEND\nB:\nML P2\nEND\n", room=2)
    assert machine.line == 1
    assert machine.run() == BufferFull()
    assert machine.line == 9
    assert machine.call_stack == (ActiveCall(2, 4, 2), ActiveCall(6, 8, 1))
    assert machine.modal == Modal(Speed(SpeedKind.LINEAR, 100.0), 3)
    port.room = 100
    assert machine.run() == Ended(3)
    assert machine.call_stack == ()


def test_a_motion_carries_the_state_of_its_place() -> None:
    machine, port, _ = _machine("T 2\nML P1 FA5\nML P3 T0 Z4 F9 R1\nMC P1 Q2 H90\n")
    machine.run()
    first, second, third = (call for call in port.calls if isinstance(call, Motion))
    assert (first.tool, first.frame, first.speed) == (2, 0, Speed(SpeedKind.ANGULAR, 5.0))
    assert (second.tool, second.frame, second.round_edge) == (0, 4, 1.0)
    assert (third.tool, third.frame, third.speed) == (2, 0, Speed(SpeedKind.GENERIC, 9.0))
    assert third.via is not None
    assert (third.target.point, third.via.point, third.angle) == (1, 2, 90.0)


def test_the_canonical_port_describes_every_call() -> None:
    world = ScriptedWorld()
    machine = Machine(compiled("ML P1 F100\n"), CanonicalPort(world), world)
    assert machine.run() == Ended(1)
    assert world.log == ["   1 ML P1 F100.000 Z0 T0", "   1 END"]


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("ML P1 F100\nA: ML P2\nGOTO A\n", [1, 2, 2, 2]),
        ("A: ML P1 F100\nB:\nIF NOT DI1\nGOTO B\nENDIF\nGOTO A\n", [1, 1, 1]),
        ("W:\nIF NOT DI1\nGOTO W\nENDIF\nA: ML P1 F100\nGOTO A\n", [1, 1, 1]),
        ("A: SUB S\nGOTO A\nS:\nB: ML P1 F100\nIF DI2\nGOTO B\nENDIF\nEND\n", [1, 1, 1]),
        ("A: ML P1 F100\nIF DI2\nGOTO A\nENDIF\nML P2\nGOTO A\n", [1, 2, 1, 2, 1, 2]),
    ],
)
def test_cycles_are_passes_of_the_main_loop(text: str, points: list[int]) -> None:
    port, world = Room(1000), ScriptedWorld({1: [False, False, False, False, True]})
    machine = Machine(compiled(text), port, world, max_cycles=3)
    while not isinstance(machine.run(), Ended):
        pass
    assert [call.target.point for call in port.calls if isinstance(call, Motion)] == points
    assert machine.cut_short


def test_a_program_that_ends_has_not_been_cut_short() -> None:
    machine, _, _ = _machine("A: ML P1 F100\nGOTO A 5\n")
    assert machine.run() == Ended(2)
    assert not machine.cut_short


def test_a_twin_goes_on_by_itself() -> None:
    """In a counted loop in a subroutine, with a call that was refused: both make the rest, each its own."""
    text = "ML P1 F100\nSUB S\nEND\nS:\nA:\nML P2\nSET DO 1\nGOTO A 3\nEND\n"
    machine, port, world = _machine(text, room=3)
    assert machine.run() == BufferFull()
    other = Room(1000)
    twin = machine.twin(other, world)
    assert (twin.state, twin.call_stack) == (machine.state, machine.call_stack)
    assert twin.run() == Ended(3)
    assert len(port.calls) == 3
    port.room = 1000
    assert machine.run() == Ended(3)
    assert port.calls[3:] == other.calls
    assert [type(call).__name__ for call in other.calls].count("Motion") == 2
