"""Signals and M flags over the ticks of a run, with a scenario that acts and answers.

It takes part in a tick before the path does: `advance(tick)` first, then the path's own writes. Writes of
outputs become visible in the next tick. Nothing here depends on how many ticks are computed at once.
"""

from __future__ import annotations

import copy
import heapq
import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self, assert_never

from viapoint.runtime.cell import Cell, Signal, SignalKind
from viapoint.runtime.signals.bank import SignalBank, Value
from viapoint.runtime.signals.parts import PartQueues
from viapoint.runtime.signals.scenario import Answer, Change, MFlag, Scenario
from viapoint.vm.conditions import NUMBER, Reading


@dataclass(frozen=True, slots=True, order=True)
class _Due:
    """Changes to be made in a tick; those of one tick in the order in which they were scheduled."""

    tick: int
    order: int
    changes: tuple[Change, ...]


def _reading(target: Signal | MFlag) -> Reading:
    if isinstance(target, MFlag):
        return Reading("M", target.index)
    if target.kind is SignalKind.VARIABLE:
        return Reading(NUMBER, 0, target.name)
    return Reading(target.kind.value, target.index)


class SignalWorld:
    """The outside world as one robot sees it: inputs, outputs, its M flags, and who answers them."""

    def __init__(self, cell: Cell, scenario: Scenario | None, tick: float, *, dry_run: bool = False) -> None:
        """`tick` in s. In a dry run the cell's process outputs stay off."""
        self.bank = SignalBank(cell.io)
        self.scenario = scenario
        self.parts = PartQueues()
        """What the robots have taken from the belts."""
        self._tick = tick
        self._held_off = cell.io.process_outputs if dry_run else frozenset()
        self._robot = 1
        self._flags: set[MFlag] = set()
        self._agenda: list[_Due] = []
        self._order = itertools.count()
        self._changed = [0]  # the last tick in which something changed; of all robots that see this world
        self._answers: dict[Change, list[Answer]] = {}
        for answer in scenario.answers if scenario is not None else ():
            for cause in _causes(answer):
                self._answers.setdefault(cause, []).append(answer)
        for timed in scenario.timed if scenario is not None else ():
            self._schedule(self.ticks(timed.time), timed.changes)

    def seen_by(self, robot: int) -> Self:
        """The same world as another robot of the cell sees it, whose M flags are its own."""
        world = copy.copy(self)
        world._robot = robot
        return world

    def ticks(self, seconds: float) -> int:
        """The tick nearest to a time; halves go to the later one."""
        return math.floor(seconds / self._tick + 0.5)

    # --- time --------------------------------------------------------------------------------------

    def next_change(self, tick: int) -> int | None:
        """The next tick after `tick` in which something scheduled happens; None: nothing is."""
        return max(self._agenda[0].tick, tick + 1) if self._agenda else None

    def next_look(self, looked: int) -> int | None:
        """The next tick in which to look again after a look in tick `looked`; None: nothing will change.

        That is the next change, or one that somebody else has let come about since.
        """
        return self._changed[0] if self._changed[0] > looked else self.next_change(looked)

    def advance(self, tick: int) -> None:
        """Make all changes due up to and in this tick, in order, their answers included."""
        while self._agenda and self._agenda[0].tick <= tick:
            due = heapq.heappop(self._agenda)
            self._changed[0] = max(self._changed[0], due.tick)
            for change in due.changes:
                self._apply(change, due.tick)

    def _apply(self, change: Change, tick: int) -> None:
        match change.target:
            case Signal() as signal:
                # An output was written one tick before it is seen; delays count from the write.
                written = change.by_robot or signal.kind is SignalKind.DIGITAL_OUTPUT
                value = self.bank.written(signal) + change.value if change.adds else change.value
                if self.bank.write(signal, value):
                    self._answer(Change(signal, value), tick - 1 if written else tick, tick)
            case MFlag() as flag:
                self._flags.discard(flag)
            case _:
                assert_never(change.target)

    def _answer(self, cause: Change, at: int, now: int) -> None:
        """Schedule the answers to something that came about in tick `at`; never in the past, nor at once."""
        for answer in self._answers.get(cause, ()):
            if isinstance(cause.target, MFlag) and not self._flags.issuperset(_flags(answer, cause.target)):
                continue  # not all robots have raised theirs
            due = at + max(self.ticks(answer.delay), 1)
            self._schedule(max(due, now), answer.changes)

    def _schedule(self, tick: int, changes: tuple[Change, ...]) -> None:
        heapq.heappush(self._agenda, _Due(tick, next(self._order), changes))

    def pending(self, awaited: Change | None = None) -> bool:
        """Whether anything scheduled, or an answer to it, can still change a signal or reset a flag.

        With `awaited` (an input getting a value, `Change(MFlag(n), False)`): whether exactly that can
        still come about while the robot stands.
        """
        coming = self._coming()
        return bool(coming) if awaited is None else awaited in coming

    def coming(self, readings: Iterable[Reading]) -> bool:
        """Whether anything of what is read may still change without the robot doing anything."""
        read = {each._replace(kind=NUMBER) if each.name else each for each in readings}
        return any(_reading(change.target) in read for change in self._coming())

    def _coming(self) -> set[Change]:
        """All changes that may still happen without the robot doing anything."""
        fresh = [change for due in self._agenda for change in due.changes]
        coming: set[Change] = set()
        while fresh:
            change = fresh.pop()
            if change not in coming:
                coming.add(change)
                fresh += (each for answer in self._answers_to(change) for each in answer.changes)
        return coming

    def _answers_to(self, change: Change) -> Iterable[Answer]:
        """What a change may bring about; of a number that is added it is not known what comes of it."""
        if not change.adds:
            return self._answers.get(change, ())
        known = (answers for cause, answers in self._answers.items() if cause.target == change.target)
        return itertools.chain.from_iterable(known)

    # --- the robot's side --------------------------------------------------------------------------

    def write_output(self, index: int, value: bool, tick: int) -> None:
        """The path switches a digital output in `tick`; readers, and who answers, see it in the next."""
        signal = self.bank.existing(Signal(SignalKind.DIGITAL_OUTPUT, index))
        if index not in self._held_off:
            self._schedule(tick + 1, (Change(signal, value),))

    def write_level(self, index: int, value: float, tick: int) -> None:
        """The path sets an analog output in `tick`; readers see it in the next."""
        signal = self.bank.existing(Signal(SignalKind.ANALOG_OUTPUT, index))
        self._schedule(tick + 1, (Change(signal, value),))

    def write_variable(self, name: str, value: Value, tick: int, *, adds: bool = False) -> Value:
        """The path gives a variable a value, or adds to it, in `tick`; readers see it in the next.

        Returns what it will be. Raises KeyError where the cell has it not, TypeError where it is of another
        kind.
        """
        signal = self._variable(name, isinstance(value, bool))
        change = Change(signal, value, adds, by_robot=True)
        self._schedule(tick + 1, (change,))
        if not adds:
            return value
        total = self.bank.written(signal)
        for due in sorted(self._agenda):
            for each in due.changes if due.tick <= tick + 1 else ():
                if each.target == signal:
                    total = total + each.value if each.adds else each.value
        return total

    def _variable(self, name: str, switch: bool) -> Signal:
        signal = self.bank.resolve(f"${name}")
        if isinstance(self.bank.written(signal), bool) is not switch:
            raise TypeError(f"in this cell {signal} is {'a number' if switch else 'true or false'}")
        return signal

    def raise_m(self, index: int, tick: int) -> None:
        """The path raises a flag. It is the robot's own: seen by it at once, by others in the next tick."""
        flag = MFlag(index, self._robot)
        if flag in self._flags:
            return
        self._flags.add(flag)
        self._changed[0] = max(self._changed[0], tick)
        self._answer(Change(flag, True), tick, tick + 1)

    def read_input(self, index: int) -> bool:
        """Digital input. Raises KeyError where the cell has it not."""
        return bool(self.bank.read(Signal(SignalKind.DIGITAL_INPUT, index)))

    def read_output(self, index: int) -> bool:
        """Digital output as seen from outside. Raises KeyError where the cell has it not."""
        return bool(self.bank.read(Signal(SignalKind.DIGITAL_OUTPUT, index)))

    def read_m(self, index: int) -> bool:
        """Whether the flag of an M function is raised."""
        return MFlag(index, self._robot) in self._flags

    @property
    def flags(self) -> frozenset[int]:
        """The M functions whose flag is raised."""
        return frozenset(flag.index for flag in self._flags if flag.robot == self._robot)

    def read(self, reading: Reading) -> Value:
        """A signal, flag or variable as a condition reads it. Raises KeyError where the cell has it not.

        Raises TypeError for a variable of another kind.
        """
        if reading.kind == "M":
            return self.read_m(reading.number)
        if reading.name:
            return self.bank.read(self._variable(reading.name, reading.is_switch))
        return self.bank.read(Signal(SignalKind(reading.kind), reading.number))

    # --- somebody outside --------------------------------------------------------------------------

    def set_input(self, which: int | str, value: Value, tick: int) -> None:
        """Set an input (index of a digital one, `"AI1"`, or a name), seen from the tick after `tick` on.

        A variable is `"$count"`. Raises KeyError for a signal the cell has not, ValueError for an output.
        """
        if isinstance(which, int):
            signal = self.bank.existing(Signal(SignalKind.DIGITAL_INPUT, which))
        else:
            signal = self.bank.resolve(which)
        if signal.kind is SignalKind.VARIABLE:
            self.set_variable(signal.name, value, tick)
            return
        if signal.kind in (SignalKind.DIGITAL_OUTPUT, SignalKind.ANALOG_OUTPUT):
            raise ValueError(f"{signal} is an output: the program sets it")
        self._schedule(tick + 1, (Change(signal, value),))

    def set_variable(self, name: str, value: Value, tick: int) -> None:
        """Give a variable a value, seen from the tick after `tick` on.

        Raises KeyError where the cell declares none, ValueError for a value of another kind or not finite.
        """
        signal = self.bank.resolve(f"${name}")
        switch = isinstance(self.bank.written(signal), bool)
        if switch is not isinstance(value, bool) or not math.isfinite(value):
            raise ValueError(
                f"{signal} takes {'true or false' if switch else 'a finite number'}, not {value!r}"
            )
        self._schedule(tick + 1, (Change(signal, value if switch else float(value)),))

    def reset_m(self, index: int, tick: int) -> None:
        """The application resets a flag, seen from the tick after `tick` on."""
        self._schedule(tick + 1, (Change(MFlag(index, self._robot), False),))

    def force(self, name: str, value: Value, tick: int) -> None:
        """Hold a signal at a value from now on, for diagnostics. Raises KeyError for an unknown signal."""
        signal = self.bank.resolve(name)
        self._changed[0] = tick + 1
        if self.bank.force(signal, value):
            self._answer(Change(signal, value), tick, tick + 1)

    def release(self, name: str, tick: int) -> None:
        """End forcing. Raises KeyError for an unknown signal."""
        signal = self.bank.resolve(name)
        self._changed[0] = tick + 1
        if self.bank.release(signal):
            self._answer(Change(signal, self.bank.read(signal)), tick, tick + 1)


def _causes(answer: Answer) -> list[Change]:
    """What may bring an answer about: a signal, or any robot's flag that completes those of all."""
    target = answer.cause.target
    if isinstance(target, MFlag):
        return [Change(flag, answer.cause.value) for flag in _flags(answer, target)]
    return [answer.cause]


def _flags(answer: Answer, flag: MFlag) -> list[MFlag]:
    return [MFlag(flag.index, robot) for robot in answer.robots]
