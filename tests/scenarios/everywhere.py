"""One program under all conditions that must not matter: override 100 and 37 %, windows of 1 and 1024."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

from session_runs import Floats, Run, run
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.session import Session, compile_text

CELL = """
[robot]
model = "frigeni6"
home = [-1.5, 9.5, 38, 0, 42, -1.9]
[[tools]]
index = 1
xyz = [80, 0, 0]
[[tools]]
index = 2
xyz = [60, 0, 20]
abc = [0, 30, 0]
[points]
P1 = { x = 1500, y = -50, z = 1500, a = 0, b = 90, c = 0 }
P2 = { x = 1500, y = 50, z = 1500, a = 0, b = 90, c = 0 }
P3 = { x = 1600, y = 50, z = 1500, a = 0, b = 90, c = 0 }
P4 = { x = 1600, y = -50, z = 1500, a = 0, b = 90, c = 0 }
P7 = { j = [5, 10, 30, 10, 45, 5] }
[m_functions]
5 = "async"
"""
"""Points close together, so that runs are short."""

OVERRIDES = (1.0, 0.37)
WINDOWS = (1, 1024)
SAME = 1e-9
"""rad or m between set points computed in windows of different lengths."""

STANDING = 1e-6
"""rad or m per tick: a thousandth of what the slowest of these runs moves by."""

PATH_TOLERANCE = 2e-6
"""m between a path and the chords between its ticks."""


@cache
def place() -> Cell:
    """The cell of all scenarios."""
    return parse_cell(CELL)


def everywhere(
    text: str, where: Cell | None = None, *, scenario: str | None = None, **options: Any
) -> Iterator[Run]:
    """Runs of a program at each override; what windows of different lengths give has been found equal."""
    for override in OVERRIDES:
        short, long = (
            run(text, where or place(), scenario=scenario, override=override, window=window, **options)
            for window in WINDOWS
        )
        assert short.history == long.history
        assert (short.status, short.code) == (long.status, long.code)
        assert short.joints.shape == long.joints.shape
        assert np.abs(short.joints - long.joints).max() < SAME
        assert not long.over_limits()
        yield long


def finished(text: str, where: Cell | None = None, **options: Any) -> Iterator[Run]:
    """The same, of programs that run to their end."""
    for done in everywhere(text, where, **options):
        assert done.status == "finished", done.session.failure
        yield done


def line_at(done: Run, tick: int) -> int:
    """Source line the path is in."""
    return int(done.column("line")[tick])


def stands(done: Run, tick: int) -> bool:
    """Whether the robot has come to rest in a tick; it may set out again in the next."""
    return bool(np.abs(np.diff(done.joints[tick - 1 : tick + 2], axis=0)).max() < STANDING)


def on_the_path_of(done: Run, automatic: Run, part: Any = slice(None)) -> float:
    """How far the TCP gets, in part of its ticks, from where it is at the same length in another run, m."""
    s, position = automatic.column("s"), automatic.column("position")
    rows = np.flatnonzero(np.diff(s, prepend=-1.0) > 0.0)
    at = np.stack([np.interp(done.column("s"), s[rows], position[rows, k]) for k in range(3)], axis=1)
    return float(np.linalg.norm(done.column("position") - at, axis=1)[part].max())


def session_of(text: str, **options: Any) -> Session:
    where = place()
    return Session(where, compile_text(text, cell=where), **options)


def nearest_to(done: Run, point: Floats, first: int, last: int) -> int:
    """The tick of a range in which the TCP is nearest to a point."""
    distance = np.linalg.norm(done.column("position")[first : last + 1] - point, axis=1)
    return first + int(np.argmin(distance))
