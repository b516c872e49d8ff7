"""One line of a program: comment, label and statement, the fast path first, then the grammar.

Collects statements and diagnostics; a bad line adds diagnostics and nothing else, so the lines after it
are read as if it were not there.
"""

from __future__ import annotations

import re
from typing import Final

from viapoint.language import tree
from viapoint.language.building import Place, build_action, build_search, domain_fault, label_fault
from viapoint.language.checks import base_key, check_layout, check_missing, parameters_of
from viapoint.language.commands import (
    ACTION_BY_WORD,
    FIRST_WORDS,
    LATER_STATEMENTS,
    MOTION_BY_WORD,
    Operand,
)
from viapoint.language.diagnostics import Diagnostic, Label
from viapoint.language.fault_words import scan_parameters
from viapoint.language.faults import action_fault, expression_fault, later
from viapoint.language.grammar import (
    Fault,
    Given,
    Unexpected,
    parse_action,
    parse_motion,
    parse_search,
)
from viapoint.language.lexical import MAX_LINE, NAME, code_end, is_code
from viapoint.language.shapes import JUMP_NODES, quick
from viapoint.language.source import Source, Span
from viapoint.language.suggestions import command_hint

_LABEL: Final = re.compile(rf"({NAME})[ \t]*:")
_FIRST: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_GLUED_FIRST: Final = re.compile(r"([A-Za-z]+)(?=[-+.0-9(])")
_ELSE_IF: Final = re.compile(r"[ \t]+IF(?![A-Za-z0-9_])", re.IGNORECASE)
_UNTIL: Final = re.compile(r"(?<![A-Za-z0-9_])UNTIL(?![A-Za-z0-9_])", re.IGNORECASE)
_CAPTURE: Final = re.compile(r"[ \t]CAPTURE[ \t]*$", re.IGNORECASE)
_STRAY: Final = re.compile(r"[^\t -~]")
_LONG_QUOTE: Final = re.compile(r"`([^`]{40})[^`]{20,}`")
"""Quoted text is cut in messages: they are to be read, the place shows the rest."""

_TAKES_GLUED: Final = frozenset(
    command.word
    for command in ACTION_BY_WORD.values()
    if command.operand in (Operand.VALUE, Operand.TANGENT, Operand.WAIT)
)
_LOOK_ALIKES: Final = {
    "\u00a0": "a blank that is not the ordinary one",
    "\u2212": "a minus sign; write `-`",
    "\u2013": "a dash; write `-`",
    "\u201c": 'a typographic quote; write `"`',
    "\u201d": 'a typographic quote; write `"`',
    "\uff1a": "a wide colon; write `:`",
}


