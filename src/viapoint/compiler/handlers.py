"""Subroutines that interrupt, as the text has them: what may not stand in them, and OFF without its ON."""

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
    handlers = {name_key(each.label): each for each in statements if isinstance(each, tree.On)}
    if not handlers:
        positions: dict[int, int] = {}
    else:
        positions = {each.start: k for k, each in enumerate(statements) if isinstance(each, tree.Label)}
    for key, on in handlers.items():
        definition = defined.get(key)
        if definition is not None:
            body = list(_body(statements, positions[definition.statement.start]))
            _check_body(body, on, definition, defined, findings)
    for off in statements:
        if (
            isinstance(off, tree.Off)
            and name_key(off.label) in defined
            and name_key(off.label) not in handlers
        ):
            findings.add(
                "W509",
                statement_span(off),
                f"no ON switches `{off.label}` on",
                f"remove it, or write `ON … SUB {off.label}`",
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
    on: tree.On,
    handler: Definition,
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
