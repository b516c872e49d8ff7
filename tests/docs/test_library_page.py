"""docs/library.md names every public name, and every argument, field and member of the main classes."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields

import pytest
from doc_pages import DOCS, read_page

import viapoint as via

PAGE = read_page(DOCS / "library.md")
NAMED = set(re.findall(r"[A-Za-z_]+", " ".join(re.findall(r"`([^`]+)`", "\n".join(PAGE.prose())))))


def public(kind: type) -> set[str]:
    return {name for name in vars(kind) if not name.startswith("_")}


def test_every_public_name() -> None:
    assert set(via.__all__) <= NAMED


def test_every_argument_and_member_of_a_session() -> None:
    assert set(inspect.signature(via.Session).parameters) <= NAMED
    assert public(via.Session) | {"status", "events"} <= NAMED


@pytest.mark.parametrize("kind", [via.Window, via.Event])
def test_every_field(kind: type) -> None:
    assert {field.name for field in fields(kind)} <= NAMED


def test_every_member_of_a_robot() -> None:
    plain = {"name", "family", "kinematics", "prismatic", "coupling", "body_radius", "joint_count"}
    others = {"with_limits", "ik_path", "inside", "tcp"}  # for the kernel
    assert public(via.Robot) - plain - others <= NAMED


def test_defaults_of_a_session() -> None:
    shown: dict[str, str] = {}
    for row in PAGE.table_rows():  # the first table that names them
        shown.setdefault(row[0].strip("`"), row[1].strip("`"))
    for name, parameter in inspect.signature(via.Session).parameters.items():
        if parameter.default not in (None, (), inspect.Parameter.empty):
            assert shown[name] == repr(parameter.default)