class LineReader:
    """Reads lines of one source into `statements` and `diagnostics`."""

    __slots__ = ("_line", "_source", "_use_shapes", "diagnostics", "statements")

    def __init__(self, source: Source, *, use_shapes: bool = True) -> None:
        self.statements: list[tree.Statement] = []
        self.diagnostics: list[Diagnostic] = []
        self._source = source
        self._use_shapes = use_shapes
        self._line = 0

    def read(self, line: int, start: int, text: str) -> None:
        """Read line number `line`, whose first character has the offset `start`."""
        self._line = line
        if len(text) > MAX_LINE:
            message = f"the line has {len(text)} characters; at most {MAX_LINE} are allowed"
            self._report(Fault("E103", message, 0, MAX_LINE, "is this a program file?"), start)
            return
        end, quote = code_end(text)
        if quote is not None:
            self._report(
                Fault("E105", "the string is not closed", quote, len(text), 'end it with `"`'), start
            )
            return
        code = text[:end].rstrip(" \t\r")
        body = code.lstrip(" \t")
        if not body:
            return
        stray = _STRAY.search(code)
        if stray is not None:
            self._report(_stray_fault(stray.group(), stray.start()), start)
            return
        self._statement(body, start + len(code) - len(body))

    def _report(self, fault: Fault, offset: int, labels: tuple[Label, ...] = ()) -> None:
        self.diagnostics.append(
            Diagnostic(
                code=fault.code,
                message=_LONG_QUOTE.sub(r"`\1…`", fault.message),
                source=self._source,
                span=Span(offset + fault.start, offset + fault.end),
                hint=fault.hint,
                labels=labels,
            )
        )

    def _statement(self, text: str, start: int) -> None:
        """A statement from its text, stripped; labels before it are taken off first."""
        if self._use_shapes:
            made = quick(text, self._line, start)
            if made is not None:
                self.statements.append(made)
                return
        label = _LABEL.match(text)
        if label is None:
            self._command(text, start)
            return
        self._label(label.group(1), start)
        rest = text[label.end() :]
        body = rest.lstrip(" \t")
        if body:
            self._statement(body, start + len(text) - len(body))

    def _label(self, name: str, start: int) -> None:
        fault = label_fault(name, 0)
        if fault is not None:
            self._report(fault, start)
        else:
            self.statements.append(tree.Label(self._line, start, start + len(name), name))

    def _command(self, text: str, start: int) -> None:
        found = _FIRST.match(text)
        word = found.group().upper() if found is not None else ""
        if word not in FIRST_WORDS:
            glued = _GLUED_FIRST.match(text)
            if glued is None or glued.group().upper() not in _TAKES_GLUED:
                self._report(_first_fault(text, found), start)
                return
            word = glued.group().upper()
        after = len(word)
        else_if = _ELSE_IF.match(text, after) if word == "ELSE" else None
        if else_if is not None:
            word, after = "ELSEIF", else_if.end()
        if word in MOTION_BY_WORD:
            self._motion(word, text, after, start)
        else:
            self._action(word, text, after, start)

    def _motion(self, word: str, text: str, after: int, start: int) -> None:
        faults: list[Fault] = []
        meant: set[str] = set()
        until = _UNTIL.search(text, after)
        search = None
        if until is not None:
            search = self._search(text[until.end() :], start + until.start(), start + until.end())
            text = text[: until.start()].rstrip()
        try:
            given = parse_motion(text[after:])
        except (Fault, Unexpected) as error:
            scan = scan_parameters(text[after:])
            given, faults, meant = scan.given, scan.faults, scan.meant
            if not faults:
                faults = [_unexplained(error, text[after:])]
        for fault in faults:
            self._report(fault, start + after)
        sound = self._check(word, given, start + after) and not faults
        layout = tree.Layout(word, tuple(each.key for each in given))
        for need in check_missing(layout):
            wanted = {base_key(key) for key in (*need.any_of, *need.all_of)}
            if wanted & {base_key(key) for key in meant if key}:
                continue
            sound = False
            message = f"`{word}` needs a {need.name}"
            self._report(Fault("E123", message, 0, len(word), f"add {need.example}"), start)
        if sound:
            values = _values(word, given)
            if until is not None:
                if search is None:
                    return
                self.statements.append(search)
            names = tuple((at, each.name) for at, each in enumerate(given) if each.name is not None)
            self.statements.append(tree.Motion(self._line, start, start + len(text), layout, values, names))

    def _search(self, text: str, start: int, behind: int) -> tree.Until | None:
        """What stands behind the UNTIL at `start`; None if it is reported."""
        try:
            operands = parse_search(text)
            return build_search(operands, Place(self._line, start, behind + len(text), behind - start))
        except Fault as fault:
            self._report(fault, behind)
        except Unexpected as error:
            what = "a point" if _CAPTURE.search(text) else "a condition"
            found = expression_fault(text, error.at, what, "for instance `UNTIL DI3 CAPTURE P20`")
            found.start = max(found.start, start - behind)
            self._report(found, behind)
        return None

    def _check(self, word: str, given: list[Given], offset: int) -> bool:
        """Report what the table finds wrong with the codes and values of a motion."""
        layout = tree.Layout(word, tuple(each.key for each in given))
        findings = check_layout(layout)
        for finding in findings:
            place = given[finding.at]
            labels: tuple[Label, ...] = ()
            if finding.other is not None:
                first = given[finding.other]
                labels = (Label(Span(offset + first.start, offset + first.end), "the other one"),)
            message, hint = finding.message, finding.hint
            if place.name is not None and finding.code == "E122":
                message = f"`{place.name}` reads as the name of a point, and the target is given already"
            fault = Fault(finding.code, message, place.start, place.end, hint)
            self._report(fault, offset, labels)
        known = parameters_of(word)
        sound = not findings
        for each in given:
            parameter = known.get(base_key(each.key))
            if parameter is not None and not parameter.domain.holds(each.value):
                self._report(domain_fault(each, parameter), offset)
                sound = False
        return sound

    def _action(self, word: str, text: str, after: int, start: int) -> None:
        end = start + len(text)
        try:
            called = re.match(rf"[ \t]+{NAME}\(", text[after:]) if word in JUMP_NODES else None
            if called is not None:
                raise later(
                    "SUB NAME(…)", called.start() + 1, called.end(), "a count stands apart: `SUB CUT 3`"
                )
            operands = parse_action(word, text[after:])
            made = build_action(operands, Place(self._line, start, end, after), text[after:])
        except Fault as fault:
            self._report(fault, start + after)
        except Unexpected as error:
            found = action_fault(word, text[after:], error)
            found.start = max(found.start, -after)
            self._report(found, start + after)
        else:
            self.statements.append(made)


