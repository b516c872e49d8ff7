"""Does in a run what clients ask, between two windows of ticks, and tells them what happens.

Time does not run away from a client: unless the run is paced by the clock, it stands still while the
robot is halted or waits for something that only a client can bring; of several robots, while all of them do.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from queue import Empty
from typing import Any, Final

from viapoint.jogging import HeldJog, JogError, JogSpace
from viapoint.report import event_data
from viapoint.runtime.cell import SignalKind
from viapoint.runtime.kernel import State
from viapoint.runtime.records import Event, Window
from viapoint.serving.hub import Hub, Incoming, What
from viapoint.serving.monitor import monitors
from viapoint.serving.requests import Refused, Request, Scalar, parse
from viapoint.serving.robots import Robots
from viapoint.session import Session
from viapoint.station import Station

PROTOCOL: Final = 1
"""Raised when a client of before would not understand what comes now."""

WINDOW_S: Final = 0.02
"""Most time computed at once: how late a request may be heeded."""

_LISTEN_S: Final = 0.05
"""How long to listen before looking whether the run shall end."""

_Command = Callable[[Session, Request], str | None]

_COMMANDS: Final[Mapping[str, _Command]] = {
    "override": lambda session, request: session.set_override(request.values["percent"] / 100.0),
    "halt": lambda session, _: session.halt(),
    "continue": lambda session, _: session.resume(),
    "stop": lambda session, _: session.stop(),
    "estop": lambda session, _: session.emergency_stop(),
    "reset": lambda session, _: session.reset(),
    "let_go": lambda session, _: session.let_go(),
}
"""What each robot that is meant is told."""


@dataclass(slots=True)
class _Client:
    """What a client wants to be told: the monitor every so many ticks (0: never), of which robots; events."""

    stride: int = 0
    events: bool = False
    robots: frozenset[int] = frozenset()


class _Ear:
    """Listener of one robot's session."""

    def __init__(self, attendant: Attendant, number: int) -> None:
        self._attendant = attendant
        self._number = number

    def window(self, window: Window) -> None:
        self._attendant.hear(self._number, window)

    def event(self, event: Event) -> None:
        self._attendant.tell_event(event)


