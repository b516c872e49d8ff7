"""Random commands at random ticks over random programs: one run, and what must hold for it.

Used by the tests with a few seeds, and by `benchmarks/commands.py` with as many as wanted.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from path_oracle import PathOracle
from programs_at_random import DEG, Floats

from viapoint.report import limits_report
from viapoint.runtime.cell import Cell, default_cell
from viapoint.runtime.kernel import State
from viapoint.session import Session, Status, compile_text

ROUNDING = 1e-9
MOST_TICKS = 120_000
ON_PATH, ON_ORIENTATION = 1e-9, 1e-8
"""m and rad off the path: 1e-6 mm."""

LOOKS = 120
"""Ticks of a run that are compared with the path."""

STEPPED = 4
"""One seed in so many runs motion by motion, with single steps among the commands."""

COMMANDS = ["override"] * 6 + ["halt"] * 3 + ["resume", "back", "back", "emergency", "emergency"]
STOPPED = 0.06
"""Part of the runs that end with a stop instead of the end of the program."""


def command_cell(profile: str = "s-curve") -> Cell:
    """The default cell with a home in front of the robot, so that no time is spent in getting there."""
    home = (0.0, 6.0 * DEG, 8.0 * DEG, 0.0, 70.0 * DEG, 0.0)
    return replace(default_cell(), home=home, profile=profile)  # type: ignore[arg-type]


def random_program(rng: np.random.Generator) -> str:
    """A few rounded, smooth and sharp motions of every kind about a place in front of frigeni6."""
    lines = ["MJ X=1500 Y=0 Z=1700 A=0 B=90 C=0 F100"]
    for _ in range(int(rng.integers(2, 6))):
        x, y, z = 1500 + rng.uniform(-150, 150), rng.uniform(-200, 200), 1700 + rng.uniform(-100, 100)
        rounded = f" R{rng.uniform(5, 40):.1f}" if rng.random() < 0.6 else ""
        speed = f" F{rng.uniform(150, 600):.0f}" if rng.random() < 0.5 else ""
        where = f"X={x:.1f} Y={y:.1f} Z={z:.1f}"
        if rng.random() < 0.3:
            a, b, c = rng.uniform(-30, 30), 90 + rng.uniform(-30, 20), rng.uniform(-30, 30)
            where += f" A={a:.1f} B={b:.1f} C={c:.1f}"
        match int(rng.integers(0, 6)):
            case 0:
                lines.append(f"MS {where}{speed}")
            case 1:
                lines.append(f"MJ {where} F60{rounded}")
            case 2:
                turns = f" H{rng.uniform(-300, 300):.0f}" if rng.random() < 0.3 else ""
                through = f"QX={x - 90:.1f} QY={y + 70:.1f} QZ={z + 40:.1f}"
                lines.append(f"MC {where} {through} F200{turns}{rounded}")
            case _:
                lines.append(f"ML {where} F{rng.uniform(150, 600):.0f}{rounded}")
        if rng.random() < 0.3:
            lines.append(f"SET DO{int(rng.integers(1, 9))}")
    return "\n".join(lines) + "\n"


@dataclass
class Found:
    """What a run has shown."""

    wrong: list[str] = field(default_factory=list)
    off_path: float = 0.0  # m
    off_orientation: float = 0.0  # rad
    ratios: dict[str, float] = field(default_factory=dict)
    """Largest peak ÷ limit by name; in a run with an emergency stop ÷ what such a stop may take."""
    ticks: int = 0


class CommandRun:
    """One program run once undisturbed and once under random commands."""

    def __init__(self, seed: int, cell: Cell | None = None) -> None:
        self.seed = seed
        self.rng = np.random.default_rng(seed)
        self.cell = cell or command_cell()
        self.text = random_program(self.rng)
        self.stepped = seed % STEPPED == STEPPED - 1
        self.log: list[tuple[int, str]] = []
        self.emergency = False
        self._joints: list[Floats] = []

    def describe(self) -> str:
        """A reproducer."""
        return f"{self.text}profile {self.cell.profile}, step {self.stepped}, commands: {self.log}"

    def session(self, window: int) -> Session:
        program = compile_text(self.text, cell=self.cell)
        return Session(self.cell, program, window=window, step=self.stepped)

    def disturbed(self) -> Session:
        """The program under commands; it always comes to its end."""
        session = self.session(int(self.rng.integers(5, 200)))
        wait, commands = int(self.rng.integers(10, 300)), 10
        stop_after = int(self.rng.integers(1, 10)) if self.rng.random() < STOPPED else -1
        while session.status is Status.RUNNING and session.kernel.tick < MOST_TICKS:
            for window in session.run():
                self._joints.append(window.joints)
                wait -= len(window)
                held = session.kernel.state in (State.EMERGENCY, State.HALTED)
                if (held and self.rng.random() < 0.25) or (wait <= 0 and commands):
                    break
            else:
                break
            if (held and wait > 0) or not commands:
                self._go_on(session)
            else:
                commands -= 1
                wait = int(self.rng.integers(10, 400))
                self._command(session, "stop" if commands == stop_after else None)
        return session

    def _go_on(self, session: Session) -> None:
        if session.kernel.state in (State.EMERGENCY, State.HALTED):
            self.log.append((session.kernel.tick, "reset, resume, forward"))
            session.reset()
            session.resume()
            session.set_override(float(self.rng.choice([0.37, 1.0])))

    def _command(self, session: Session, choice: str | None) -> None:
        choices = COMMANDS + ["step"] * 4 if self.stepped else COMMANDS
        choice = choice or str(self.rng.choice(choices))
        tick = session.kernel.tick
        match choice:
            case "override":
                override = float(self.rng.choice([0.0, 0.1, 0.2, 0.5, 0.8, 1.0]))
                choice = f"override {override}"
                session.set_override(override)
            case "back":
                override = -float(self.rng.uniform(0.1, 1.0))
                choice = f"override {override:.3f}"
                session.set_override(override)
            case "halt":
                session.halt()
            case "resume":
                session.resume()
            case "step":
                self._joints += [window.joints for window in session.step()]
            case "stop":
                session.stop()
            case "emergency":
                self.emergency = True
                session.emergency_stop()
        self.log.append((tick, choice))

    def check(self) -> Found:
        """What the run has shown, and what of it does not hold."""
        plain = self.session(1024)
        oracle = PathOracle(plain)
        plain.finish()
        session = self.disturbed()
        found = Found(ticks=session.kernel.tick)
        self._check_limits(session, found)
        self._check_end(session, plain, found)
        joints = np.concatenate(self._joints)
        looks = self.rng.integers(0, len(joints), LOOKS)
        found.off_path, found.off_orientation = oracle.deviations(joints[looks])
        path, orientation = self.may_be_off(session)
        if found.off_path > path or found.off_orientation > orientation:
            found.wrong.append(f"off the path by {found.off_path} m, {found.off_orientation} rad")
        return found

    def may_be_off(self, session: Session) -> tuple[float, float]:
        """How far set points may be from the path: m, rad."""
        return ON_PATH, ON_ORIENTATION

    def _check_limits(self, session: Session, found: Found) -> None:
        factor = self.cell.emergency_deceleration_factor if self.emergency else 1.0
        bounds = {"speed": 1.0, "acceleration": factor, "jerk": factor}
        for name, value in limits_report(session).items():
            ratio = float(np.max(value)) / bounds[name.rsplit("_", 1)[1]]
            found.ratios[name] = ratio
            if ratio > (1.05 if name.endswith("jerk") else 1.0) + ROUNDING:
                found.wrong.append(f"{name}: {ratio} of its limit")

    def _check_end(self, session: Session, plain: Session, found: Found) -> None:
        done, all_of_it = self.happened(session), self.happened(plain)
        if self.was_stopped(session):
            all_of_it = all_of_it[: len(done)]
        else:
            if session.status is not plain.status or str(session.failure) != str(plain.failure):
                found.wrong.append(
                    f"{session.status}, {session.failure}, not {plain.status}, {plain.failure}"
                )
            gap = float(np.abs(session.kernel.telemetry.joints - plain.kernel.telemetry.joints).max())
            if gap > ROUNDING:
                found.wrong.append(f"ends {gap} rad from where it should")
        if done != all_of_it:
            found.wrong.append("other events, or in another order")

    def was_stopped(self, session: Session) -> bool:
        """Whether a command has ended the run."""
        return session.status is Status.STOPPED and any(choice == "stop" for _, choice in self.log)

    def happened(self, session: Session) -> list[tuple[object, ...]]:
        """Motions finished and outputs switched, in order."""
        return [
            (e.kind, e.line, e.data.get("signal"), e.data.get("value"))
            for e in session.events
            if e.kind in ("block", "output")
        ]
