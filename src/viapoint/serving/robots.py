"""The robots of a run that serves, one or all of a cell; which of them, and which signal, is meant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from viapoint.language.suggestions import did_you_mean
from viapoint.runtime.cell import Signal
from viapoint.runtime.kernel import State
from viapoint.serving.requests import Refused, Request
from viapoint.session import Session, Status
from viapoint.station import Station


class Robots:
    """The sessions of one run, in the order of the cell; all of them are in the same tick."""

    def __init__(self, run: Session | Station) -> None:
        self._run = run
        self.sessions: Sequence[Session] = run.sessions if isinstance(run, Station) else (run,)

    @property
    def first(self) -> Session:
        """The first one: what all share, signals and time, is reached through it."""
        return self.sessions[0]

    @property
    def several(self) -> bool:
        """Whether a request may have to say which robot it means."""
        return len(self.sessions) > 1

    @property
    def tick(self) -> int:
        """The tick computed last."""
        return self.first.kernel.tick

    @property
    def begun(self) -> bool:
        """Tick 0 is done."""
        return self.first.kernel.state is not State.READY

    @property
    def over(self) -> bool:
        """No robot goes on any more."""
        return all(session.kernel.over for session in self.sessions)

    @property
    def at_rest(self) -> bool:
        """Nothing goes on by itself."""
        return all(session.at_rest for session in self.sessions)

    @property
    def status(self) -> Status:
        """How the run has ended, or that it has not."""
        return self._run.status

    @property
    def described(self) -> dict[str, Any]:
        """The robots for those who come: alone, or one by one."""
        each = [
            {
                "robot": session.cell.number,
                "name": session.cell.robot_name,
                "model": session.cell.robot.name,
                "program": session.program.source.name,
            }
            for session in self.sessions
        ]
        alone = {} if self.several else {"robot": each[0]["model"], "program": each[0]["program"]}
        return {**alone, "robots": each}

    def set_window(self, ticks: int) -> None:
        """The most ticks computed at once."""
        self._run.set_window(ticks)

    def one(self, request: Request) -> Session:
        """The robot that is meant. Raises Refused where that is not said, or there is none."""
        if self.several and request.values.get("robot") is None:
            example = f'"robot": {len(self.sessions)}'
            sentence = f"the cell has {len(self.sessions)} robots: say which one, as in {example}"
            raise Refused(sentence, request.identity)
        return self.meant(request)[0]

    def meant(self, request: Request) -> Sequence[Session]:
        """The robots that are meant: all, or the one that is named. Raises Refused where there is none."""
        which = request.values.get("robot")
        if which is None:
            return self.sessions
        for session in self.sessions:
            if which in (session.cell.number, session.cell.robot_name) and not isinstance(which, bool):
                return (session,)
        names = [session.cell.robot_name for session in self.sessions if session.cell.robot_name is not None]
        hint = did_you_mean(which, names) if isinstance(which, str) else None
        hint = hint or f"its robots are {', '.join(str(session.cell.number) for session in self.sessions)}"
        raise Refused(f"the cell has no robot {which}; {hint}", request.identity)

    def signal(self, request: Request) -> Signal:
        """The signal or variable that is meant; a request for a variable may leave out its `$`."""
        values, io = request.values, self.first.cell.io
        name = f"${values['name'].removeprefix('$')}" if "name" in values else values["signal"]
        try:
            return self.first.signals.resolve(name)
        except KeyError:
            hint = did_you_mean(name, (*io.names, *(f"${each}" for each in io.variables)))
            what = f"declares no variable `{name}`" if name.startswith("$") else f"has no signal `{name}`"
            raise Refused(f"the cell {what}{f'; {hint}' if hint else ''}", request.identity) from None

    def level(self, request: Request) -> bool | float:
        """The value that a signal or variable is to have. Raises Refused where it is of another kind."""
        signal, value = self.signal(request), request.values["value"]
        switch = self.first.cell.io.is_switch(signal)
        if switch is not isinstance(value, bool):
            kind = "true or false" if switch else "a number"
            raise Refused(f"{signal} takes {kind}", request.identity)
        return value if switch else float(value)
