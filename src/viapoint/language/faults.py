"""Diagnosis of statements that the grammar refuses: what is wrong, where, and what to write instead.

Nothing here accepts anything: a text comes in with the offset at which the grammar gave up, and exactly
one `Fault` goes out. Motions, whose words can be judged one by one, are diagnosed in `fault_words.py`.
"""

from __future__ import annotations

import re
from typing import Final

from viapoint.language.commands import ACTION_BY_WORD, FIRST_WORDS, LATER_WORDS, SIGNALS
from viapoint.language.grammar import Fault, Unexpected
from viapoint.language.lexical import MAX_LINE, NAME, NUMBER, is_keyword
from viapoint.language.suggestions import did_you_mean

LATER: Final = "is not part of this version of the language"

_WORD: Final = re.compile(r"\$?[A-Za-z_][A-Za-z0-9_.]*|[0-9.][A-Za-z0-9_.]*|==|!=|=<|=>|&&|\|\||.", re.DOTALL)
_FOREIGN_OPERATORS: Final = {
    "==": "=",
    "!=": "<>",
    "!": "NOT",
    "&&": "AND",
    "&": "AND",
    "||": "OR",
    "|": "OR",
    "=>": ">=",
    "=<": "<=",
    "~": "NOT",
    "%": "MOD",
}
_SIGNAL: Final = re.compile(rf"({'|'.join(SIGNALS)})[0-9]+", re.IGNORECASE)
_LATER_SIGNAL: Final = re.compile(r"HERE(\..*)?|TIME", re.IGNORECASE)
_AT_PLACE: Final = re.compile(
    rf"[ \t]*(?:[DS](?:[-+]?{NUMBER}|\(.*\))|(?:[-+]?{NUMBER}|\(.*\))[ \t]*%)", re.IGNORECASE
)
_OPERATORS: Final = ("AND", "OR", "NOT", "MOD")


_VARIABLES_ARE: Final = "a variable is compared, as in `IF $count > 3`, and written by LET and INC"


def later(word: str, start: int, end: int, hint: str | None = None) -> Fault:
    """The fault of a construct that the language reserves, and of a variable where none can stand."""
    if word.startswith("$"):
        message = f"`{word}` changes while the program runs; what stands here has to be known before"
        return Fault("E132", message, start, end, _VARIABLES_ARE)
    return Fault("E111", f"`{word}` {LATER}", start, end, hint)


def unbalanced(text: str) -> Fault | None:
    """The first parenthesis of `text` without its partner, if one is."""
    opened: list[int] = []
    for at, character in enumerate(text):
        if character == "(":
            opened.append(at)
        elif character == ")":
            if not opened:
                return Fault("E117", "this `)` closes nothing", at, at + 1, "remove it, or open it before")
            opened.pop()
    if opened:
        return Fault("E117", "this `(` is never closed", opened[-1], opened[-1] + 1, "add the `)`")
    return None


def bad_number(word: str, start: int) -> Fault:
    """The fault of a word that begins like a number and is none."""
    end = start + len(word)
    hint = "numbers are decimal, as in 12, -3.5 or 1E3"
    unit = re.fullmatch(rf"[-+]?{NUMBER}(mm|cm|m|deg|°|s|ms|mm/s|deg/s|%)", word)
    if unit is not None:
        hint = "units are fixed (mm, deg, s, mm/s, deg/s) and not written"
    elif re.fullmatch(r"[-+]?[0-9]+,[0-9]+", word):
        hint = f"the decimal sign is a point: {word.replace(',', '.')}"
    elif re.fullmatch(rf"{NUMBER}([-+*/]{NUMBER})+", word):
        hint = f"arithmetic stands in parentheses: `({word})`"
    return Fault("E106", f"`{word}` is not a number", start, end, hint)


def nothing_there(text: str, what: str, hint: str | None) -> Fault:
    """The fault of a statement that ends too early; it covers its last word.

    Where nothing follows the command word, the place begins before `text`: at the start of the statement.
    """
    end = len(text.rstrip())
    start = max(text.rfind(" ", 0, end), text.rfind("\t", 0, end)) + 1 if end else -MAX_LINE
    message = f"the statement ends where {what} is expected"
    return Fault("E113", message, start, end, hint)


