"""Reads and writes the case files of tests/golden/compiler: many little programs in one text.

--- name of the case
source lines; `//! CODE text | text && CODE …` expects diagnostics on the line
=== world
DI3 0 1        successive reads, the last one for ever
async 7        M functions declared asynchronous
lines 12       cut an endless program off
=== calls
the canonical calls and reads; rewritten with --update-goldens
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

from viapoint.language.diagnostics import Diagnostic
from viapoint.vm import Program, ScriptedWorld, run_canonical


@dataclass
class Case:
    file: Path
    name: str
    source: str
    sections: dict[str, str] = field(default_factory=dict)

    @property
    def id(self) -> str:
        return f"{self.file.stem}: {self.name}"

    @property
    def runs(self) -> bool:
        """Whether the case is run: all of the course are, and those that show their calls."""
        return self.file.stem == "course" or "calls" in self.sections

    def world(self) -> tuple[ScriptedWorld, int]:
        inputs: dict[int, list[bool]] = {}
        asynchronous: set[int] = set()
        lines = 10_000
        for line in self.sections.get("world", "").splitlines():
            word, *values = line.split()
            if word == "async":
                asynchronous |= {int(value) for value in values}
            elif word == "lines":
                lines = int(values[0])
            else:
                inputs[int(word.removeprefix("DI"))] = [value == "1" for value in values]
        return ScriptedWorld(inputs, frozenset(asynchronous)), lines

    def run(self, program: Program, *, refuse_every: int = 0) -> list[str]:
        world, lines = self.world()
        return run_canonical(program, world, refuse_every=refuse_every, call_limit=lines)

    def text(self) -> str:
        parts = [f"--- {self.name}\n{self.source}"]
        parts += [f"=== {name}\n{body}" for name, body in self.sections.items()]
        return "".join(parts)


def read_cases(file: Path) -> list[Case]:
    cases = []
    for chunk in re.split(r"^--- ", file.read_text(), flags=re.MULTILINE)[1:]:
        source, *sections = re.split(r"^=== ", chunk, flags=re.MULTILINE)
        name, _, body = source.partition("\n")
        split = (section.partition("\n") for section in sections)
        cases.append(Case(file, name, body, {title: text for title, _, text in split}))
    return cases


def update_calls(case: Case, calls: list[str]) -> None:
    """Write the calls of one case into its file."""
    case.sections["calls"] = "".join(f"{line}\n" for line in calls)
    texts = [case.text() if each.name == case.name else each.text() for each in read_cases(case.file)]
    case.file.write_text("".join(texts))


def expected_diagnostics(source: str) -> list[tuple[int, str, list[str]]]:
    """Line, code, and texts that message or hint must contain."""
    found = []
    for number, line in enumerate(source.splitlines(), 1):
        _, mark, rest = line.partition("//!")
        for wanted in rest.split("&&") if mark else ():
            code, _, texts = wanted.strip().partition(" ")
            found.append((number, code, [text.strip() for text in texts.split("|") if text.strip()]))
    return found


def mismatch(source: str, diagnostics: tuple[Diagnostic, ...]) -> str | None:
    """What differs between the diagnostics and those expected in the comments."""
    given = [(each.extent[0] if each.extent else 0, each) for each in diagnostics]
    for line, code, texts in expected_diagnostics(source):
        matching = [
            pair
            for pair in given
            if pair[0] == line
            and pair[1].code.startswith(code)
            and all(text in f"{pair[1].message} {pair[1].hint}".replace("`", "") for text in texts)
        ]
        if not matching:
            return (
                f"line {line}: no {code} {texts} among {[(n, d.code, d.message, d.hint) for n, d in given]}"
            )
        given.remove(matching[0])
    return f"not expected: {[(n, d.code, d.message) for n, d in given]}" if given else None
