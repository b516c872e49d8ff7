"""Lines of keys in TOML texts, however they are written."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from viapoint.runtime.documents import CELL_CODES, DocumentError, key_lines, parse_document

# Every number is the line it stands in.
TEXT = '''\
a = 1
"b c".d = 2
[t]  # [not.a.table]
x = 4
y = "]["  # = 3
z = """
[fake]
fake = 8
"""
w = 10
list = [
  [1, 2],  # ]
  "]",
]
after = 15
[t.inner]
deep.er = 17
[[rows]]
k = 19
[[rows]]
k = 21
[rows.sub]
k = 23
[[rows.subs]]
k = 25
[[rows.subs]]
k = 27
  indented = 28
literal = \'\'\'
[x]
\'\'\'
last = 32
'''


def numbers(value: Any, path: tuple[str | int, ...] = ()) -> list[tuple[tuple[str | int, ...], int]]:
    """Paths of the plain numbers in tables and arrays of tables."""
    if isinstance(value, dict):
        return [each for key, inner in value.items() for each in numbers(inner, (*path, key))]
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return [each for i, inner in enumerate(value) for each in numbers(inner, (*path, i))]
    return [(path, value)] if isinstance(value, int) else []


def test_every_key_has_its_line() -> None:
    lines = key_lines(TEXT)
    found = numbers(tomllib.loads(TEXT))
    assert len(found) == 13
    for path, line in found:
        assert lines[path] == line, path


def test_line_of_something_inside_a_value() -> None:
    document = parse_document("file", TEXT, CELL_CODES)
    assert document.line(("t", "list", 0, 1)) == 11
    assert document.line(("rows", 1, "missing")) == 20
    assert document.line(("nothing",)) == 1


@pytest.mark.parametrize(("text", "line"), [("a = 1\nb = \n", 2), ("a = 1\n\n[x\n", 3), ('a = """\n\n', 3)])
def test_syntax_errors_have_their_line(text: str, line: int) -> None:
    with pytest.raises(DocumentError) as caught:
        parse_document("file", text, CELL_CODES)
    assert [each.line for each in caught.value.diagnostics] == [line]


def test_long_texts_are_read_in_linear_time() -> None:
    text = "x = [" + "1," * 2_000_000 + "]\ny = 2\n"
    assert key_lines(text) == {("x",): 1, ("y",): 2}
