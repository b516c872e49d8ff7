"""What can be written on the command line: one table of commands and options, on argparse.

Parsing only. Each command names the function that runs it, imported when it is called.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NoReturn

from viapoint.cli.failures import UsageError
from viapoint.cli.values import address, axes, number, one_of, path, percent, positive, whole


@dataclass(frozen=True, slots=True)
class Option:
    """One argument: `flags` and what argparse takes with them."""

    flags: tuple[str, ...]
    settings: dict[str, Any]


def _option(*flags: str, **settings: Any) -> Option:
    return Option(flags, settings)


@dataclass(frozen=True, slots=True)
class Command:
    """One row of the table; `function` is "module:name" below viapoint.cli."""

    name: str
    help: str
    function: str
    options: tuple[Option, ...]
    example: str


# --- the table ----------------------------------------------------------------------------------

PROGRAM = _option("file", metavar="FILE", type=path, help="program, .via or .viac")
PROGRAMS = _option("files", metavar="FILE", type=path, nargs="+", help="programs, .via or .viac")
CELL = _option("--cell", metavar="CELL", type=path, help="cell file (.toml); run and plot have one built in")
SCENARIO = _option("--scenario", metavar="S", type=path, help="what happens around the robot (.toml)")
FORMAT = _option(
    "--format", metavar="text|json", type=one_of("text", "json"), default="text", help="default: text"
)
ROBOT = _option("--robot", metavar="R", required=True, help="name of `viapoint robots`, or a robot file")
TOOL = _option(
    "--tool", metavar="V", type=number, nargs=6, default=None, help="tool: X Y Z A B C in mm and deg"
)


def _output(what: str) -> Option:
    return _option("-o", "--output", metavar="OUT", type=path, required=True, help=what)


LIMITS = (
    _option("--max-time", metavar="S", type=positive, help="stop after S seconds of the robot's time"),
    _option("--cycles", metavar="N", type=whole, help="stop when the program has run N times"),
)

COMMANDS = (
    Command(
        "run",
        "run a program on the simulated robot",
        "running:run",
        (
            _option(
                "file",
                metavar="FILE",
                type=path,
                nargs="?",
                help="program, .via or .viac; not needed where the cell names one for each of its robots",
            ),
            CELL,
            SCENARIO,
            *LIMITS,
            _option("--from", dest="first", metavar="N", type=whole, help="start from line N"),
            _option("--to", metavar="N", type=whole, help="end the run when line N has been executed"),
            _option(
                "--reference",
                metavar="J1=V,…",
                type=axes,
                help="where axes stand when the run begins, deg or mm; the others at home",
            ),
            _option("--step", action="store_true", help="exact stop after every motion, as in stepping"),
            _option("--override", metavar="P", type=percent, default=100.0, help="override in percent"),
            _option("--record", metavar="OUT.mcap", type=path, help="write a recording"),
            _option("--dry-run", action="store_true", help="hold the cell's process outputs off"),
            _option(
                "--drives",
                metavar="ideal",
                type=one_of("ideal"),
                default="ideal",
                help="model of the drives",
            ),
            _option(
                "--serve",
                metavar="[HOST:]PORT",
                type=address,
                help="let clients watch and command the run over TCP; port 0: a free one",
            ),
            _option("--await-client", action="store_true", help="begin when a client of --serve says start"),
            _option("--window", metavar="N", type=whole, default=512, help="ticks computed at once"),
            _option("--realtime", action="store_true", help="every tick at its time on the clock"),
            FORMAT,
        ),
        "viapoint run part.via --cell cell.toml --record part.mcap",
    ),
    Command(
        "repl",
        "a prompt: statements typed are executed at once on the simulated robot",
        "prompt:repl",
        (
            _option("file", metavar="FILE", type=path, nargs="?", default=None, help="program to load"),
            CELL,
            SCENARIO,
        ),
        "viapoint repl --cell cell.toml",
    ),
    Command(
        "check",
        "all diagnostics, where the program reads the world; with a cell: its corners and reach",
        "programs:check",
        (PROGRAMS, CELL, FORMAT),
        "viapoint check part.via --cell cell.toml",
    ),
    Command(
        "compile",
        "translate a program to bytecode",
        "programs:compile_program",
        (PROGRAM, CELL, _output("program file to write (.viac)")),
        "viapoint compile part.via -o part.viac",
    ),
    Command("dis", "show bytecode with source lines", "programs:dis", (PROGRAM,), "viapoint dis part.viac"),
    Command(
        "plot",
        "picture of a run: path, joints against limits, signals",
        "recordings:plot",
        (
            _option("file", metavar="REC.mcap|FILE.via", type=path, help="recording or program"),
            _output("picture to write (.png, .svg or .pdf)"),
            CELL,
            SCENARIO,
            *LIMITS,
        ),
        "viapoint plot part.mcap -o part.png",
    ),
    Command(
        "export",
        "a recording as CSV, one row per tick",
        "recordings:export",
        (
            _option("file", metavar="REC.mcap", type=path, help="recording"),
            _output("table to write (.csv), - for the terminal"),
        ),
        "viapoint export part.mcap -o part.csv",
    ),
    Command(
        "diff",
        "first difference of two recordings, and both cycle times per statement",
        "recordings:diff",
        (
            _option("a", metavar="A.mcap", type=path, help="recording"),
            _option("b", metavar="B.mcap", type=path, help="recording"),
            FORMAT,
        ),
        "viapoint diff before.mcap after.mcap",
    ),
    Command(
        "fk",
        "where the TCP is: pose of joints (deg or mm)",
        "kinematics:fk",
        (
            ROBOT,
            _option("joints", metavar="J", type=number, nargs="+", help="joints, deg or mm"),
            TOOL,
            FORMAT,
        ),
        "viapoint fk --robot frigeni6 0 0 0 0 0 0",
    ),
    Command(
        "ik",
        "all joints that reach a pose (mm, deg)",
        "kinematics:ik",
        (
            ROBOT,
            _option("pose", metavar="X…C", type=number, nargs=6, help="X Y Z A B C of the TCP"),
            TOOL,
            FORMAT,
        ),
        "viapoint ik --robot frigeni6 1755 0 2660 0 0 0",
    ),
    Command(
        "calibrate",
        "a tool from flange poses that touched one point; a frame from three points",
        "calibrating:calibrate",
        (
            _option("what", metavar="tool|frame", type=one_of("tool", "frame"), help="what to find"),
            _option(
                "file",
                metavar="MEASURED.csv",
                type=path,
                help="a row per pose: x,y,z,a,b,c in mm and deg; for a frame x,y,z will do",
            ),
            _option("--robot", metavar="R", default=None, help="rows are joints of this robot, deg or mm"),
            _option(
                "--tool",
                metavar="V",
                type=number,
                nargs=6,
                default=None,
                help="for a frame: the tool that touched, X Y Z A B C from the flange",
            ),
            _option("--xxy", action="store_true", help="a frame's points are two on X and one on Y"),
            FORMAT,
        ),
        "viapoint calibrate tool touched.csv",
    ),
    Command(
        "identify",
        "masses, inertias and friction of an arm from measured torques",
        "identifying:identify",
        (
            _option(
                "file",
                metavar="REC.mcap|TABLE.csv",
                type=path,
                help="recording with torques; or a table of t, j1…, tj1…, as `export` writes it",
            ),
            _option("--robot", metavar="R", default=None, help="the robot, on a level base"),
            _option("--cell", metavar="CELL", type=path, help="the robot as it stands in a cell (.toml)"),
            _option(
                "--against",
                metavar="OTHER",
                type=path,
                default=None,
                help="another recording or table: how well its torques are predicted",
            ),
            FORMAT,
        ),
        "viapoint identify exciting.mcap --cell cell.toml --against part.mcap",
    ),
    Command(
        "robots", "the robots that come with viapoint", "kinematics:robots", (FORMAT,), "viapoint robots"
    ),
    Command(
        "explain",
        "what a diagnostic code means, with an example",
        "programs:explain",
        (_option("code", metavar="CODE", help="such as E201"),),
        "viapoint explain E201",
    ),
)


# --- parsing ------------------------------------------------------------------------------------


class _Parser(argparse.ArgumentParser):
    """Raises instead of leaving the process, and takes `-1e-3` for a number, not for an option."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._negative_number_matcher = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$")

    def error(self, message: str) -> NoReturn:
        raise UsageError(message, self.format_usage().rstrip())


