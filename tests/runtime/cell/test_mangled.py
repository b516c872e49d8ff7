"""Cell files with random damage: taken, or refused with diagnostics that name a line; never anything else."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from viapoint.language.diagnostics import Diagnostic
from viapoint.runtime.cell import CellError, parse_cell

TEXT = Path(__file__).with_name("full.toml").read_text(encoding="utf-8")
VALUES = [
    "nan",
    "inf",
    "-1",
    "0",
    '"x"',
    "[]",
    "{}",
    "true",
    "[[1]]",
    "1e400",
    "1979-05-27",
    "9" * 30,
    "{ x = 1 }",
]


def damage(rng: random.Random, lines: list[str]) -> None:
    i = rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            lines[i] = lines[i].split("=")[0] + "= " + rng.choice(VALUES)
        case 1:
            del lines[i]
        case 2:
            lines.insert(i, rng.choice(lines))
        case _:
            at = rng.randrange(len(lines[i]) + 1)
            lines[i] = lines[i][:at] + rng.choice('[]{}",=.#x1-') + lines[i][at:]


def faults(text: str) -> tuple[Diagnostic, ...]:
    """Those of a text; none where it makes a cell."""
    try:
        parse_cell(text)
    except CellError as error:
        return error.diagnostics or (Diagnostic(code="E27?", message="refused without a reason"),)
    return ()


@pytest.mark.parametrize("seed", range(4))
def test_damaged_files_are_taken_or_refused(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(60):
        lines = TEXT.splitlines()
        for _ in range(rng.randint(1, 4)):
            damage(rng, lines)
        for fault in faults("\n".join(lines)):
            assert fault.line, f"seed {seed}"
            assert fault.code.startswith("E27"), f"seed {seed}"
