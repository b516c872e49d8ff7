"""Plans a program without running it: every way through it, from each place where the robot stands.

The machine runs against a list. Where it reads the outside world both answers are followed; a wait is
passed. A *node* is a place where the path stands still: what the machine goes on with, and where the robot
is. Ways that meet in the same node go on as one, those that do not are planned on each by itself. A
stretch between two nodes that was planned before is not planned again.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from viapoint.excusing import handling_errors, plan_excused
from viapoint.language.catalogue import CATALOGUE
from viapoint.runtime.kernel import ExecutionError
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.forecast import Forecast, Rest, forecast
from viapoint.runtime.kernel.guard import TickGuard
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.kernel.unsupported import refusal
from viapoint.runtime.workspace import Monitor
from viapoint.vm import Machine, Program
from viapoint.vm.cycles import main_loop
from viapoint.vm.folding import Folded, fold
from viapoint.vm.ports import (
    Barrier,
    Call,
    Dwell,
    End,
    Ended,
    Failed,
    HandleErrors,
    Handler,
    Modal,
    Motion,
    RaiseM,
    SelectTool,
    SwitchOn,
    Track,
)
from viapoint.ways import Answers, run_on

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.kernel import MotionError
    from viapoint.runtime.records import Floats

MOST_NODES: Final = 10_000
"""Places to stand at that are looked at; beyond them ways are cut off."""

MOST_PLANNED: Final = 20_000
"""Motions and actions that are planned in all, at some milliseconds each; beyond them ways are cut off. In a
program of more bytes of code there are so many: it is planned some ten times over."""

MOST_CALLS: Final = 200_000
"""Motions and actions between two places to stand at."""

ROUNDS: Final = 3
"""Passes of an endless loop: the first one, one as all that follow, and one that this one leads into."""


ANY_ERROR: Final = 300
"""Stands for an error that a program does not ask for by its number."""


class Stretch(NamedTuple):
    """A way from one node to the next: how it is planned, its calls, and in which pass of the main loop."""

    source: int
    target: int | None
    """None: the program is over, or cannot go on."""
    calls: tuple[Call, ...]
    cycles: tuple[int | None, ...]
    weights: tuple[int, ...]
    """How often each call is made: rounds of a loop that are all alike are planned once."""
    planned: Forecast
    ends: bool = False
    """The program is over behind it."""


@dataclass(slots=True)
class Survey:
    """What the ways through a program show."""

    stretches: list[Stretch] = field(default_factory=list)
    failures: list[MotionError] = field(default_factory=list)
    excused: list[MotionError] = field(default_factory=list)
    """Those that the program handles itself: their statements are left out."""
    cut_at: int | None = None
    """Line at which a bound cut a way off."""
    beside: list[Stretch] = field(default_factory=list)
    """The ways through subroutines that interrupt, each from the place of its ON."""
    passes: list[Stretch] | None = None
    """Of a program that never ends: the ways through some passes of its main loop."""


def survey(program: Program, cell: Cell) -> Survey:
    """Plan every way through a program."""
    planned: dict[Hashable, Forecast] = {}
    surveyor = _Surveyor(program, cell, planned)
    found = surveyor.run()
    _survey_interrupts(found, surveyor.interrupts, _Surveyor(program, cell, planned))
    ends = any(stretch.ends for stretch in found.stretches)
    if not (ends or found.failures or found.cut_at) and main_loop(program) is not None:
        found.passes = _Surveyor(program, cell, planned, ROUNDS).run().stretches
    return found


def _survey_interrupts(found: Survey, interrupts: Iterable[_Interrupt], surveyor: _Surveyor) -> None:
    """Plan every way through the subroutines that interrupt, and those that they switch on."""
    waiting, known = deque(interrupts), set[Hashable]()
    while waiting:
        each = waiting.popleft()
        key = (each.handler, each.rest.key, each.modal, each.error)
        if key not in known:
            known.add(key)
            surveyor.enter(each)
            surveyor.follow_all()
            waiting += surveyor.interrupts
            surveyor.interrupts.clear()
    more = surveyor.found
    found.beside, found.cut_at = more.stretches, found.cut_at or more.cut_at
    found.failures += more.failures


class _Interrupt(NamedTuple):
    """A subroutine that interrupts, and a place from which it may have to run."""

    handler: Handler
    machine: Machine
    """One that runs its program."""
    rest: Rest
    modal: Modal
    error: int = 0
    """Number of the error that it handles, 0: none."""


class _Node(NamedTuple):
    """A place where the path stands still: the machine, as far as it has come, and the robot."""

    number: int
    machine: Machine
    rest: Rest
    errors: Handler | None
    """What handles errors there."""


class _Surveyor:
    """Looks at all ways, or at so many passes; `planned` are stretches whose plans are known."""

    def __init__(
        self, program: Program, cell: Cell, planned: dict[Hashable, Forecast], passes: int | None = None
    ) -> None:
        self._cell = cell
        self.interrupts: list[_Interrupt] = []
        """Where interrupts were switched on."""
        self.found = Survey()
        self._errors = _errors_asked_for(program)
        self._numbers: dict[Hashable, int] = {}
        self._waiting: deque[_Node] = deque()
        self._planned = planned
        self._most = max(MOST_PLANNED, len(program.code))
        self._cost = 0
        self._begin = Machine(program, _List(), Answers(cell, ()), max_cycles=passes)

    def run(self) -> Survey:
        """Everything from the program's start on, with the robot at home."""
        home = np.asarray(self._cell.home, dtype=np.float64)
        refused = self._refused(home)
        if refused is not None:
            self.found.failures.append(refused)
            return self.found
        self._enter(self._begin, Rest(home, AuxiliaryAxes.of(self._cell).start, 0), None, None)
        self.follow_all()
        return self.found

    def enter(self, interrupt: _Interrupt) -> None:
        """An interrupt begins."""
        machine, sink, world = interrupt.machine, _List(), Answers(self._cell, ())
        handler, modal, error = interrupt.handler, interrupt.modal, interrupt.error
        self._enter(machine.handling(handler, sink, world, modal, error), interrupt.rest, None, None)

    def follow_all(self) -> None:
        """Follow every way from the nodes that were entered."""
        while self._waiting:
            node = self._waiting.popleft()
            scripts: list[tuple[bool, ...]] = [()]
            while scripts:
                scripts += self._follow(node, scripts.pop())

    def _refused(self, home: Floats) -> MotionError | None:
        """What keeps the robot from setting out at all."""
        guard = TickGuard(Monitor(self._cell), Trace(lambda event: None, self._cell.tick))
        return refusal(self._cell) or guard.standing(home, 0, 0)

    def _follow(self, node: _Node, script: tuple[bool, ...]) -> list[tuple[bool, ...]]:
        """One way on from a node; what else could have been answered on it."""
        sink, world = _List(), Answers(self._cell, script)
        machine = sink.machine = node.machine.twin(sink, world)
        outcome = run_on(machine, world)
        stretch = self._excused(node, sink, self._plan(node, sink))
        if stretch is None:
            self.found.cut_at = self.found.cut_at or machine.line
            return []
        failure, target = stretch.planned.failure, None
        if failure is None and isinstance(outcome, Failed):
            failure = ExecutionError(outcome.code, outcome.message, outcome.line)
        if failure is not None:
            self.found.failures.append(failure)
        elif not isinstance(outcome, (Ended, Failed)) and not sink.endless:
            errors = handling_errors(node.errors, stretch.calls)
            target = self._enter(machine, stretch.planned.end, sink.refused, errors)
        if failure is None:
            self._note_interrupts(node, stretch.calls)
        self.found.stretches.append(stretch._replace(target=target, ends=isinstance(outcome, Ended)))
        return world.alternatives

    def _note_interrupts(self, node: _Node, calls: Sequence[Call]) -> None:
        """Where interrupts are switched on between a node and the next; on a belt they wait."""
        first: dict[tuple[Handler, bool], int] = {}
        for k, call in enumerate(calls):
            if isinstance(call, SwitchOn | HandleErrors):
                first.setdefault((call.handler, isinstance(call, HandleErrors)), k)
        for (handler, of_errors), k in first.items():
            before = tuple(calls[:k])
            planned = self._forecast(node.rest, before)
            if planned is not None and planned.failure is None and planned.end.track is None:
                modal = _modal_behind(node.machine.modal, before)
                self.interrupts += (
                    _Interrupt(handler, node.machine, planned.end, modal, error)
                    for error in (self._errors if of_errors else (0,))
                )

    def _excused(self, node: _Node, sink: _List, stretch: Stretch | None) -> Stretch | None:
        """The stretch without the statements whose errors the program handles; each of them is a stop."""
        if stretch is None or stretch.planned.failure is None:
            return stretch
        whole = self._forecast(node.rest, tuple(sink.calls))
        if whole is None:
            return None
        planned, calls, excused = plan_excused(
            sink.calls, node.errors, whole, lambda calls: self._forecast(node.rest, calls)
        )
        self.found.excused += excused
        if planned is None or not excused:
            return stretch if planned is not None else None
        return Stretch(node.number, None, calls, tuple(sink.cycles), (1,) * len(calls), planned)

    def _plan(self, node: _Node, sink: _List) -> Stretch | None:
        """The stretch of a list of calls, folded where that shows the same; None if it was one too many."""
        items = list(zip(sink.calls, sink.cycles, strict=True))
        for folded in (fold(items), _whole(len(items))):
            calls = tuple(sink.calls[k] for k in folded.kept)
            planned = self._forecast(node.rest, calls)
            if planned is None:
                return None
            if _proved(folded, planned):
                cycles = tuple(sink.cycles[k] for k in folded.kept)
                return Stretch(node.number, None, calls, cycles, folded.weights, planned)
        raise AssertionError("what is not folded needs no proof")

    def _forecast(self, rest: Rest, calls: tuple[Call, ...]) -> Forecast | None:
        """How calls are planned; None if they were too many."""
        key = (rest.key, calls)
        if (known := self._planned.get(key)) is not None:
            return known
        self._cost += len(calls)
        if self._cost > self._most:
            return None
        known = self._planned[key] = forecast(self._cell, rest, calls)
        return known

    def _enter(
        self, machine: Machine, rest: Rest, refused: Call | None, errors: Handler | None
    ) -> int | None:
        """The number of a node, which is looked at if it is new; None if it is one too many."""
        key = (machine.state, refused, rest.key, errors)
        if key not in self._numbers:
            if len(self._numbers) >= MOST_NODES:
                self.found.cut_at = self.found.cut_at or machine.line
                return None
            number = self._numbers[key] = len(self._numbers)
            self._waiting.append(_Node(number, machine, rest, errors))
        return self._numbers[key]


