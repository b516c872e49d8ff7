"""The reference pages, made from the tables in the code. `--check` fails where a page is out of date.

docs/diagnostics.md from the catalogue, docs/instructions.md from the instruction table,
docs/language-commands.md from the command table. No page is edited by hand.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from viapoint.language import commands
from viapoint.language.catalogue import CATALOGUE, SHOWN_LINES, SHOWN_WIDTH, Entry
from viapoint.vm.instructions import SIZES, Instruction, Operand

DOCS = Path(__file__).parent
NOTE = "<!-- Made by docs/generate.py; do not edit. -->"

# First code of each family.
FAMILIES = {
    "E100": "Syntax",
    "E200": "Names, labels and blocks",
    "E250": "Program files",
    "E260": "Cell and robot files",
    "E290": "Scenario files",
    "E300": "Planning: before the robot moves there",
    "E400": "Execution",
    "I600": "Information",
    "W500": "Advice",
}
WRITTEN = {commands.Form.GLUED: "{}10", commands.Form.ASSIGNED: "{}=10", commands.Form.NUMBERED: "{}1=10"}


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> Iterator[str]:
    """A Markdown table; bars inside cells are escaped."""
    names = list(head)
    yield "| " + " | ".join(names) + " |"
    yield "|" + " --- |" * len(names)
    for row in rows:
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"
    yield ""


def code_block(text: str, language: str) -> Iterator[str]:
    lines = text.rstrip("\n").split("\n")
    yield f"```{language}"
    for line in lines[:SHOWN_LINES]:
        yield line if len(line) <= SHOWN_WIDTH else f"{line[:SHOWN_WIDTH]} …"
    if len(lines) > SHOWN_LINES:
        yield f"… {len(lines) - SHOWN_LINES} more lines"
    yield "```"
    yield ""


def diagnostics() -> Iterator[str]:
    yield from (NOTE, "# Diagnostics", "")
    yield "Every message carries a code that never changes its meaning. `viapoint explain E201` prints one."
    yield "Errors (E) forbid running, warnings (W) and information (I) do not."
    yield ""
    family = ""
    for entry in CATALOGUE.values():
        title = FAMILIES[max(first for first in FAMILIES if first <= entry.code)]
        if title != family:
            family = title
            yield from (f"## {title}", "")
        yield from entry_section(entry)


def entry_section(entry: Entry) -> Iterator[str]:
    yield from (f"### {entry.code}: {entry.title}", "", entry.explanation, "")
    for example in entry.examples:
        for name, text in example.files():
            yield from (f"`{name}`:", "")
            yield from code_block(text, "via" if name.endswith(".via") else "toml")


def instructions() -> Iterator[str]:
    yield from (NOTE, "# Instructions", "")
    yield "One byte of code, then the operands, little-endian. The stack holds booleans (B) and numbers (N)"
    yield "of conditions; between statements it is empty. `viapoint dis` prints a program in these words."
    yield ""
    head = ("code", "instruction", "operands", "bytes", "stack", "place", "meaning")
    yield from table(head, map(instruction_row, Instruction))
    yield from ("## Operands", "")
    yield from table(("operand", "bytes", "meaning"), map(operand_row, Operand))
    yield from ("## Place", "")
    yield "How an instruction stands to the path. The verifier follows it through every way a program can"
    yield "take, so that no loaded file reads the outside world before the robot has arrived."
    yield ""
    places = {one.spec.place for one in Instruction}
    ordered = sorted(places, key=lambda place: list(type(place)).index(place))
    yield from table(("place", "meaning"), ((place.name.lower(), place.value) for place in ordered))


def instruction_row(one: Instruction) -> Iterable[str]:
    spec = one.spec
    stack = f"{spec.pops or '–'} → {spec.pushes or '–'}" if spec.pops or spec.pushes else ""
    operands = ", ".join(operand.word for operand in spec.operands)
    doc = f"`{spec.doc}`" if not any(c.isalnum() for c in spec.doc) else spec.doc
    place = spec.place.name.lower()
    return f"`{spec.code:#04x}`", f"`{one.word}`", operands, str(SIZES[one]), stack, place, doc


def operand_row(operand: Operand) -> Iterable[str]:
    return operand.word, {"I": "4", "B": "1"}[operand.format], operand.meaning


def language_commands() -> Iterator[str]:
    yield from (NOTE, "# Commands", "")
    yield "One statement per line; keywords in any case; `//` starts a comment. Lengths in mm, angles in deg,"
    yield "times in s."
    yield from ("", "## Motion", "")
    for motion in commands.MOTIONS:
        yield from motion_section(motion)
    yield from ("## The rest", "")
    head = ("command", "example", "takes", "meaning")
    yield from table(head, map(action_row, commands.ACTIONS))
    yield from ("A label is a name and a colon, `LOOP:`, alone or before a statement. Conditions read", "")
    signals = ", ".join(f"`{code}n` ({doc})" for code, doc in commands.SIGNALS.items())
    yield f"{signals}, joined by `NOT`, `AND`, `OR` and parentheses, and compare numbers with"
    yield "`=` `<>` `<` `<=` `>` `>=`."
    yield ""


def motion_section(motion: commands.MotionCommand) -> Iterator[str]:
    yield from (f"### {motion.word}", "", f"{motion.doc[0].upper()}{motion.doc[1:]}.", "")
    for need in motion.needs:
        either = " or ".join(f"`{key}`" for key in need.any_of)
        together = " ".join(f"`{key}`" for key in need.all_of)
        yield f"Needs a {need.name}: {either}{f', or {together}' if together else ''}."
        yield ""
    rows = (
        (
            f"`{WRITTEN[p.form].format(p.code)}`",
            p.domain.text,
            p.unit,
            p.doc,
            " ".join(f"`{other}`" for other in p.excludes),
        )
        for p in motion.parameters
    )
    yield from table(("parameter", "value", "unit", "meaning", "not beside"), rows)


def action_row(action: commands.ActionCommand) -> Iterable[str]:
    takes = action.operand.value
    if action.domain is not None:
        takes += f": {action.domain.text}"
    return f"`{action.word}`", f"`{action.example}`", takes, action.doc


PAGES: dict[str, Callable[[], Iterator[str]]] = {
    "diagnostics.md": diagnostics,
    "instructions.md": instructions,
    "language-commands.md": language_commands,
}


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="change nothing, fail where a page is stale")
    check = parser.parse_args(arguments).check
    stale = []
    for name, make in PAGES.items():
        text = "\n".join(make()).rstrip("\n") + "\n"
        page = DOCS / name
        if page.exists() and page.read_text(encoding="utf-8") == text:
            continue
        stale.append(name)
        if not check:
            page.write_text(text, encoding="utf-8")
    if check and stale:
        print(f"out of date: {', '.join(stale)}; run `make docs`", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
