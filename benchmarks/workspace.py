"""What watching the workspace costs: per pair, per look, per tick of a window, per block of a contour.

`python benchmarks/workspace.py` prints µs; nothing is written.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from viapoint.runtime.cell import parse_cell
from viapoint.runtime.workspace import Monitor, Watch
from viapoint.runtime.workspace.distances import segment_box, segment_segment
from viapoint.session import Session, compile_text

PAIRS = 20_000
WINDOW = 1024
BLOCKS = 400
ROBOT = '[robot]\nmodel = "frigeni6"\n'
BODILESS = '[robot]\nmodel = "frigeni6"\n[body]\nradius_mm = [0, 0, 0, 0, 0, 0]\n'
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


def ticks(name: str, cell: str) -> None:
    """One second of a line at 200 mm/s, as the ticks of a window; and one look of many rows."""
    monitor = Monitor(parse_cell(cell))
    q = np.linspace([0.0, 0.1, 0.2, 0.0, 1.2, 0.0], [0.15, 0.2, 0.1, 0.0, 1.25, 0.1], WINDOW)
    watch = Watch(monitor)

    def window() -> None:
        travel = np.cumsum(np.abs(np.diff(q, axis=0, prepend=q[:1])) @ monitor.pace(0))
        watch.look(travel, q.__getitem__, 0)
        watch.advance(WINDOW - 1)

    look = seconds(lambda: monitor.clearances(q, 0)) / WINDOW
    print(f"{name:24} look {look * 1e6:8.2f} µs   tick {seconds(window) / WINDOW * 1e6:8.3f} µs")


def planning(name: str, cell: str) -> float:
    """µs of a whole run per block, the parts of the workspace by their difference."""
    program = compile_text(contour(BLOCKS))

    def run() -> None:
        session = Session(parse_cell(cell), program)
        session.finish()
        assert session.failure is None, session.failure

    per_block = seconds(run, 3) / BLOCKS
    print(f"{name:24} run  {per_block * 1e6:8.0f} µs per block")
    return per_block


def main() -> None:
    """All figures."""
    pairs()
    cases = {
        "nothing to watch": BODILESS,
        "own body": ROBOT,
        "own body, 4 zones": ROBOT + FOUR,
        "own body, 5 zones, union": ROBOT + FOUR + ANNEXE,
    }
    for name, cell in cases.items():
        ticks(name, cell)
    for name, cell in cases.items():
        planning(name, cell)


if __name__ == "__main__":
    main()
