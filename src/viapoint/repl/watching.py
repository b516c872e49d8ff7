"""Commands that show and keep what happened: status, source, trace, pictures, recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from viapoint.repl import show
from viapoint.repl.console import Complaint, Console

_LAST: Final = 20
"""Events shown where no number is given."""

_LEVELS: Final = {"on": True, "off": False, "default": None}


def status(console: Console, words: list[str]) -> None:
    """More than the status line has room for."""
    session = console.session
    speed = session.modal.speed
    console.say(show.status(session, console.speed))
    console.say(f"joints  {show.joints(session)}")
    console.say(f"speed   {f'{speed.kind.value}{speed.value:g}' if speed else 'the default of the cell'}")
    if console.loaded is not None:
        console.say(f"program {console.loaded.source.name}")


def listing(console: Console, words: list[str]) -> None:
    """The program under way, else the loaded one, whole or around a line."""
    session = console.session
    program = session.program if session.under_way else console.loaded
    if program is None:
        raise Complaint("no program is loaded: `:load part.via`")
    lines = program.source.text.splitlines()
    robot, interpreter = (session.next_line, session.interpreter_line) if session.under_way else (0, 0)
    around = int(words[0]) if words and words[0].isdecimal() else None
    if words and (around is None or not 1 <= around <= len(lines)):
        raise Complaint(f"`{words[0]}` is no line of {program.source.name}")
    for number, text in enumerate(lines, start=1):
        if around is None or abs(number - around) <= _LAST // 2:
            console.say(show.numbered(number, text, number == robot, number == interpreter))


def trace(console: Console, words: list[str]) -> None:
    """The last events; or which are told as they happen."""
    if words and words[0].lower() in _LEVELS:
        console.tracing = _LEVELS[words[0].lower()]
        return
    if words and not words[0].isdecimal():
        raise Complaint("write `:trace`, `:trace 50`, `:trace on`, `off` or `default`")
    from viapoint.report import in_time_order

    events = in_time_order(console.session.events)
    for event in events[-(int(words[0]) if words else _LAST) :]:
        console.say(console.event_line(event))
    if not events:
        console.say("nothing has happened yet")


def plot(console: Console, words: list[str]) -> None:
    """Of the last ten minutes of the robot's time."""
    from viapoint.report import in_time_order
    from viapoint.run_info import run_info
    from viapoint.runtime.pictures import PictureError, draw_run
    from viapoint.runtime.recording import join

    path, session = _one_file(words, "plot run.png"), console.session
    trace = join(list(console.windows))
    happened = in_time_order([*session.events, *console.paces])
    events = [event for event in happened if event.tick >= trace.first_tick]
    info = run_info(session.cell, session.program, "viapoint repl", console.versions, console.scenario)
    try:
        draw_run(info, trace, events, path)
    except PictureError as error:
        raise Complaint(str(error)) from error
    console.say(f"picture: {path}")


def record(console: Console, words: list[str]) -> None:
    """Into a file that is complete when recording ends."""
    if words and words[0].lower() == "off":
        if console.recorder is None:
            raise Complaint("nothing is being recorded")
        console.end_recording()
        return
    from viapoint.run_info import run_info
    from viapoint.runtime.recording import Recorder

    path, session = _one_file(words, "record run.mcap"), console.session
    console.end_recording()
    program = console.loaded or session.program
    info = run_info(session.cell, program, "viapoint repl", console.versions, console.scenario)
    radii = session.cell.robot.body_radius
    try:
        recorder = Recorder(
            path,
            info,
            skeleton=session.cell.robot.link_points,
            radii=() if radii is None else tuple(radii.tolist()),
        )
    except OSError as error:
        raise Complaint(f"cannot write {path}: {error.strerror or error}") from error
    console.start_recording(recorder)
    console.say(f"recording: {path}")


def explain(console: Console, words: list[str]) -> None:
    """The catalogue's entry."""
    from viapoint.language.catalogue import CATALOGUE
    from viapoint.language.catalogue import explain as explained
    from viapoint.language.suggestions import did_you_mean

    code = words[0] if words else ""
    text = explained(code)
    if text is None:
        hint = did_you_mean(code, CATALOGUE) or "codes look like E201, W501"
        raise Complaint(f"there is no code `{code}`; {hint}")
    console.say(text)


def _one_file(words: list[str], example: str) -> Path:
    if len(words) != 1:
        raise Complaint(f"name one file: `:{example}`")
    return Path(words[0])
