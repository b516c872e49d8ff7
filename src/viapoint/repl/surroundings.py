"""Commands about what is around the robot: points, signals and variables."""

from __future__ import annotations

from pathlib import Path

from viapoint.repl import pointsfile, show, values
from viapoint.repl.console import Complaint, Console
from viapoint.runtime.kernel import State

FREE = "free"
"""Instead of a value: the signal is not held any more."""


def teach(console: Console, words: list[str]) -> None:
    """The pose of the TCP, or the joints."""
    if not words:
        raise Complaint("say which point: `:teach P5`")
    number, rest = values.index(words[0], "P"), [word.lower() for word in words[1:]]
    session, frame, name = console.session, 0, None
    joints = "joints" in rest
    rest = [word for word in rest if word != "joints"]
    while rest:
        key, value = rest[0], rest[1] if len(rest) > 1 else ""
        if key == "frame" and value.isdecimal() and int(value) in session.cell.frames:
            frame = int(value)
        elif key == "as" and value.isidentifier():
            name = words[[word.lower() for word in words].index("as") + 1]
        else:
            raise Complaint(f"`{' '.join(rest)}` should be `joints`, `frame N` or `as NAME`")
        rest = rest[2:]
    point = session.teach(number, frame=frame, joints=joints, name=name)
    console.taught.add(number)
    place = f"  in frame {frame}" if frame else ""
    console.say(f"{show.point_text(point, show.joint_units(session))}{place}")


def points(console: Console, words: list[str]) -> None:
    """All of them in the order of their numbers; or write those that were taught."""
    session = console.session
    if words:
        if words[0].lower() != "save" or len(words) > 2:
            raise Complaint("write `:points` or `:points save FILE`")
        _save(console, Path(words[1]) if len(words) > 1 else None)
        return
    units = show.joint_units(session)
    for number in sorted(session.points):
        taught = "  taught" if number in console.taught else ""
        console.say(f"{show.point_text(session.points[number], units)}{taught}")
    if not session.points:
        console.say("no points")


def _save(console: Console, path: Path | None) -> None:
    session = console.session
    if path is None:
        source = session.cell.points_source
        if source is None:
            raise Complaint("the cell has no file of points: name one, `:points save points.toml`")
        path = Path(source.name)
    taught = [session.points[number] for number in sorted(console.taught)]
    if not taught:
        raise Complaint("no point was taught")
    try:
        pointsfile.update(path, taught, show.joint_units(session), session.cell)
    except OSError as error:
        raise Complaint(f"cannot write {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise Complaint(f"{path} is not a file of points: {error}") from error
    console.taught.clear()
    console.say(f"{path}: {', '.join(f'P{point.index}' for point in taught)}")


def io(console: Console, words: list[str]) -> None:
    """Set an input or a variable, answer an M function, or list what is not at rest."""
    session = console.session
    words = [word for word in words if word != "="]
    if not words:
        _list(console)
        return
    if len(words) != 2:
        raise Complaint("write `:io DI3 on`, or `:io M5 off`")
    if words[0].upper().startswith("M") and words[0][1:].isdecimal():
        if values.level(session, words[0], words[1]):
            raise Complaint("only the program raises an M function; `off` answers it")
        session.reset_m(int(words[0][1:]))
    else:
        code = values.signal(session, words[0])
        try:
            session.set_input(code, values.level(session, code, words[1]))
        except ValueError:
            raise Complaint(f"{code} is an output: the program sets it; `:force {code}` holds it") from None
    _pass_on(console)


def force(console: Console, words: list[str]) -> None:
    """Hold a signal at a value whatever is written, or let it go."""
    session = console.session
    if not words:
        _list(console)
        return
    if len(words) == 1 and words[0].lower() == FREE:
        for signal in session.signals.forced:
            session.release(str(signal))
    elif len(words) == 2:
        code = values.signal(session, words[0])
        if words[1].lower() == FREE:
            session.release(code)
        else:
            session.force(code, values.level(session, code, words[1]))
    else:
        raise Complaint("write `:force DI3 on`, `:force DI3 free`, or `:force free`")
    _pass_on(console)


def _pass_on(console: Console) -> None:
    """One tick at least, so that what was set is seen; on with what waited for it."""
    if console.session.kernel.state is State.HALTED:
        console.pass_time(at_least=1)
    else:
        console.go(at_least=1)


def _list(console: Console) -> None:
    lines = list(show.signal_lines(console.session))
    for line in lines or ["all signals are at rest"]:
        console.say(line)
