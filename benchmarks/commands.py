"""Random commands at random ticks over random programs: how many runs keep every limit and end in place.

python benchmarks/commands.py [runs] [first seed]
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests/runtime/kernel"))

from command_runs import CommandRun


def main(runs: int = 1000, first: int = 0) -> int:
    """Print every run that fails, with its seed and a reproducer; the number of them is the exit code."""
    warnings.simplefilter("error")
    failed = 0
    for seed in range(first, first + runs):
        run = CommandRun(seed)
        wrong = run.check()
        if wrong:
            failed += 1
            print(f"seed {seed}: {wrong}\n{run.describe()}", flush=True)
    print(f"{runs - failed} of {runs} runs keep every limit and end as without commands (seeds from {first})")
    return min(failed, 125)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
