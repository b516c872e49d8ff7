"""Scenario files: read, checked as a whole against a cell, built."""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from viapoint.language.diagnostics import Diagnostic
from viapoint.language.source import Source
from viapoint.language.units import MM
from viapoint.runtime.cell import Cell, Signal, SignalKind, signal_fault
from viapoint.runtime.documents import (
    SCENARIO_CODES,
    Document,
    DocumentError,
    Fault,
    Key,
    check,
    parse_document,
    read_document,
)
from viapoint.runtime.signals.scenario import (
    Answer,
    BeltScript,
    Change,
    CorrectionScript,
    Floats,
    MFlag,
    Scenario,
    Timed,
)

if TYPE_CHECKING:
    from viapoint.runtime.signals import schema

_OUTPUTS = (SignalKind.DIGITAL_OUTPUT, SignalKind.ANALOG_OUTPUT)
_ANALOG = (SignalKind.ANALOG_INPUT, SignalKind.ANALOG_OUTPUT)


class ScenarioError(DocumentError):
    """A scenario that cannot be used; `diagnostics` holds every reason, each with key and line."""


def load_scenario(path: str | Path, cell: Cell) -> Scenario:
    """The scenario of a file, for a cell. Raises ScenarioError with all diagnostics."""
    try:
        document = read_document(Path(path), SCENARIO_CODES)
    except DocumentError as error:
        raise ScenarioError(error.diagnostics) from None
    return _Builder(document, cell).build()


def parse_scenario(text: str, cell: Cell, name: str = "<scenario>") -> Scenario:
    """The scenario of a text, for a cell. Raises ScenarioError with all diagnostics."""
    try:
        document = parse_document(name, text, SCENARIO_CODES)
    except DocumentError as error:
        raise ScenarioError(error.diagnostics) from None
    return _Builder(document, cell).build()


