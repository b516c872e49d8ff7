"""Starting from a line: what the lines above leave, without motion and without outputs.

The program is followed to the line on the shortest way through its reads. What holds there (tool, speed,
tangent, counters) is restored; the robot goes there by a joint move of reduced speed. What depends on the
world cannot be known, and is said.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeGuard

import numpy as np

from viapoint.excusing import plan_excused
from viapoint.runtime.kernel.auxiliary import AuxiliaryAxes
from viapoint.runtime.kernel.forecast import Forecast, Rest, forecast
from viapoint.runtime.kernel.returning import joint_move
from viapoint.vm import Machine, Program
from viapoint.vm.ports import (
    Barrier,
    BufferFull,
    Call,
    Dwell,
    End,
    Ended,
    Failed,
    HandleErrors,
    Handler,
    Motion,
    MotionKind,
    MotionPort,
    RaiseM,
    SelectTool,
    SetOutput,
    SetVariable,
    Speed,
    SpeedKind,
    Suspension,
    SwitchOff,
    SwitchOn,
    Tangent,
    Track,
)
from viapoint.ways import Answers, Read, Script, run_on

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell

APPROACH: Final = Speed(SpeedKind.GENERIC, 15.0)
"""deg/s of the joint move to the first target: slow enough to be watched."""

MOST_NODES: Final = 2000
"""Places looked at in search of the line."""

MOST_CALLS: Final = 100_000
"""Motions and actions between two reads."""


class StartError(ValueError):
    """A run cannot start from that line. `nearest` is the nearest line from which it can, if there is one."""

    def __init__(self, message: str, nearest: int | None) -> None:
        where = f"; the nearest line to start from is {nearest}" if nearest is not None else ""
        super().__init__(message + where)
        self.nearest = nearest


@dataclass(frozen=True, slots=True, kw_only=True)
class LineStart:
    """What holds where a run starts. `approach` is the joint move to the first target, None without one."""

    line: int
    tool: int
    speed: Speed | None
    tangent: Tangent | None
    interrupts: tuple[SwitchOn | HandleErrors, ...]
    """Those that are on; they come into force where the approach has ended."""
    counters: tuple[tuple[str, int], ...]
    """Labels, and which run of their loop this is."""
    assumed: tuple[Read, ...]
    """Reads on the way to the line, with the answers that lead there."""
    skipped: tuple[SetOutput, ...]
    """What the lines above switch, last of each output: it is not done."""
    unwritten: tuple[SetVariable, ...]
    """What they write to variables, in order: it is not done either."""
    approach: Motion | None
    machine: Machine
    """Before the line; give its `twin` the ports to run on."""


@dataclass(slots=True)
class _Way:
    """A way from the program's start: its calls and reads, by the part behind each node."""

    machine: Machine
    before: _Way | None = None
    calls: tuple[Call, ...] = ()
    reads: tuple[Read, ...] = ()
    over: bool = False
    """The program has ended, or cannot go on."""

    def all_calls(self) -> list[Call]:
        parts: list[Sequence[Call]] = []
        way: _Way | None = self
        while way is not None:
            parts.append(way.calls)
            way = way.before
        return [call for part in reversed(parts) for call in part]

    def all_reads(self) -> tuple[Read, ...]:
        before = self.before.all_reads() if self.before is not None else ()
        return before + self.reads


class _List:
    """MotionPort: takes calls until the machine goes round."""

    def __init__(self) -> None:
        self.calls: list[Call] = []
        self.machine: Machine | None = None
        self.full = False
        self._passed: set[Hashable] = set()

    def submit(self, call: Call) -> bool:
        assert self.machine is not None, "it is given one before it runs"
        state = self.machine.state
        if state in self._passed or len(self.calls) >= MOST_CALLS:
            self.full = True
            return False
        self._passed.add(state)
        self.calls.append(call)
        return True


def start_at(
    program: Program, cell: Cell, line: int, *, cycles: int | None = None, last_line: int | None = None
) -> LineStart:
    """What holds at `line`. Raises StartError, naming the nearest line that will do."""
    problem = "it is never reached from the start of the program"
    if line not in _lines(program):
        problem = "no statement begins there"
    machine = Machine(program, _List(), Answers(cell), max_cycles=cycles, last_line=last_line, until=line)
    for way in _ways(machine, cell):
        if not _arrived(way, line):
            continue
        refused = _unfit(way, cell)
        if refused is None:
            return _start(way, cell, line)
        problem = refused
        break
    raise StartError(f"the run cannot start from line {line}: {problem}", _nearest(program, cell, line))


def _ways(machine: Machine, cell: Cell) -> Iterator[_Way]:
    """Every way through a program, from wait to wait, the shortest first; each place once."""
    waiting = deque([_Way(machine)])
    known: set[Hashable] = set()
    while waiting and len(known) < MOST_NODES:
        way = waiting.popleft()
        scripts: list[Script] = [()]
        while scripts:
            further, outcome, alternatives = _follow(way, cell, scripts.pop(0))
            scripts += alternatives
            state = further.machine.state
            if state in known:
                continue
            known.add(state)
            yield further
            if not isinstance(outcome, (Ended, Failed, BufferFull)):
                waiting.append(further)


def _follow(way: _Way, cell: Cell, script: Script) -> tuple[_Way, Suspension, list[Script]]:
    """On from a node to the next one, with given answers; and what else could be answered."""
    sink, world = _List(), Answers(cell, script)
    machine = sink.machine = way.machine.twin(sink, world, until=way.machine.until)
    outcome = run_on(machine, world)
    over = isinstance(outcome, (Ended, Failed)) or sink.full
    further = _Way(machine, way, tuple(sink.calls), tuple(world.given), over)
    return further, outcome, world.alternatives


