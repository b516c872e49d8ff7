"""The whole simulation measured: virtual machine, planning, ideal drives, recording, against real time.

Per program, with the compiled core and with its numpy twin, with and without a recording: times real time
(by wall clock and by CPU time), ticks per second, CPU milliseconds of planning per block (median, p99,
worst) and the longest single call of the planner or of the time law. The best of some runs counts, each
from the making of its session to its end or, recording, to the closed file.

The first line says how fast the machine is; figures of two machines compare by it. The contours and the
pick-and-place are judged as programs are run. The short lines have no goal but that of planning: a block that
lasts 75 ms and may take 1 ms to plan cannot be simulated 200 times faster than it lasts.

    python benchmarks/simulation.py [--quick] [--rounds N]
"""

from __future__ import annotations

import argparse
import random
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import probe

from viapoint.runtime import core
from viapoint.runtime.cell import Cell, load_cell, parse_cell
from viapoint.runtime.recording import REVOLUTE, Axis, Recorder, RunInfo
from viapoint.runtime.signals import Scenario, load_scenario
from viapoint.session import Listener, Loaded, Session, compile_file, compile_text

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
GOALS = {"contour": 200.0, "pick_and_place": 500.0}
"""Times real time to reach with the compiled core, recording; the twin has another."""

SECONDS = 3.0
"""Runs are repeated for so long at least: the short ones more often, as they are disturbed more easily."""

TWIN_GOAL = 25.0
MEDIAN_GOAL, P99_GOAL = 1.0, 5.0
"""ms of planning per block to stay under."""


@dataclass(frozen=True)
class Job:
    """What is run; `max_time` (s) ends it early."""

    name: str
    cell: Cell
    program: Loaded
    scenario: Scenario | None = None
    max_time: float | None = None


def example(name: str) -> Job:
    """An example of the repository."""
    folder = EXAMPLES / name
    cell = load_cell(folder / "cell.toml")
    scenario = folder / "scenario.toml"
    loaded = load_scenario(scenario, cell) if scenario.exists() else None
    return Job(name, cell, compile_file(folder / f"{name}.via", cell), loaded, 120.0)