class _ShowVersion(argparse.Action):
    """Looks the version up when it is asked for: that takes as long as all the rest of `--help`."""

    def __call__(self, parser: argparse.ArgumentParser, *rest: object) -> NoReturn:
        from viapoint.cli.version import version

        print(f"viapoint {version()}")
        parser.exit()


def _main_parser() -> _Parser:
    parser = _Parser(
        prog="viapoint",
        description="Robot programs: check, compile, run, look at what they did.",
        epilog="`viapoint COMMAND --help` shows the options of a command.",
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_ShowVersion, nargs=0, help="show the version and exit")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    for command in COMMANDS:
        sub = commands.add_parser(
            command.name,
            help=command.help,
            description=f"{command.help[0].upper()}{command.help[1:]}.",
            epilog=f"example: {command.example}",
            allow_abbrev=False,
        )
        for option in command.options:
            sub.add_argument(*option.flags, **option.settings)
        sub.set_defaults(run=_runner(command.function), usage=sub.format_usage().rstrip())
    return parser


def _runner(function: str) -> Callable[[argparse.Namespace], int]:
    def run(chosen: argparse.Namespace) -> int:
        module, _, name = function.partition(":")
        code: int = getattr(import_module(f"viapoint.cli.{module}"), name)(chosen)
        return code

    return run


def parse(words: Sequence[str]) -> argparse.Namespace:
    """The command and its options, with `run`; raises UsageError, or SystemExit after --help."""
    from viapoint.language.suggestions import closest

    parser = _main_parser()
    names = [command.name for command in COMMANDS]
    if not words:
        raise UsageError("a command is missing", parser.format_help().rstrip())
    first = words[0]
    if not first.startswith("-") and first not in names:
        near = closest(first, names)
        hint = f"did you mean `{near}`?" if near else f"commands are {', '.join(names)}"
        raise UsageError(f"unknown command `{first}`; {hint}")
    chosen, unknown = parser.parse_known_args(list(words))
    if unknown:
        raise UsageError(_unknown(unknown[0], chosen), getattr(chosen, "usage", ""))
    if chosen.command is None:
        raise UsageError("a command is missing", parser.format_help().rstrip())
    return chosen


def _unknown(word: str, chosen: argparse.Namespace) -> str:
    """What to say about an argument that the command does not take."""
    if not word.startswith("-"):
        return f"`{word}` is one argument too many"
    from viapoint.language.suggestions import closest

    flags = [
        flag
        for command in COMMANDS
        if command.name == chosen.command
        for option in command.options
        for flag in option.flags
        if flag.startswith("-")
    ]
    near = closest(word.partition("=")[0], [*flags, "--help"])
    hint = f"; did you mean `{near}`?" if near else ""
    return f"`{chosen.command}` has no option `{word}`{hint}"
