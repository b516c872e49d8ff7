"""The flag that rewrites golden files: it does, and nothing is rewritten without it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

CONFTEST = Path(__file__).parents[1] / "conftest.py"
INI = "[pytest]\nenable_assertion_pass_hook = true\n"
TEST = """
def test_text(check_golden):
    check_golden("room/text.txt", {text!r})
"""


def run_pytest(folder: Path, text: str, *flags: str) -> tuple[int, str]:
    (folder / "test_text.py").write_text(TEST.format(text=text))
    plugins = ["-p", "pytest_golden.plugin", "-p", "no:cacheprovider"]
    command = [sys.executable, "-m", "pytest", "-q", *plugins, *flags, str(folder)]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


def test_goldens_are_written_on_demand_only(tmp_path: Path) -> None:
    shutil.copy(CONFTEST, tmp_path)
    (tmp_path / "pytest.ini").write_text(INI)
    golden = tmp_path / "golden" / "room" / "text.txt"

    code, output = run_pytest(tmp_path, "one")
    assert code == 1
    assert "does not exist" in output
    assert not golden.exists()

    assert run_pytest(tmp_path, "one", "--update-goldens")[0] == 0
    assert golden.read_text() == "one\n"

    code, output = run_pytest(tmp_path, "two")
    assert code == 1
    assert "--update-goldens" in output
    assert golden.read_text() == "one\n"

    assert run_pytest(tmp_path, "two", "--update-goldens")[0] == 0
    assert golden.read_text() == "two\n"