def _errors_asked_for(program: Program) -> tuple[int, ...]:
    """Numbers of errors that a program may compare with, and one that it does not."""
    known = {int(code[1:]) for code in CATALOGUE if code.startswith(("E3", "E4"))}
    return (ANY_ERROR, *sorted(known.intersection(program.numbers)))


def _modal_behind(modal: Modal, calls: Iterable[Call]) -> Modal:
    """What holds behind calls that were made where `modal` was in force."""
    for call in calls:
        if isinstance(call, Motion):
            modal = modal._replace(speed=call.speed)
        elif isinstance(call, SelectTool):
            modal = modal._replace(tool=call.tool)
    return modal


def _whole(count: int) -> Folded:
    return Folded(tuple(range(count)), (1,) * count, ())


def _proved(folded: Folded, planned: Forecast) -> bool:
    """Whether rounds that were folded end in the same place, as far as they could be planned."""
    if planned.failure is not None:
        return True
    ends: list[tuple[float, ...]] = [()] * len(folded.kept)
    for block in planned.blocks:
        ends[block.number] = block.end
    for k in range(1, len(ends)):  # actions stand where the motion before them ends
        ends[k] = ends[k] or ends[k - 1]
    return all(ends[a] == ends[b] for a, b in folded.proofs)


class _List:
    """MotionPort: takes calls up to one behind which the path stands still, or until they go round."""

    def __init__(self) -> None:
        self.machine: Machine | None = None
        self.calls: list[Call] = []
        self.cycles: list[int | None] = []
        """The passes of the main loop that were still to come at each call."""
        self.refused: Call | None = None
        self.endless = False
        self._closed = False
        self._passed: Counter[Hashable] = Counter()

    def submit(self, call: Call) -> bool:
        assert self.machine is not None, "it is given one before it runs"
        if isinstance(call, Motion) and not self._closed:
            state = self.machine.state
            self._passed[state] += 1
            self.endless = self._passed[state] > ROUNDS
        if self._closed or self.endless or len(self.calls) >= MOST_CALLS:
            self.refused = call
            return False
        self.calls.append(call)
        self.cycles.append(self.machine.cycles_left)
        self._closed = isinstance(call, (Barrier, Dwell, End, SelectTool, Track)) or (
            isinstance(call, RaiseM) and call.synchronous
        )
        return True
