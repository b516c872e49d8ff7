"""Runs command lines in this process, in the folder of the test files."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_runs import Outcome, RunCli

from viapoint.cli import main

FILES = Path(__file__).parent / "files"


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> RunCli:
    """`cli("check", "part.via")`: exit code and what was printed."""
    monkeypatch.chdir(FILES)

    def run(*words: object) -> Outcome:
        capsys.readouterr()
        code = main([str(word) for word in words])
        printed = capsys.readouterr()
        return Outcome(code, printed.out, printed.err)

    return run