def expression_fault(text: str, at: int, what: str = "a condition", hint: str | None = None) -> Fault:
    """Why the expression `text` is refused at offset `at`; `what` is expected if it ends there."""
    wrong = unbalanced(text)
    if not text[at:].strip():
        return wrong or nothing_there(text, what, hint)
    found = _WORD.search(text, at + len(text[at:]) - len(text[at:].lstrip()))
    assert found is not None
    word, start, end = found.group(), found.start(), found.end()
    if word in _FOREIGN_OPERATORS:
        right = _FOREIGN_OPERATORS[word]
        return Fault("E130", f"`{word}` is not an operator", start, end, f"write `{right}`")
    if text[start - 1 : end] in _FOREIGN_OPERATORS:  # the grammar took the first half of == or =>
        whole = text[start - 1 : end]
        hint = f"write `{_FOREIGN_OPERATORS[whole]}`"
        return Fault("E130", f"`{whole}` is not an operator", start - 1, end, hint)
    if wrong is not None and word in "()":
        return wrong
    called = re.search(rf"({NAME})[ \t]*$", text[:start]) if word == "(" else None
    if called is not None and called[1].upper() in LATER_WORDS:
        return later(called[1], called.start(1), called.end(1))
    before = re.search(r"([A-Za-z]+)[ \t]*$", text[:start])
    if before is not None and before[1].upper() in ("AHEAD", "TIMEOUT"):  # read as a name at first
        hint = "AHEAD stands before the whole condition" if before[1].upper() == "AHEAD" else None
        return Fault("E112", f"unexpected `{before[1]}`", before.start(1), before.end(1), hint)
    return _word_fault(text, word, start, end)


def _word_fault(text: str, word: str, start: int, end: int) -> Fault:
    upper = word.upper()
    complete = _is_complete(text[:start])
    if _LATER_SIGNAL.fullmatch(word) or upper in LATER_WORDS:
        return later(word, start, end)
    if upper in SIGNALS:
        return Fault(
            "E113", f"`{word}` needs the number of the {SIGNALS[upper]}", start, end, f"write `{upper}3`"
        )
    if complete and upper == "THEN":
        return Fault("E112", f"`{word}` is not needed", start, end, "the condition ends with the line")
    if complete and _SIGNAL.fullmatch(word):
        hint = f"join conditions with AND or OR: `AND {word}`"
        return Fault("E112", f"unexpected `{word}` after a complete condition", start, end, hint)
    if word[0].isdigit() or (word[0] == "." and len(word) > 1):
        if re.fullmatch(NUMBER, word):
            return Fault("E112", f"unexpected number `{word}`", start, end)
        return bad_number(word, start)
    if word[0].isalpha():
        return _name_fault(word, start, end, complete)
    message = f"unexpected `{word}`"
    if word == "=":
        return Fault(
            "E112", message, start, end, "only numbers are compared; a signal is true or not by itself"
        )
    return Fault("E112", message, start, end)


def _name_fault(word: str, start: int, end: int, complete: bool) -> Fault:
    if word.upper() in _OPERATORS or word.upper() in FIRST_WORDS:
        return Fault("E112", f"unexpected `{word}`", start, end)
    if complete or not is_keyword(word):
        hint = did_you_mean(word, ("AND", "OR", "MOD"))
        return Fault("E112", f"unexpected `{word}`", start, end, hint)
    return name_for_number(word, start, end, did_you_mean(word, (*SIGNALS, "NOT")))


def name_for_number(word: str, start: int, end: int, hint: str | None = None) -> Fault:
    """The fault of a name where a value has to stand."""
    if word.upper() in LATER_WORDS or word.startswith("$"):
        return later(word, start, end)
    if word.upper() in FIRST_WORDS:
        return Fault("E112", f"unexpected `{word}`", start, end, "a number is expected")
    message = f"`{word}` is a name; naming values {LATER}"
    return Fault("E118", message, start, end, hint or "write the number itself")


