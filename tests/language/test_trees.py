"""Trees of whole programs as golden texts; the listings of the book among them."""

from __future__ import annotations

from pathlib import Path

import pytest
from case_files import Case, read_listing

from viapoint.language.dump import dump
from viapoint.language.lexical import parameter_spans
from viapoint.language.parser import parse
from viapoint.language.source import Source
from viapoint.language.tree import Motion, condition_span, statement_span

LISTINGS = read_listing(Path(__file__).parent / "listings.via")


def tree_text(cases: list[Case]) -> str:
    parts = []
    for case in cases:
        result = parse(Source(case.name, case.text))
        assert result.diagnostics == (), case.name
        parts.append(f"--- {case.name}\n{dump(result.program)}\n")
    return "".join(parts)


def test_trees_are_the_golden_ones(check_golden) -> None:
    check_golden("language/trees.txt", tree_text(LISTINGS))


@pytest.mark.parametrize("case", LISTINGS, ids=lambda case: case.name)
def test_line_ends_and_byte_order_mark_change_no_value(case: Case) -> None:
    plain = parse(Source("a", case.text)).program.statements
    other = parse(Source("a", "\ufeff" + case.text.replace("\n", "\r\n")))
    assert other.ok
    assert [(type(s), s.line, *s[3:]) for s in other.program.statements] == [
        (type(s), s.line, *s[3:]) for s in plain
    ]


@pytest.mark.parametrize("case", LISTINGS, ids=lambda case: case.name)
def test_the_grammar_alone_makes_the_same_tree(case: Case) -> None:
    source = Source("a", case.text)
    assert parse(source, use_shapes=False) == parse(source)


def test_places_of_a_statement_its_parameters_and_its_condition() -> None:
    source = Source("a", "  ML P3 X2: // no\nL: MJ P1 J1=(2 * 45)  F5\n ELSE IF DI1 AND NOT DO 2\n")
    result = parse(source)
    label, motion, branch = result.program.statements
    assert isinstance(motion, Motion)
    assert source.slice(statement_span(label)) == "L"
    assert source.slice(statement_span(motion)) == "MJ P1 J1=(2 * 45)  F5"
    assert [source.slice(span) for span in parameter_spans(source, motion)] == ["P1", "J1=(2 * 45)", "F5"]
    assert motion.parameters == {"P": 1, "J1=": 90.0, "F": 5.0}
    assert source.slice(statement_span(branch)) == "ELSE IF DI1 AND NOT DO 2"
    second = branch.condition.operands[1]
    assert source.slice(condition_span(branch, second)) == "NOT DO 2"
    assert source.slice(condition_span(branch, second.operand)) == "DO 2"
