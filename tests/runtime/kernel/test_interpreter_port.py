"""The kernel under an interpreter that follows a script: when it is asked, and what becomes of its calls."""

from __future__ import annotations

from collections.abc import Hashable, Iterable

import numpy as np
import pytest

from session_runs import cell
from viapoint.runtime.kernel import Kernel, State
from viapoint.runtime.records import Event
from viapoint.runtime.signals import SignalWorld
from viapoint.vm.ports import (
    BEGINNING,
    AtBarrier,
    AwaitInput,
    Barrier,
    BufferFull,
    Call,
    Dwell,
    End,
    Ended,
    Failed,
    Modal,
    Motion,
    MotionKind,
    SetOutput,
    Speed,
    SpeedKind,
    Suspension,
    Target,
)

FAST = Speed(SpeedKind.GENERIC, 90.0)


def joint_move(line: int, **degrees: float) -> Motion:
    """`MJ J1=…`."""
    joints = tuple((int(name[1:]), value) for name, value in degrees.items())
    return Motion(line=line, kind=MotionKind.JOINT, target=Target(joints=joints), speed=FAST)


class Script:
    """Hands its calls over one after the other; an entry that is no call is where it waits."""

    def __init__(self, entries: Iterable[Call | Suspension]) -> None:
        self.entries = list(entries)
        self.asked: list[int] = []
        self.kernel: Kernel | None = None
        self.last: Suspension = BufferFull()

    @property
    def line(self) -> int:
        return getattr(self.entries[0], "line", 0) if self.entries else 0

    @property
    def modal(self) -> Modal:
        return BEGINNING

    def handling(self, *arguments: object) -> Script:
        raise AssertionError("nothing interrupts these scripts")

    @property
    def state(self) -> Hashable:
        return len(self.entries)

    def run(self) -> Suspension:
        assert self.kernel is not None
        self.asked.append(self.kernel.tick)
        while self.entries:
            entry = self.entries[0]
            if isinstance(entry, Call):
                if not self.kernel.dialogue.submit(entry):
                    return BufferFull()
                del self.entries[0]
            else:
                del self.entries[0]
                self.last = entry
                return entry
        return self.last


def execute(
    script: Script, *, window: int = 300, patient: bool = False, slots: int = 1024
) -> tuple[Kernel, list[Event]]:
    where = cell(controller=f"lookahead = {slots}")
    events: list[Event] = []
    world = SignalWorld(where, None, where.tick)
    kernel = Kernel(where, world, events.append, patient=patient)
    script.kernel = kernel
    kernel.begin(script)
    while not kernel.over and kernel.tick < 60_000:
        kernel.advance(window)
    return kernel, events


def test_the_kernel_before_it_begins() -> None:
    where = cell()
    kernel = Kernel(where, SignalWorld(where, None, where.tick), lambda event: None)
    assert kernel.state is State.READY
    assert kernel.tick == 0
    assert not kernel.over


def test_calls_are_executed_in_program_order() -> None:
    calls: list[Call | Suspension] = [
        SetOutput(line=1, index=1, value=True),
        joint_move(2, J1=5.0),
        SetOutput(line=3, index=1, value=False),
        Dwell(line=4, seconds=0.01),
        joint_move(5, J1=0.0),
        End(line=6),
        Ended(6),
    ]
    kernel, events = execute(Script(calls))
    assert kernel.state is State.FINISHED
    assert [(e.kind, e.line) for e in events] == [
        ("output", 1),
        ("block", 2),
        ("output", 3),
        ("wait", 4),
        ("block", 5),
    ]
    assert kernel.statements == 6
    assert np.abs(kernel.telemetry.joints).max() < 1e-12


def test_the_interpreter_goes_on_in_the_tick_in_which_its_barrier_is_reached() -> None:
    script = Script(
        [
            joint_move(1, J1=5.0),
            Barrier(line=2, reason="IF DI1"),
            AtBarrier(2, "IF DI1"),
            End(line=3),
            Ended(3),
        ]
    )
    kernel, events = execute(script)
    arrived = round(events[0].data["t_end"] * 1000)
    assert script.asked == [0, arrived]
    assert kernel.tick == arrived


def test_the_interpreter_is_asked_again_when_there_is_room() -> None:
    calls: list[Call | Suspension] = [joint_move(k, J1=float(k % 3), J2=float(k)) for k in range(1, 9)]
    script = Script([*calls, End(line=9), Ended(9)])
    kernel, events = execute(script, slots=3)
    assert kernel.state is State.FINISHED
    ends = [round(e.data["t_end"] * 1000) for e in events]
    assert len(ends) == 8
    assert set(script.asked) <= {0, *ends}


@pytest.mark.parametrize("slots", [1, 2, 1024])
def test_what_was_submitted_before_a_failure_is_executed(slots: int) -> None:
    script = Script(
        [joint_move(1, J1=5.0), SetOutput(line=2, index=1, value=True), Failed(3, "E401", "round and round")]
    )
    kernel, events = execute(script, slots=slots)
    assert kernel.state is State.FAILED
    assert kernel.failure is not None
    assert (kernel.failure.code, kernel.failure.line) == ("E401", 3)
    assert [e.kind for e in events] == ["block", "output", "error"]
    assert kernel.telemetry.joints[0] == pytest.approx(np.radians(5.0))


def test_a_wait_that_nobody_answers_fails_unless_somebody_may() -> None:
    script = [Barrier(line=1, reason="WAIT DI 1"), AtBarrier(1, "WAIT DI 1"), AwaitInput(1, 1)]
    kernel, _ = execute(Script(script))
    assert kernel.failure is not None
    assert kernel.failure.code == "E410"
    patient, _ = execute(Script(script), patient=True)
    assert patient.state is State.WAITING


def test_nothing_moves_after_the_end() -> None:
    kernel, _ = execute(Script([joint_move(1, J1=5.0), End(line=2), Ended(2)]))
    before, tick = kernel.telemetry.joints.copy(), kernel.tick
    kernel.halt()
    kernel.resume()
    kernel.stop()
    assert kernel.state is State.FINISHED
    assert (kernel.telemetry.joints == before).all()
    assert kernel.tick == tick