def _is_complete(before: str) -> bool:
    """Whether an expression could end after `before`: it ends with a number or a parenthesis."""
    stripped = before.rstrip()
    if not stripped or re.search(rf"[$]{NAME}$", stripped):
        return bool(stripped)
    return stripped[-1] == ")" or stripped[-1].isdigit() or stripped[-1] == "."


def action_fault(word: str, text: str, error: Unexpected) -> Fault:
    """Why `text`, what follows the first word of an auxiliary statement, is refused."""
    match word:
        case "IF" | "ELSEIF":
            if error.at >= len(text.rstrip()) and not text.strip():
                return nothing_there(text, "a condition", f"for instance `{ACTION_BY_WORD[word].example}`")
            return expression_fault(text, error.at)
        case "GOTO" | "SUB":
            return _jump_fault(word, text, error.at)
        case "ON":
            return _interrupt_fault(text, error.at)
        case "OFF":
            return _label_fault(word, text, error.at)
        case "SET" | "RESET" | "PULSE":
            return _output_fault(word, text, error.at)
        case "WAIT":
            return _wait_fault(text, error.at)
        case "AT":
            return _place_fault(text, error.at)
        case "LET" | "INC":
            return _variable_fault(word, text, error.at)
        case "RESUME":
            return _resume_fault(text)
        case "STOP" if text.lstrip().startswith('"'):
            return later('STOP "…"', -MAX_LINE, 0, "`STOP` alone leaves an error as it is")
        case "ELSE" | "ENDIF" | "END" | "SYNC" | "RETRY" | "STOP":
            return _bare_fault(word, text)
        case _:
            return _index_fault(word, text, error.at)


def _at_word(text: str, at: int) -> tuple[str, int, int]:
    start = at + len(text[at:]) - len(text[at:].lstrip())
    end = start
    while end < len(text) and not text[end].isspace():
        end += 1
    return text[start:end], start, end


def _bare_fault(word: str, text: str) -> Fault:
    first, start, _ = _at_word(text, 0)
    end = len(text.rstrip())
    joined = word + first.upper()
    if joined in ACTION_BY_WORD:
        return Fault("E112", f"unexpected `{first}` after `{word}`", start, end, f"write `{joined}`")
    hint = "one statement per line" if first.upper() in FIRST_WORDS else None
    if word == "ELSE" and _SIGNAL.match(first):
        hint = "a branch with a condition is `ELSEIF`"
    return Fault("E112", f"unexpected `{text[start:end]}` after `{word}`", start, end, hint)


def _resume_fault(text: str) -> Fault:
    found, start, end = _at_word(text, 0)
    if not found:
        return nothing_there(text, "`NEXT`", "`RESUME NEXT` goes on behind the error, `RETRY` tries again")
    if found.upper() == "NEXT":
        _, start, _ = _at_word(text, end)
        end = len(text.rstrip())
        return Fault("E112", f"unexpected `{text[start:end]}`", start, end, "one statement per line")
    return Fault("E112", f"unexpected `{found}` after `RESUME`", start, end, "write `RESUME NEXT`")


def _interrupt_fault(text: str, at: int) -> Fault:
    example = f"for instance `{ACTION_BY_WORD['ON'].example}`"
    if not text.strip():
        return nothing_there(text, "a condition", example)
    sub = re.search(r"\bSUB\b", text, re.IGNORECASE)
    if sub is None:
        if at >= len(text.rstrip()):
            return nothing_there(text, "`SUB` and a label", example)
        if (other := re.search(r"\b(GOTO|THEN|CALL)\b", text, re.IGNORECASE)) is not None:
            hint = f"an interrupt runs a subroutine, {example}"
            return Fault("E112", f"unexpected `{other[0]}`", other.start(), other.end(), hint)
        return expression_fault(text, at, "a condition", example)
    if not text[: sub.start()].strip():
        message = f"`{sub[0]}` stands where a condition is expected"
        return Fault("E113", message, sub.start(), sub.end(), example)
    if at < sub.end():
        return expression_fault(text[: sub.start()], min(at, sub.start()), "a condition", example)
    rest, by = text[sub.end() :], sub.end()
    if not rest.strip():
        return nothing_there(text, "a label", example)
    inner = _label_fault("SUB", rest, at - by)
    return Fault(inner.code, inner.message, inner.start + by, inner.end + by, inner.hint)


