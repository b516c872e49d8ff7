"""Runs of programs given as text, with everything that came out of them; shared by the tests of sessions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from viapoint.report import limits_report
from viapoint.runtime.cell import Cell, parse_cell
from viapoint.runtime.records import Event, Window
from viapoint.runtime.signals import parse_scenario
from viapoint.session import Session, compile_text

Floats = npt.NDArray[np.float64]
ROUNDING = 1e-9
"""A ratio to a limit may pass 1 by the rounding of differences."""

BODY = """
[[tools]]
index = 1
xyz = [380, 0, 0]
[[tools]]
index = 2
xyz = [200, 0, 50]
abc = [0, 30, 0]
[[frames]]
index = 1
xyz = [1400, -400, 700]
abc = [0, 0, 30]
[points]
P0 = { x = 1755, y = 0, z = 2660, a = 0, b = 0, c = 0 }
P1 = { x = 1500, y = -300, z = 1500, a = 0, b = 90, c = 0 }
P2 = { x = 1500, y = 300, z = 1500, a = 0, b = 90, c = 0 }
P3 = { x = 1800, y = 300, z = 1500, a = 0, b = 90, c = 0 }
P4 = { x = 1800, y = -300, z = 1500, a = 0, b = 90, c = 0 }
P6 = { j = [0, 0, 0, 0, 90, 0] }
P7 = { j = [20, 10, -20, 30, 40, 50] }
#points
[m_functions]
5 = "async"
"""


@cache
def cell(*, controller: str = "", limits: str = "", points: str = "", more: str = "") -> Cell:
    """frigeni6 with two tools, a frame and some points; extra lines of some tables, and more tables."""
    return parse_cell(cell_text(controller=controller, limits=limits, points=points, more=more))


def cell_text(*, controller: str = "", limits: str = "", points: str = "", more: str = "") -> str:
    """The file of `cell`."""
    head = '[robot]\nmodel = "frigeni6"\n'
    body = BODY.replace("#points", points)
    return f"{head}[controller]\n{controller}\n[limits.path]\n{limits}\n{body}{more}"


@dataclass(frozen=True, repr=False)
class Run:
    """A run that is over: its session and its set points, tick by tick from tick 0 on."""

    session: Session
    windows: tuple[Window, ...]

    def __repr__(self) -> str:
        """Short: pytest writes out what an assertion compares, also of one that holds."""
        return f"<{self.status} after tick {self.session.kernel.tick}>"

    def column(self, name: str) -> npt.NDArray[Any]:
        """One of the arrays of `Window`, over the whole run."""
        result: npt.NDArray[Any] = np.concatenate([getattr(window, name) for window in self.windows])
        return result

    @property
    def joints(self) -> Floats:
        return self.column("joints")

    @property
    def status(self) -> str:
        return self.session.status.value

    @property
    def code(self) -> str | None:
        """Of the failure that ended the run."""
        failure = self.session.failure
        return None if failure is None else failure.code

    @property
    def failed_line(self) -> int:
        failure = self.session.failure
        assert failure is not None, "the run did not fail"
        return failure.line

    def events(self, kind: str, line: int | None = None) -> list[Event]:
        return [e for e in self.session.events if e.kind == kind and line in (None, e.line)]

    def end_of(self, line: int) -> int:
        """Tick in which the motion of a line ended for the first time."""
        return round(self.events("block", line)[0].data["t_end"] / self.session.cell.tick)

    @property
    def history(self) -> list[tuple[Any, ...]]:
        """All events as plain data."""
        return [(e.tick, e.line, e.kind, dict(e.data)) for e in self.session.events]

    @property
    def reasons(self) -> dict[int, str]:
        """How each corner is passed, by the line before it (the last time round)."""
        return {corner.line: corner.transition.reason.name for corner in self.session.corners}

    def over_limits(self, jerk: float = 1.05) -> dict[str, float]:
        """Peaks over what is allowed."""
        peaks = {k: float(np.max(v)) for k, v in limits_report(self.session).items()}
        return {k: v for k, v in peaks.items() if v > (jerk if k.endswith("jerk") else 1.0) + ROUNDING}


def run(text: str, where: Cell | None = None, *, scenario: str | None = None, **options: Any) -> Run:
    """Compile and run to the end; options as those of `Session`."""
    where = where or cell()
    loaded = compile_text(text, cell=where)
    happenings = None if scenario is None else parse_scenario(scenario, where)
    session = Session(where, loaded, scenario=happenings, **options)
    return Run(session, tuple(session.run()))


def at(seconds: float, **changes: bool) -> str:
    """A scenario entry: inputs set at a time."""
    values = ", ".join(f"{name} = {str(value).lower()}" for name, value in changes.items())
    return f"[[at]]\nt_s = {seconds!r}\nset = {{ {values} }}\n"