def _values(word: str, given: list[Given]) -> tuple[float, ...]:
    known = parameters_of(word)
    return tuple(
        int(each.value) if known[base_key(each.key)].domain.is_whole else each.value for each in given
    )


def _unexplained(error: Fault | Unexpected, text: str) -> Fault:
    """The scan saw nothing wrong though the grammar did: report the grammar's own place."""
    if isinstance(error, Fault):
        return error
    return Fault("E112", "unexpected text", min(error.at, len(text.rstrip())), len(text.rstrip()))


def _stray_fault(character: str, at: int) -> Fault:
    if character == "\0":
        return Fault("E102", "the line holds a NUL character", at, at + 1, "is this a text file?")
    name = f"`{character}`" if character.isprintable() else f"U+{ord(character):04X}"
    hint = _LOOK_ALIKES.get(character, "other than ASCII characters may stand in comments and strings only")
    return Fault("E104", f"{name} cannot stand here", at, at + 1, hint)


def _first_fault(text: str, found: re.Match[str] | None) -> Fault:
    """A line that begins with no command."""
    if found is None:
        word = text.split()[0]
        if word[0] in ";#'/*%":
            return Fault("E110", f"unexpected `{word[0]}`", 0, len(text), "a comment begins with `//`")
        if word[0] == ":":
            return Fault("E113", "the name of the label is missing", 0, 1, "a label is `NAME:`")
        if word[0] == "$":
            hint = "write `LET $count = 3`, or `INC $count`"
            return Fault("E110", f"`{word}` is a variable and no command", 0, len(word), hint)
        hint = "a statement begins with a command, such as `ML P1`"
        return Fault("E110", f"`{word}` is not a command", 0, len(word), hint)
    word = found.group()
    if word.upper() in LATER_STATEMENTS:
        return later(word, 0, len(word))
    if re.match(rf"{NAME}\([^()]*\)[ \t]*:", text):
        return later(f"{word}(…):", 0, len(word), "a label without parameters is `NAME:`")
    rest = text[len(word) :].strip()
    if is_code(word) or rest.startswith("="):
        hint = (
            f"a statement begins with a command, such as `ML {word}`"
            if is_code(word)
            else ("a statement begins with a command, such as `ML X=100`")
        )
        return Fault("E110", f"`{word}` is not a command", 0, len(word), hint)
    hint = command_hint(word, FIRST_WORDS)
    if not rest and hint.startswith("commands are"):
        hint = f"a label is declared with a colon: `{word}:`"
    return Fault("E110", f"there is no command `{word}`", 0, len(word), hint)
