"""Sittings at the prompt for the tests: a console on the test cell, and everything it said."""

from __future__ import annotations

from pathlib import Path

from viapoint.repl import Console
from viapoint.repl.plain import converse
from viapoint.runtime.cell import load_cell
from viapoint.runtime.signals import load_scenario

FILES = Path(__file__).parent / "files"


class Sitting:
    """A console on the test cell, and everything it said."""

    def __init__(self, scenario: Path | None = None) -> None:
        self.said: list[str] = []
        cell = load_cell(FILES / "cell.toml")
        self.console = Console(
            cell,
            self.said.append,
            versions={"viapoint": "0"},
            scenario=None if scenario is None else load_scenario(scenario, cell),
        )

    def enter(self, *lines: str) -> str:
        """What is said to these lines."""
        before = len(self.said)
        for line in lines:
            self.console.enter(line)
        return "\n".join(self.said[before:])

    def read(self, text: str) -> str:
        """The transcript of a whole sitting."""
        converse(self.console, text.splitlines(), echo=True)
        return "\n".join(self.said)
