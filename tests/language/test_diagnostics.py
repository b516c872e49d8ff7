"""Diagnostics as data, as text and as JSON; files that are no programs."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

from viapoint.language.diagnostics import Diagnostic, Label, Severity, has_errors, sort_key
from viapoint.language.parser import MAX_ERRORS, parse
from viapoint.language.reading import decode, read_source
from viapoint.language.render import render, summary, to_json, to_text
from viapoint.language.source import Source, Span

PROGRAM = """MJ P1 F100
	MLL P2 // tab before
ML P1 P2
IF DI1 AND
GOTO
ML P1 X=1E1=500
PRINT "open
"""


def test_texts_are_the_golden_ones(check_golden) -> None:
    given = parse(Source("part.via", PROGRAM)).diagnostics
    places = (
        Diagnostic(code="E270", message="a key is missing", file="cell.toml", line=7, key="robot.model"),
        Diagnostic(code="W501", message="no line is known", file="cell.toml", key="points.P1", hint="add it"),
        Diagnostic(code="I601", message="nothing is known"),
        Diagnostic(code="E401", message="a line alone", source=Source("a.via", "END\nML P1\n"), line=2),
    )
    check_golden("language/diagnostics.txt", render([*given, *places]))
    check_golden("language/diagnostics_colour.txt", render(given[:2], colour=True).replace("\x1b", "<ESC>"))
    check_golden("language/diagnostics.json", json.dumps([to_json(d) for d in (*given, *places)], indent=1))


def test_labels_on_other_lines_have_excerpts_of_their_own() -> None:
    source = Source("a.via", "A:\nML P1\nA:\n")
    label = Label(Span(0, 1), "first declared here")
    text = to_text(
        Diagnostic(code="E202", message="label twice", source=source, span=Span(9, 10), labels=(label,))
    )
    assert text.splitlines()[3:] == ["1 | A:", "  | - first declared here", "3 | A:", "  | ^"]


def test_long_lines_are_cut_around_the_place() -> None:
    source = Source("a.via", "ML " + " " * 3000 + "P1 P2")
    text = render(parse(source).diagnostics)
    assert max(map(len, text.splitlines())) < 200
    assert "P1 P2" in text


def test_severities_order_and_summary() -> None:
    error = Diagnostic(code="E101", message="", file="b", line=2)
    warning = Diagnostic(code="W501", message="", file="b", line=1)
    info = Diagnostic(code="I601", message="", file="a", line=9)
    assert [d.severity for d in (error, warning, info)] == list(Severity)
    assert sorted([error, warning, info], key=sort_key) == [info, warning, error]
    assert has_errors([warning, error])
    assert not has_errors([warning, info])
    assert summary([error, error, warning, info]) == "2 errors, 1 warning, 1 info"
    assert summary([]) == "no problems"


def test_positions_count_characters_from_one() -> None:
    source = Source("a", "äö\n\nx")
    assert [source.position(offset) for offset in (0, 2, 3, 4, 5)] == [(1, 1), (1, 3), (2, 1), (3, 1), (3, 2)]
    assert source.line_text(1) == "äö"
    assert source.line_text(3) == "x"


@pytest.mark.parametrize(
    ("data", "code", "place"),
    [
        (b"ML P1\nML P\xff2\n", "E101", (2, 5, 2, 6)),
        (b"\xff\xfeM\0L\0", "E101", (1, 1, 1, 2)),
        (b"ML P1 \xc3", "E101", (1, 7, 1, 8)),
        (b"\xef\xbb\xbfML\n\xe4", "E101", (2, 1, 2, 2)),
        (b"ML P1\nM\0", "E102", (2, 2, 2, 3)),
    ],
)
def test_files_that_are_no_text(tmp_path: Path, data: bytes, code: str, place: tuple[int, ...]) -> None:
    path = tmp_path / "part.via"
    path.write_bytes(data)
    source, diagnostics = read_source(path)
    assert source is None
    assert [(d.code, d.extent) for d in diagnostics] == [(code, place)]
    assert render(diagnostics)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    for path in (tmp_path / "missing.via", tmp_path, "a\0b"):
        source, diagnostics = read_source(path)
        assert source is None
        assert [d.code for d in diagnostics] == ["E100"]
        assert diagnostics[0].file_name == str(path)


def test_files_that_are_programs(tmp_path: Path) -> None:
    path = tmp_path / "part.via"
    path.write_bytes(b"\xef\xbb\xbfML P1\r\n// \xc3\xa4\r\n")
    source, diagnostics = read_source(path)
    assert diagnostics == ()
    assert source is not None
    assert source.text == "ML P1\r\n// ä\r\n"
    assert parse(source).ok
    empty = decode("empty.via", b"").source
    assert empty is not None
    assert parse(empty).program.statements == ()


@pytest.mark.parametrize(
    "text",
    [
        "A" * 10_000_000,
        "(" * 10_000_000,
        "1 " * 5_000_000,
        "1E" * 5_000_000,
        '"' * 10_000_000,
        "//" + "x" * 10_000_000,
        "ML P1\n" + "." * 10_000_000 + "\nML P2",
    ],
    ids=lambda text: repr(text[:3]),
)
def test_a_line_of_ten_megabytes_is_one_diagnostic_at_once(text: str) -> None:
    begin = time.perf_counter()
    diagnostics = parse(Source("long.via", text)).diagnostics
    assert [d.code for d in diagnostics] == ["E103"]
    assert len(render(diagnostics)) < 1000
    assert time.perf_counter() - begin < 2.0  # ordinarily 0.01 s; anything quadratic takes minutes


@pytest.mark.parametrize(
    "text",
    [
        "IF " + "(" * 4000,
        "ML P" + "(" * 4000,
        "IF " + "NOT " * 1000 + "DI1",
        "IF " + "-" * 4000 + "1 < 2",
        "ML P1 F" + "1" * 4000,
        "ML X=1E" + "1" * 4000,
        "ML " + "P1" * 2000,
        "ML " + "P1 " * 1000,
    ],
    ids=lambda text: text[:7],
)
def test_mangled_statements_end_quickly(text: str) -> None:
    begin = time.perf_counter()
    assert not parse(Source("mangled.via", text)).ok
    assert time.perf_counter() - begin < 2.0


def test_too_many_errors_end_the_reading() -> None:
    result = parse(Source("no_program.via", "what is this\n" * 100_000))
    assert [d.code for d in result.diagnostics] == ["E110"] * MAX_ERRORS + ["E139"]


def test_conditions_nest_to_a_limit() -> None:
    assert parse(Source("a", "IF " + "(" * 64 + "DI1" + ")" * 64)).ok
    result = parse(Source("a", "IF " + "(" * 65 + "DI1" + ")" * 65))
    assert [d.code for d in result.diagnostics] == ["E119"]
