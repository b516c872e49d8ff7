"""Plans a program without running it: every motion's geometry and reach, no time law and no waiting.

The machine runs against the planner alone. Reads of the outside world all get one answer; waits are
passed. Endless programs end when they have shown nothing new for a while.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from viapoint.runtime.kernel import ExecutionError
from viapoint.runtime.kernel.buffer import MotionBuffer
from viapoint.runtime.kernel.planner import Corner, Planner
from viapoint.vm import Machine, Program
from viapoint.vm.ports import AwaitInput, Call, End, Ended, Failed, Motion, MotionKind

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.kernel import MotionError

NOTHING_NEW: Final = 1000
"""Motions and actions in a row that follow one another as before, after which a loop counts as known."""

MOST_CALLS: Final = 100_000
"""The bound for programs that show something new all the time."""


class _Answers:
    """WorldPort: one answer for every read; a wait is satisfied when it is asked again."""

    def __init__(self, cell: Cell, answer: bool) -> None:
        self._cell = cell
        self._answer = answer
        self.awaited: int | None = None

    def read_input(self, index: int, *, line: int, ahead: bool) -> bool:
        return self._answer or index == self.awaited

    def read_output(self, index: int, *, line: int, ahead: bool) -> bool:
        return self._answer

    def read_m(self, index: int, *, line: int, ahead: bool) -> bool:
        return self._answer

    def m_is_synchronous(self, index: int) -> bool:
        return self._cell.m_functions.get(index, True)


class _Sink:
    """MotionPort: plans each call at once and forgets it."""

    def __init__(self, cell: Cell) -> None:
        self._buffer: MotionBuffer = MotionBuffer(cell.lookahead)
        self.planner = Planner(cell, self._buffer, cell.home)
        self.calls = 0
        self.joint_lines: set[int] = set()
        self.edges: dict[int, float | None] = {}
        self._last_line = 0
        self._seen: set[tuple[int, int]] = set()
        self._since_news = 0

    @property
    def done(self) -> bool:
        return self.planner.failure is not None or self._since_news > NOTHING_NEW or self.calls > MOST_CALLS

    def submit(self, call: Call) -> bool:
        if self.done:
            return False
        self._buffer.put(call)
        self.planner.plan()
        while self._buffer.to_execute() is not None:
            self._buffer.executed()
        if isinstance(call, Motion):
            self.edges[call.line] = call.round_edge
            if call.kind in (MotionKind.JOINT, MotionKind.HOME):
                self.joint_lines.add(call.line)
        self._count(call.line)
        if isinstance(call, End):
            self.planner.close(call.line)
        return True

    def _count(self, line: int) -> None:
        step = (self._last_line, line)
        self._since_news = 0 if step not in self._seen else self._since_news + 1
        self._seen.add(step)
        self._last_line = line
        self.calls += 1


@dataclass(frozen=True, slots=True)
class Survey:
    """What one way through a program shows: corners, joint moves, R as programmed, what cannot be planned."""

    corners: tuple[Corner, ...]
    joint_lines: frozenset[int]
    edges: dict[int, float | None]
    failure: MotionError | None


def survey(program: Program, cell: Cell, answer: bool) -> Survey:
    """Plan the way the program takes when every read gives `answer`."""
    sink, world = _Sink(cell), _Answers(cell, answer)
    machine = Machine(program, sink, world)
    while not sink.done:
        outcome = machine.run()
        if isinstance(outcome, Failed):
            sink.planner.abort(ExecutionError(outcome.code, outcome.message, outcome.line))
        if isinstance(outcome, (Ended, Failed)):
            break
        world.awaited = outcome.index if isinstance(outcome, AwaitInput) else None
    planner = sink.planner
    return Survey(tuple(planner.corners), frozenset(sink.joint_lines), sink.edges, planner.failure)
