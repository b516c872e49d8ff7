"""What an entry of the catalogue holds."""

from __future__ import annotations

from dataclasses import dataclass

from viapoint.language.diagnostics import Severity

_SEVERITY = {"E": Severity.ERROR, "W": Severity.WARNING, "I": Severity.INFO}


@dataclass(frozen=True, slots=True, kw_only=True)
class Example:
    """Input that raises the code; a test runs it. Give what is needed, leave the rest None.

    `program` is program text; `cell`, `scenario`, `robot` are TOML texts; `data` is the content of a file
    that is not text (a mangled program file, bad UTF-8); `path` names a file that cannot be read.
    """

    program: str | None = None
    cell: str | None = None
    scenario: str | None = None
    robot: str | None = None
    data: bytes | None = None
    path: str | None = None

    def files(self) -> tuple[tuple[str, str], ...]:
        """Names and texts to show, for those given."""
        named = (
            ("part.via", self.program),
            ("cell.toml", self.cell),
            ("scenario.toml", self.scenario),
            ("robot.toml", self.robot),
        )
        return tuple((name, text) for name, text in named if text is not None)


@dataclass(frozen=True, slots=True)
class Entry:
    """One code: `title` in a few words, `explanation` says what it means, why, and what to do."""

    code: str
    title: str
    explanation: str
    examples: tuple[Example, ...]

    @property
    def severity(self) -> Severity:
        """From the letter of the code."""
        return _SEVERITY[self.code[0]]


def entry(code: str, title: str, explanation: str, *examples: Example | str) -> Entry:
    """An entry; a plain string among the examples is program text."""
    made = tuple(Example(program=each) if isinstance(each, str) else each for each in examples)
    return Entry(code, title, " ".join(explanation.split()), made)