def _arrived(way: _Way, line: int) -> bool:
    return not way.over and way.machine.next_line == line


def _closes(call: Call) -> bool:
    """Whether a call ends a spline."""
    synchronous = isinstance(call, RaiseM) and call.synchronous
    return synchronous or isinstance(call, (Barrier, Dwell, SelectTool, Track))


def _unfit(way: _Way, cell: Cell) -> str | None:
    """Why a run cannot start at the end of a way."""
    if way.machine.call_stack:
        return f"it is in the subroutine that begins in line {way.machine.call_stack[-1].label_line}"
    tracked = [call for call in way.all_calls() if isinstance(call, Track)]
    if tracked and tracked[-1].conveyor:
        return f"line {tracked[-1].line} has the robot follow conveyor {tracked[-1].conveyor}"
    return "it is inside a spline" if _in_spline(way, cell) else None


def _in_spline(way: _Way, cell: Cell) -> bool:
    for call in reversed(way.all_calls()):
        if _closes(call):
            return False
        if isinstance(call, Motion):
            if call.kind is not MotionKind.SPLINE:
                return False
            break
    else:
        return False
    for call in _ahead(way, cell):
        if _closes(call):
            return False
        if isinstance(call, Motion):
            return call.kind is MotionKind.SPLINE
    return False


def _ahead(way: _Way, cell: Cell) -> list[Call]:
    """What follows a way up to the next wait."""
    sink = _List()
    machine = sink.machine = way.machine.twin(sink, Answers(cell))
    machine.run()
    return sink.calls


def _nearest(program: Program, cell: Cell, line: int) -> int | None:
    """The nearest line from which a run can start; of two as near the one above."""
    for other in sorted(_lines(program), key=lambda each: (abs(each - line), each)):
        if other == line:
            continue
        for way in _ways(Machine(program, _List(), Answers(cell), until=other), cell):
            if _arrived(way, other):
                if _unfit(way, cell) is None and not isinstance(_ahead(way, cell)[0], End):
                    return other
                break
    return None


def _lines(program: Program) -> set[int]:
    """Lines in which a statement begins that does something."""
    return {program.line_at(address) for address in program.spans.addresses}


def _start(way: _Way, cell: Cell, line: int) -> LineStart:
    calls = way.all_calls()
    tangents = [call for call in calls if isinstance(call, Tangent)]
    switched = {call.index: call for call in calls if isinstance(call, SetOutput)}
    return LineStart(
        line=line,
        tool=way.machine.modal.tool,
        speed=way.machine.modal.speed,
        tangent=tangents[-1] if tangents and tangents[-1].on else None,
        interrupts=_switched_on(calls),
        counters=way.machine.counters,
        assumed=way.all_reads(),
        skipped=tuple(switched[index] for index in sorted(switched)),
        unwritten=tuple(call for call in calls if isinstance(call, SetVariable)),
        approach=_approach(calls, _ahead(way, cell), cell, line),
        machine=way.machine,
    )


def _switched_on(calls: Iterable[Call]) -> tuple[SwitchOn | HandleErrors, ...]:
    """The interrupts that are on behind calls, in the order of their ON."""
    on: dict[Handler, SwitchOn] = {}
    errors: HandleErrors | None = None
    for call in calls:
        match call:
            case SwitchOn(handler=handler, condition=condition):
                if handler in on and on[handler].condition != condition:
                    del on[handler]
                on.setdefault(handler, call)
            case HandleErrors():
                errors = call
            case SwitchOff(handler=handler):
                on.pop(handler, None)
                errors = None if errors is not None and errors.handler == handler else errors
            case _:
                pass
    return (*on.values(), *([errors] if errors is not None else []))


def _approach(above: Sequence[Call], ahead: Sequence[Call], cell: Cell, line: int) -> Motion | None:
    """To the target of a motion in the line; else to where the motion above it ends, if there is one."""
    calls = list(above)
    if ahead and _replaced(ahead[0], line):
        calls.append(ahead[0])
    motions = [call for call in calls if isinstance(call, Motion)]
    if not motions:
        return None
    home = Rest(np.asarray(cell.home, dtype=np.float64), AuxiliaryAxes.of(cell).start, 0)
    planned = _forecast(cell, home, calls)
    if planned.failure is not None:
        failure = planned.failure
        raise StartError(f"line {failure.line} cannot be planned: {failure.message}", None)
    end = planned.end
    return joint_move(cell, end.q, end.e, line=line, tool=motions[-1].tool, speed=APPROACH)


def _forecast(cell: Cell, home: Rest, calls: Sequence[Call]) -> Forecast:
    """How calls are planned from home, without the statements whose errors the program handles."""
    planned = forecast(cell, home, calls)
    found, _, _ = plan_excused(calls, None, planned, lambda left: forecast(cell, home, left))
    return found or planned


def _replaced(call: Call | None, line: int) -> TypeGuard[Motion]:
    """Whether the approach takes the place of a call: of the line's motion, unless it acts on its way."""
    if not isinstance(call, Motion) or call.line != line:
        return False
    return not call.actions and call.search is None


class Approaching:
    """MotionPort: the approach in place of the motion of the line, or before its action; then what comes."""

    def __init__(self, port: MotionPort, start: LineStart) -> None:
        self._port = port
        self._line = start.line
        before = (start.tangent, start.approach, *start.interrupts)
        self._before: list[Call] = [call for call in before if call is not None]

    def submit(self, call: Call) -> bool:
        """Accept a call, or not: see MotionPort."""
        while self._before:
            if not self._port.submit(self._before[0]):
                return False
            approach = self._before.pop(0)
            if isinstance(approach, Motion) and _replaced(call, self._line):
                return True
        return self._port.submit(call)
