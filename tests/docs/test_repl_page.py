"""docs/repl.md names every command of the prompt as it is, and every member of the session behind it."""

from __future__ import annotations

import re

from doc_pages import DOCS, read_page

import viapoint as via
from viapoint.repl.commands import COMMANDS

PAGE = read_page(DOCS / "repl.md")
ROWS = {row[0]: row[1] for row in PAGE.table_rows()}


def test_every_command_is_listed_as_it_is() -> None:
    listed = {usage.strip("`"): text for usage, text in ROWS.items() if usage.startswith("`:")}
    assert listed == {f":{command.usage}": command.help for command in COMMANDS}


def test_members_exist() -> None:
    session = via.Interactive(via.default_cell())
    named = {name for row in ROWS if not row.startswith("`:") for name in re.findall(r"`(\w+)", row)}
    assert len(named) > 10
    assert all(hasattr(session, name) for name in named - {"command", "member"})