class Attendant:
    """Speaks to the run for its clients. `ear` is the listener that each robot's session is given."""

    def __init__(self, hub: Hub, *, await_client: bool = False, paced: bool = False) -> None:
        self._hub = hub
        self._clients: dict[int, _Client] = {}
        self._started = not await_client
        self._paced = paced
        self._lockstep: int | None = None  # the client that lets time pass
        self._allowed = 0  # the tick up to which it may
        self._advancing: tuple[int, Scalar] | None = None  # who asked for it last, and his `id`
        self._bound: Robots | None = None
        self._starting: list[tuple[int, Scalar]] = []  # who asked for the beginning, with his `id`
        self._window = 1
        self._last: dict[int, Window] = {}  # by robot
        self._jogging: int | None = None  # the client that holds a jog
        self._stood: dict[int, dict[str, Any]] = {}  # what was told when time stood still last, by robot

    @property
    def robots(self) -> Robots:
        """The robots it attends."""
        assert self._bound is not None, "bound before it is used"
        return self._bound

    def ear(self, number: int) -> _Ear:
        """The listener for the session of a robot of the cell."""
        return _Ear(self, number)

    def bind(self, run: Session | Station, window: int) -> None:
        """Attend this run, whose sessions have its ears; `window` ticks at most are computed at once."""
        self._bound = Robots(run)
        self._window = max(1, min(window, round(WINDOW_S / self.robots.first.cell.tick)))
        self.robots.set_window(self._window)

    # --- listening ---------------------------------------------------------------------------------

    def hear(self, number: int, window: Window) -> None:
        """Tell the monitor of a robot to those whose time it is in one of these ticks."""
        self._last[number] = window
        made: dict[int, list[bytes]] = {}  # by stride: lines are made once, and not for deaf ears
        for client, wanted in self._clients.items():
            if wanted.stride and number in wanted.robots and not self._hub.full(client):
                if wanted.stride not in made:
                    made[wanted.stride] = self._monitor_lines(number, window, wanted.stride)
                for line in made[wanted.stride]:
                    self._hub.send(client, line)

    def _monitor_lines(self, number: int, window: Window, stride: int) -> list[bytes]:
        first = -window.first_tick % stride
        rows = range(first, len(window), stride)
        session = self.robots.sessions[number - 1]
        return [_line({"monitor": one}) for one in monitors(session, window, rows)] if rows else []

    def tell_event(self, event: Event) -> None:
        """Tell an event."""
        self._tell({"event": event_data(event)})

    # --- between two windows -----------------------------------------------------------------------

    def attend(self, ending: Callable[[], bool]) -> None:
        """Do what was asked; come back when time may pass, or when the run is `ending`."""
        self._report_start()
        self._report_advance(over=self._idle)
        while not ending():
            self._tell_standing()
            for incoming in self._waiting(self._must_wait()):
                self._take(incoming)
            if not self._must_wait():
                break
        if self._lockstep is not None:
            left = self._allowed - self.robots.tick
            self.robots.set_window(max(1, min(self._window, left)))

    def end(self) -> None:
        """The run is over: say so, and let everybody go."""
        robots = self.robots
        self._report_start()
        self._report_advance(over=True)
        for incoming in self._waiting(False):
            if incoming.what is What.JOINED:
                self._take(incoming)
        over: dict[str, Any] = {"status": robots.status.value, "tick": robots.tick}
        failed = next((session for session in robots.sessions if session.failure is not None), None)
        if failed is not None and (failure := failed.failure) is not None:
            over |= {"code": failure.code, "line": failure.line, "message": failure.message}
            over |= {"robot": failed.cell.number} if robots.several else {}
        for client in self._clients:
            self._hub.send(client, _line({"end": over}))
        self._hub.close()

    def _tell_standing(self) -> None:
        """Time stands still until a client does something: said once."""
        if not self._started or not self._must_wait() or not self.robots.at_rest:
            return
        for session in self.robots.sessions:
            number, here = session.cell.number, _standing(session)
            if here != self._stood.get(number) and not session.kernel.over:
                self._stood[number] = here
                self._tell(here)

    def _tell(self, message: dict[str, Any]) -> None:
        """To everybody who wants to be told events."""
        wanting = [client for client, wanted in self._clients.items() if wanted.events]
        line = _line(message) if wanting else b""
        for client in wanting:
            self._hub.send(client, line)

    def _waiting(self, wait: bool) -> Iterator[Incoming]:
        try:
            yield self._hub.incoming.get(timeout=_LISTEN_S) if wait else self._hub.incoming.get_nowait()
            while True:
                yield self._hub.incoming.get_nowait()
        except Empty:
            return

    @property
    def _idle(self) -> bool:
        """The run has not begun, and nothing moves: then no time passes."""
        still = (State.READY, State.EMERGENCY)
        return not self._started and all(each.kernel.state in still for each in self.robots.sessions)

    def _must_wait(self) -> bool:
        if self._idle:
            return True
        robots = self.robots
        if robots.over or not robots.begun:
            return False
        if self._lockstep is not None:
            return robots.tick >= self._allowed
        return robots.at_rest and not self._paced

    def _report_start(self) -> None:
        """Answered when tick 0 is done, so that what is asked next falls into a known tick."""
        if self.robots.begun:
            for client, identity in self._starting:
                self._answer(client, identity, {})
            self._starting.clear()

    def _report_advance(self, *, over: bool) -> None:
        if self._advancing is not None and (over or self.robots.tick >= self._allowed):
            client, identity = self._advancing
            self._advancing = None
            self._answer(client, identity, {})

    def _take(self, incoming: Incoming) -> None:
        client = incoming.client
        match incoming.what:
            case What.JOINED:
                self._clients[client] = _Client()
                self._hub.send(client, _line({"hello": self._hello()}))
            case What.LEFT:
                self._clients.pop(client, None)
                if self._jogging == client:  # nobody has the key any more
                    self.robots.first.let_go()
                if self._lockstep == client:
                    self._lockstep = None
                    self.robots.set_window(self._window)
            case What.LINE:
                self._heed(client, incoming.line)

    def _heed(self, client: int, line: bytes) -> None:
        if not line.strip():
            return
        try:
            request = parse(line)
            answer = self._do(client, request)
        except Refused as refused:
            wrong = {"id": refused.identity, "ok": False, "error": str(refused)}
            self._hub.send(client, _line(wrong))
            return
        if answer is not None:
            self._answer(client, request.identity, answer)

    def _answer(self, client: int, identity: Scalar, answer: dict[str, Any]) -> None:
        head = {"id": identity, "ok": True, "tick": self.robots.tick}
        self._hub.send(client, _line(head | answer))

    # --- requests ----------------------------------------------------------------------------------

    def _do(self, client: int, request: Request) -> dict[str, Any] | None:
        """Do it and give what belongs into the answer; None where it is answered later. Raises Refused."""
        values = request.values
        match request.do:
            case "start":
                state = self.robots.first.kernel.state
                if state in (State.JOGGING, State.EMERGENCY) and not self._started:
                    raise Refused(f"the run has not begun, and the robot is {state.value}", request.identity)
                self._started = True
                self._starting.append((client, request.identity))
                self._report_start()
                return None
            case "subscribe":
                self._subscribe(client, request)
            case "monitor":
                session = self.robots.one(request)
                last = self._last.get(session.cell.number)
                if last is None:
                    raise Refused("the run has not begun", request.identity)
                return {"monitor": monitors(session, last, [len(last) - 1])[0]}
            case "read":
                return {"value": self.robots.first.signals.read(self.robots.signal(request))}
            case "lockstep":
                self._set_lockstep(client, values["on"], request)
            case "advance":
                self._advance(client, request)
                return None
            case "variable" if values["value"] is None:
                return {"value": self.robots.first.signals.read(self.robots.signal(request))}
            case "ping":
                pass
            case _:
                given = {k: v for k, v in values.items() if v is not None and k != "robot"}
                given |= {name.upper(): value for name, value in given.pop("axes", {}).items()}
                for session in self._command(client, request):
                    kernel = session.kernel
                    kernel.trace.emit("command", kernel.line, do=request.do, client=client, **given)
        return {}

    def _jog(self, client: int, request: Request) -> None:
        """Hold a jog for a client, until it falls silent."""
        session, values = self.robots.first, request.values
        if self.robots.several:
            raise Refused("the robots of a cell of several are not jogged by a client", request.identity)
        jogging = session.kernel.state is State.JOGGING
        if jogging and self._jogging not in (None, client):
            raise Refused("another client jogs the robot already", request.identity)
        held = HeldJog(
            values["axis"].upper(),
            values["direction"],
            JogSpace(values["space"]),
            values["frame"],
            values["speed"],
            values["seconds"],
        )
        try:
            refused = "the run has begun" if self._started else session.hold(held)
        except JogError as error:
            refused = str(error)
        if refused is not None:
            raise Refused(refused, request.identity)
        self._jogging = client

    def _reference(self, session: Session, request: Request) -> None:
        axes = {name.upper(): float(value) for name, value in request.values["axes"].items()}
        try:
            refused = "the run has begun" if self._started else session.reference(axes)
        except ValueError as error:
            refused = str(error)
        if refused is not None:
            raise Refused(refused, request.identity)

    def _command(self, client: int, request: Request) -> Sequence[Session]:
        """What changes the run, from the next tick on; the robots whose run that is. Raises Refused."""
        session, values = self.robots.first, request.values
        match request.do:
            case "jog":
                self._jog(client, request)
            case "reference":
                session = self.robots.one(request)
                self._reference(session, request)
            case "set" | "variable":
                signal = self.robots.signal(request)
                if signal.kind in (SignalKind.DIGITAL_OUTPUT, SignalKind.ANALOG_OUTPUT):
                    raise Refused(f"{signal} is an output: the program sets it", request.identity)
                session.set_input(str(signal), self.robots.level(request))
            case "force":
                session.force(str(self.robots.signal(request)), self.robots.level(request))
            case "release":
                session.release(str(self.robots.signal(request)))
            case "reset_m":
                session = self.robots.one(request)
                session.reset_m(values["index"])
            case do:
                return self._of_each(request, _COMMANDS[do])
        return (session,)

    def _of_each(self, request: Request, command: _Command) -> Sequence[Session]:
        """A command for every robot that is meant; those that took it. Raises Refused if none did."""
        refused = [(session, command(session, request)) for session in self.robots.meant(request)]
        took = [session for session, why in refused if why is None]
        if not took:
            raise Refused(refused[0][1] or "", request.identity)
        return took

    def _subscribe(self, client: int, request: Request) -> None:
        hertz = request.values["monitor_hz"]
        stride = max(1, round(1.0 / (hertz * self.robots.first.cell.tick))) if hertz else 0
        numbers = frozenset(session.cell.number for session in self.robots.meant(request))
        self._clients[client] = _Client(stride, request.values["events"], numbers)
        if request.values["events"]:
            self._tell_late(client)

    def _tell_late(self, client: int) -> None:
        """To one who wants to be told events from now on: who stands already."""
        for session in self.robots.sessions:
            here = _standing(session)
            if here == self._stood.get(session.cell.number):
                self._hub.send(client, _line(here))

    def _set_lockstep(self, client: int, on: bool, request: Request) -> None:
        if self._lockstep not in (None, client):
            raise Refused("another client lets time pass already", request.identity)
        self._lockstep = client if on else None
        self._allowed = self.robots.tick
        self.robots.set_window(self._window)

    def _advance(self, client: int, request: Request) -> None:
        if self._lockstep != client:
            raise Refused("time passes by itself: ask for `lockstep` first", request.identity)
        if self._advancing is not None:
            raise Refused("the last `advance` is not over yet", request.identity)
        self._allowed = self.robots.tick + request.values["ticks"]
        self._advancing = client, request.identity

    # --- what is told ------------------------------------------------------------------------------

    def _hello(self) -> dict[str, Any]:
        robots = self.robots
        return {
            "protocol": PROTOCOL,
            **robots.described,
            "tick_s": robots.first.cell.tick,
            "tick": robots.tick,
            "started": self._started and robots.begun,
        }


def _standing(session: Session) -> dict[str, Any]:
    """That a robot stands until a client does something, and for what."""
    kernel = session.kernel
    standing: dict[str, Any] = {"robot": session.cell.number, "tick": kernel.tick}
    standing |= {"state": kernel.state.value, "line": kernel.line}
    awaited = kernel.dialogue.awaited
    return {"standing": standing | ({"for": awaited} if awaited else {})}


def _line(value: dict[str, Any]) -> bytes:
    return json.dumps(value, separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode()
