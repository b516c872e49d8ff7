"""The tables of docs/cell.md name every key of the files, with its default."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from doc_pages import DOCS, read_page
from pydantic import BaseModel

import viapoint as via
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.cell.schema import CellFile, MemberFile
from viapoint.runtime.robots.schema import RobotFile
from viapoint.runtime.signals.schema import ScenarioFile

Keys = dict[str, Any]
NEEDED = object()

IN_WORDS = {
    "robot.home",
    "m_functions",
    "points.x",
    "points.y",
    "points.z",
    "points.a",
    "points.b",
    "points.c",
}
"""Keys whose default is more than one value."""


def keys_of(model: type[BaseModel], before: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys of a schema and their defaults."""
    for name, field in model.model_fields.items():
        inner = _table(field.annotation)
        if inner is not None:
            yield from keys_of(inner, f"{before}{name}.")
        else:
            default = field.get_default(call_default_factory=True)
            yield f"{before}{name}", NEEDED if field.is_required() else default


def _table(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    inner = (_table(each) for each in get_args(annotation))
    return next((found for found in inner if found is not None), None)


def shown_keys(heading: str) -> dict[str, str]:
    """Keys and defaults in the tables of one part of the page."""
    page = read_page(DOCS / "cell.md")
    part = page.text.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    rows = (row for row in type(page)(page.path, part).table_rows() if len(row) == 4)
    return {row[0].split("`")[1]: row[2] for row in rows if "`" in row[0]}


@pytest.mark.parametrize(
    ("heading", "model"),
    [("The cell", CellFile), ("The robot file", RobotFile), ("The scenario file", ScenarioFile)],
)
def test_every_key_with_its_default(heading: str, model: type[BaseModel]) -> None:
    keys, shown = dict(keys_of(model)), shown_keys(heading)
    if model is CellFile:  # what only a robot of several has
        member = dict(keys_of(MemberFile, "robots."))
        keys |= {key: member[key] for key in member if key.removeprefix("robots.") not in keys}
    assert set(shown) == set(keys)
    for key, default in keys.items():
        if key not in IN_WORDS:
            assert _agree(shown[key], default), f"{key}: {shown[key]}, in fact {default}"


def _agree(shown: str, default: Any) -> bool:
    if default is NEEDED:
        return shown == "needed"
    if not shown.startswith("`"):
        return default is None or callable(default)
    return bool(tomllib.loads(f"x = {shown.strip('`')}")["x"] == default)


# --- what the page says is not there yet --------------------------------------------------------------

ROBOT = '[robot]\nmodel = "frigeni6"\n'
PROGRAM = "MJ J1=20 J5=30 F60\nML X=1600 F200\n"

IGNORED = {
    "limits.joints.torque_nm": "[limits.joints]\ntorque_nm = [1, 1, 1, 1, 1, 1]",
}
"""Keys marked ○ that would end this run if they were acted on."""

REFUSED = {
    "drives.kind": '[drives]\nkind = "servo"',
}
"""Keys marked ●: a run with another value than the default is refused."""


def _outcome(section: str) -> str | None:
    """Code of the error with which a run in a cell with `section` ends."""
    cell = parse_cell(f"{ROBOT}{section}\n")
    session = via.Session(cell, via.compile_text(PROGRAM, cell=cell))
    session.finish()
    return None if session.failure is None else session.failure.code


@pytest.mark.parametrize("key", IGNORED)
def test_what_is_marked_as_not_acted_on_is_not(key: str) -> None:
    """Fails when a key has come into use: then take the ○ from docs/cell.md and the key from here."""
    assert f"`{key}` ○" in (DOCS / "cell.md").read_text(encoding="utf-8")
    assert _outcome(IGNORED[key]) is None


@pytest.mark.parametrize("key", REFUSED)
def test_what_is_marked_as_refused_is_refused(key: str) -> None:
    """Fails when a key has come into use: then take the ● from docs/cell.md and the key from here."""
    assert f"`{key}` ●" in (DOCS / "cell.md").read_text(encoding="utf-8")
    assert _outcome(REFUSED[key]) == "E392"
