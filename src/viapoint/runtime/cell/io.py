"""Signals of a cell, their names, M functions and the variables shared with the application."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from viapoint.language.suggestions import did_you_mean
from viapoint.language.tree import name_key
from viapoint.runtime.cell.checking import Checker
from viapoint.runtime.cell.model import Io, Signal, SignalKind
from viapoint.runtime.documents import Fault, Key

if TYPE_CHECKING:
    from viapoint.runtime.cell.schema import CellFile, IoSection

_M_INDEX = re.compile(r"0|[1-9][0-9]{0,8}")


def signal_fault(signal: Signal | None, text: str, io: Io) -> tuple[str, str] | None:
    """What is wrong with what `io.find` made of a text, and a hint; None where it exists."""
    if signal is None and text.startswith("$"):
        declare = f"declare it in the cell file, under [variables]: {text[1:]} = 0"
        near = did_you_mean(text, [f"${name}" for name in io.variables])
        return f"the cell declares no variable {text}", near or declare
    if signal is None:
        return f"{text!r} is no signal of this cell", "write DI3, DO1, AI2 or AO1, or a name of [io] names"
    if not io.exists(signal):
        return (
            f"{signal} does not exist",
            f"the cell has {signal.kind.value}1 … {signal.kind.value}{io.counts[signal.kind]}",
        )
    return None


def build_io(check: Checker, section: IoSection, variables: Mapping[str, bool | float]) -> Io:
    """Counts, names, process outputs and variables."""
    counts = {
        SignalKind.DIGITAL_INPUT: section.digital_inputs,
        SignalKind.DIGITAL_OUTPUT: section.digital_outputs,
        SignalKind.ANALOG_INPUT: section.analog_inputs,
        SignalKind.ANALOG_OUTPUT: section.analog_outputs,
    }
    bare = Io(counts=counts, names={}, process_outputs=frozenset())
    names: dict[str, Signal] = {}
    for name, text in section.names.items():
        check.check_name(("io", "names", name), name)
        check.check_word(("io", "names", name), name)
        if text.startswith("$"):
            message = f"{text} has its name already: only signals are named here"
            check.fault(Fault.REFERENCE, ("io", "names", name), message)
            continue
        signal = _signal(check, ("io", "names", name), text, bare)
        if signal is not None:
            names[name] = signal
    named = Io(counts=counts, names=names, process_outputs=frozenset())
    outputs = _process_outputs(check, section, named)
    return Io(counts=counts, names=names, process_outputs=outputs, variables=variables)


def _signal(check: Checker, key: Key, text: str, io: Io) -> Signal | None:
    signal = io.find(text)
    wrong = signal_fault(signal, text, io)
    if wrong is not None:
        check.fault(Fault.REFERENCE, key, *wrong)
        return None
    return signal


def _process_outputs(check: Checker, section: IoSection, io: Io) -> frozenset[int]:
    outputs: set[int] = set()
    for i, text in enumerate(section.process_outputs):
        key: Key = ("io", "process_outputs", i)
        signal = _signal(check, key, text, io)
        if signal is None:
            continue
        if signal.kind is not SignalKind.DIGITAL_OUTPUT:
            check.fault(Fault.REFERENCE, key, f"{signal} is not a digital output")
        outputs.add(signal.index)
    return frozenset(outputs)


def build_m_functions(check: Checker, file: CellFile) -> dict[int, bool]:
    """Index → whether it is synchronous."""
    functions: dict[int, bool] = {}
    for key, kind in file.m_functions.items():
        if _M_INDEX.fullmatch(key):
            functions[int(key)] = kind == "sync"
        else:
            check.fault(
                Fault.UNKNOWN_KEY,
                ("m_functions", key),
                f"unknown key m_functions.{key}",
                "write the number of the M function",
            )
    return functions


def build_variables(check: Checker, file: CellFile) -> dict[str, bool | float]:
    """Numbers and booleans by name."""
    variables: dict[str, bool | float] = {}
    known: dict[str, str] = {}
    for name, value in file.variables.items():
        key: Key = ("variables", name)
        check.check_name(key, name)
        other = known.setdefault(name_key(name), name)
        if other != name:
            check.fault(Fault.DUPLICATE, key, f"variables.{name} and variables.{other} are one name")
        elif not isinstance(value, bool | int | float):
            check.fault(Fault.TYPE, key, f"variables.{name} must be a number, true or false")
        elif not isinstance(value, bool) and not math.isfinite(value):
            check.fault(Fault.DOMAIN, key, f"variables.{name} must be a finite number, not {value}")
        else:
            variables[name] = value if isinstance(value, bool) else float(value)
    return variables
