"""The prompt in a terminal, with keys from a pipe; as a process: piped, in a dumb terminal, with Ctrl-C."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.history import FileHistory, InMemoryHistory
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput
from repl_sittings import FILES, Sitting

from viapoint.repl.terminal import converse_in_terminal, history, toolbar

COMMAND = [sys.executable, "-m", "viapoint", "repl", "--cell", "cell.toml"]
ENDLESS = "A:\nML P2 F100\nML P1\nGOTO A\n"


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """History goes to a folder of the test's own."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def type_keys(sitting: Sitting, keys: str, capsys: pytest.CaptureFixture[str]) -> str:
    """What a terminal shows of a sitting, the prompt itself aside."""
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(keys)
        converse_in_terminal(sitting.console)
    return capsys.readouterr().out


def test_keys(sitting: Sitting, capsys: pytest.CaptureFixture[str], own_state: Path) -> None:
    shown = type_keys(sitting, "MJ P1 F60\r:io DI3 on\r\x04", capsys)
    assert "at X=1500 Y=-300 Z=1500 A=0 B=90 C=0" in shown
    kept = (own_state / "viapoint" / "history").read_text(encoding="utf-8")
    assert "+MJ P1 F60" in kept
    assert "+:io DI3 on" in kept


def test_a_tab_completes(sitting: Sitting, capsys: pytest.CaptureFixture[str]) -> None:
    type_keys(sitting, "MJ P1 F60\r:lis\t part\x15:tea\t P5\r:quit\r", capsys)
    assert 5 in sitting.console.taught
    assert sitting.console.leaving


def test_ctrl_c_drops_a_line_and_a_block_and_never_leaves(
    sitting: Sitting, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = type_keys(sitting, "ML P9\x03\x03IF DI3\r\x03SET DO1\r:quit\r", capsys)
    assert "DO1 on" in shown
    assert "error" not in shown


def test_the_status_line(sitting: Sitting, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    sitting.enter("MJ P1 F60", "ML P2 F100", ":load part.via", ":break 6", ":run")
    text = toolbar(sitting.console)
    for part in ("halted", "line 6", "X=", "0.0 mm/s", "100 %", "buffer"):
        assert part in text
    assert len(text) == 80


def test_history_without_a_place_for_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert isinstance(history(), FileHistory)
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    assert isinstance(history(), InMemoryHistory)


def test_piped_without_colour_and_without_prompt_toolkit() -> None:
    code = "import sys; from viapoint.cli import main; c = main(sys.argv[1:]); "
    code += "assert not any(m.startswith('prompt_toolkit') for m in sys.modules); sys.exit(c)"
    done = subprocess.run(
        [sys.executable, "-c", code, "repl", "--cell", "cell.toml", "part.via"],
        cwd=FILES,
        input="SET DO1\nMV P1\n",
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "TERM": "xterm-256color"},
        timeout=60,
    )
    assert done.returncode == 1
    assert done.stderr == ""
    assert "\x1b" not in done.stdout
    assert "via> SET DO1\n  0.000 s  line 1  DO1 on" in done.stdout
    assert "part.via: 17 lines" in done.stdout


def test_ctrl_c_halts_on_the_path() -> None:
    with subprocess.Popen(
        COMMAND, cwd=FILES, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write("MJ P1 F60\n:pace 20\n" + ENDLESS)
        process.stdin.flush()
        for line in process.stdout:
            if "GOTO A" in line:
                break
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        process.stdin.write(":stop\nML P2\n:quit\n")
        process.stdin.flush()
        rest = process.stdout.read()
        assert process.wait(30) == 0
    assert "halted by Ctrl-C" in rest
    assert "stopped in line" in rest
    assert rest.splitlines()[-2].startswith("at X=1500 Y=300 Z=1500 A=0 B=90 C=0, ")


def test_a_dumb_terminal() -> None:
    master, slave = pty.openpty()
    environment = {**os.environ, "TERM": "dumb"}
    with subprocess.Popen(
        COMMAND, cwd=FILES, stdin=slave, stdout=slave, stderr=slave, env=environment
    ) as process:
        os.close(slave)
        os.write(master, b"SET DO1\n:quit\n")
        shown = b""
        while b"DO1 on" not in shown:
            shown += os.read(master, 1000)
        assert process.wait(30) == 0
    os.close(master)
    assert b"via> " in shown
    assert b"\x1b" not in shown
