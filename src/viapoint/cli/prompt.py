"""The command repl: a prompt in a terminal, or the lines of a pipe."""

from __future__ import annotations

import os
import sys
from argparse import Namespace

from viapoint.cli.loading import cell_from, scenario_from


def repl(chosen: Namespace) -> int:
    """0, or 1 where lines of a pipe could not be done."""
    from viapoint.cli.version import versions
    from viapoint.repl import Console
    from viapoint.repl.moving import load_program

    cell = cell_from(chosen.cell, chosen.file)
    terminal = sys.stdin.isatty() and sys.stdout.isatty()
    clever = terminal and os.environ.get("TERM", "dumb") != "dumb"
    console = Console(
        cell,
        lambda text: print(text, flush=terminal),
        scenario=scenario_from(chosen.scenario, cell),
        colour=clever and "NO_COLOR" not in os.environ,
        versions=versions(),
    )
    if chosen.file is not None:
        load_program(console, chosen.file)
    if clever:
        from viapoint.repl.terminal import converse_in_terminal

        converse_in_terminal(console)
        return 0
    from viapoint.repl.plain import converse, typed

    converse(console, typed(console) if terminal else sys.stdin, echo=not terminal)
    return 0 if terminal or not console.failures else 1
