"""The text of the grammar: `via.lark` completed from the command table. No parsing here."""

from __future__ import annotations

import re
from importlib.resources import files
from typing import Final

from viapoint.language.commands import ACTIONS, MOTIONS, SIGNALS, Form, Operand
from viapoint.language.lexical import NAME, NUMBER


def rule_of(word: str) -> str:
    """Start rule of the statements whose first word is `word`."""
    return "motion" if any(word == command.word for command in MOTIONS) else f"on_{word.lower()}"


def _alternation(codes: set[str]) -> str:
    return "|".join(sorted(codes, key=lambda code: (-len(code), code)))


def _codes(form: Form) -> str:
    return _alternation({p.code for m in MOTIONS for p in m.parameters if p.form is form})


_OPERAND_RULES: Final = {
    Operand.NOTHING: ("",),
    Operand.VALUE: ("value",),
    Operand.LABEL_TIMES: ("NAME value?",),
    Operand.CONDITION: ("AHEAD? disjunction",),
    Operand.TANGENT: ("value parameter?",),
    Operand.WAIT: ("disjunction (_TIMEOUT value (_GOTO NAME)?)?",),
    Operand.OUTPUT: ("DO value", "NAME"),
    Operand.LEVEL: ("DO value", "NAME", "AO value _EQUALS value", "NAME _EQUALS value"),
    Operand.PULSE: ("DO value value", "NAME value"),
    Operand.LET: ("WRITTEN _EQUALS disjunction",),
    Operand.INC: ("WRITTEN disjunction?",),
    Operand.PLACE: ("ORIGIN value placed", "value PERCENT placed"),
    Operand.INTERRUPT: ("disjunction _SUB NAME", "_ERROR _SUB NAME"),
    Operand.NEXT: ("_NEXT",),
    Operand.LABEL: ("NAME",),
}

_KEYWORDS: Final = {
    "AND": "AND(?![A-Za-z0-9_])",
    "OR": "OR(?![A-Za-z0-9_])",
    "NOT": "NOT(?![A-Za-z0-9_])",
    "MOD": "MOD(?![A-Za-z0-9_])",
    "AHEAD": "AHEAD(?![A-Za-z0-9_])",
    "FOUND": "FOUND(?![A-Za-z0-9_])",
    "TRUTH": "(?:TRUE|FALSE)(?![A-Za-z0-9_])",
    "ERRNO": "ERRNO(?![A-Za-z0-9_])",
    "_ERROR": "ERROR(?![A-Za-z0-9_])",
    "_NEXT": "NEXT(?![A-Za-z0-9_])",
    "_CAPTURE": "CAPTURE(?![A-Za-z0-9_])",
    "DO": "DO(?![A-Za-z_])",
    "AO": "AO(?![A-Za-z_])",
    "ORIGIN": "[DS](?=[-+.0-9(])",
    "_TIMEOUT": "TIMEOUT(?![A-Za-z_])",
    "_GOTO": "GOTO(?![A-Za-z0-9_])",
    "_SUB": "SUB(?![A-Za-z0-9_])",
    "_SET": "SET(?![A-Za-z0-9_])",
    "_RESET": "RESET(?![A-Za-z0-9_])",
    "_PULSE": "PULSE(?![A-Za-z0-9_])",
    "_LET": "LET(?![A-Za-z0-9_])",
    "_INC": "INC(?![A-Za-z0-9_])",
    "_M": r"M(?=[ \t]*[0-9(])",
}
"""Words inside a statement; they go before names."""


SEARCH: Final = "on_until"
"""Start rule of what stands behind UNTIL."""


def starts() -> tuple[str, ...]:
    """Start rules of the auxiliary commands, one per word."""
    return (SEARCH, *(rule_of(command.word) for command in ACTIONS))


def _rules() -> str:
    lines = [f"{SEARCH}: disjunction (_CAPTURE GLUED value)? -> take_until"]
    for command in ACTIONS:
        bodies = (f"{body} -> take_{command.word.lower()}" for body in _OPERAND_RULES[command.operand])
        lines.append(f"{rule_of(command.word)}: " + "\n  | ".join(bodies))
    lines += [f"{word}.2: /{pattern}/i" for word, pattern in _KEYWORDS.items()]
    return "\n".join(lines)


def grammar_text() -> str:
    """The complete grammar, as lark reads it."""
    filled = {
        "RULES": _rules(),
        "GLUED": _codes(Form.GLUED),
        "ASSIGNED": _codes(Form.ASSIGNED),
        "NUMBERED": _codes(Form.NUMBERED),
        "SIGNALS": _alternation(set(SIGNALS)),
        "NUMBER": NUMBER,
        "NAME": NAME,
    }
    text = files("viapoint.language").joinpath("via.lark").read_text(encoding="utf-8")
    return re.sub(r"\$([A-Z]+)", lambda found: filled[found.group(1)], text)
