"""Subroutines that interrupt or handle errors: what may not stand in them, and what only there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from viapoint.compiler.findings import Findings
from viapoint.compiler.labels import Definition
from viapoint.language import tree
from viapoint.language.tree import name_key, statement_span


def check_handlers(
    statements: Sequence[tree.Statement], defined: Mapping[str, Definition], findings: Findings
) -> None:
    """Look at the subroutines of all `ON`, each once, and at every `OFF`."""
    ons = [each for each in statements if isinstance(each, tree.On | tree.OnError)]
    handlers = {name_key(each.label): each for each in ons}
    handles = {name_key(each.label) for each in ons if isinstance(each, tree.OnError)}
    positions = {}
    if handlers:
        positions = {each.start: k for k, each in enumerate(statements) if isinstance(each, tree.Label)}
    decided: set[int] = set()
    for key, on in handlers.items():
        definition = defined.get(key)
        if definition is not None:
            body = list(_body(statements, positions[definition.statement.start]))
            _check_body(body, on, defined, findings)
            if key in handles:
                decided.update(each.start for each in body if isinstance(each, tree.Decision))
    for each in statements:
        if isinstance(each, tree.Off):
            key = name_key(each.label)
            if key in defined and key not in handlers:
                hint = f"remove it, or write `ON … SUB {each.label}`"
                findings.add("W509", statement_span(each), f"no ON switches `{each.label}` on", hint)
        elif isinstance(each, tree.Decision) and each.start not in decided:
            findings.add(
                "E216",
                statement_span(each),
                "this stands in no subroutine that handles errors",
                "it belongs into the lines from the label of an `ON ERROR SUB` to their END",
            )


def _body(statements: Sequence[tree.Statement], first: int) -> Iterator[tree.Statement]:
    """From a label to the first END outside any block."""
    depth = 0
    for statement in statements[first:]:
        yield statement
        if isinstance(statement, tree.If):
            depth += 1
        elif isinstance(statement, tree.EndIf):
            depth -= 1
        elif isinstance(statement, tree.End) and depth <= 0:
            return


def _check_body(
    body: Sequence[tree.Statement],
    on: tree.On | tree.OnError,
    defined: Mapping[str, Definition],
    findings: Findings,
) -> None:
    begin, end = body[0].start, body[-1].end
    interrupts = (statement_span(on), f"this lets `{on.label}` interrupt")
    for statement in body:
        if isinstance(statement, tree.Track):
            findings.add(
                "E215",
                statement_span(statement),
                f"`{on.label}` interrupts the program: it cannot follow a conveyor, or leave one",
                "follow the conveyor in the program itself",
                interrupts,
            )
        elif isinstance(statement, tree.Goto | tree.WaitFor) and statement.label is not None:
            target = defined.get(name_key(statement.label))
            if target is not None and not begin <= target.statement.start < end:
                findings.add(
                    "E214",
                    findings.label_span(statement, statement.label),
                    f"a jump out of `{on.label}`, which interrupts the program and has to come back",
                    "let it run to its END; the program can ask afterwards for an output or M that it sets",
                    interrupts,
                )