def _label_fault(word: str, text: str, at: int) -> Fault:
    """Of a word that takes a label and nothing else."""
    found, start, end = _at_word(text, at)
    if at > 0 and text[:at].strip() and found:
        what = "a repeat count" if found[0].isdigit() else f"`{found}`"
        hint = "the subroutine runs once each time" if found[0].isdigit() else "one statement per line"
        return Fault("E112", f"unexpected {what} after the label", start, end, hint)
    return _jump_fault(word, text, at)


def _jump_fault(word: str, text: str, at: int) -> Fault:
    example = f"for instance `{ACTION_BY_WORD[word].example}`"
    label, start, end = _at_word(text, 0)
    if not label:
        return nothing_there(text, "a label", example)
    if not label[0].isalpha():
        hint = "a label begins with a letter" if label.isdigit() else example
        return Fault("E113", f"a label is expected, not `{label}`", start, end, hint)
    name = re.match(NAME, label)
    if label.endswith(":") or text[end:].strip() == ":":
        colon = text.index(":", start)
        hint = f"write `{word} {label.rstrip(':')}`"
        return Fault("E112", "unexpected `:`", colon, colon + 1, hint)
    if name is None or name.end() < len(label):
        hint = "a label is a letter, then letters, digits and _"
        return Fault("E112", f"`{label}` is not a label", start, end, hint)
    found, start, end = _at_word(text, at)
    if not found:
        return unbalanced(text) or nothing_there(text, "a repeat count", example)
    return _count_fault(text, at, "a repeat count", found, start, end)


def _count_fault(text: str, at: int, what: str, found: str, start: int, end: int) -> Fault:
    if found and found[0] in "0123456789.+-":
        return (
            bad_number(found, start)
            if not re.fullmatch(rf"[-+]?{NUMBER}", found)
            else Fault("E112", f"unexpected `{found}`", start, end)
        )
    if "(" in text[:start] + found:
        return expression_fault(text, at, what)
    if _SIGNAL.fullmatch(found) and not _is_complete(text[:start]):
        message = f"`{found}` is read while the program runs"
        return Fault("E112", message, start, end, "write the number itself")
    if re.fullmatch(r"\$?[A-Za-z_][A-Za-z0-9_.]*", found) and not _is_complete(text[:start]):
        return name_for_number(found, start, end)
    hint = "one statement per line" if found.upper() in FIRST_WORDS else None
    return Fault("E112", f"unexpected `{found}`", start, end, hint)


def _output_fault(word: str, text: str, at: int) -> Fault:
    example = f"for instance `{ACTION_BY_WORD[word].example}`"
    found, start, end = _at_word(text, 0)
    if not found:
        return nothing_there(text, "`DO` and a number, or a name,", example)
    letters = re.match(r"[A-Za-z_$]*", found)
    kind = letters.group().upper() if letters is not None else ""
    if kind in ("DI", "AI"):
        return Fault("E112", "an input cannot be set", start, end, "outputs are `DO` and `AO`")
    if kind == "AO" and word != "SET":
        hint = "an analog output is given a value: `SET AO1 = 2.5`"
        return Fault("E112", f"`{word}` is for digital outputs", start, end, hint)
    if kind in ("DO", "AO"):
        return _number_fault(f"{word} {kind}", text, max(at, start + 2), example)
    if kind == "":
        hint = f"write `{word} DO {found}`" if found.isdigit() else example
        return Fault("E113", f"`DO` is expected, not `{found}`", start, end, hint)
    if kind.startswith("$") or kind in LATER_WORDS:
        return later(found, start, end)
    if re.fullmatch(NAME, found) and at > start and not is_keyword(found):
        return _number_fault(word, text, at, example)
    near = did_you_mean(kind, ("DO", "AO"))
    return Fault("E112", f"`{found}` is no output", start, end, near or example)


