"""docs/command-line.md names every command, option, event and key of the JSON contracts."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path

import pytest
from doc_pages import DOCS, REPOSITORY, read_page

import viapoint as via
from viapoint.cli import main
from viapoint.cli.arguments import COMMANDS
from viapoint.runtime.recording.compare import PathDifference, StatementTime

PAGE = read_page(DOCS / "command-line.md")
NAMED = set(re.findall(r"`([^`]+)`", "\n".join(PAGE.prose())))
WORDS = set(re.findall(r"[\w-]+", " ".join(NAMED)))


def test_every_command_has_its_section() -> None:
    headings = " ".join(re.findall(r"^## (.+)$", PAGE.text, flags=re.MULTILINE))
    assert {command.name for command in COMMANDS} <= set(re.findall(r"\w+", headings))


def test_the_readme_names_every_command() -> None:
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    assert set(re.findall(r"`viapoint (\w+)", text)) == {command.name for command in COMMANDS}


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_every_option_is_named(command) -> None:
    flags = {flag for option in command.options for flag in option.flags if flag.startswith("-")}
    assert flags <= {each.partition(" ")[0] for each in NAMED}


def test_every_key_of_the_run_report_is_named(tmp_path: Path) -> None:
    program = via.compile_text("T 1\nMJ P5 F60\nWAIT 0.1\nSET DO1\nIF DI1\nENDIF\nM 5\n")
    session = via.Session(via.default_cell(), program)
    session.set_override(0.5)
    session.finish()
    report = via.run_report(session, [])
    kinds = {event["kind"] for event in report["events"]}
    assert kinds == {"tool", "override", "block", "wait", "output", "input_read", "m", "error"}
    keys = {key for event in report["events"] for key in event}
    assert keys | kinds | set(report) | set(report["final"]) | set(report["limits"]) <= WORDS


def test_every_key_of_the_other_objects_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cell.toml").write_text(via.default_cell().source.text)
    Path("touched.csv").write_text("0,0,0,0,0,0\n1,0,0,0,0,20\n0,1,0,0,20,0\n0,0,1,20,0,0\n")
    Path("corners.csv").write_text("0,0,0\n100,0,0\n0,100,0\n")
    Path("part.via").write_text("ML P1\nIF DI1\nENDIF\n")
    found: set[str] = set()
    for line in (
        "check part.via --cell cell.toml --format json",
        "fk --robot frigeni6 0 0 0 0 0 0 --format json",
        "ik --robot frigeni6 1755 0 2660 0 0 0 --format json",
        "robots --format json",
        "calibrate tool touched.csv --format json",
        "calibrate frame corners.csv --format json",
    ):
        assert main(line.split()) == 0
        found |= _keys(json.loads(capsys.readouterr().out))
    found |= {field.name for kind in (PathDifference, StatementTime) for field in fields(kind)}
    found |= {"same", "event", "path", "duration_s", "length_mm", "statements"}
    assert found <= WORDS


def _keys(value: object) -> set[str]:
    if isinstance(value, dict):
        return set(value) | {key for each in value.values() for key in _keys(each)}
    if isinstance(value, list):
        return {key for each in value for key in _keys(each)}
    return set()
