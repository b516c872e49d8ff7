"""Names of the cell in a program: which point, signal or variable is meant, and what is said if none is."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Final

from viapoint.compiler.cell_names import CellNames
from viapoint.compiler.findings import LISTED, Findings
from viapoint.language import tree
from viapoint.language.commands import LEVELS, NUMBERS, SIGNALS, SWITCHES
from viapoint.language.lexical import parameter_spans
from viapoint.language.source import Source, Span
from viapoint.language.suggestions import did_you_mean

_SIGNAL: Final = re.compile(r"([A-Z]+)([0-9]+)")

UNKNOWN: Final = 0
"""Stands for an index that is not known; there is an error then, and no program."""

_Read = tree.Signal | tree.Named


class Names:
    """Resolves the names of one program in one cell; None: no cell is known."""

    def __init__(self, cell: CellNames | None, findings: Findings, source: Source) -> None:
        self._known = cell is not None
        self._points = {} if cell is None else {tree.name_key(k): v for k, v in cell.point_names.items()}
        self._signals = {} if cell is None else {tree.name_key(k): v for k, v in cell.signal_names.items()}
        self._written = () if cell is None else (*cell.point_names, *cell.signal_names)
        shared = {} if cell is None else cell.variables
        self._variables = {tree.name_key(name): (name, switch) for name, switch in shared.items()}
        self._findings = findings
        self._source = source

    def motion(self, motion: tree.Motion) -> tree.Motion:
        """The motion with the indices of its points in place of their names; those unknown keep theirs."""
        values = list(motion.values)
        unknown = []
        for at, name in motion.names:
            span = parameter_spans(self._source, motion)[at]
            found = self._points.get(tree.name_key(name))
            if found is None:
                self._unknown("E228", "point", name, span, self._points)
                unknown.append((at, name))
            else:
                values[at] = found
        return motion._replace(values=tuple(values), names=tuple(unknown))

    def output(self, statement: tree.SetOutput | tree.SetLevel | tree.Pulse) -> int:
        """The index of the output of a statement."""
        if isinstance(statement.output, int):
            return statement.output
        kind = "AO" if isinstance(statement, tree.SetLevel) else "DO"
        found = self._signal(statement.output, (kind,), self._place(statement, statement.output))
        return UNKNOWN if found is None else found[1]

    def _place(self, statement: tree.PathAction, name: str) -> Span:
        text = self._source.text[statement.start : statement.end]
        behind_word = text.find(" ") if " " in text else 0
        found = re.compile(rf"\b{name}\b").search(text, behind_word)
        at = statement.start + (found.start() if found is not None else 0)
        return Span(at, at + len(name))

    def condition(self, condition: tree.Condition, start: int) -> tree.Condition:
        """The condition of the statement at `start` with the signals in place of their names."""
        match condition:
            case tree.Named():
                return self._in_condition(condition, start, tuple(SWITCHES))
            case tree.Variable():
                return self._variable(condition, start, switch=True) or condition
            case tree.Not():
                return condition._replace(operand=self.condition(condition.operand, start))
            case tree.And() | tree.Or():
                operands = tuple(self.condition(each, start) for each in condition.operands)
                return condition._replace(operands=operands)
            case tree.Compare():
                left, right = (self._comparable(each, start) for each in (condition.left, condition.right))
                return condition._replace(left=left, right=right)
            case _:
                return condition

    def _comparable(self, each: tree.Comparable, start: int) -> tree.Comparable:
        match each:
            case tree.Named():
                return self._in_condition(each, start, tuple(LEVELS))
            case tree.Variable():
                return self._variable(each, start, switch=False) or each
            case _:
                return each

    def assignment(self, statement: tree.Let | tree.Inc) -> tuple[tree.Variable, tree.Value]:
        """The variable that LET or INC writes, and its value, of the variable's kind."""
        start, written = statement.start, statement.variable
        value = statement.value if isinstance(statement, tree.Let) else statement.by
        wanted = None if isinstance(statement, tree.Let) else False
        variable = self._variable(written, start, switch=wanted)
        if variable is None:
            return written, tree.Number(value.start, value.end, 0.0)
        if variable.switch:
            if isinstance(value, tree.Number) or (isinstance(value, tree.Signal) and value.kind in NUMBERS):
                self._wrong_kind(f"`${variable.name}` is true or false; this is a number", value, start)
                return variable, tree.Truth(value.start, value.end, False)
            return variable, self.condition(value, start)
        match value:
            case tree.Number() | tree.Named() | tree.Variable():
                return variable, self._comparable(value, start)
            case tree.Signal(kind=kind) if kind in NUMBERS:
                return variable, value
        self._wrong_kind(f"`${variable.name}` is a number; this is true or false", value, start)
        return variable, tree.Number(value.start, value.end, 0.0)

    def _wrong_kind(self, message: str, node: tree.Value, start: int, hint: str | None = None) -> None:
        self._findings.add("E234", Span(start + node.start, start + node.end), message, hint)

    def _variable(self, each: tree.Variable, start: int, *, switch: bool | None) -> tree.Variable | None:
        """The variable as the cell declares it, which has to be of a kind; None: that is an error."""
        span = Span(start + each.start, start + each.end)
        found = self._variables.get(tree.name_key(each.name))
        if found is None:
            self._no_variable(each.name, span)
            return None
        name, is_switch = found
        if switch is not None and is_switch is not switch:
            if switch:
                message, hint = f"`${name}` is a number", f"compare it: `${name} > 0`"
            else:
                message, hint = f"`${name}` is true or false; a number has to stand here", None
            self._wrong_kind(message, each, start, hint)
            return None
        return tree.Variable(each.start, each.end, name, is_switch)

    def _no_variable(self, name: str, span: Span) -> None:
        if not self._known:
            message = f"what `${name}` is stands in the cell file, and no cell is given"
            self._findings.add("E212", span, message, "compile with --cell")
            return
        declared = [f"${each}" for each, _ in self._variables.values()]
        hint = did_you_mean(f"${name}", declared) or (
            f"declared are {', '.join(sorted(declared)[:LISTED])}"
            if declared
            else f"declare it in the cell file, under [variables]: {name} = 0"
        )
        self._findings.add("E233", span, f"the cell declares no variable `${name}`", hint)

    def _in_condition(self, named: tree.Named, start: int, kinds: tuple[str, ...]) -> _Read:
        span = Span(start + named.start, start + named.end)
        found = self._signal(named.name, kinds, span)
        return named if found is None else tree.Signal(named.start, named.end, *found)

    def _signal(self, name: str, kinds: tuple[str, ...], span: Span) -> tuple[str, int] | None:
        """Kind and index of a signal, which has to be of one of the kinds; None: that is an error."""
        text = self._signals.get(tree.name_key(name))
        found = None if text is None else _SIGNAL.fullmatch(text)
        if found is None:
            self._unknown("E229", "signal", name, span, self._signals)
            return None
        kind, index = found[1], int(found[2])
        if kind not in kinds:
            wanted = " or ".join(SIGNALS[each] for each in kinds)
            message = f"`{name}` is {text}, a {SIGNALS[kind]}; a {wanted} has to stand here"
            hint = "an analog signal is compared with a number: `flow > 2.5`" if kind in LEVELS else None
            self._findings.add("E230", span, message.replace("a analog", "an analog"), hint)
            return None
        return kind, index

    def _unknown(self, code: str, what: str, name: str, span: Span, defined: Mapping[str, object]) -> None:
        if not self._known:
            message = f"which {what} `{name}` is stands in the cell file, and no cell is given"
            self._findings.add("E212", span, message, "compile with --cell, or write the number")
            return
        names = [each for each in self._written if tree.name_key(each) in defined]
        variables = [f"${each}" for each, _ in self._variables.values()] if what == "signal" else []
        hint = did_you_mean(name, (*names, *variables)) or _listed(what, names)
        self._findings.add(code, span, f"the cell has no {what} of the name `{name}`", hint)


def _listed(what: str, names: Iterable[str]) -> str:
    ordered = sorted(names)
    if not ordered:
        return f"the cell names no {what}s"
    more = " and others" if len(ordered) > LISTED else ""
    return f"named are {', '.join(ordered[:LISTED])}{more}"