def _wait_fault(text: str, at: int) -> Fault:
    example = "for instance `WAIT 0.5` or `WAIT DI 3`"
    found, _, _ = _at_word(text, 0)
    if not found:
        return nothing_there(text, "a time or a condition", example)
    if re.match(r"[-+.0-9]", found):
        return _number_fault("WAIT", text, at, example)
    limit = re.search(r"\bTIMEOUT\b", text, re.IGNORECASE)
    if limit is not None and at >= limit.end():
        return _number_fault("TIMEOUT", text, at, "for instance `WAIT DI3 TIMEOUT 2 GOTO LATE`")
    return expression_fault(text, at, "a condition", example)


def _variable_fault(word: str, text: str, at: int) -> Fault:
    example = f"for instance `{ACTION_BY_WORD[word].example}`"
    found, start, end = _at_word(text, 0)
    if not found:
        return nothing_there(text, "a variable", example)
    variable = re.match(rf"[ \t]*[$]{NAME}", text)
    if variable is None:
        if re.match(NAME, found):
            message = f"`{found}` is no variable: the application's begin with `$`, others come later"
            return Fault("E111", message, start, end, example)
        return Fault("E113", f"a variable is expected, not `{found}`", start, end, example)
    if word == "LET" and not text[variable.end() :].lstrip().startswith("="):
        found, start, end = _at_word(text, variable.end())
        message = f"`=` is expected behind the variable{f', not `{found}`' if found else ''}"
        at = variable.end()
        return Fault("E113", message, start if found else at - 1, end if found else at, example)
    return expression_fault(text, at, "a value", example)


def _place_fault(text: str, at: int) -> Fault:
    example = "for instance `AT D20 SET DO1`, `AT D-20 …`, `AT S-0.1 …`, `AT 50% …`"
    found, start, end = _at_word(text, 0)
    if not found:
        return nothing_there(text, "a place and an action", example)
    placed = _AT_PLACE.match(text)
    if placed is None:
        return Fault("E113", f"`{found}` is no place on a motion", start, end, example)
    action, start, end = _at_word(text, placed.end())
    if not action:
        return nothing_there(text, "an action", example)
    if action.upper() in ("SET", "RESET", "PULSE") and at > start:
        inner = _output_fault(action.upper(), text[end:], max(at - end, 0))
        return Fault(
            inner.code, inner.message, max(inner.start, -MAX_LINE) + end, inner.end + end, inner.hint
        )
    if action.upper() in ("LET", "INC") and at > start:
        inner = _variable_fault(action.upper(), text[end:], max(at - end, 0))
        return Fault(inner.code, inner.message, inner.start + end, inner.end + end, inner.hint)
    if re.match("M[0-9]*$", action, re.IGNORECASE) and at >= end:
        return _number_fault("M", text, at, example)
    hint = "on the path stand SET, RESET, PULSE, LET, INC and asynchronous M"
    return Fault("E112", f"unexpected `{action}` behind the place", start, end, hint)


def _index_fault(word: str, text: str, at: int) -> Fault:
    example = f"for instance `{ACTION_BY_WORD[word].example}`"
    if not text.strip():
        return nothing_there(text, "a number", example)
    return _number_fault(word, text, at, example)


def _number_fault(command: str, text: str, at: int, example: str) -> Fault:
    found, start, end = _at_word(text, at)
    if not found:
        return unbalanced(text) or nothing_there(text, "a number", example)
    previous = text[:start].rstrip()
    if text[start - 1 : start].strip() and "(" not in previous:  # the grammar gave up inside a word
        begin = max(text.rfind(" ", 0, start), text.rfind("\t", 0, start)) + 1
        whole = text[begin:end]
        digits = re.match(r"[A-Za-z]*", whole)
        offset = digits.end() if digits is not None else 0
        return bad_number(whole[offset:], begin + offset)
    if command == "TANG" and found.upper().startswith("H"):
        return Fault("E126", f"`{found}` is not a parameter with its value", start, end, "write `TANG 1 H45`")
    if command == "TANG" and re.fullmatch(rf"[-+]?{NUMBER}", found):
        return Fault("E112", f"unexpected `{found}`", start, end, f"the offset is written `H{found}`")
    return _count_fault(text, at, "a number", found, start, end)
