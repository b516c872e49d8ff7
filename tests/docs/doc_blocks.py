"""Runs the blocks of one page, in order, in one folder. What a block says above itself:

`file: NAME`   it is written to NAME in the page's folder (any language);
`run`          a program that is run to its end and must finish; `scenario: NAME` and `cell: NAME` with it;
`cell: NAME`   the cell it is compiled against, or the scenario belongs to; without: the built-in cell;
`error: CODES` a program, cell or scenario that is refused with exactly these codes;
`fails: CODE`  a program that runs and ends with this error; `refused`: with any;
`scenario`, `robot`, `points`  a TOML block that is no cell;
`section`      a part of a cell, tried with a bare robot;
`printed`      a text block: what the Python block before it has printed;
`exact`        a console block whose figures must be those shown; else words and order count;
`exit: N`      the exit code of a console block's last command, 0 if nothing is said.

A console block may leave lines out with a line `…`. Blocks of other languages are not run.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from doc_pages import Block

import viapoint as via
from viapoint.cli import main

BARE = '[robot]\nmodel = "frigeni6"\n\n'
GAP = "…"


class Mismatch(AssertionError):
    """A block shows something else than what happens; `now` is what it should show, if that is known."""

    def __init__(self, message: str, now: str | None = None) -> None:
        super().__init__(message)
        self.now = now


class Room:
    """The folder of one page and what its blocks leave there; the process stands in that folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, Any] = {}
        self._printed = ""
        self._runners: dict[str, Callable[[Block], None]] = {
            "via": self._via,
            "toml": self._toml,
            "python": self._python,
            "console": self._console,
            "text": self._text,
        }

    def furnish(self, blocks: Iterable[Block]) -> None:
        """Write the blocks that are files, so that any block may use them."""
        for block in blocks:
            if "file" in block.says:
                (self._folder / block.says["file"]).write_text(block.text, encoding="utf-8")

    def run(self, block: Block) -> None:
        """Try one block; raises Mismatch, or whatever the block raises."""
        runner = self._runners.get(block.language)
        if runner is not None:
            runner(block)

    # --- programs -----------------------------------------------------------------------------------

    def _via(self, block: Block) -> None:
        says = block.says
        cell = self._cell(says)
        try:
            program = via.compile_text(block.text, cell=cell)
        except via.CompileError as error:
            _expect_codes(says, [d.code for d in error.diagnostics if d.is_error])
            return
        _expect_codes(says, [])
        if not {"run", "fails", "refused"} & set(says):
            return
        scenario = via.load_scenario(says["scenario"], cell) if "scenario" in says else None
        session = via.Session(cell, program, scenario=scenario, max_time=120.0)
        status = session.finish()
        failed = None if session.failure is None else session.failure.code
        if "refused" in says and failed is not None:
            return
        if failed != says.get("fails") or (failed is None and status is not via.Status.FINISHED):
            raise Mismatch(f"the run ends with {status.value}, {session.failure}")

    def _cell(self, says: dict[str, str]) -> via.Cell:
        return via.load_cell(says["cell"]) if "cell" in says else via.default_cell()

    # --- files --------------------------------------------------------------------------------------

    def _toml(self, block: Block) -> None:
        says = block.says
        text = BARE + block.text if "section" in says else block.text
        path = self._folder / says.get("file", f"block{block.line}.toml")
        path.write_text(text, encoding="utf-8")
        try:
            if "scenario" in says:
                via.load_scenario(path, self._cell(says))
            elif "robot" in says:
                via.load_robot(path)
            elif "points" in says:
                tomllib.loads(text)
            else:
                via.load_cells(path)
        except (via.CellError, via.ScenarioError, via.RobotError) as error:
            _expect_codes(says, [d.code for d in error.diagnostics])
        else:
            _expect_codes(says, [])

    # --- Python -------------------------------------------------------------------------------------

    def _python(self, block: Block) -> None:
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(block.text, f"block of line {block.line}", "exec"), self._names)
        self._printed = out.getvalue()

    def _text(self, block: Block) -> None:
        if "printed" in block.says:
            compare(block.text, self._printed, exact="exact" in block.says)

    # --- command lines ------------------------------------------------------------------------------

    def _console(self, block: Block) -> None:
        now, code = "", 0
        for line in block.text.splitlines():
            if line.startswith("$ "):
                output, code = _command(line[2:], code)
                now += f"{line}\n{output}"
        wanted = int(block.says.get("exit", "0"))
        if code != wanted:
            raise Mismatch(f"the exit code is {code}, not {wanted}:\n{now}")
        compare(block.text, now, exact="exact" in block.says)


def _command(line: str, code_before: int) -> tuple[str, int]:
    """What a command line prints, standard error last, and its exit code."""
    line, _, given = line.partition(" < ")
    words = shlex.split(line)
    if words == ["echo", "$?"]:
        return f"{code_before}\n", 0
    assert words[0] == "viapoint", f"{line}: only viapoint is run"
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), _input(given.strip()):
        code = main(words[1:])
    text = out.getvalue() + err.getvalue()
    return text if not text or text.endswith("\n") else f"{text}\n", code


@contextlib.contextmanager
def _input(name: str) -> Iterator[None]:
    """Standard input comes from the file of this name, if there is one."""
    before = sys.stdin
    sys.stdin = io.StringIO(Path(name).read_text(encoding="utf-8") if name else "")
    try:
        yield
    finally:
        sys.stdin = before


def compare(shown: str, now: str, *, exact: bool) -> None:
    """Raises Mismatch where what is shown is not what comes out, line by line; `…` stands for any lines."""
    wanted, given = _lines(shown, exact), _lines(now, exact)
    if GAP not in wanted:
        if wanted != given:
            raise Mismatch(f"it shows\n{shown}\nwhere now comes\n{now}", now)
        return
    at = 0
    for k, part in enumerate(_parts(wanted)):
        places = range(at, len(given) - len(part) + 1) if k else range(at, at + 1)
        found = next((i for i in places if given[i : i + len(part)] == part), None)
        if found is None:
            raise Mismatch("these lines are not in\n{}\n{}".format(now, "\n".join(part)))
        at = found + len(part)
    if wanted[-1] != GAP and at != len(given):
        raise Mismatch(f"more lines follow:\n{now}")


def _parts(lines: list[str]) -> list[list[str]]:
    parts: list[list[str]] = [[]]
    for line in lines:
        if line == GAP:
            parts.append([])
        else:
            parts[-1].append(line)
    return parts


def _lines(text: str, exact: bool) -> list[str]:
    """With `exact` as they are; else words and order, for figures may change with the time law."""
    lines = [line.rstrip() for line in text.strip("\n").splitlines()]
    if exact:
        return lines
    return [" ".join(re.sub(r"-?\d+(\.\d+)?", "#", line).split()) for line in lines]


def _expect_codes(says: dict[str, str], found: list[str]) -> None:
    wanted = sorted(says.get("error", "").replace(",", " ").split())
    if sorted(found) != wanted:
        raise Mismatch(f"it is refused with {sorted(found)}, not {wanted}")
