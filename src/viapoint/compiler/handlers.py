"""Subroutines that interrupt or handle errors: what may not stand in them, and what only there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from viapoint.compiler.findings import Findings
from viapoint.compiler.labels import Definition
from viapoint.language import tree
from viapoint.language.tree import name_key, statement_span

_On = tree.On | tree.OnError


def check_handlers(
    statements: Sequence[tree.Statement], defined: Mapping[str, Definition], findings: Findings
) -> None:
    """Look at the subroutines of all `ON`, at those that they call, and at every `OFF`."""
    ons = [each for each in statements if isinstance(each, tree.On | tree.OnError)]
    handlers = {name_key(each.label): each for each in ons}
    handles = {name_key(each.label) for each in ons if isinstance(each, tree.OnError)}
    bodies = _Bodies(statements, defined) if handlers else None
    decided: set[int] = set()
    seen: set[str] = set()
    for key, on in handlers.items():
        if bodies is None or key not in defined:
            continue
        body = bodies.of(key)
        _check_tracks(body, on, findings)
        if key in handles:
            decided.update(each.start for each in body if isinstance(each, tree.Decision))
        for called in bodies.called(key):
            if called not in seen:
                seen.add(called)
                _check_jumps(bodies.of(called), on, defined, findings)
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


class _Bodies:
    """The subroutines of a program, from a label to the first END outside any block."""

    def __init__(self, statements: Sequence[tree.Statement], defined: Mapping[str, Definition]) -> None:
        self._statements = statements
        self._defined = defined
        self._positions = {each.start: k for k, each in enumerate(statements) if isinstance(each, tree.Label)}

    def of(self, key: str) -> list[tree.Statement]:
        """The body of a label that is defined."""
        first = self._positions[self._defined[key].statement.start]
        body, depth = [], 0
        for statement in self._statements[first:]:
            body.append(statement)
            if isinstance(statement, tree.If):
                depth += 1
            elif isinstance(statement, tree.EndIf):
                depth -= 1
            elif isinstance(statement, tree.End) and depth <= 0:
                break
        return body

    def called(self, key: str) -> Iterator[str]:
        """A subroutine and all that it calls, each once."""
        waiting, known = [key], {key}
        while waiting:
            key = waiting.pop()
            yield key
            for each in self.of(key):
                if isinstance(each, tree.Sub) and (called := name_key(each.label)) in self._defined:
                    waiting += [called] if called not in known else []
                    known.add(called)


def _check_tracks(body: Sequence[tree.Statement], on: _On, findings: Findings) -> None:
    for statement in body:
        if isinstance(statement, tree.Track):
            findings.add(
                "E215",
                statement_span(statement),
                f"`{on.label}` interrupts the program: it cannot follow a conveyor, or leave one",
                "follow the conveyor in the program itself",
                (statement_span(on), f"this lets `{on.label}` interrupt"),
            )


def _check_jumps(
    body: Sequence[tree.Statement], on: _On, defined: Mapping[str, Definition], findings: Findings
) -> None:
    label, begin, end = body[0], body[0].start, body[-1].end
    assert isinstance(label, tree.Label), "a subroutine begins with one"
    who = f"`{label.name}`, which interrupts the program"
    if name_key(label.name) != name_key(on.label):
        who = f"`{label.name}`, which `{on.label}` calls,"
    for statement in body:
        if not isinstance(statement, tree.Goto | tree.WaitFor) or statement.label is None:
            continue
        target = defined.get(name_key(statement.label))
        if target is not None and not begin <= target.statement.start < end:
            findings.add(
                "E214",
                findings.label_span(statement, statement.label),
                f"a jump out of {who} and has to come back",
                "let it run to its END; the program can ask afterwards for an output or M that it sets",
                (statement_span(on), f"this lets `{on.label}` interrupt"),
            )
