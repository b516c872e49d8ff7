"""Exit codes, JSON, numerics left alone, nothing that looks like a crash."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import viapoint.cli
from viapoint.cli.arguments import COMMANDS
from viapoint.language.catalogue import CATALOGUE

FILES = Path(__file__).parent / "files"


def spawn(*words: str, **settings: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "viapoint", *words]
    return subprocess.run(command, cwd=FILES, capture_output=True, text=True, timeout=60, **settings)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_every_command_explains_itself(command, cli) -> None:
    outcome = cli(command.name, "--help")
    assert outcome.code == 0
    assert command.example in outcome.out
    assert not outcome.err


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["frobnicate"],
        ["run"],
        ["run", "part.via", "--frobnicate"],
        ["run", "part.via", "--override", "0"],
        ["run", "part.via", "--override", "nan"],
        ["run", "part.via", "--max-time", "-1"],
        ["run", "part.via", "--cycles", "1.5"],
        ["run", "part.via", "--window", "0"],
        ["run", "part.via", "--drives", "magic"],
        ["run", ""],
        ["ik", "--robot", "frigeni6", "1", "2"],
        ["explain", "X1"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_exit_code_2(words: list[str], cli) -> None:
    outcome = cli(*words)
    assert outcome.code == 2
    assert outcome.out == ""
    assert outcome.err.startswith("viapoint: ")


def test_every_code_can_be_explained(cli) -> None:
    for code, entry in CATALOGUE.items():
        outcome = cli("explain", code)
        assert outcome.code == 0
        assert outcome.out.startswith(f"{code} ({entry.severity.value}): {entry.title}")


def test_ik_gives_back_every_pose_it_solves(cli) -> None:
    outcome = cli("ik", "--robot", "irb140", "300", "100", "600", "20", "30", "40", "--format", "json")
    solutions = json.loads(outcome.out)["solutions"]
    assert len(solutions) >= 2
    for solution in solutions:
        again = cli("fk", "--robot", "irb140", *solution["joints_deg"], "--format", "json")
        pose = json.loads(again.out)
        np.testing.assert_allclose(list(pose["tcp"].values()), [300, 100, 600, 20, 30, 40], atol=1e-8)
        assert pose["configuration"] == solution["configuration"]


def test_ik_without_solution_is_an_empty_list(cli) -> None:
    outcome = cli("ik", "--robot", "irb140", "9000", "0", "0", "0", "0", "0", "--format", "json")
    assert outcome.code == 1
    assert json.loads(outcome.out) == {"solutions": []}


def test_tool_is_taken_off_again(cli) -> None:
    tool = ["--tool", "100", "-20", "30", "10", "20", "30"]
    pose = json.loads(cli("fk", "--robot", "frigeni6", *"123456", *tool, "--format", "json").out)["tcp"]
    found = json.loads(cli("ik", "--robot", "frigeni6", *pose.values(), *tool, "--format", "json").out)
    np.testing.assert_allclose(found["solutions"][0]["joints_deg"], [1, 2, 3, 4, 5, 6], atol=1e-7)


def test_compiled_file_disassembles_like_its_source(cli, tmp_path: Path) -> None:
    assert cli("compile", "part.via", "-o", tmp_path / "part.viac").code == 0
    assert cli("dis", tmp_path / "part.viac").out == cli("dis", "part.via").out
    assert cli("check", tmp_path / "part.viac").code == 0


def test_compile_writes_nothing_for_a_wrong_program(cli, tmp_path: Path) -> None:
    outcome = cli("compile", "wrong.via", "-o", tmp_path / "wrong.viac")
    assert outcome.code == 1
    assert "E201" in outcome.err
    assert not (tmp_path / "wrong.viac").exists()


def test_mangled_program_file_is_refused(cli, tmp_path: Path) -> None:
    path = tmp_path / "x.viac"
    path.write_bytes(b"VIAC" + bytes(40))
    for words in (["dis", path], ["check", path], ["run", path]):
        outcome = cli(*words)
        assert outcome.code == 1
        assert "[E25" in outcome.out + outcome.err


@pytest.mark.parametrize("words", [["compile", "part.via", "-o", "no\0thing"], ["dis", "no\0thing.viac"]])
def test_impossible_names_are_refused(words: list[str], cli) -> None:
    outcome = cli(*words)
    assert outcome.code == 2
    assert "is not the name of a file" in outcome.err


def test_output_that_cannot_be_written_is_refused(cli) -> None:
    outcome = cli("compile", "part.via", "-o", "part.via/below.viac")
    assert outcome.code == 1
    assert outcome.err.startswith("viapoint: cannot write part.via/below.viac: ")


def test_no_numerics_without_a_cell(tmp_path: Path) -> None:
    code = (
        "import sys; from viapoint.cli import main; main(sys.argv[1:]); "
        "print([name for name in ('numpy', 'scipy', 'matplotlib', 'rich') if name in sys.modules])"
    )
    for words in (
        ["check", "part.via"],
        ["compile", "part.via", "-o", str(tmp_path / "p.viac")],
        ["dis", "part.via"],
    ):
        command = [sys.executable, "-c", code, *words]
        done = subprocess.run(command, cwd=FILES, capture_output=True, text=True, timeout=60, check=True)
        assert done.stdout.splitlines()[-1] == "[]", words


def test_process_gives_the_exit_code() -> None:
    assert spawn("check", "part.via").returncode == 0
    wrong = spawn("check", "wrong.via")
    assert wrong.returncode == 1
    assert "\x1b" not in wrong.stdout + wrong.stderr


def test_reader_that_goes_away_is_no_crash() -> None:
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "viapoint", "dis", "part.via"]
    done = subprocess.run(command, cwd=FILES, stdout=write, stderr=subprocess.PIPE, text=True, timeout=60)
    os.close(write)
    assert done.returncode == viapoint.cli.BROKEN_PIPE
    assert done.stderr == ""


def test_internal_errors_are_one_line(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(chosen: object) -> int:
        raise ZeroDivisionError("of all things")

    monkeypatch.setattr("viapoint.cli.programs.dis", broken)
    outcome = cli("dis", "part.via")
    assert outcome.code == 1
    assert outcome.err.count("\n") == 1
    assert "internal error: ZeroDivisionError: of all things" in outcome.err
    assert "report" in outcome.err


def test_ctrl_c_is_one_word(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(chosen: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr("viapoint.cli.programs.dis", stopped)
    outcome = cli("dis", "part.via")
    assert (outcome.code, outcome.err) == (130, "stopped\n")


@pytest.mark.parametrize(
    "line",
    [
        "compile {program} -o {program}",
        "compile {program} --cell {cell} -o {cell}",
        "run {program} --cell {cell} --record {cell}",
        "plot {program} -o {program}",
        "export {program} -o {program}",
    ],
)
def test_no_command_replaces_what_it_reads(line: str, cli, tmp_path: Path) -> None:
    program, cell = tmp_path / "part.via", tmp_path / "cell.toml"
    program.write_text("MJ J1=10 F50\n")
    cell.write_text('[robot]\nmodel = "frigeni6"\n')
    outcome = cli(*line.format(program=program, cell=cell).split())
    assert outcome.code == 2
    assert "is read by this command" in outcome.err
    assert program.read_text() == "MJ J1=10 F50\n"
    assert cell.read_text().startswith("[robot]")
