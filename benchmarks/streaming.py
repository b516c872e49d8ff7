"""A path without end: what each block costs, and what the process holds, from the first tenth to the last.

A closed polygon of 200 short lines with round corners is run round and round without a stop, in a session
that keeps the last events alone. Planning, simulation and memory are judged by the tenths of the run: the
cost of a block must stay what it is, and memory must not grow.

    python benchmarks/streaming.py [--blocks N]
"""

from __future__ import annotations

import argparse
import math
import random
import resource
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

from viapoint.runtime.cell import parse_cell
from viapoint.session import Session, compile_text

BLOCKS = 100_000
CORNERS, RADIUS, JITTER = 200, 100.0, 1.0  # mm
PARTS = 10
KEPT = 1000
GROWTH_GOAL, MEMORY_GOAL = 1.15, 20.0
"""Cost of a block in the last half over that in the first (the first tenth, which warms up, aside); MB that
memory may grow after the first tenth."""

PEAK_UNIT = 1e6 if sys.platform == "darwin" else 1e3
"""Of `ru_maxrss` in a MB."""


@dataclass(frozen=True)
class Part:
    """A tenth of the run: blocks, CPU seconds, simulated seconds; peak memory of the process so far, MB."""

    blocks: int
    seconds: float
    simulated: float
    memory: float

    @property
    def cost(self) -> float:
        """CPU ms per block."""
        return self.seconds / self.blocks * 1e3


def program() -> str:
    """Round and round."""
    draw = random.Random(5)
    lines = ["MJ X=1500 Y=0 Z=1400 A=0 B=90 C=0 F60", "LOOP:"]
    for k in range(CORNERS):
        angle = 2.0 * math.pi * k / CORNERS
        r = RADIUS + draw.uniform(-JITTER, JITTER)
        lines.append(f"ML X={1400 + r * math.cos(angle):.3f} Y={r * math.sin(angle):.3f} F300 R1")
    return "\n".join([*lines, "GOTO LOOP", ""])


class Counter:
    """Listener that counts blocks."""

    def __init__(self) -> None:
        self.blocks = 0

    def event(self, event: object) -> None:
        self.blocks += getattr(event, "kind", "") == "block"

    def window(self, window: object) -> None:
        """Windows are let go."""


def parts(blocks: int) -> list[Part]:
    """The run, in tenths."""
    cell = parse_cell('[robot]\nmodel = "frigeni6"\n')
    counter = Counter()
    session = Session(cell, compile_text(program(), "streaming", cell), keep=KEPT, listeners=[counter])
    done: list[Part] = []
    begin, clock, tick = 0, time.process_time(), 0
    for _ in session.run():
        if counter.blocks < blocks * (len(done) + 1) / PARTS:
            continue
        now = time.process_time()
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / PEAK_UNIT
        simulated = (session.kernel.tick - tick) * cell.tick
        done.append(Part(counter.blocks - begin, now - clock, simulated, memory))
        print(row(len(done), done[-1]), flush=True)
        begin, clock, tick = counter.blocks, time.process_time(), session.kernel.tick
        if len(done) == PARTS:
            return done
    raise SystemExit(f"the path ended after {counter.blocks} blocks: {session.failure}")


def row(number: int, part: Part) -> str:
    return (
        f"{number:5d} {part.blocks:9,d} {part.simulated:9.1f} {part.cost:9.3f}"
        f" {part.simulated / part.seconds:8.0f} {part.memory:8.1f}"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--blocks", type=int, default=BLOCKS)
    chosen = parser.parse_args(arguments)
    print(f"{'tenth':>5} {'blocks':>9} {'sim s':>9} {'ms/block':>9} {'x CPU':>8} {'peak MB':>8}")
    done = parts(chosen.blocks)
    early, late = done[1 : PARTS // 2], done[PARTS // 2 :]
    growth = sum(p.cost for p in late) / len(late) / (sum(p.cost for p in early) / len(early))
    memory = done[-1].memory - done[0].memory
    print(f"\nlater blocks cost {growth:.3f} times what earlier ones do (goal: at most {GROWTH_GOAL})")
    print(f"memory grew by {memory:.1f} MB after the first tenth (goal: at most {MEMORY_GOAL:g})")


if __name__ == "__main__":
    main()
