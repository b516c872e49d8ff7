"""Commands that let the robot move, or keep it from moving."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from viapoint.interactive import Interactive, Question
from viapoint.jogging import HeldJog, JogError
from viapoint.language.render import render
from viapoint.language.tree import name_key
from viapoint.repl import jogging, show, values
from viapoint.repl.console import Complaint, Console
from viapoint.runtime.kernel import State
from viapoint.session import CompileError, Loaded, compile_file
from viapoint.start_report import start_lines
from viapoint.starting import LineStart, StartError, start_at

_CONDITION: Final = re.compile(r"if", re.IGNORECASE)
_MOST: Final = 100.0
"""Percent of override at most, forward and back."""


def load(console: Console, words: list[str]) -> None:
    """Compile a program and keep it for `:run`; breakpoints of the one before are dropped."""
    if len(words) != 1:
        raise Complaint("name one program: `:load part.via`")
    console.require_free()
    load_program(console, Path(words[0]))


def load_program(console: Console, path: Path) -> None:
    """Load a program and say what is odd about it."""
    try:
        loaded = compile_file(path, console.session.cell)
    except CompileError as error:
        console.show(list(error.diagnostics))
        return
    console.loaded = loaded
    console.breakpoints.clear()
    if loaded.diagnostics:
        console.say(render(loaded.diagnostics, colour=console.colour))
    count = len(loaded.source.text.splitlines())
    console.say(f"{path.name}: {count} line{'' if count == 1 else 's'}; `:run` or `:step`")


def run(console: Console, words: list[str]) -> None:
    """The loaded program from its first line, or from another one."""
    first = None
    if len(words) > 1 and words[0].lower() == "from":
        first, words = words[1], words[2:]
    if len(words) == 1 and words[0].lower().endswith((".via", ".viac")):
        raise Complaint(f"a program is loaded first: write `:load {words[0]}`, then `:run`")
    seconds = values.seconds(words)
    begin = console.session.kernel.tick
    _take_on(console, None, first)
    console.go(begin=begin, seconds=seconds)


def _take_on(console: Console, steps: int | None, first: str | None = None) -> None:
    if console.loaded is None:
        raise Complaint("no program is loaded: `:load part.via`")
    console.require_free()
    start = None if first is None else _start(console, console.loaded, first)
    console.take_on(console.loaded, steps=steps, breakpoints=_questions(console), start=start)


def _start(console: Console, loaded: Loaded, word: str) -> LineStart:
    """What holds at a line or label; it is shown."""
    line = int(word) if word.isdecimal() else _place(console, word)
    try:
        start = start_at(loaded.program, console.session.cell, line)
    except StartError as error:
        raise Complaint(str(error)) from None
    for said in start_lines(start, loaded.source.text.splitlines()):
        console.say(said)
    return start


def _questions(console: Console) -> dict[int, Question]:
    session = console.session
    return {
        line: session.question(condition) if condition else _always
        for line, condition in console.breakpoints.items()
    }


def _always() -> bool:
    return True


def step(console: Console, words: list[str]) -> None:
    """Statements of what is under way, or of the loaded program from its beginning."""
    count, session = values.count(words), console.session
    begin = session.kernel.tick
    if session.under_way or session.kernel.state is State.HALTED:
        _require_no_emergency(console)
        _taken(session.step_on(count))
    else:
        _take_on(console, count)
    console.go(begin=begin)


def back(console: Console, words: list[str]) -> None:
    """Motions back."""
    session = console.session
    begin = session.kernel.tick
    for k in range(values.count(words)):
        if session.kernel.state not in (State.HALTED, State.FINISHED):
            state = show.state_word(session)
            raise Complaint(f"the robot is {state}: it goes back when it is halted or ready")
        before = session.kernel.mover.s
        _taken(session.step_back())
        console.pass_time()
        if session.kernel.mover.s == before:
            if k == 0:
                raise Complaint("there is nothing further back")
            break
    console.tell(begin)


def set_break(console: Console, words: list[str]) -> None:
    """List, set or clear breakpoints of the loaded program."""
    if not words:
        _list_breaks(console)
        return
    if words[0].lower() == "off":
        _clear(console, words[1:])
    else:
        line, condition = _place(console, words[0]), _condition(words[1:])
        if condition:
            console.session.question(condition)  # what is wrong with it is said now
        console.breakpoints[line] = condition
        console.say(_break_text(console, line))
    if console.session.program is console.loaded:
        console.session.set_breakpoints(_questions(console))


def _list_breaks(console: Console) -> None:
    for line in sorted(console.breakpoints):
        console.say(_break_text(console, line))
    if not console.breakpoints:
        console.say("no breakpoints")


def _break_text(console: Console, line: int) -> str:
    assert console.loaded is not None, "breakpoints belong to a program"
    condition = console.breakpoints[line]
    text = console.loaded.source.line_text(line).strip()
    return f"break before line {line}{f' if {condition}' if condition else ''}: {text}"


def _clear(console: Console, words: list[str]) -> None:
    if not words:
        console.breakpoints.clear()
        return
    line = _place(console, words[0])
    if console.breakpoints.pop(line, None) is None:
        raise Complaint(f"line {line} has no breakpoint")


def _condition(words: list[str]) -> str:
    if not words:
        return ""
    if not _CONDITION.fullmatch(words[0]) or len(words) < 2:
        raise Complaint("write `:break LINE if CONDITION`")
    return " ".join(words[1:])


def _place(console: Console, word: str) -> int:
    """The line of a number or label: the first statement there or below."""
    if console.loaded is None:
        raise Complaint("no program is loaded: `:load part.via`")
    program = console.loaded.program
    lines = sorted(set(program.spans.lines))
    if not word.isdecimal():
        for label in program.labels:
            if name_key(label.name) == name_key(word):
                line = program.line_at(label.address)
                beside = console.loaded.source.line_text(line).partition(":")[2].partition("//")[0].strip()
                return line if beside else next((n for n in lines if n > line), line)
        raise Complaint(f"the program has no label `{word}`")
    statement = next((n for n in lines if n >= int(word)), None)
    if statement is None or int(word) == 0:
        raise Complaint(f"there is no statement in line {word}: the last one is in line {lines[-1]}")
    return statement


def override(console: Console, words: list[str]) -> None:
    """Show or set it; 0 stands still, below 0 the path is travelled back."""
    session = console.session
    if words:
        value = values.number(words[0].removesuffix("%"), "a percentage")
        if len(words) > 1 or not -_MOST <= value <= _MOST:
            raise Complaint("the override is between -100 and 100 percent")
        begin = session.kernel.tick
        _taken(session.set_override(value / 100.0))
        if session.under_way:
            console.go(begin=begin)
    console.say(f"override {show.figure(session.kernel.override * 100.0)} %")


def halt(console: Console, words: list[str]) -> None:
    """Where a program was left in motion by `for S`."""
    session = console.session
    if session.kernel.state is not State.MOVING:
        _under_way(console)
    begin = session.kernel.tick
    if session.kernel.state is State.JOGGING:
        raise Complaint("the robot is being jogged: `:continue`, or `:stop`")
    session.halt()
    console.go(begin=begin, at_least=1)


def resume(console: Console, words: list[str]) -> None:
    """On from a halt, a step, a step back; from where time was stopped."""
    seconds, session = values.seconds(words), console.session
    _require_no_emergency(console)
    if not session.under_way and session.kernel.state not in (State.HALTED, State.MOVING, State.JOGGING):
        raise Complaint("nothing is halted")
    begin = session.kernel.tick
    session.resume()
    console.go(begin=begin, seconds=seconds)


def stop(console: Console, words: list[str]) -> None:
    """Leave the program where the robot comes to rest."""
    session = _under_way(console)
    _require_no_emergency(console)
    begin = session.kernel.tick
    session.stop()
    console.go(begin=begin)


def emergency_stop(console: Console, words: list[str]) -> None:
    """With the emergency deceleration."""
    session = _under_way(console)
    begin = session.kernel.tick
    session.emergency_stop()
    console.go(begin=begin, at_least=1)


def reset(console: Console, words: list[str]) -> None:
    """After an emergency stop the program is halted."""
    if console.session.kernel.state is not State.EMERGENCY:
        raise Complaint("there is nothing to reset")
    session = console.session
    session.reset()
    console.say(f"halted in line {session.next_line}" if session.under_way else "ready")


def jog(console: Console, words: list[str]) -> None:
    """One move by an increment, as a statement of its own; or on along an axis, to a time or a limit."""
    console.require_free()
    held = jogging.held(console.session, words)
    if held is not None:
        _jog_on(console, held)
        return
    text = jogging.statement(console.session, words)
    console.execute(text, keep_modal=True)


def _jog_on(console: Console, held: HeldJog) -> None:
    begin = console.session.kernel.tick
    try:
        _taken(console.session.hold(held))
    except JogError as error:
        raise Complaint(str(error)) from None
    console.go(begin=begin)


def reference(console: Console, words: list[str]) -> None:
    """Where the axes stand; then what the TCP is at."""
    console.require_free()
    axes: dict[str, float] = {}
    for word in words:
        name, given, value = word.partition("=")
        if not given or name.upper() in axes:
            raise Complaint(f"`{word}`: write each axis once, as in `:reference J1=12.5 E1=300`")
        axes[name.upper()] = values.number(value, "deg or mm")
    try:
        _taken(console.session.reference(axes))
    except ValueError as error:
        raise Complaint(str(error)) from None
    console.say(f"joints  {show.joints(console.session)}")


def let_pass(console: Console, words: list[str]) -> None:
    """Whatever the robot does or does not do meanwhile."""
    session = console.session
    if words:
        ticks = round(values.positive(words[0], "a time in s") / session.cell.tick)
        begin = session.kernel.tick
        console.go(begin=begin, seconds=ticks * session.cell.tick, at_least=ticks)
    console.say(f"t = {session.kernel.tick * session.cell.tick:.3f} s")


def set_pace(console: Console, words: list[str]) -> None:
    """1: in step with the clock."""
    if words:
        console.set_pace(None if words[0].lower() == "off" else values.positive(words[0], "a factor"))
    pace = console.pace
    console.say("as fast as can be computed" if pace is None else f"{show.figure(pace)} × the clock")


def _under_way(console: Console) -> Interactive:
    """Raises Complaint where no program is, and the robot is not being jogged."""
    if not console.session.under_way and console.session.kernel.state is not State.JOGGING:
        raise Complaint("no program is under way")
    return console.session


def _taken(refused: str | None) -> None:
    """Raises Complaint for what is refused."""
    if refused is not None:
        raise Complaint(refused)


def _require_no_emergency(console: Console) -> None:
    if console.session.kernel.state is State.EMERGENCY:
        raise Complaint("the robot is in emergency stop: `:reset` first")
