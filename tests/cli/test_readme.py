"""What the README shows is what happens."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)


def without_figures(text: str) -> list[str]:
    """Words and order; numbers and the widths they take may change with the time law."""
    return [" ".join(re.sub(r"\d+(\.\d+)?", "#", line).split()) for line in text.strip().splitlines()]


def test_the_program_prints_what_is_shown(cli, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    """`--update-goldens` writes the new output into the README."""
    (program,) = blocks("via")
    (shown,) = blocks("console")
    path = tmp_path / "hello.via"
    path.write_text(program)
    outcome = cli("run", path)
    assert outcome.code == 0
    assert outcome.err == ""
    now = f"$ viapoint run hello.via\n{outcome.out}"
    if without_figures(shown) == without_figures(now):
        return
    assert request.config.getoption("--update-goldens"), "the README shows another output"
    README.write_text(README.read_text(encoding="utf-8").replace(shown, now), encoding="utf-8")


def test_the_library_example_runs(cli, capsys) -> None:
    """In the folder of the test files, which has a part.via and a cell.toml."""
    (code,) = blocks("python")
    exec(compile(code, "README.md", "exec"), {})
    last = capsys.readouterr().out.strip().splitlines()[-1]
    assert re.match(r"\d\.\d+ \[", last)


def test_every_command_named_exists() -> None:
    from viapoint.cli.arguments import COMMANDS

    named = set(re.findall(r"`viapoint (\w+)", README.read_text(encoding="utf-8")))
    assert named == {command.name for command in COMMANDS}


def test_links_lead_somewhere() -> None:
    for page in (README, README.with_name("CONTRIBUTING.md")):
        for target in re.findall(r"\]\((?!http)([^)]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), target