def dense(blocks: int) -> Job:
    """A contour of short lines (2 to 8 mm, F300), rounded: the densest work there is for the planner."""
    draw = random.Random(17)
    cell = parse_cell('[robot]\nmodel = "frigeni6"\n')
    lines = ["MJ X=1400 Y=-400 Z=1400 A=0 B=90 C=0 F60"]
    x, y = 1400.0, -400.0
    for k in range(blocks):
        x = min(max(x + draw.uniform(-4.0, 4.0), 1250.0), 1550.0)
        y += draw.uniform(1.5, 6.0) * (1.0 if k // 200 % 2 == 0 else -1.0)
        lines.append(f"ML X={x:.3f} Y={y:.3f} F300 R1")
    return Job(f"{blocks} short lines", cell, compile_text("\n".join(lines) + "\n", "dense", cell))


def recorder(job: Job, path: Path) -> Recorder:
    """A recorder as the command line makes it."""
    limits, robot = job.cell.robot.limits, job.cell.robot
    axes = tuple(
        Axis(
            name=f"J{k + 1}",
            kind=REVOLUTE,
            lower=float(limits.lower[k]),
            upper=float(limits.upper[k]),
            speed=float(limits.speed[k]),
            acceleration=float(limits.acceleration[k]),
            jerk=float(limits.jerk[k]),
        )
        for k in range(robot.joint_count)
    )
    info = RunInfo(
        program_name=job.name,
        program_source=job.program.source.text,
        tick_s=job.cell.tick,
        axes=axes,
        robot=robot.name,
    )
    return Recorder(path, info, skeleton=robot.link_points)


def measure(job: Job, core_name: str, recorded: bool, rounds: int, seconds: float = 0.0) -> probe.Cost:
    """The quickest of so many runs, and of as many more as begin within so many seconds."""
    core.asked = core_name
    end = time.perf_counter() + seconds
    try:
        runs = [_once(job, recorded) for _ in range(rounds)]
        while time.perf_counter() < end:
            runs.append(_once(job, recorded))
        return min(runs, key=lambda cost: cost.wall)
    finally:
        core.asked = "auto"


def _once(job: Job, recorded: bool) -> probe.Cost:
    def session(listeners: Sequence[Listener]) -> Session:
        return Session(
            job.cell, job.program, scenario=job.scenario, max_time=job.max_time, listeners=listeners
        )

    with tempfile.TemporaryDirectory() as folder:
        wall, cpu = time.perf_counter(), time.process_time()
        if recorded:
            with recorder(job, Path(folder) / "run.mcap") as listener:
                cost = probe.run(session((listener,)))
        else:
            cost = probe.run(session(()))
        return replace(cost, wall=time.perf_counter() - wall, cpu=time.process_time() - cpu)


def row(job: Job, core_name: str, recorded: bool, cost: probe.Cost) -> str:
    planned = cost.planned
    return (
        f"{job.name:18} {core_name:9} {'yes' if recorded else 'no':>4} {cost.simulated:8.1f}"
        f" {cost.wall:7.2f} {cost.times_real:8.0f} {cost.times_real_cpu:8.0f} {cost.ticks / cost.wall:10,.0f}"
        f" {len(planned.blocks):7d} {planned.quantile(0.5):7.2f} {planned.quantile(0.99):7.2f}"
        f" {planned.quantile(1.0):7.2f} {planned.longest_call * 1e3:8.1f}"
    )


HEAD = (
    f"{'program':18} {'core':9} {'rec':>4} {'sim s':>8} {'wall s':>7} {'x wall':>8} {'x CPU':>8}"
    f" {'ticks/s':>10} {'blocks':>7} {'median':>7} {'p99':>7} {'worst':>7} {'call ms':>8}"
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer rounds and blocks")
    parser.add_argument("--rounds", type=int, default=3)
    chosen = parser.parse_args(arguments)
    rounds = 1 if chosen.quick else chosen.rounds
    jobs = [example("contour"), example("pick_and_place"), dense(400 if chosen.quick else 2000)]
    names = ("python",) if core.built("timing._core") is None else ("compiled", "python")
    _once(jobs[1], recorded=True)  # imports and first use are not what is measured
    print(probe.machine(), end="\n\n")
    print(HEAD)
    verdicts = []
    for job in jobs:
        for name in names:
            for recorded in (True, False):
                compiled = name == "compiled"
                cost = measure(job, name, recorded, rounds if compiled else 1, SECONDS if compiled else 0.0)
                print(row(job, name, recorded, cost), flush=True)
                if recorded:
                    verdicts += _judge(job, name, cost)
    print("\ngoals, recording on: ratio to the goal (1 or more is reached)")
    print("\n".join(verdicts))


def _judge(job: Job, core_name: str, cost: probe.Cost) -> list[str]:
    compiled = core_name == "compiled"
    rows = []
    if job.name in GOALS:
        wanted = GOALS[job.name] if compiled else TWIN_GOAL
        rows.append((f"times real time >= {wanted:g}", cost.times_real / wanted))
        rows.append((f"  by CPU time >= {wanted:g}", cost.times_real_cpu / wanted))
    if compiled:
        rows.append((f"planning per block, median <= {MEDIAN_GOAL:g} ms", _share(cost, 0.5, MEDIAN_GOAL)))
        rows.append((f"planning per block, p99 <= {P99_GOAL:g} ms", _share(cost, 0.99, P99_GOAL)))
    return [f"{job.name:18} {core_name:9} {text:44} {ratio:6.2f}" for text, ratio in rows]


def _share(cost: probe.Cost, quantile: float, goal: float) -> float:
    return goal / max(cost.planned.quantile(quantile), 1e-9)


if __name__ == "__main__":
    main()
