"""Does in a session what clients ask, between two windows of ticks, and tells them what happens.

Time does not run away from a client: unless the run is paced by the clock, it stands still while the
robot is halted or waits for something that only a client can bring.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from queue import Empty
from typing import Any, Final

from viapoint.jogging import HeldJog, JogError, JogSpace
from viapoint.language.suggestions import did_you_mean
from viapoint.report import event_data
from viapoint.runtime.cell import Signal, SignalKind
from viapoint.runtime.kernel import State
from viapoint.runtime.records import Event, Window
from viapoint.serving.hub import Hub, Incoming, What
from viapoint.serving.monitor import monitors
from viapoint.serving.requests import REQUESTS, Refused, Request, Scalar, parse
from viapoint.session import Session

PROTOCOL: Final = 1
"""Raised when a client of before would not understand what comes now."""

WINDOW_S: Final = 0.02
"""Most time computed at once: how late a request may be heeded."""

_LISTEN_S: Final = 0.05
"""How long to listen before looking whether the run shall end."""

_COMMANDS: Final[Mapping[str, Callable[[Session], str | None]]] = {
    "halt": Session.halt,
    "continue": Session.resume,
    "stop": Session.stop,
    "estop": Session.emergency_stop,
    "reset": Session.reset,
    "let_go": Session.let_go,
}


@dataclass(slots=True)
class _Client:
    """What a client wants to be told: the monitor every so many ticks (0: never), events."""

    stride: int = 0
    events: bool = False


class Attendant:
    """A listener of the session, and the one who speaks for its clients."""

    def __init__(self, hub: Hub, *, await_client: bool = False, paced: bool = False) -> None:
        self._hub = hub
        self._clients: dict[int, _Client] = {}
        self._started = not await_client
        self._paced = paced
        self._lockstep: int | None = None  # the client that lets time pass
        self._allowed = 0  # the tick up to which it may
        self._advancing: tuple[int, Scalar] | None = None  # who asked for it last, and his `id`
        self._session: Session | None = None
        self._starting: list[tuple[int, Scalar]] = []  # who asked for the beginning, with his `id`
        self._window = 1
        self._last: Window | None = None
        self._jogging: int | None = None  # the client that holds a jog
        self._stood: tuple[int, State, str] | None = None  # where time stood still last

    @property
    def session(self) -> Session:
        """The session it attends."""
        assert self._session is not None, "bound before it is used"
        return self._session

    def bind(self, session: Session, window: int) -> None:
        """Attend this session, whose listener it is; `window` ticks at most are computed at once."""
        self._session = session
        self._window = max(1, min(window, round(WINDOW_S / session.cell.tick)))
        session.set_window(self._window)

    # --- listening ---------------------------------------------------------------------------------

    def window(self, window: Window) -> None:
        """Tell the monitor to those whose time it is in one of these ticks."""
        self._last = window
        made: dict[int, list[bytes]] = {}  # by stride: lines are made once, and not for deaf ears
        for client, wanted in self._clients.items():
            if wanted.stride and not self._hub.full(client):
                if wanted.stride not in made:
                    made[wanted.stride] = self._monitor_lines(window, wanted.stride)
                for line in made[wanted.stride]:
                    self._hub.send(client, line)

    def _monitor_lines(self, window: Window, stride: int) -> list[bytes]:
        first = -window.first_tick % stride
        rows = range(first, len(window), stride)
        return [_line({"monitor": one}) for one in monitors(self.session, window, rows)] if rows else []

    def event(self, event: Event) -> None:
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
            left = self._allowed - self.session.kernel.tick
            self.session.set_window(max(1, min(self._window, left)))

    def end(self) -> None:
        """The run is over: say so, and let everybody go."""
        session = self.session
        self._report_start()
        self._report_advance(over=True)
        for incoming in self._waiting(False):
            if incoming.what is What.JOINED:
                self._take(incoming)
        over: dict[str, Any] = {"status": session.status.value, "tick": session.kernel.tick}
        if session.failure is not None:
            failure = session.failure
            over |= {"code": failure.code, "line": failure.line, "message": failure.message}
        for client in self._clients:
            self._hub.send(client, _line({"end": over}))
        self._hub.close()

    def _tell_standing(self) -> None:
        """Time stands still until a client does something: said once."""
        session = self.session
        if not self._started or not self._must_wait() or not session.at_rest:
            return
        kernel = session.kernel
        here = (kernel.tick, kernel.state, kernel.dialogue.awaited)
        if here != self._stood:
            self._stood = here
            standing = {"tick": kernel.tick, "state": kernel.state.value, "line": kernel.line}
            self._tell({"standing": standing | ({"for": here[2]} if here[2] else {})})

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
        return not self._started and self.session.kernel.state in (State.READY, State.EMERGENCY)

    def _must_wait(self) -> bool:
        if self._idle:
            return True
        kernel = self.session.kernel
        if kernel.over or kernel.state is State.READY:
            return False
        if self._lockstep is not None:
            return kernel.tick >= self._allowed
        return self.session.at_rest and not self._paced

    def _report_start(self) -> None:
        """Answered when tick 0 is done, so that what is asked next falls into a known tick."""
        if self.session.kernel.state is not State.READY:
            for client, identity in self._starting:
                self._answer(client, identity, {})
            self._starting.clear()

    def _report_advance(self, *, over: bool) -> None:
        if self._advancing is not None and (over or self.session.kernel.tick >= self._allowed):
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
                    self.session.let_go()
                if self._lockstep == client:
                    self._lockstep = None
                    self.session.set_window(self._window)
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
        head = {"id": identity, "ok": True, "tick": self.session.kernel.tick}
        self._hub.send(client, _line(head | answer))

    # --- requests ----------------------------------------------------------------------------------

    def _do(self, client: int, request: Request) -> dict[str, Any] | None:
        """Do it and give what belongs into the answer; None where it is answered later. Raises Refused."""
        values = request.values
        match request.do:
            case "start":
                if self.session.kernel.state in (State.JOGGING, State.EMERGENCY) and not self._started:
                    state = self.session.kernel.state.value
                    raise Refused(f"the run has not begun, and the robot is {state}", request.identity)
                self._started = True
                self._starting.append((client, request.identity))
                self._report_start()
                return None
            case "subscribe":
                self._subscribe(client, values["monitor_hz"], values["events"])
            case "monitor":
                if self._last is None:
                    raise Refused("the run has not begun", request.identity)
                return {"monitor": monitors(self.session, self._last, [len(self._last) - 1])[0]}
            case "read":
                return {"value": self.session.signals.read(self._signal(request))}
            case "lockstep":
                self._set_lockstep(client, values["on"], request)
            case "advance":
                self._advance(client, request)
                return None
            case "variable" if values["value"] is None:
                return {"value": self.session.signals.read(self._signal(request))}
            case "ping":
                pass
            case "jog":
                self._jog(client, request)
            case _:
                self._command(request)
        if REQUESTS[request.do].logged:
            kernel = self.session.kernel
            given = {key: value for key, value in values.items() if value is not None}
            kernel.trace.emit("command", kernel.line, do=request.do, client=client, **given)
        return {}

    def _jog(self, client: int, request: Request) -> None:
        """Hold a jog for a client, until it falls silent."""
        session, values = self.session, request.values
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

    def _command(self, request: Request) -> None:
        """What changes the run, from the next tick on."""
        session, values, refused = self.session, request.values, None
        match request.do:
            case "set" | "variable":
                signal = self._signal(request)
                if signal.kind in (SignalKind.DIGITAL_OUTPUT, SignalKind.ANALOG_OUTPUT):
                    raise Refused(f"{signal} is an output: the program sets it", request.identity)
                session.set_input(str(signal), self._level(request))
            case "force":
                session.force(str(self._signal(request)), self._level(request))
            case "release":
                session.release(str(self._signal(request)))
            case "reset_m":
                session.reset_m(values["index"])
            case "override":
                refused = session.set_override(values["percent"] / 100.0)
            case do:
                refused = _COMMANDS[do](session)
        if refused is not None:
            raise Refused(refused, request.identity)

    def _signal(self, request: Request) -> Signal:
        """The signal or variable that is meant; a request for a variable may leave out its `$`."""
        values, io = request.values, self.session.cell.io
        name = f"${values['name'].removeprefix('$')}" if "name" in values else values["signal"]
        try:
            return self.session.signals.resolve(name)
        except KeyError:
            hint = did_you_mean(name, (*io.names, *(f"${each}" for each in io.variables)))
            what = f"declares no variable `{name}`" if name.startswith("$") else f"has no signal `{name}`"
            raise Refused(f"the cell {what}{f'; {hint}' if hint else ''}", request.identity) from None

    def _level(self, request: Request) -> bool | float:
        signal, value = self._signal(request), request.values["value"]
        switch = self.session.cell.io.is_switch(signal)
        if switch is not isinstance(value, bool):
            kind = "true or false" if switch else "a number"
            raise Refused(f"{signal} takes {kind}", request.identity)
        return value if switch else float(value)

    def _subscribe(self, client: int, hertz: float, events: bool) -> None:
        stride = max(1, round(1.0 / (hertz * self.session.cell.tick))) if hertz else 0
        self._clients[client] = _Client(stride, events)

    def _set_lockstep(self, client: int, on: bool, request: Request) -> None:
        if self._lockstep not in (None, client):
            raise Refused("another client lets time pass already", request.identity)
        self._lockstep = client if on else None
        self._allowed = self.session.kernel.tick
        self.session.set_window(self._window)

    def _advance(self, client: int, request: Request) -> None:
        if self._lockstep != client:
            raise Refused("time passes by itself: ask for `lockstep` first", request.identity)
        if self._advancing is not None:
            raise Refused("the last `advance` is not over yet", request.identity)
        self._allowed = self.session.kernel.tick + request.values["ticks"]
        self._advancing = client, request.identity

    # --- what is told ------------------------------------------------------------------------------

    def _hello(self) -> dict[str, Any]:
        session = self.session
        return {
            "protocol": PROTOCOL,
            "robot": session.cell.robot.name,
            "program": session.program.source.name,
            "tick_s": session.cell.tick,
            "tick": session.kernel.tick,
            "started": self._started and session.kernel.state is not State.READY,
        }


def _line(value: dict[str, Any]) -> bytes:
    return json.dumps(value, separators=(",", ":"), allow_nan=False, ensure_ascii=False).encode()
