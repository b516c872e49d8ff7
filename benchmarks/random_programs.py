"""Random programs of every kind of motion: limits, ranges, path and end of each, and how near they come.

Lines, turns in place, circles, splines, joint moves and HOME, with and without R, every kind of speed, tools
and frames; one seed in four moves two auxiliary axes too, one in ten has the sinusoidal profile, one the
Bézier one. Judged by forward kinematics that are not the kernel's.

python benchmarks/random_programs.py [programs] [first seed]
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests/runtime/kernel"))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from program_checks import assert_keeps_all
from programs_at_random import Arm, Programmed, random_program

from session_runs import cell, run
from viapoint.report import limits_report

PROGRAMS = 2000
PROFILES = {8: "sinusoidal", 9: "bezier"}
"""By the last digit of the seed; else the S-curve."""

AUXILIARY = 4
"""One seed in so many moves auxiliary axes."""

AXES = """
[auxiliary_axes.E1]
kind = "linear"
range = [0, 3000]
speed = 1000
acceleration = 3000
[auxiliary_axes.E2]
kind = "rotary"
range = [-720, 720]
speed = 180
acceleration = 600
jerk = 9000
"""


@dataclass(frozen=True)
class Found:
    """One program: what was wrong, how it ended, its ticks and its peaks."""

    wrong: str
    code: str | None
    ticks: int
    ratios: dict[str, float]


def one(seed: int, arm: Arm) -> Found:
    """Run one program and judge it."""
    program = random_program(seed)
    moves_auxiliary = seed % AUXILIARY == 0
    if moves_auxiliary:
        _with_auxiliary(program, seed)
    profile = f'profile = "{PROFILES.get(seed % 10, "s-curve")}"'
    done = run(program.text, cell(controller=profile, more=AXES if moves_auxiliary else ""), max_time=60.0)
    wrong = ""
    try:
        assert_keeps_all(done, program, arm, "")
    except AssertionError as error:
        wrong = f"{error} ({done.status}, {done.session.failure})\n{program.text}"
    ratios = {name: float(np.max(value)) for name, value in limits_report(done.session).items()}
    return Found(wrong, done.code, done.session.kernel.tick, ratios)


def _with_auxiliary(program: Programmed, seed: int) -> None:
    """Let E1 and E2 move with some of the motions."""
    rng = np.random.default_rng(seed)
    for k, line in enumerate(program.lines):
        if line[:2] in ("ML", "MJ", "MC", "MS") and rng.random() < 0.7:
            program.lines[k] = f"{line} E1={rng.uniform(0, 900):.0f} E2={rng.uniform(-200, 200):.0f}"


def main(programs: int = PROGRAMS, first: int = 0) -> int:
    """Print every program that fails, with its seed, and a table; 1 if one has failed."""
    warnings.simplefilter("error")
    arm, begin = Arm(), time.process_time()
    found: dict[int, Found] = {}
    for seed in range(first, first + programs):
        found[seed] = one(seed, arm)
        if found[seed].wrong:
            print(f"seed {seed}: {found[seed].wrong}", flush=True)
    _table(found, time.process_time() - begin)
    return 1 if any(f.wrong for f in found.values()) else 0


def _table(found: dict[int, Found], seconds: float) -> None:
    failed = [str(seed) for seed, f in found.items() if f.wrong]
    refused = sum(f.code is not None for f in found.values())
    ticks = sum(f.ticks for f in found.values())
    seeds = f"seeds {min(found)}…{max(found)}"
    print(f"{len(found)} programs ({seeds}), {ticks} ticks, {seconds:.0f} s of processor time")
    print(f"{refused} refused before the motion that cannot be; {len(failed)} failed {', '.join(failed)}\n")
    print("worst of all programs             value  seed")
    for name in dict.fromkeys(name for f in found.values() for name in f.ratios):
        worst = max(found, key=lambda seed: found[seed].ratios.get(name, 0.0))
        print(f"{name + ' ÷ limit':30} {found[worst].ratios[name]:8.4f}  {worst}")


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
