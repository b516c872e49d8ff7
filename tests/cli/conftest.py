"""Runs command lines in this process, in the folder of the test files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from viapoint.cli import main

FILES = Path(__file__).parent / "files"


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def transcript(self) -> str:
        """As a golden file shows it."""
        parts = [f"exit code {self.code}"]
        for name, text in (("standard output", self.out), ("standard error", self.err)):
            if text:
                parts.append(f"--- {name}\n{text.rstrip()}")
        return "\n".join(parts)


RunCli = Callable[..., Outcome]


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
