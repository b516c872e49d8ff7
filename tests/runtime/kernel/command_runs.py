"""Random commands at random ticks over random programs: one run, and what must hold for it.

Used by the tests with a few seeds, and by `benchmarks/commands.py` with as many as wanted.
"""

from __future__ import annotations

import numpy as np

from viapoint.report import limits_report
from viapoint.runtime.cell import Cell, default_cell
from viapoint.runtime.kernel import State
from viapoint.session import Session, compile_text

ROUNDING = 1e-9
MOST_TICKS = 200_000


def random_program(rng: np.random.Generator) -> str:
    """A few rounded, smooth and sharp motions of every kind about a place in front of frigeni6."""
    lines = ["MJ X=1500 Y=0 Z=1700 A=0 B=90 C=0 F80"]
    for _ in range(int(rng.integers(2, 6))):
        x, y, z = 1500 + rng.uniform(-150, 150), rng.uniform(-200, 200), 1700 + rng.uniform(-100, 100)
        rounded = f" R{rng.uniform(5, 40):.1f}" if rng.random() < 0.6 else ""
        speed = f" F{rng.uniform(60, 600):.0f}" if rng.random() < 0.5 else ""
        where = f"X={x:.1f} Y={y:.1f} Z={z:.1f}"
        match int(rng.integers(0, 5)):
            case 0:
                lines.append(f"MS {where}{speed}")
            case 1:
                lines.append(f"MJ {where} F60{rounded}")
            case 2:
                lines.append(f"MC {where} QX={x - 90:.1f} QY={y + 70:.1f} QZ={z + 40:.1f} F200{rounded}")
            case _:
                lines.append(f"ML {where} F{rng.uniform(80, 500):.0f}{rounded}")
        if rng.random() < 0.3:
            lines.append(f"SET DO{int(rng.integers(1, 9))}")
    return "\n".join(lines) + "\n"


class CommandRun:
    """One program run once undisturbed and once under random commands."""

    def __init__(self, seed: int, cell: Cell | None = None) -> None:
        self.rng = np.random.default_rng(seed)
        self.cell = cell or default_cell()
        self.text = random_program(self.rng)
        self.log: list[tuple[int, str]] = []
        self.emergency = False

    def describe(self) -> str:
        """A reproducer."""
        return f"{self.text}commands: {self.log}"

    def session(self, window: int) -> Session:
        return Session(self.cell, compile_text(self.text, cell=self.cell), window=window)

    def undisturbed(self) -> Session:
        session = self.session(1024)
        session.finish()
        return session

    def disturbed(self) -> Session:
        """The same under commands; it always comes to its end."""
        session = self.session(int(self.rng.integers(5, 200)))
        wait, commands = int(self.rng.integers(20, 400)), 10
        for window in session.run():
            wait -= len(window)
            if session.kernel.state in (State.EMERGENCY, State.HALTED) and self.rng.random() < 0.2:
                self._go_on(session)
            elif wait <= 0 and commands:
                commands -= 1
                wait = int(self.rng.integers(10, 500))
                self._command(session)
            elif not commands and session.kernel.tick > MOST_TICKS:
                break
        return session

    def _go_on(self, session: Session) -> None:
        self.log.append((session.kernel.tick, "reset, resume, forward"))
        session.reset()
        session.resume()
        session.set_override(float(self.rng.choice([0.37, 1.0])))

    def _command(self, session: Session) -> None:
        choice = str(self.rng.choice(["override"] * 5 + ["halt", "halt", "resume", "back", "emergency"]))
        match choice:
            case "override":
                override = float(self.rng.choice([0.0, 0.05, 0.2, 0.5, 0.8, 1.0]))
                choice = f"override {override}"
                session.set_override(override)
            case "back":
                session.set_override(-float(self.rng.uniform(0.1, 1.0)))
            case "halt":
                session.halt()
            case "resume":
                session.resume()
            case "emergency":
                self.emergency = True
                session.emergency_stop()
        self.log.append((session.kernel.tick, choice))

    def check(self) -> list[str]:
        """What does not hold; empty if all does."""
        plain, session = self.undisturbed(), self.disturbed()
        factor = self.cell.emergency_deceleration_factor if self.emergency else 1.0
        limits = limits_report(session)
        bounds = {"speed": 1.0, "acceleration": factor, "jerk": 1.05 * factor}
        wrong = [
            f"{name}: {value}"
            for name, value in limits.items()
            if np.max(value) > bounds[name.rsplit("_", 1)[1]] + ROUNDING
        ]
        if session.status is not plain.status or str(session.failure) != str(plain.failure):
            wrong.append(f"{session.status}, {session.failure}, not {plain.status}, {plain.failure}")
        gap = float(np.abs(session.kernel.telemetry.joints - plain.kernel.telemetry.joints).max())
        if gap > ROUNDING:
            wrong.append(f"ends {gap} rad from where it should")
        if _outputs(plain) != _outputs(session):
            wrong.append("other outputs, or at other places of the path")
        return wrong


def _outputs(session: Session) -> list[tuple[int, object, object]]:
    return [(e.line, e.data["signal"], e.data["value"]) for e in session.events if e.kind == "output"]
