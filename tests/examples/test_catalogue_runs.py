"""Every example of the catalogue, given to the command line as a user would, shows its code."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from viapoint.cli import main
from viapoint.language.catalogue import CATALOGUE, Entry, Example
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.kernel.motion import Mover, Rows
from viapoint.runtime.kernel.resolver import Resolver
from viapoint.session import Session, compile_text

PROGRAM_FILES = "E25"
SCENARIO_FILES = "E29"
INJECTED = {"E305", "E432", "E490"}
"""Codes that no file raises: a sensor in Python (tests of corrections), and what is broken below."""


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(entry: Entry, example: Example) -> tuple[str, list[str]]:
    """The example's files in the current folder: the program's name, and the options for the others."""
    options: list[str] = []
    for name, text in example.files():
        Path(name).write_bytes(text.encode())
    if example.robot is not None and example.cell is None:
        Path("cell.toml").write_text('[robot]\nmodel = "robot.toml"\n')
    program = "part.via"
    if example.path is not None:
        program = example.path
    elif example.data is not None and entry.code.startswith(SCENARIO_FILES):
        Path("scenario.toml").write_bytes(example.data)
    elif example.data is not None:
        program = "part.viac" if entry.code.startswith(PROGRAM_FILES) else program
        Path(program).write_bytes(example.data)
    if not Path(program).exists() and example.path is None:
        Path(program).write_text("WAIT 0.1\n")
    if Path("cell.toml").exists():
        options += ["--cell", "cell.toml"]
    if Path("scenario.toml").exists():
        options += ["--scenario", "scenario.toml"]
    return program, options


def ways(program: str, options: list[str]) -> Iterator[list[str]]:
    """Command lines that may show the code: run it; compile it knowing no cell, and run that; check it."""
    yield ["run", program, *options]
    if main(["compile", program, "-o", "elsewhere.viac"]) == 0:
        yield ["run", "elsewhere.viac", *options]
    yield ["check", program, *options[:2]]


def codes_of(words: list[str], capsys: pytest.CaptureFixture[str]) -> list[str]:
    capsys.readouterr()
    code = main([*words, "--format", "json", *(["--max-time", "60"] if words[0] == "run" else [])])
    out = capsys.readouterr().out
    found = [diagnostic["code"] for diagnostic in json.loads(out)["diagnostics"]]
    assert code == (1 if any(each.startswith("E") for each in found) else 0), words
    return found


@pytest.mark.parametrize("entry", CATALOGUE.values(), ids=lambda entry: entry.code)
def test_example_shows_its_code(entry: Entry, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert entry.examples or entry.code in INJECTED
    for example in entry.examples:
        for file in place.iterdir():
            file.unlink()
        program, options = write(entry, example)
        assert any(entry.code in codes_of(words, capsys) for words in ways(program, options)), example


def test_no_set_point_that_is_no_number_leaves_the_kernel() -> None:
    """E490: no input leads there, so the path is broken on purpose, in the middle of a motion."""
    cell = parse_cell('[robot]\nmodel = "frigeni6"\n')
    session = Session(cell, compile_text("MJ J1=30 F50\nMJ J1=0\n", cell=cell), window=50)
    rows = Mover.rows

    def broken(mover: Mover, first_tick: int, count: int) -> Rows:
        result = rows(mover, first_tick, count)
        if first_tick > 100:
            result.columns[len(result.columns) // 2 :, 2] = np.nan
        return result

    with patch.object(Mover, "rows", broken):
        windows = list(session.run())
    assert session.failure is not None
    assert (session.failure.code, session.failure.line) == ("E490", 1)
    assert all(np.isfinite(window.joints).all() for window in windows)


def test_a_joint_move_that_the_path_does_not_lead_into_is_refused() -> None:
    cell = parse_cell('[robot]\nmodel = "frigeni6"\n')
    text = "MJ X=1755 Y=-200 Z=2400 A=0 B=0 C=0 F50\nML Z=2600 F200\nMS Y=200\nMJ Z=2300 F50\n"
    session = Session(cell, compile_text(text, cell=cell))
    with patch.object(Resolver, "must_stop_before", return_value=False):
        for _ in session.run():
            pass
    assert session.failure is not None
    assert (session.failure.code, session.failure.line) == ("E305", 4)
