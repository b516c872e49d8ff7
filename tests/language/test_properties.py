"""What holds for every program: the fast path agrees with the grammar, nothing raises, places are real."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from case_files import read_cases, read_listing
from hypothesis import example, given, settings
from hypothesis import strategies as st
from programs import MOTIONS_OF_SEEDS, PROGRAMS, line, mutated

from viapoint.language.commands import MAX_AXIS
from viapoint.language.dump import dump
from viapoint.language.lexical import parameter_spans
from viapoint.language.lines import LineReader
from viapoint.language.parser import BLOCK, ParseResult, parse
from viapoint.language.render import render, to_json
from viapoint.language.shapes import quick
from viapoint.language.source import Source
from viapoint.language.tree import Motion, statement_span

HERE = Path(__file__).parent
TEXTS = [case.text for case in [*read_listing(HERE / "listings.via"), *read_cases(HERE / "cases")]]
FUZZ_SEED = 4711
FUZZ_ROUNDS = 1500


def assert_places_are_real(result: ParseResult) -> None:
    """Every place lies in the text and every statement has a line of its own text."""
    source = result.program.source
    size = len(source.text)
    for diagnostic in result.diagnostics:
        span = diagnostic.span
        assert span is not None
        assert 0 <= span.start < span.end <= size, (diagnostic, source.text)
        for label in diagnostic.labels:
            assert 0 <= label.span.start < label.span.end <= size
        row, column, end_row, end_column = diagnostic.extent or (0, 0, 0, 0)
        assert row == end_row
        assert 1 <= column < end_column
        assert to_json(diagnostic)["line"] == row
    for statement in result.program.statements:
        span = statement_span(statement)
        assert 0 <= span.start < span.end <= size
        assert source.position(span.start)[0] == statement.line
        assert "\n" not in source.slice(span)
        if isinstance(statement, Motion):
            assert len(parameter_spans(source, statement)) == len(statement.values)
    dump(result.program)
    render(result.diagnostics)


@settings(max_examples=300, deadline=None)
@given(PROGRAMS)
@example("ML X=1E1=500\nML P1E3\nML P1.0\nWAIT 1E400")
@example("GOTO LOOP 0\nSUB A 1000000001\nIF DI70000\nIF DI1 AND DI2 OR DI3")
@example("SET\rDO 1\nML P1\r F5\r\r\nT\x0b1\nIF DI1\x1cAND DI2\nGOTO\x0cA\nA\x1f:")
@example("\rGOTO A\nML P1 F5.5.E1=3")
@example("ML P1 J1=5\nMJ P1 J01=5\nMJ P1 J33=5")
def test_fast_path_and_grammar_agree(text: str) -> None:
    source = Source("generated.via", text)
    fast, slow = parse(source), parse(source, use_shapes=False)
    assert fast == slow
    assert [type(each) for each in fast.program.statements] == [type(s) for s in slow.program.statements]
    assert [tuple(map(type, s)) for s in fast.program.statements] == [
        tuple(map(type, s)) for s in slow.program.statements
    ]
    assert_places_are_real(fast)


@settings(max_examples=200, deadline=None)
@given(MOTIONS_OF_SEEDS)
def test_canonical_motions_take_the_fast_path(text: str) -> None:
    reader = LineReader(Source("generated.via", text), use_shapes=False)
    reader.read(1, 0, text)
    made = quick(text, 1, 0)
    if reader.diagnostics:
        assert made is None
    elif made is not None:
        assert [made] == reader.statements


@pytest.mark.parametrize(
    "text", ["ML P1 F100 Z1 T1 R5", "MJ X=1 Y=-2.5 Z=3 A=1E2 J1=0 E1=5", "SET DO 3", "m5"]
)
def test_plain_statements_need_no_grammar(text: str) -> None:
    assert quick(text, 1, 0) is not None


def test_every_joint_takes_the_fast_path() -> None:
    for axis in range(1, MAX_AXIS + 1):
        assert quick(f"MJ P1 J{axis}=-5.5", 1, 0) is not None


@settings(max_examples=150, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_judged_without_an_exception(text: str) -> None:
    source = Source("any.via", text)
    result = parse(source)
    assert result == parse(source, use_shapes=False)
    assert_places_are_real(result)


def test_mutated_programs_are_judged_without_an_exception() -> None:
    generator = random.Random(FUZZ_SEED)
    for round_number in range(FUZZ_ROUNDS):
        seed = generator.getrandbits(32)
        text = generator.choice(TEXTS) if seed % 2 else "\n".join(line(generator) for _ in range(6))
        text = mutated(text, seed)
        source = Source("mutated.via", text)
        try:
            result = parse(source)
            assert_places_are_real(result)
            if round_number % 4 == 0:
                assert parse(source, use_shapes=False) == result
        except BaseException:
            print(f"reproduce: seed {seed}, text {text!r}")
            raise


PADDING = "a long comment " * 6


def test_blocks_change_nothing() -> None:
    text = "\n".join(
        f"L{i}: ML P{i} F{i + 0.5} // {i} # {PADDING}" if i % 7 else f"IF DI{i % 30}" for i in range(2499)
    )
    assert len(text) > 3 * BLOCK
    result = parse(Source("long.via", text))
    assert result.ok
    assert [s.line for s in result.program.statements][-1] == 2499
    assert_places_are_real(result)
    tail = parse(Source("tail.via", text[text.rindex("L2498") :]))
    assert [tuple(s[3:]) for s in tail.program.statements] == [
        tuple(s[3:]) for s in result.program.statements[-2:]
    ]
