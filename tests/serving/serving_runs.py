"""Runs of `viapoint run --serve` as processes of their own."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

FILES = Path(__file__).parent / "files"


class Served:
    """A run that serves: its port, and its report once it is over."""

    def __init__(self, process: subprocess.Popen[str], port: int) -> None:
        self.process = process
        self.port = port

    def report(self) -> dict[str, Any]:
        out, _ = self.process.communicate(timeout=60)
        result: dict[str, Any] = json.loads(out)
        return result


@contextmanager
def served(program: str | None = "part.via", *options: str) -> Iterator[Served]:
    """`viapoint run PROGRAM --serve 0 --format json …`, stopped at the end if it still runs.

    Without a program the cell among the options names those of its robots.
    """
    named = [] if program is None else [program]
    command = [sys.executable, "-m", "viapoint", "run", *named, "--serve", "0", "--format", "json", *options]
    with subprocess.Popen(
        command, cwd=FILES, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stderr is not None
        said = process.stderr.readline()
        found = re.fullmatch(r"serving on 127\.0\.0\.1:(\d+)\n", said)
        assert found is not None, said
        try:
            yield Served(process, int(found[1]))
        finally:
            if process.poll() is None:
                process.terminate()
                process.communicate(timeout=30)
