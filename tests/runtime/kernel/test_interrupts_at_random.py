"""Interrupts at random ticks over random paths, among random commands: the path is as if none had been."""

from __future__ import annotations

import numpy as np
import pytest
from command_runs import LOOKS, ON_ORIENTATION, ON_PATH, CommandRun, Found
from path_oracle import PathOracle

from viapoint.session import Session, Status

PULSES = 0.5
"""Part of the commands that set the input, or reset it."""

BACK = 1e-12
"""rad between where a path was left and where it is taken up."""

BESIDE = (
    "ML Z=1790 F400\nSET DO9\nML Y=60 R20\nML Z=1650\n",
    "MJ J1=8 F90\nML Z=1750 F300\n",
    "WAIT 0.08\nSET DO9\n",
    "MC X=1450 Y=30 Z=1720 QX=1520 QY=60 QZ=1700 F300\nWAIT 0.02\nML Z=1700\nHOME F90\n",
)


class InterruptedRun(CommandRun):
    """One program run once undisturbed and once with interrupts and commands."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed)
        self._high = False
        first, *others = self.text.splitlines()
        lines = [first, "ON DI1 SUB BESIDE", *others]
        self.last_line = len(lines)
        beside = BESIDE[int(self.rng.integers(len(BESIDE)))]
        self.text = "\n".join([*lines, "END", "BESIDE:", f"{beside}END\n"])

    def _command(self, session: Session, choice: str | None) -> None:
        if choice is None and self.rng.random() < PULSES:
            self._high = not self._high
            session.set_input("DI1", self._high)
            self.log.append((session.kernel.tick, f"DI1 {self._high}"))
        else:
            super()._command(session, choice)

    def check(self) -> Found:
        plain = self.session(1024)
        oracle = PathOracle(plain)
        plain.finish()
        session = self.disturbed()
        found = Found(ticks=session.kernel.tick)
        self._check_limits(session, found)
        self._check_end(session, plain, found)
        joints = np.concatenate(self._joints)
        on_path = np.ones(len(joints), dtype=bool)
        for begin, end in self.spans(session):
            if end < len(joints) and np.abs(joints[begin] - joints[end]).max() > BACK:
                found.wrong.append(f"not back in tick {end} where it was in {begin}")
            on_path[begin + 1 : end] = False
        looks = self.rng.choice(np.flatnonzero(on_path), LOOKS)
        found.off_path, found.off_orientation = oracle.deviations(joints[looks])
        if found.off_path > ON_PATH or found.off_orientation > ON_ORIENTATION:
            found.wrong.append(f"off the path by {found.off_path} m, {found.off_orientation} rad")
        return found

    @staticmethod
    def spans(session: Session) -> list[tuple[int, int]]:
        """Ticks in which subroutines began and in which the robot was back, if it came back."""
        told = [e for e in session.events if e.kind == "interrupt" and e.data["action"] != "triggered"]
        ticks = [event.tick for event in told]
        if len(ticks) % 2:
            ticks.append(session.kernel.tick + 1)
        return list(zip(ticks[::2], ticks[1::2], strict=True))

    def was_stopped(self, session: Session) -> bool:
        return session.status is Status.STOPPED

    def happened(self, session: Session) -> list[tuple[object, ...]]:
        """What the program itself has done, in order."""
        return [each for each in super().happened(session) if int(str(each[1])) <= self.last_line]


@pytest.mark.parametrize("seed", range(16))
def test_the_path_is_that_of_the_undisturbed_run(seed: int) -> None:
    run = InterruptedRun(seed)
    wrong = run.check().wrong
    assert not wrong, f"seed {seed}: {wrong}\n{run.describe()}"
