"""Grammar, fast path and checks come from one table of commands."""

from __future__ import annotations

import subprocess
import sys

from viapoint.language.commands import (
    ACTIONS,
    CODES_BEFORE_DIGITS,
    FIRST_WORDS,
    KEYWORDS,
    MOTIONS,
    Form,
    Operand,
)
from viapoint.language.parser import parse
from viapoint.language.rules import grammar_text, rule_of
from viapoint.language.source import Source


def test_every_command_has_a_rule_and_an_example_that_parses() -> None:
    text = grammar_text()
    for word in FIRST_WORDS:
        assert f"{rule_of(word)}:" in text
    for command in ACTIONS:
        source = Source(command.word, command.example)
        assert parse(source).ok, command.word
        assert parse(source) == parse(source, use_shapes=False)


def test_every_parameter_of_every_motion_parses() -> None:
    for command in MOTIONS:
        for parameter in command.parameters:
            axis = "1" if parameter.form is Form.NUMBERED else ""
            sign = "" if parameter.form is Form.GLUED else "="
            written = f"{parameter.code}{axis}{sign}1"
            needed = [] if not command.needs or "P" in parameter.excludes else ["P1"]
            if command.word == "MC" and not parameter.code.startswith("Q"):
                needed.append("Q2")
            if parameter.code == "P":
                needed = needed[1:]
            if parameter.form is Form.ASSIGNED and parameter.code.startswith("Q"):
                needed = ["P1", *(f"Q{c}=5" for c in "XYZ" if f"Q{c}" != parameter.code)]
            if parameter.code == "Q":
                needed = ["P1"]
            result = parse(Source("a", " ".join([command.word, *needed, written])))
            assert result.ok, (command.word, written, result.diagnostics)


def test_words_of_the_table_are_reserved() -> None:
    assert set(FIRST_WORDS) - {"T", "M"} <= KEYWORDS
    assert {"P", "Q", "F", "FC", "FA", "Z", "T", "R", "H", "E", "J", "DI", "DO", "M"} <= CODES_BEFORE_DIGITS
    assert not {"X", "A", "B", "C", "Y"} & CODES_BEFORE_DIGITS
    assert all(command.domain is None or command.operand is not Operand.NOTHING for command in ACTIONS)


PROBE = """
import sys
from viapoint.language.parser import parse
from viapoint.language.source import Source
text = "LOOP: ML P1 F100\\nIF DI1 AND NOT DO2\\nENDIF\\nGOTO LOOP 5\\nSET DO 1"
result = parse(Source("a", text))
assert result.ok and len(result.program.statements) == 6
assert not {"lark", "numpy", "difflib"} & set(sys.modules)
"""


def test_canonical_programs_need_neither_lark_nor_numpy() -> None:
    subprocess.run([sys.executable, "-c", PROBE], check=True)
