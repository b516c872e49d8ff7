"""Lowers what happens on the path without a motion: outputs, variables, M functions, and these behind AT."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from viapoint.compiler.cell_checks import CellChecks
from viapoint.compiler.conditions import ConditionLowering
from viapoint.compiler.emitter import Emitter
from viapoint.compiler.findings import Findings
from viapoint.compiler.flow import Flow
from viapoint.compiler.names import Names
from viapoint.language import tree
from viapoint.language.tree import statement_span
from viapoint.vm.instructions import Instruction
from viapoint.vm.ports import Origin

_I = Instruction
_ORIGINS = {"D": Origin.START, "D-": Origin.END, "S-": Origin.TIME, "%": Origin.PART}

Handler = Callable[[Any], None]


class ActionLowering(Emitter):
    """The actions of one program."""

    _cell: CellChecks | None
    _names: Names
    _findings: Findings
    _flow: Flow
    _conditions: ConditionLowering
    _handlers: dict[type, Handler]
    _place: tuple[int, int] | None = None  # where on the next motion the action being lowered stands

    def _set_output(self, statement: tree.SetOutput) -> None:
        self._emit(_I.SET_OUTPUT, self._output("DO", statement), int(statement.value))

    def _set_level(self, statement: tree.SetLevel) -> None:
        self._emit(_I.SET_LEVEL, self._output("AO", statement), self._number(statement.value))

    def _pulse(self, statement: tree.Pulse) -> None:
        self._emit(_I.PULSE, self._output("DO", statement), self._number(statement.seconds))

    def _let(self, statement: tree.Let) -> None:
        variable, value = self._names.assignment(statement)
        self._write(statement, variable, value, _I.LET_BOOLEAN if variable.switch else _I.LET_NUMBER)

    def _inc(self, statement: tree.Inc) -> None:
        variable, value = self._names.assignment(statement)
        self._write(statement, variable, value, _I.INCREMENT)

    def _write(
        self, statement: tree.Let | tree.Inc, variable: tree.Variable, value: tree.Value, write: Instruction
    ) -> None:
        """The value on the stack, read behind a barrier where it is read, and the variable that gets it."""
        lowered = self._conditions.lower(value)
        if lowered.reads:
            word = "INC" if write is _I.INCREMENT else "LET"
            equals = "" if write is _I.INCREMENT else " ="
            self._emit(_I.BARRIER, self._text(f"{word} ${variable.name}{equals} {lowered.text}"))
            self._flow.exact_stop(word)
            self._flow.takes_time()
            if self._cell:
                self._cell.condition(lowered.reads, statement.start)
        self._code += lowered.code
        if self._place is not None:
            self._emit(_I.AT, *self._place)
        self._emit(write, self._text(variable.name))

    def _output(self, kind: str, statement: tree.SetOutput | tree.SetLevel | tree.Pulse) -> int:
        index = self._names.output(statement)
        if self._cell and isinstance(statement.output, int):
            self._cell.signal(kind, index, statement_span(statement))
        return index

    def _at(self, statement: tree.At) -> None:
        place, action = (_ORIGINS[statement.origin].value, self._number(statement.value)), statement.action
        if isinstance(action, tree.Let | tree.Inc):  # their value goes before
            self._place = place
            self._handlers[action.__class__](action)
            self._place = None
            return
        self._emit(_I.AT, *place)
        if not isinstance(action, tree.MFunction):
            self._handlers[action.__class__](action)
            return
        self._emit(_I.RAISE_M, action.function)
        if self._cell and self._cell.is_synchronous(action.function):
            self._findings.add(
                "E213",
                statement_span(statement),
                f"M{action.function} is synchronous: the robot would have to stop on the motion for it",
                "declare it async under [m_functions] of the cell, or put it behind the motion",
            )

    def _m_function(self, statement: tree.MFunction) -> None:
        self._emit(_I.RAISE_M, statement.function)
        self._flow.takes_time()
        if self._cell and self._cell.is_synchronous(statement.function):
            self._flow.exact_stop(f"synchronous M{statement.function}")