class _Builder:
    def __init__(self, document: Document, cell: Cell) -> None:
        self.document = document
        self.cell = cell
        self.faults: list[Diagnostic] = []
        self.dropped: frozenset[Key] = frozenset()

    def build(self) -> Scenario:
        from viapoint.runtime.signals.schema import ScenarioFile

        checked = check(self.document, ScenarioFile)
        file = checked.model
        if file is None:
            raise ScenarioError(checked.faults)
        self.dropped = checked.dropped
        self._once([section.index for section in file.conveyor])
        scenario = Scenario(
            seed=file.seed,
            timed=tuple(
                Timed(section.t_s, self._changes(("at", i, "set"), section.set))
                for i, section in enumerate(file.at)
            ),
            answers=tuple(
                answer for i, each in enumerate(file.when) if (answer := self._answer(i, each)) is not None
            ),
            belts=tuple(self._belt(i, section) for i, section in enumerate(file.conveyor)),
            corrections=tuple(self._correction(i, section) for i, section in enumerate(file.correction)),
            source=Source(self.document.name, self.document.text),
        )
        if checked.faults or self.faults:
            raise ScenarioError([*checked.faults, *self.faults])
        return scenario

    def _fault(self, fault: Fault, key: Key, message: str, hint: str | None = None) -> None:
        if fault is Fault.MISSING_KEY and any(key[:-1] == other[:-1] for other in self.dropped):
            return  # it may be missing only because it was faulty
        self.faults.append(self.document.fault(fault, key, message, hint))

    # --- signals -----------------------------------------------------------------------------------

    def _signal(self, key: Key, text: str) -> Signal | None:
        io = self.cell.io
        signal = io.find(text)
        wrong = signal_fault(signal, text, io)
        if wrong is None:
            return signal
        message, hint = wrong
        near = difflib.get_close_matches(text, io.names, n=1)
        self._fault(Fault.REFERENCE, key, message, f"did you mean `{near[0]}`?" if near else hint)
        return None

    def _changes(self, key: Key, given: dict[str, Any]) -> tuple[Change, ...]:
        """`{ DI3 = true, "$count" = 3 }`; inputs and variables can be set, outputs belong to the program."""
        changes: list[Change] = []
        for text, value in given.items():
            here: Key = (*key, text)
            signal = self._signal(here, text)
            if signal is None:
                continue
            if signal.kind in _OUTPUTS:
                self._fault(Fault.CONTRADICTION, here, f"{text} is an output: only the program sets it")
            elif self._is_value(here, signal, value):
                changes.append(Change(signal, value if isinstance(value, bool) else float(value)))
        return tuple(changes)

    def _is_value(self, key: Key, signal: Signal, value: Any) -> bool:
        if self.cell.io.is_switch(signal):
            if not isinstance(value, bool):
                self._fault(Fault.TYPE, key, f"{signal} must be true or false")
                return False
            return True
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._fault(Fault.TYPE, key, f"{signal} must be a number")
            return False
        if not math.isfinite(value):
            self._fault(Fault.DOMAIN, key, f"{signal} must be a finite number, not {value}")
            return False
        return True

    # --- sections ----------------------------------------------------------------------------------

    def _answer(self, i: int, section: schema.WhenSection) -> Answer | None:
        key: Key = ("when", i)
        cause = self._cause(key, section)
        changes = self._changes((*key, "set"), section.set)
        if section.reset_m is not None:
            flags = (MFlag(section.reset_m, robot) for robot in section.robots)
            changes = (*changes, *(Change(flag, False) for flag in flags))
        elif not section.set:
            self._fault(Fault.MISSING_KEY, (*key, "set"), "when: there is no answer", "add set or reset_m")
        if cause is None:
            return None
        return Answer(cause, section.after_s, changes, tuple(section.robots))

    def _cause(self, key: Key, section: schema.WhenSection) -> Change | None:
        if section.signal is None and section.m is None:
            self._fault(Fault.MISSING_KEY, (*key, "signal"), "when: there is no cause", "add signal or m")
            return None
        if section.m is not None:
            if section.signal is not None:
                self._fault(
                    Fault.CONTRADICTION, (*key, "m"), "when: signal and m are two causes", "keep one of them"
                )
            return Change(MFlag(section.m), True)
        assert section.signal is not None
        signal = self._signal((*key, "signal"), section.signal)
        if signal is None:
            return None
        if signal.kind in _ANALOG:
            self._fault(
                Fault.CONTRADICTION,
                (*key, "signal"),
                f"{signal} is not digital: it becomes neither true nor false",
            )
            return None
        becomes, here = section.becomes, (*key, "becomes")
        if "becomes" not in section.model_fields_set and not self.cell.io.is_switch(signal):
            self._fault(Fault.MISSING_KEY, here, f"when: {signal} is a number", "say which: becomes = 3")
            return None
        if not self._is_value(here, signal, becomes):
            return None
        return Change(signal, becomes if isinstance(becomes, bool) else float(becomes))

    def _once(self, indices: Sequence[int]) -> None:
        for i, index in enumerate(indices):
            if index in indices[:i]:
                self._fault(Fault.DUPLICATE, ("conveyor", i, "index"), f"conveyor {index} is described twice")

    def _belt(self, i: int, section: schema.ConveyorSection) -> BeltScript:
        if section.index not in self.cell.conveyors:
            self._fault(
                Fault.REFERENCE, ("conveyor", i, "index"), f"the cell has no conveyor {section.index}"
            )
        times, speeds = self._breakpoints(("conveyor", i, "speed_mm_s"), section.speed_mm_s)
        return BeltScript(section.index, times, speeds, section.noise_counts)

    def _correction(self, i: int, section: schema.CorrectionSection) -> CorrectionScript:
        axes = tuple(
            None if points is None else self._breakpoints(("correction", i, name), points)
            for name, points in (("x_mm", section.x_mm), ("y_mm", section.y_mm), ("z_mm", section.z_mm))
        )
        return CorrectionScript(section.frame, axes, section.max_rate_mm_s * MM)

    def _breakpoints(self, key: Key, points: Sequence[Sequence[float]]) -> tuple[Floats, Floats]:
        table = np.array(points, dtype=np.float64)
        if (np.diff(table[:, 0]) <= 0.0).any():
            self._fault(Fault.CONTRADICTION, key, "the times of the breakpoints must increase")
        return table[:, 0], table[:, 1] * MM
