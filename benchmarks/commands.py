"""Random commands at random ticks over random programs: what every run must keep, and how near it comes.

Override (0, up, down, back), halt, resume, stop, emergency stop with reset, single steps. Every run stays on
the path of the undisturbed one (independent forward kinematics), keeps every limit, and ends where that
one does, with the same events. One seed in ten has the sinusoidal profile, one the Bézier one.

python benchmarks/commands.py [runs] [first seed]
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests/runtime/kernel"))

from command_runs import CommandRun, Found, command_cell

PROFILES = {8: "sinusoidal", 9: "bezier"}
"""By the last digit of the seed; else the S-curve."""

RUNS = 1000


def main(runs: int = RUNS, first: int = 0) -> int:
    """Print every run that fails, with its seed and a reproducer, and a table; 1 if one has failed."""
    warnings.simplefilter("error")
    found: dict[int, Found] = {}
    begin = time.process_time()
    for seed in range(first, first + runs):
        run = CommandRun(seed, command_cell(PROFILES.get(seed % 10, "s-curve")))
        found[seed] = run.check()
        if found[seed].wrong:
            print(f"seed {seed}: {found[seed].wrong}\n{run.describe()}", flush=True)
    _table(found, time.process_time() - begin)
    return 1 if any(f.wrong for f in found.values()) else 0


def _table(found: dict[int, Found], seconds: float) -> None:
    failed = [seed for seed, f in found.items() if f.wrong]
    ticks = sum(f.ticks for f in found.values())
    seeds = f"seeds {min(found)}…{max(found)}"
    print(f"{len(found)} runs ({seeds}), {ticks} ticks, {seconds:.0f} s of processor time")
    print(f"{len(failed)} failed{': seeds ' + ', '.join(map(str, failed)) if failed else ''}\n")
    print("worst of all runs                 value  seed")
    off, turned = (
        max(found, key=lambda s, k=k: getattr(found[s], k)) for k in ("off_path", "off_orientation")
    )
    print(f"{'off the path, mm':30} {1e3 * found[off].off_path:8.1e}  {off}")
    print(f"{'off the orientation, rad':30} {found[turned].off_orientation:8.1e}  {turned}")
    for name in next(iter(found.values())).ratios:
        worst = max(found, key=lambda seed: found[seed].ratios[name])
        print(f"{name + ' ÷ limit':30} {found[worst].ratios[name]:8.4f}  {worst}")


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
