"""What a tick costs with corrections, the joint filter and a belt: µs of computing time per tick, and ratios.

python benchmarks/tracking.py
"""

from __future__ import annotations

import time

from viapoint.runtime.cell import parse_cell
from viapoint.runtime.signals import parse_scenario
from viapoint.session import Session, Status, compile_text

CELL = """[robot]
model = "frigeni6"
[controller]
{controller}
[points]
P1 = {{ x = 1500, y = -400, z = 1300, a = 0, b = 90, c = 0 }}
P2 = {{ x = 1500, y = -300, z = 1300, a = 0, b = 90, c = 0 }}
P3 = {{ x = 1400, y = -300, z = 1250, a = 0, b = 90, c = 0 }}
[[conveyors]]
index = 1
xyz = [1400, -1500, 500]
abc = [0, 0, 90]
counts_per_mm = 100
"""
BELT = "[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, 40]]\nnoise_counts = 0.5\n"
CORRECTION = '[[correction]]\nframe = "tool"\nz_mm = [[2, 0], [3, 2], [4, -2], [9, 2]]\nmax_rate_mm_s = 10\n'
MOTIONS = "ML P2 F100\nML P3 R10\nML P1\nML P2\nML P3\n"
FREE = f"MJ P1 F60\n{MOTIONS}WAIT 2\n"
TRACKED = f"MJ P1 F60\nTRK 1\n{MOTIONS}WAIT 2\nTRK 0\n"
CASES = {
    "nothing added": (FREE, "", ""),
    "joint filter, 20 ticks": (FREE, "filter = { ticks = 20 }", ""),
    "correction in the tool": (FREE, "", CORRECTION),
    "on a belt, noisy encoder": (TRACKED, "", BELT),
    "belt, correction and filter": (TRACKED, "filter = { ticks = 20 }", BELT + CORRECTION),
}
ROUNDS = 3


def cost(program: str, controller: str, scenario: str) -> float:
    """Least µs per tick of a few runs."""
    cell = parse_cell(CELL.format(controller=controller))
    loaded, happenings = compile_text(program, cell=cell), parse_scenario(scenario, cell)
    best = float("inf")
    for _ in range(ROUNDS):
        session = Session(cell, loaded, scenario=happenings)
        begin = time.process_time()
        if session.finish() is not Status.FINISHED:
            raise SystemExit(f"the run ended with {session.failure}")
        best = min(best, (time.process_time() - begin) / session.kernel.tick)
    return best * 1e6


def main() -> None:
    base = None
    print(f"{'':30}{'µs per tick':>12}{'ratio':>8}{'× real time':>13}")
    for name, case in CASES.items():
        found = cost(*case)
        base = base or found
        print(f"{name:30}{found:12.1f}{found / base:8.2f}{1000.0 / found:13.0f}")


if __name__ == "__main__":
    main()
