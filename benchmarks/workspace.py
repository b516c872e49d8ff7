"""What watching the workspace costs: per pair, per look, per tick of a window, per block of a contour.

`python benchmarks/workspace.py` prints µs; nothing is written.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from viapoint.runtime.cell import parse_cell
from viapoint.runtime.kernel.joining import Joined
from viapoint.runtime.workspace import Monitor
from viapoint.runtime.workspace.distances import segment_box, segment_segment
from viapoint.session import Session, compile_text

PAIRS = 20_000
WINDOW = 1024
BLOCKS = 400
ROBOT = '[robot]\nmodel = "frigeni6"\n'
BODILESS = ROBOT + "[body]\nradius_mm = [0, 0, 0, 0, 0, 0]\n"
FOUR = """
[[zones]]
name = "table"
kind = "forbidden"
corner_1 = [800, -1000, 0]
corner_2 = [2500, 1000, 1100]
[[zones]]
name = "post"
kind = "forbidden"
corner_1 = [1000, 1300, 0]
corner_2 = [1100, 1400, 3000]
[[zones]]
name = "cage"
kind = "safe"
corner_1 = [-1500, -2500, -500]
corner_2 = [2600, 2500, 3600]
[[zones]]
name = "shared"
kind = "exclusive"
corner_1 = [1700, -300, 1100]
corner_2 = [2000, 300, 2000]
"""
ANNEXE = """
[[zones]]
name = "annexe"
kind = "safe"
corner_1 = [2500, -500, 500]
corner_2 = [3500, 500, 2500]
"""


def seconds(action: Callable[[], object], repeats: int = 5) -> float:
    """The best of some times."""
    best = np.inf
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        best = min(best, time.perf_counter() - start)
    return float(best)


def contour(blocks: int) -> str:
    """A circle of short lines at Z = 1500, tool down, over the table."""
    angles = np.linspace(0.0, 2.0 * np.pi, blocks)
    lines = [f"ML X={1500 + 150 * np.cos(a):.3f} Y={150 * np.sin(a):.3f} F200" for a in angles]
    return "\n".join(["MJ X=1650 Y=0 Z=1500 A=0 B=90 C=0 F50", *lines, ""])


def pairs() -> None:
    """The bare formulas."""
    rng = np.random.default_rng(1)
    a, b, c, d = rng.uniform(-1.0, 1.0, (4, PAIRS, 3))
    half = rng.uniform(0.1, 0.5, (PAIRS, 3))
    print(f"segment–segment   {seconds(lambda: segment_segment(a, b, c, d)) / PAIRS * 1e6:8.2f} µs per pair")
    print(f"segment–cuboid    {seconds(lambda: segment_box(a, b, half)) / PAIRS * 1e6:8.2f} µs per pair")


def look(name: str, cell: str) -> None:
    """A look at many rows, and one at few."""
    monitor = Monitor(parse_cell(cell))
    q = np.linspace([0.0, 0.1, 0.2, 0.0, 1.2, 0.0], [0.15, 0.2, 0.1, 0.0, 1.25, 0.1], WINDOW)
    many = seconds(lambda: monitor.clearances(q, 0)) / WINDOW
    few = seconds(lambda: monitor.clearances(q[:8], 0), 50)
    print(f"{name:26} a look at {WINDOW} rows {many * 1e6:6.2f} µs per row, at 8 rows {few * 1e6:5.0f} µs")


class Stopwatch:
    """Counts the time spent in a function."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        self.total = 0.0

    def __call__(self, *arguments: Any) -> Any:
        start = time.perf_counter()
        try:
            return self.function(*arguments)
        finally:
            self.total += time.perf_counter() - start


def _let_pass(_: Any, joined: Joined, *__: Any) -> tuple[int, None]:
    return len(joined.lengths), None


def run(name: str, cell: str) -> None:
    """A contour of short lines: time in the two doors, per tick and per block; the best of some runs."""
    program, per_tick, per_block = compile_text(contour(BLOCKS)), np.inf, np.inf
    for _ in range(4):
        session = Session(parse_cell(cell), program)
        kernel = session.kernel
        guard = kernel.outlet.guard
        doors = [Stopwatch(guard.watch), Stopwatch(guard.sent)]
        guard.watch, guard.sent = doors  # type: ignore[method-assign]
        planned = Stopwatch(kernel.planner.route.axes.inspect or _let_pass)
        kernel.planner.route.axes.inspect = planned
        session.finish()
        assert session.failure is None, session.failure
        per_tick = min(per_tick, sum(door.total for door in doors) / kernel.tick)
        per_block = min(per_block, planned.total / BLOCKS)
    print(f"{name:26} {per_tick * 1e6:6.3f} µs per tick, planning {per_block * 1e6:6.1f} µs per block")


def main() -> None:
    """All figures."""
    pairs()
    cases = {
        "nothing to watch": BODILESS,
        "own body": ROBOT,
        "own body, 3 zones": ROBOT + FOUR[: FOUR.rindex("[[zones]]")],
        "the same, through a 4th": ROBOT + FOUR,
        "own body, 5 zones, union": ROBOT + FOUR + ANNEXE,
    }
    for name, cell in cases.items():
        look(name, cell)
    for name, cell in cases.items():
        run(name, cell)


if __name__ == "__main__":
    main()
