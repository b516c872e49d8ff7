"""A tree as readable text, one statement per line: what the golden tests compare."""

from __future__ import annotations

from typing import assert_never

from viapoint.language import tree
from viapoint.language.commands import SETTLED
from viapoint.language.lexical import parameter_spans


def dump(program: tree.Program) -> str:
    """All statements: line, columns of the statement, kind and contents; parameters with their columns."""
    source = program.source
    lines = []
    for statement in program.statements:
        base = source.line_start(statement.line)
        place = f"{statement.line}:{statement.start - base + 1}-{statement.end - base + 1}"
        lines.append(f"{place:<10} {_statement(program, statement, base)}")
    return "\n".join(lines)


def _statement(program: tree.Program, statement: tree.Statement, base: int) -> str:
    name = type(statement).__name__
    match statement:
        case tree.Motion():
            spans = parameter_spans(program.source, statement)
            values: list[float | str] = [*statement.values]
            for at, point in statement.names:
                values[at] = point
            pairs = zip(statement.layout.codes, values, spans, strict=True)
            shown = (f"{key} {value!r} @{span.start - base + 1}" for key, value, span in pairs)
            return f"{statement.command} {', '.join(shown)}".rstrip()
        case tree.If() | tree.ElseIf():
            ahead = " ahead" if statement.ahead else ""
            return f"{name}{ahead} {condition(statement.condition, statement.start - base + 1)}"
        case tree.WaitFor():
            limit = "" if statement.timeout is None else f" timeout {statement.timeout!r}"
            otherwise = "" if statement.label is None else f" else {statement.label}"
            return f"{name} {condition(statement.condition, statement.start - base + 1)}{limit}{otherwise}"
        case tree.On():
            watched = condition(statement.condition, statement.start - base + 1)
            return f"{name} {watched} sub {statement.label}"
        case tree.OnError():
            return f"{name} sub {statement.label}"
        case tree.Off():
            return f"{name} {statement.label}"
        case tree.Until():
            kept = "" if statement.capture is None else f" capture P{statement.capture}"
            return f"{name} {condition(statement.condition, statement.start - base + 1)}{kept}"
        case tree.At():
            place = f"{statement.origin} {statement.value!r}"
            return f"{name} {place}: {_statement(program, statement.action, base)}"
        case tree.Let(variable=variable, value=value) | tree.Inc(variable=variable, by=value):
            column = statement.start - base + 1
            return f"{name} {condition(variable, column)} {condition(value, column)}"
        case tree.Goto() | tree.Sub():
            return f"{name} {statement.label}" + ("" if statement.times is None else f" x {statement.times}")
        case tree.Label():
            return f"{name} {statement.name}"
        case tree.Else() | tree.EndIf() | tree.End() | tree.Sync():
            return name
        case tree.Retry() | tree.ResumeNext() | tree.Stop():
            return name
        case (
            tree.SelectTool()
            | tree.Track()
            | tree.Tangent()
            | tree.Wait()
            | tree.WaitInput()
            | tree.SetOutput()
            | tree.SetLevel()
            | tree.Pulse()
            | tree.MFunction()
        ):
            return f"{name} " + " ".join(f"{value!r}" for value in statement[3:])
    assert_never(statement)


def condition(node: tree.Value, column: int = 1) -> str:
    """A condition with the columns of its parts; `column` is that of its statement."""
    place = f"@{node.start + column}-{node.end + column}"
    match node:
        case tree.Signal():
            return f"{node.kind}{'' if node.kind in SETTLED else node.number}{place}"
        case tree.Number():
            return f"{node.value!r}{place}"
        case tree.Named():
            return f"{node.name}{place}"
        case tree.Variable():
            return f"${node.name}{place}"
        case tree.Truth():
            return f"{'TRUE' if node.value else 'FALSE'}{place}"
        case tree.Compare():
            return f"({condition(node.left, column)} {node.operator} {condition(node.right, column)}){place}"
        case tree.Not():
            return f"NOT({condition(node.operand, column)}){place}"
        case tree.And() | tree.Or():
            inner = ", ".join(condition(each, column) for each in node.operands)
            return f"{type(node).__name__.upper()}({inner}){place}"
    assert_never(node)
