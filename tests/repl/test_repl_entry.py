"""When lines make something complete, and what it is."""

from __future__ import annotations

import pytest

from viapoint.repl.entry import Collector, Kind, references

CASES = [
    ("ML P1", Kind.PROGRAM),
    ("  :load part.via", Kind.COMMAND),
    ("", Kind.NOTHING),
    ("   ", Kind.NOTHING),
    ("IF DI3|ML P1|ENDIF", Kind.PROGRAM),
    ("if DI3|if DI4|ML P1|endif|ELSE|ML P2|endif // done", Kind.PROGRAM),
    ("A:|ML P1|END", Kind.SUBROUTINE),
    ("A: ML P1|IF DI3|END|ENDIF|END", Kind.SUBROUTINE),
    ("A:|ML P1|GOTO A", Kind.PROGRAM),
    ("A:|ML P1|B:|ML P2|GOTO B 3|GOTO a 2", Kind.PROGRAM),
    ("ML P1 R5 \\|ML P2", Kind.PROGRAM),
    ("A:|ML P1|", Kind.PROGRAM),
    ("IF DI3|", Kind.PROGRAM),
    ("IF DI3 // :not a command|ML P1|ENDIF", Kind.PROGRAM),
    ("END", Kind.PROGRAM),
    ("ENDIF", Kind.PROGRAM),
    ("AT D20 SET DO1|ML P1", Kind.PROGRAM),
]


@pytest.mark.parametrize(("text", "kind"), CASES)
def test_complete_with_the_last_line_only(text: str, kind: Kind) -> None:
    collector = Collector()
    *before, last = text.split("|")
    for line in before:
        assert collector.feed(line) is None
        assert collector.pending
    entry = collector.feed(last)
    assert entry is not None
    assert entry.kind is kind
    assert not collector.pending
    if kind in (Kind.PROGRAM, Kind.SUBROUTINE):
        lines = [line.rstrip().removesuffix("\\") for line in text.split("|") if line]
        assert entry.text.splitlines() == lines


def test_a_backslash_is_no_part_of_the_program() -> None:
    collector = Collector()
    collector.feed("ML P1 \\")
    entry = collector.feed("ML P2")
    assert entry is not None
    assert entry.text == "ML P1 \nML P2\n"


def test_a_command_does_not_disturb_a_block() -> None:
    collector = Collector()
    collector.feed("IF DI3")
    command = collector.feed(":io DI3 on")
    assert command is not None
    assert command.kind is Kind.COMMAND
    assert collector.pending
    entry = collector.feed("ENDIF")
    assert entry is not None
    assert entry.text == "IF DI3\nENDIF\n"


def test_what_is_dropped_leaves_nothing() -> None:
    collector = Collector()
    collector.feed("IF DI3")
    collector.drop()
    entry = collector.feed("ML P1")
    assert entry is not None
    assert entry.text == "ML P1\n"


def test_the_end_of_the_input_closes_what_is_open() -> None:
    collector = Collector()
    assert collector.rest() is None
    collector.feed("IF DI3")
    entry = collector.rest()
    assert entry is not None
    assert entry.text == "IF DI3\n"


def test_references() -> None:
    assert references("SUB A 2\nGOTO B // SUB C\nsub d") == ["A", "B", "d"]
