"""The commands with a colon: one table from which dispatch, help and completion come."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from viapoint.language.suggestions import did_you_mean
from viapoint.repl import calibrating, moving, surroundings, watching
from viapoint.repl.console import Complaint, Console

Words = list[str]


@dataclass(frozen=True, slots=True)
class Command:
    """One command: how it is written, what it does, who does it, and what its words may be."""

    name: str
    usage: str
    help: str
    run: Callable[[Console, Words], None]
    words: str = ""
    """Kinds of words for completion: file, label, signal, point, command, or the words themselves."""


def quit_prompt(console: Console, words: Words) -> None:
    """Leave."""
    none_of(words)
    console.leaving = True


def none_of(words: Words) -> None:
    """Raises Complaint where a command that takes nothing was given something."""
    if words:
        raise Complaint(f"`{words[0]}` is one word too many")


def help_on(console: Console, words: Words) -> None:
    """All commands, or one."""
    if not words:
        width = max(len(command.usage) for command in COMMANDS)
        for command in COMMANDS:
            console.say(f":{command.usage:<{width}}  {command.help}")
        console.say("Anything else is a statement and is executed at once; a block is collected to its end.")
        return
    command = find(words[0].removeprefix(":"))
    console.say(f":{command.usage}\n{command.help}")


COMMANDS: Final = (
    Command("load", "load FILE", "load a program, .via or .viac", moving.load, "file"),
    Command(
        "run",
        "run [from LINE|LABEL] [for S]",
        "run the loaded program, from a line, or S seconds of it",
        moving.run,
        "from for label",
    ),
    Command("step", "step [N]", "N statements of the robot; begins the loaded program", moving.step),
    Command("back", "back [N]", "N motions back along the travelled path", moving.back),
    Command(
        "break",
        "break [LINE|LABEL [if COND] | off [LINE|LABEL]]",
        "halt the robot before a line; list; off",
        moving.set_break,
        "label off if",
    ),
    Command("override", "override [P]", "all speeds in percent, below 0 back; show it", moving.override),
    Command("halt", "halt", "halt on the path", moving.halt),
    Command("continue", "continue [for S]", "go on, to the next breakpoint", moving.resume, "for"),
    Command("stop", "stop", "stop on the path and leave the program", moving.stop),
    Command("estop", "estop", "emergency stop on the path", moving.emergency_stop),
    Command("reset", "reset", "acknowledge an emergency stop", moving.reset),
    Command(
        "jog",
        "jog [base|tool|frame N] AXIS BY|AXIS+|AXIS- [for S] [at F]",
        "move J1…, E1…, X Y Z (mm) or A B C (deg about X Y Z) by so much, or on and on",
        moving.jog,
        "base tool frame for at J1 J2 J3 J4 J5 J6 X Y Z A B C",
    ),
    Command(
        "reference",
        "reference AXIS=V…",
        "say where axes stand, J1… and E1… in deg or mm, as encoders read; nothing moves",
        moving.reference,
    ),
    Command("time", "time [S]", "the time; let S seconds pass", moving.let_pass),
    Command("pace", "pace [X|off]", "let time pass X times as fast as the clock", moving.set_pace, "off"),
    Command(
        "teach",
        "teach P5 [joints] [frame N] [as NAME]",
        "make where the robot stands a point",
        surroundings.teach,
        "point joints frame as",
    ),
    Command(
        "points",
        "points [save [FILE]]",
        "list the points; write the taught ones",
        surroundings.points,
        "save file",
    ),
    Command(
        "calibrate",
        "calibrate tool N P… | frame N P P P [xxy] | save [FILE]",
        "a tool from 4 points taught in joints, a frame from 3; write them",
        calibrating.calibrate,
        "tool frame point xxy save file",
    ),
    Command(
        "io",
        "io [SIGNAL VALUE | Mn off]",
        "list signals and variables; set one; answer an M function",
        surroundings.io,
        "signal on off",
    ),
    Command(
        "force",
        "force [SIGNAL VALUE|free | free]",
        "hold a signal or variable at on, off or a number; let it go, or all",
        surroundings.force,
        "signal on off free",
    ),
    Command("status", "status", "state, place, joints, tool, speed", watching.status),
    Command("list", "list [LINE]", "the source, with robot and interpreter in it", watching.listing),
    Command(
        "trace",
        "trace [N|on|off|default]",
        "the last events; tell all, none, or some",
        watching.trace,
        "on off default",
    ),
    Command("plot", "plot OUT.png", "a picture of what was done, .png .svg .pdf", watching.plot, "file"),
    Command("record", "record OUT.mcap | off", "record from here on; end it", watching.record, "file off"),
    Command("explain", "explain CODE", "what a diagnostic means", watching.explain),
    Command("help", "help [COMMAND]", "this", help_on, "command"),
    Command("quit", "quit", "leave; so does Ctrl-D", quit_prompt),
)

BY_NAME: Final = {command.name: command for command in COMMANDS}


def find(name: str) -> Command:
    """The command of a name, or of the only one that begins so. Raises Complaint."""
    key = name.lower()
    if key in BY_NAME:
        return BY_NAME[key]
    begin = [each for each in BY_NAME if each.startswith(key)] if key else []
    if len(begin) == 1:
        return BY_NAME[begin[0]]
    if begin:
        raise Complaint(f"`:{name}` may be {', '.join(f'`:{each}`' for each in begin)}")
    near = did_you_mean(name, BY_NAME)
    hint = near.replace("`", "`:", 1) if near else "`:help` lists the commands"
    raise Complaint(f"unknown command `:{name}`; {hint}")


def perform(console: Console, text: str) -> None:
    """Do one command, written without its colon. Raises Complaint, CompileError."""
    try:
        words = shlex.split(text)
    except ValueError:  # a quotation mark without its other one
        words = text.split()
    if not words:
        raise Complaint("a command is missing; `:help` lists them")
    command = find(words[0])
    command.run(console, words[1:])
