"""How near to the fastest the robot runs its paths, what its ticks show, and what planning costs.

The paths are programs (see `paths`), run as a whole session runs them: planned ahead piece by piece. Judged
is the path from its start to its end, both at rest. The first table is for jerk limits of 10 /s times the
acceleration limits. Its columns: blocks; duration (s); its lower bound, by speed and acceleration alone
(TOPP-RA), and the ratio to it; the ratio to one law with everything known beforehand; largest ticks over
their limits, of the joints' and of the path's speed, acceleration and jerk (1, 1 and 1.05 are allowed); by
how many percent the programmed speed was passed; ms of planning per block (median, p99, worst); ticks per
second. The second table has jerk limits raised 1000-fold, against the same bound. The third one, for some
paths, is against the local optimum of an NLP within the same limits.

    python benchmarks/oracles.py [--quick]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import bounds
import numpy as np
import paths
import probe
from sections import Section, lay

from viapoint.report import limits_report
from viapoint.runtime.cell import parse_cell
from viapoint.runtime.timing import TimeLaw, plan
from viapoint.session import Session, compile_text

USUAL, SHARP, FREE = 10.0, 50.0, 1e4
"""1/s: jerk limits in units of acceleration limits."""

BOUND_GOAL = 1.02
WORST_GOAL, MEDIAN_GOAL = 1.06, 1.03
SPACING, QUICK_SPACING = 0.003, 0.006
"""s between the nodes of the NLP."""

SECONDS = 60.0
"""Time limit of one solve of it."""

PLANNING_GOALS = ((0.5, "median", 1.0), (0.99, "p99", 5.0))
"""ms of planning per block to stay under, of all blocks of all paths."""

ROUNDS = 3
"""A program is run so often for the first table, and the quickest run counts: machines are disturbed."""


def section(program: paths.Program, jerk: float) -> Section:
    return lay(program.text, parse_cell(paths.cell_text(jerk)))


def whole(path: Section) -> TimeLaw:
    """One law with everything known beforehand."""
    return plan(path, path.limits, path.bound, s_start=path.begin, s_end=path.end, tick=path.tick)


def run(program: paths.Program, jerk: float, rounds: int = 1) -> tuple[probe.Cost, float]:
    """The session of a program, the quickest of some, and the duration of its path."""
    cell = parse_cell(paths.cell_text(jerk))
    compiled = compile_text(program.text, program.name, cell)
    cost = min((probe.run(Session(cell, compiled)) for _ in range(rounds)), key=lambda cost: cost.cpu)
    blocks = [event for event in cost.session.events if event.kind == "block"]
    return cost, float(blocks[-1].data["t_end"] or 0.0) - blocks[1].t


LIMITS = ("joint_speed", "joint_acceleration", "joint_jerk", "path_speed", "path_acceleration", "path_jerk")


def peaks(session: Session) -> str:
    """Largest ticks over limits, and by how much the programmed speed was passed, in percent."""
    report = limits_report(session)
    ratios = " ".join(f"{np.max(report[name]):6.3f}" for name in LIMITS)
    return f"{ratios} {100.0 * max(report['programmed_speed'] - 1.0, 0.0):6.2f}"


HEAD = (
    f"{'jerk = 10 /s x acceleration':32} {'blocks':>6} {'run s':>8} {'bound s':>8} {'/bound':>7}"
    f" {'/whole':>7} {'j.spd':>6} {'j.acc':>6} {'j.jrk':>6} {'p.spd':>6} {'p.acc':>6} {'p.jrk':>6}"
    f" {'over%':>6} {'median':>7} {'p99':>7} {'worst':>7} {'ticks/s':>9}"
)


def first_table(programs: Sequence[paths.Program]) -> list[str]:
    print(HEAD)
    run(programs[0], USUAL)  # imports and first use are not what is measured
    blocks = []
    for program in programs:
        path = section(program, USUAL)
        law = whole(path)
        least = bounds.acceleration_bound(path, (law.s, law.t))
        cost, duration = run(program, USUAL, ROUNDS)
        planned = cost.planned
        blocks.append(planned.blocks)
        times = " ".join(f"{planned.quantile(q):7.2f}" for q in (0.5, 0.99, 1.0))
        print(
            f"{program.name:32} {len(planned.blocks) - 1:6d} {duration:8.3f} {least:8.3f}"
            f" {duration / least:7.4f} {duration / law.duration:7.4f}"
            f" {peaks(cost.session)} {times} {cost.ticks / cost.wall:9,.0f}",
            flush=True,
        )
    every = probe.Planned(np.concatenate(blocks), 0.0)
    shares = (f"{name} {every.quantile(q):.2f} ms (goal {goal:g})" for q, name, goal in PLANNING_GOALS)
    return [f"planning per block, all {len(every.blocks)} of {len(programs)} paths: {', '.join(shares)}"]


def second_table(programs: Sequence[paths.Program]) -> list[str]:
    print(
        f"\n{'jerk raised 1000-fold':36} {'run s':>8} {'whole s':>8}"
        f" {'TOPP-RA':>8} {'run /':>7} {'whole /':>7}"
    )
    ratios, wholes = [], []
    for program in programs:
        path = section(program, FREE)
        law = whole(path)
        least = bounds.acceleration_bound(path, (law.s, law.t))
        _, duration = run(program, FREE)
        ratios.append(duration / least)
        wholes.append(law.duration / least)
        print(
            f"{program.name:36} {duration:8.3f} {law.duration:8.3f} {least:8.3f}"
            f" {ratios[-1]:7.4f} {wholes[-1]:7.4f}{'  missed' if ratios[-1] > BOUND_GOAL else ''}",
            flush=True,
        )
    inside = sum(ratio <= BOUND_GOAL for ratio in ratios)
    return [
        f"run / TOPP-RA: {inside} of {len(ratios)} paths <= {BOUND_GOAL}, median {np.median(ratios):.4f},"
        f" worst {max(ratios):.4f} (whole: median {np.median(wholes):.4f}, worst {max(wholes):.4f})"
    ]


def third_table(programs: Sequence[paths.Program], spacing: float) -> list[str]:
    print(
        f"\n{'jerk-limited optimum':36} {'jerk/acc':>8} {'run s':>8} {'whole s':>8}"
        f" {'NLP s':>8} {'run /':>7} {'whole /':>7}"
    )
    verdicts = []
    for jerk in (USUAL, SHARP):
        ratios = []
        for program in programs:
            path = section(program, jerk)
            law = whole(path)
            best = bounds.optimum(path, (law.s, law.t), spacing, SECONDS)
            _, duration = run(program, jerk)
            if best.good:
                ratios.append(duration / best.duration)
            print(
                f"{program.name:36} {jerk:8g} {duration:8.3f} {law.duration:8.3f} {best.duration:8.3f}"
                f" {duration / best.duration:7.4f} {law.duration / best.duration:7.4f}"
                f"{'' if best.good else '  not solved: ' + best.status}",
                flush=True,
            )
        verdicts.append(
            f"run / optimum at {jerk:g}: median {np.median(ratios):.4f} (goal {MEDIAN_GOAL}),"
            f" worst {max(ratios):.4f} (goal {WORST_GOAL}), {len(ratios)} of {len(programs)} solved"
        )
    return verdicts


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="fewer paths, a coarser optimum")
    chosen = parser.parse_args(arguments)
    programs = paths.programs()
    judged = [program for program in programs if program.with_optimum]
    verdicts = first_table(judged if chosen.quick else programs)
    verdicts += second_table(judged if chosen.quick else programs)
    verdicts += third_table(
        judged[:2] if chosen.quick else judged, QUICK_SPACING if chosen.quick else SPACING
    )
    print("\n" + "\n".join(verdicts))


if __name__ == "__main__":
    main()
