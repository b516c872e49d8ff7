"""The desk behind the prompt: takes lines as they are typed, lets the robot do them, says what came of it.

It prints through `say` and asks nothing back, so that a terminal, a pipe and a test drive it alike. The
commands with a colon stand in `commands.py` and its neighbours.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from viapoint.checking import motion_diagnostic
from viapoint.interactive import Interactive, Question
from viapoint.language.diagnostics import Diagnostic
from viapoint.language.render import render
from viapoint.language.tree import name_key
from viapoint.narration import event_text, fixed
from viapoint.repl import show
from viapoint.repl.entry import Collector, Entry, Kind, label_of, references
from viapoint.repl.interrupts import Interrupts
from viapoint.runtime.kernel import State
from viapoint.session import DEFAULT_WINDOW, CompileError, Loaded, compile_text
from viapoint.starting import LineStart

if TYPE_CHECKING:
    from viapoint.runtime.cell import Cell
    from viapoint.runtime.recording import Recorder
    from viapoint.runtime.records import Event, Window
    from viapoint.runtime.signals import Scenario

PROMPT: Final = "<prompt>"
"""The name of what was typed, in diagnostics."""

KEPT_TICKS: Final = 600_000
"""Ticks kept for pictures: ten minutes at 1 ms, some 100 MB."""

KEPT_PACES: Final = 60_000
"""Motions of which it is kept for pictures what held them back."""

QUIET: Final = frozenset({"block", "error", "override", "input_read", "zone", "reference"})
"""Events not told unless tracing is on."""

SPEAKING: Final = frozenset({"output", "input_read", "block"})
"""Events whose text needs no kind before it."""

BREATH_S: Final = 0.05
"""At a pace, time is let pass in pieces of so much."""


def _is_quiet(event: Event) -> bool:
    """Also of a jog is told only what it stopped for by itself."""
    return event.kind in QUIET or (event.kind == "jog" and event.data["action"] != "stopped")


class Complaint(Exception):
    """Something typed that cannot be done; the sentence is for the user."""


class Console:
    """One sitting at the prompt. A listener of its session."""

    def __init__(
        self,
        cell: Cell,
        say: Callable[[str], None],
        *,
        scenario: Scenario | None = None,
        colour: bool = False,
        versions: Mapping[str, str] | None = None,
    ) -> None:
        self.say = say
        self.live: Callable[[str], None] | None = None
        """Shown the status line while the robot moves."""
        self.colour = colour
        self.versions = versions or {}
        self.scenario = scenario
        self.collector = Collector()
        self.loaded: Loaded | None = None
        self.breakpoints: dict[int, str] = {}
        """Lines of the loaded program, each with its condition or an empty text."""
        self.subroutines: dict[str, str] = {}
        """Texts of the subroutines typed, by the key of their name."""
        self.taught: set[int] = set()
        self.calibrated: set[tuple[str, int]] = set()
        """Tools and frames, ("tool" or "frame", index), that no file has yet."""
        self.tracing: bool | None = None
        """True: all events are told, False: none, None: those that say what the robot did."""
        self.pace: float | None = None
        """How many times faster than the clock time may pass; None: as fast as it can be computed."""
        self.recorder: Recorder | None = None
        self.failures = 0
        """Lines that could not be done."""
        self.leaving = False
        self.windows: deque[Window] = deque()
        self._kept = 0
        self.speed = 0.0
        """m/s of the TCP in the last tick."""
        self._moved = False  # since the last place was told
        self._ended = True  # and that was told
        self._told = 0  # events since the program began
        self.paces: deque[Event] = deque(maxlen=KEPT_PACES)
        """What held the last motions back, for pictures."""
        self.session = Interactive(cell, scenario=scenario, listeners=[self])
        self.session.kernel.execution.blocks.paced = self._pace

    # --- listening ---------------------------------------------------------------------------------

    def window(self, window: Window) -> None:
        """Listener: kept for pictures, and handed to the recording."""
        self.windows.append(window)
        self._kept += len(window)
        while self._kept > KEPT_TICKS and len(self.windows) > 1:
            self._kept -= len(self.windows.popleft())
        self.speed = float(window.speed[-1])
        self._moved |= bool((window.joints[0] != window.joints[-1]).any())
        if self.recorder is not None:
            self.recorder.window(window)

    def event(self, event: Event) -> None:
        """Listener: told, unless it is one of the quiet ones, and recorded."""
        if self.recorder is not None:
            self.recorder.event(event)
        self._moved |= event.kind == "block"
        told = self.tracing if self.tracing is not None else not _is_quiet(event)
        if told:
            self._told += 1
            self.say(self.event_line(event))

    def _pace(self, event: Event) -> None:
        self.paces.append(event)
        if self.recorder is not None:
            self.recorder.event(event)

    def event_line(self, event: Event) -> str:
        """One event with its time and line."""
        kind = "" if event.kind in SPEAKING else f"{event.kind} "
        line = f"line {event.line}  " if event.line else ""
        return f"  {fixed(event.t, 3)} s  {line}{kind}{event_text(event)}".rstrip()

    # --- lines -------------------------------------------------------------------------------------

    def enter(self, line: str) -> None:
        """One line as it was typed; never raises for what stands in it."""
        entry = self.collector.feed(line)
        if entry is not None:
            self._do(entry)

    def close(self) -> None:
        """No more lines will come: what waits is done, a recording is closed."""
        entry = self.collector.rest()
        if entry is not None:
            self._do(entry)
        self.end_recording()

    def _do(self, entry: Entry) -> None:
        from viapoint.repl.commands import perform

        try:
            match entry.kind:
                case Kind.COMMAND:
                    perform(self, entry.text)
                case Kind.PROGRAM:
                    self.execute(entry.text)
                case Kind.SUBROUTINE:
                    self._define(entry.text)
                case Kind.NOTHING:
                    pass
        except Complaint as complaint:
            self.complain(str(complaint))
        except CompileError as error:
            self.show([each for each in error.diagnostics if each.is_error])

    def complain(self, sentence: str) -> None:
        """Say what could not be done."""
        self.failures += 1
        self.say(f"error: {sentence}")

    def show(self, diagnostics: list[Diagnostic]) -> None:
        """Say what is wrong, or odd, and where."""
        if diagnostics:
            self.failures += any(each.is_error for each in diagnostics)
            self.say(render(diagnostics, colour=self.colour))

    def _define(self, text: str) -> None:
        name = label_of(text) or ""
        known = self.subroutines | {name_key(name): text}
        compile_text(self._with_subroutines(f"SUB {name}\n", known), PROMPT, self.session.cell)
        self.subroutines = known
        count = len(text.splitlines())
        self.say(f"subroutine {name}: {count} line{'s' if count > 1 else ''}, run it with SUB {name}")

    # --- programs ----------------------------------------------------------------------------------

    def execute(self, text: str, *, keep_modal: bool = False) -> None:
        """Compile what was typed and let the robot do it. Raises CompileError, Complaint."""
        self.require_free()
        program = compile_text(self._with_subroutines(text, self.subroutines), PROMPT, self.session.cell)
        begin = self.session.kernel.tick
        self.take_on(program, keep_modal=keep_modal)
        self.go(begin=begin)

    def require_free(self) -> None:
        """Raises Complaint while a program is under way, or the robot is left in motion."""
        session = self.session
        if session.under_way:
            name, state = session.program.source.name, session.kernel.state.value
            raise Complaint(
                f"{name} is {state} in line {session.next_line}: `:continue`, or `:stop` to leave it"
            )
        if session.kernel.state is State.MOVING:
            raise Complaint("the robot is moving: `:halt`, or `:continue`")
        if session.kernel.state is State.JOGGING:
            raise Complaint("the robot is being jogged: `:continue`, or `:stop`")
        if session.kernel.state is State.EMERGENCY:
            raise Complaint("the robot is in emergency stop: `:reset` first")

    def _with_subroutines(self, text: str, known: Mapping[str, str]) -> str:
        """A text with what it calls behind it: subroutines typed before, or the loaded program."""
        declared = {name_key(label) for line in text.splitlines() if (label := label_of(line))}
        parts, wanted = [text], references(text)
        while wanted:
            key = name_key(wanted.pop())
            if key in declared:
                continue
            if key in known:
                parts.append(known[key])
                declared.add(key)
                wanted += references(known[key])
            elif self.loaded is not None and key in self.loaded_labels:
                parts.append(self.loaded.source.text)
                declared |= self.loaded_labels
        return "END\n".join((parts[0], "".join(parts[1:]))) if len(parts) > 1 else text

    @property
    def loaded_labels(self) -> set[str]:
        """Keys of the labels of the loaded program."""
        return {name_key(label.name) for label in self.loaded.program.labels} if self.loaded else set()

    def take_on(
        self,
        program: Loaded,
        *,
        steps: int | None = None,
        breakpoints: Mapping[int, Question] | None = None,
        keep_modal: bool = False,
        start: LineStart | None = None,
    ) -> None:
        """Begin a program, perhaps from a line; how it ends will be told once."""
        self._ended, self._moved, self._told = False, False, 0
        self.session.take_on(
            program, steps=steps, breakpoints=breakpoints, keep_modal=keep_modal, start=start
        )

    def go(self, *, begin: int | None = None, seconds: float | None = None, at_least: int = 0) -> None:
        """Let time pass until nothing goes on by itself, or for some seconds; then say how things stand."""
        begin = self.session.kernel.tick if begin is None else begin
        pressed = self.pass_time(seconds, at_least)
        self.tell(begin, interrupted=pressed)

    def pass_time(self, seconds: float | None = None, at_least: int = 0) -> bool:
        """Let time pass; whether Ctrl-C was pressed.

        It halts the robot on its path; once more, and time stands still at once.
        """
        with Interrupts() as pressed:
            self._let_pass(pressed, seconds, at_least)
        if self.live is not None:
            self.live("")
        return pressed.count > 0

    def _let_pass(self, pressed: Interrupts, seconds: float | None, at_least: int) -> None:
        session, tick_s = self.session, self.session.cell.tick
        most = None if seconds is None else round(seconds / tick_s)
        halted = False
        start, first = time.monotonic(), session.kernel.tick
        for window in session.run(most, at_least=at_least):
            if self.live is not None:
                self.live(show.status(session, float(window.speed[-1])))
            if self.pace is not None:
                due = start + (session.kernel.tick - first) * tick_s / self.pace
                time.sleep(max(0.0, due - time.monotonic()))
            if pressed.count > 1:
                break
            if pressed.count and not halted:
                halted = True
                if session.let_go() is not None:
                    session.halt()

    # --- saying how things stand -------------------------------------------------------------------

    def tell(self, begin: int, *, interrupted: bool = False) -> None:
        """Say how things stand, `begin` being the tick in which they began."""
        session = self.session
        state = session.kernel.state
        took = f"{fixed((session.kernel.tick - begin) * session.cell.tick, 3)} s"
        if session.under_way:
            self.say(self._standing(interrupted, took))
            self.show_source()
            return
        ended, self._ended = not self._ended, True
        if state is State.JOGGING:
            self.say(f"jogging at {show.where(session)}, {took}")
        elif state is State.EMERGENCY:
            self.say(f"emergency stop at {show.where(session)}, {took}: `:reset`")
        elif state is State.FAILED and ended:
            self._tell_failure()
        elif state is State.STOPPED and ended:
            self.say(f"stopped in line {session.robot_line} at {show.where(session)}, {took}")
        elif state is State.HALTED or self._moved:
            self.say(f"at {show.where(session)}, {took}")
        elif ended and not self._told:
            self.say(f"done, {took}")
        self._moved = False

    def _tell_failure(self) -> None:
        session = self.session
        assert session.failure is not None, "a failed run has a failure"
        self.show([motion_diagnostic(session.failure, session.program.source, session.program.source.name)])
        if self._moved:
            self.say(f"at {show.where(session)}")

    def _standing(self, interrupted: bool, took: str) -> str:
        session = self.session
        line, state = session.next_line, session.kernel.state
        match state:
            case State.HALTED:
                by = " by Ctrl-C" if interrupted else ""
                return f"halted{by} {'before' if session.between else 'in'} line {line}, {took}"
            case State.WAITING | State.POLLING:
                awaited = session.kernel.dialogue.awaited
                what = f" for {awaited}" if awaited else ""
                return f"waiting in line {session.interpreter_line}{what}, {took}"
            case State.EMERGENCY:
                return f"emergency stop in line {line}, {took}: `:reset`, then `:continue`"
            case _:
                return f"{state.value} in line {line}, {took}"

    def show_source(self) -> None:
        """The source around the two markers, where there is more than what was just typed."""
        lines = self.session.program.source.text.splitlines()
        if len(lines) > 1:
            for line in show.source(lines, self.session.next_line, self.session.interpreter_line):
                self.say(line)

    def set_pace(self, pace: float | None) -> None:
        """How many times faster than the clock time passes; None: as fast as it can be computed."""
        self.pace = pace
        ticks = DEFAULT_WINDOW if pace is None else round(BREATH_S * pace / self.session.cell.tick)
        self.session.set_window(max(1, ticks))

    def start_recording(self, recorder: Recorder) -> None:
        """From the next tick on."""
        self.recorder = recorder

    def end_recording(self) -> None:
        """Close the recording, if one is being made."""
        if self.recorder is not None:
            self.recorder.close({"status": show.state_word(self.session)})
            self.recorder = None
