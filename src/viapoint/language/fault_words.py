"""Diagnosis of a motion's parameters, word by word, so that every bad one is reported.

Used when the grammar has refused the statement. Good words come out as values, so that the checks of
the command table still see them; bad ones as faults, with the codes they were meant for.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final

from viapoint.language.checks import all_parameters
from viapoint.language.commands import FIRST_WORDS, LATER_WORDS, Form
from viapoint.language.faults import (
    bad_number,
    expression_fault,
    later,
    name_for_number,
    unbalanced,
)
from viapoint.language.grammar import Fault, Given, Unexpected, missing_blank, parse_value
from viapoint.language.lexical import NAME, SIGNED, is_cell_name, words
from viapoint.language.suggestions import did_you_mean

_WRITTEN: Final = re.compile(r"([A-Za-z]+)([0-9]*)=|([A-Za-z]+)(?=[-+.0-9(])")
_CODE: Final = re.compile(r"([A-Za-z]+)([0-9]*)")
_OFFSETS: Final = re.compile(r"[DT][XYZABC]=", re.IGNORECASE)
_EXPONENT: Final = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)([eE][0-9]+)=")


@dataclass(slots=True)
class Scan:
    """What a scan found: values, faults, and the keys that bad words were meant for."""

    given: list[Given] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    meant: set[str] = field(default_factory=set)


def scan_parameters(text: str) -> Scan:
    """Judge the words of `text`, what follows a motion's command."""
    scan = Scan()
    queue = list(words(text))
    while queue:
        start, end = queue.pop(0)
        if _ends_statement(scan, text[start:end], start, end, text):
            break
        rest = _judge(scan, text, start, end, queue)
        if rest is not None:
            queue.insert(0, (rest, end))
    return scan


def _ends_statement(scan: Scan, word: str, start: int, end: int, text: str) -> bool:
    """Faults after which the rest of the line is not a motion's any more."""
    upper = word.upper()
    if upper in LATER_WORDS:
        scan.faults.append(later(word, start, end))
    elif upper in FIRST_WORDS and len(word) > 1:
        message = f"unexpected `{word}`: a second statement on the line"
        scan.faults.append(Fault("E112", message, start, end, "one statement per line"))
    elif word[0] in ";#" or word.startswith("/"):
        message = f"unexpected `{word[0]}`"
        scan.faults.append(Fault("E112", message, start, len(text.rstrip()), "a comment begins with `//`"))
    else:
        return False
    return True


def _judge(scan: Scan, text: str, start: int, end: int, queue: list[tuple[int, int]]) -> int | None:
    """Judge one word; the offset at which a further word begins without a blank, if one does."""
    word = text[start:end]
    if _parted(scan, text, start, end, queue):
        return None
    found = _WRITTEN.match(word)
    if found is None:
        _unwritten(scan, text, start, end, queue)
        return None
    letters, digits, glued = found.groups()
    key = f"{glued.upper()}" if glued else _key(letters, digits)
    fault = _code_fault(found.group(), key, word, start, end)
    if fault is not None:
        scan.faults.append(fault)
        scan.meant.update((key, key.rstrip("="), f"{key}="))
        return None
    return _value(scan, text, key, start, start + found.end(), end, queue)


def _parted(scan: Scan, text: str, start: int, end: int, queue: list[tuple[int, int]]) -> bool:
    """Whether an `=` stands apart from the code before it: `X = 5`, `J1 =5`."""
    code = _CODE.fullmatch(text[start:end])
    if code is None or not queue or text[queue[0][0]] != "=":
        return False
    scan.meant.update((_key(*code.groups()), code.group(1).upper()))
    last = queue.pop(0)[1]
    if text[:last].endswith("=") and queue and SIGNED.fullmatch(text[queue[0][0] : queue[0][1]]):
        last = queue.pop(0)[1]
    whole = "".join(text[start:last].split())
    message = f"`{text[start:end]}` and its value stand apart"
    scan.faults.append(Fault("E126", message, start, last, f"write `{whole}`"))
    return True


def _key(letters: str, digits: str) -> str:
    return f"{letters.upper()}{int(digits) if digits else ''}="


def _code_fault(written: str, key: str, word: str, start: int, end: int) -> Fault | None:
    """What is wrong with the code of a parameter, apart from its value."""
    known = all_parameters()
    base = key.rstrip("=").rstrip("0123456789")
    numbered = known.get(base)
    if numbered is not None and numbered.form is Form.NUMBERED:
        if re.fullmatch(rf"{base}[0-9]+=", key):
            return None
        example = f"`{base}1=…`"
        return Fault(
            "E126", f"`{word}`: an axis position is written {example}", start, end, f"write {example}"
        )
    if key in known:
        return None
    value = word[len(written) :]
    if key.endswith("=") and base == key[:-1] and base in known:
        return Fault("E126", f"`{word}`: `{base}` takes no `=`", start, end, f"write `{base}{value}`")
    if f"{key}=" in known:
        return Fault(
            "E126", f"`{word}`: a coordinate is written with `=`", start, end, f"write `{key}={value}`"
        )
    if _OFFSETS.fullmatch(written):
        return later(key, start, end, "offsets come later; write the coordinates")
    hint = did_you_mean(key, [p.shown for p in known.values()]) or "parameters of motions: " + " ".join(
        parameter.shown for parameter in known.values()
    )
    return Fault("E120", f"there is no parameter `{written}`", start, start + len(written), hint)


def _value(
    scan: Scan, text: str, key: str, start: int, at: int, end: int, queue: list[tuple[int, int]]
) -> int | None:
    value = text[at:end]
    number = SIGNED.match(value)
    if number is not None and number.end() == len(value):
        result = float(value)
        if abs(result) == float("inf"):
            scan.faults.append(Fault("E107", f"`{value}` is too large to represent", at, end))
            scan.meant.add(key)
        else:
            scan.given.append(Given(start, end, key, result))
        return None
    scan.meant.add(key)
    if value.startswith("("):
        return _enclosed(scan, key, text, start, at, end)
    if not value:
        _apart(scan, text, text[start:end], start, end, queue)
        return None
    if number is not None:
        return _tail(scan, text, key, start, at, number.end(), end)
    scan.faults.append(_no_number(value, at, end))
    return None


def _no_number(value: str, at: int, end: int) -> Fault:
    if value.upper() in {"NAN", "INF", "INFINITY"}:
        return Fault("E106", f"`{value}` is not a number", at, end)
    if value.startswith("$"):
        return later(value, at, end)
    if re.fullmatch(NAME, value):
        return name_for_number(value, at, end)
    return bad_number(value, at)


def _tail(scan: Scan, text: str, key: str, start: int, at: int, length: int, end: int) -> int | None:
    """Something follows the number without a blank: the next parameter, or the number is bad."""
    value = text[at:end]
    exponent = _EXPONENT.match(value)
    rest = at + (exponent.start(1) if exponent is not None else length)
    following = _WRITTEN.match(text[rest:end])
    if following is not None and _code_fault(following.group(), _key_of(following), "", 0, 0) is None:
        scan.given.append(Given(start, rest, key, float(text[at:rest])))
        fault = missing_blank(rest, end)
        fault.hint = f"write `{text[start:rest]} {text[rest:end]}`"
        scan.faults.append(fault)
        return rest
    if value.rstrip(",;") != value and SIGNED.fullmatch(value.rstrip(",;")):
        mark = len(value.rstrip(",;"))
        message = f"unexpected `{value[mark:]}`"
        scan.faults.append(Fault("E112", message, at + mark, end, "parameters are separated by blanks alone"))
    else:
        scan.faults.append(bad_number(value, at))
    return None


def _key_of(found: re.Match[str]) -> str:
    letters, digits, glued = found.groups()
    return glued.upper() if glued else _key(letters, digits)


def _enclosed(scan: Scan, key: str, text: str, start: int, at: int, end: int) -> int | None:
    value = text[at:end]
    wrong = unbalanced(value)
    if wrong is not None:
        scan.faults.append(_shifted(wrong, at))
        return None
    close = _closing(value)
    named = re.fullmatch(rf"\(\s*({NAME})\s*\)", value[:close])
    if named is not None and key in ("P", "Q") and is_cell_name(named[1]):
        scan.given.append(Given(start, at + close, key, 0.0, named[1]))
        return None if close == len(value) else at + close
    try:
        part = parse_value(value[:close])
    except Fault as fault:
        scan.faults.append(_shifted(fault, at))
    except Unexpected as error:
        scan.faults.append(_shifted(expression_fault(value[:close], error.at, "a number"), at))
    else:
        scan.given.append(Given(start, at + close, key, part.value or 0.0))
    if close == len(value):
        return None
    if value[close].isalpha():
        scan.faults.append(missing_blank(at + close, end))
        return at + close
    scan.faults.append(Fault("E112", f"unexpected `{value[close:]}`", at + close, end))
    return None


def _closing(value: str) -> int:
    depth = 0
    for at, character in enumerate(value):
        depth += (character == "(") - (character == ")")
        if depth == 0:
            return at + 1
    return len(value)


def _shifted(fault: Fault, by: int) -> Fault:
    return Fault(fault.code, fault.message, fault.start + by, fault.end + by, fault.hint)


def _apart(scan: Scan, text: str, code: str, start: int, end: int, queue: list[tuple[int, int]]) -> None:
    """A code without its value: it may stand as the next word."""
    if queue and SIGNED.fullmatch(text[queue[0][0] : queue[0][1]].removeprefix("=")):
        first, last = queue.pop(0)
        value = text[first:last]
        message = f"`{code}` and its value stand apart"
        scan.faults.append(Fault("E126", message, start, last, f"write `{code}{value}`"))
    else:
        example = f"{code}1" if code.endswith("=") or code.upper() in all_parameters() else f"{code}=1"
        scan.faults.append(Fault("E126", f"`{code}` needs its value", start, end, f"write `{example}`"))


def _unwritten(scan: Scan, text: str, start: int, end: int, queue: list[tuple[int, int]]) -> None:
    """A word that does not look like a parameter at all."""
    word = text[start:end]
    known = all_parameters()
    upper = word.upper()
    if upper in known or f"{upper}=" in known:
        scan.meant.update((upper, f"{upper}="))
        _apart(scan, text, word, start, end, queue)
    elif word.startswith("$"):
        scan.faults.append(later(word, start, end))
    elif SIGNED.fullmatch(word):
        message = f"the number `{word}` belongs to no parameter"
        scan.faults.append(
            Fault("E112", message, start, end, "a parameter is a code and its number, as in `F100`")
        )
    elif re.fullmatch(NAME, word) and is_cell_name(word):
        scan.given.append(Given(start, end, "P", 0.0, word))
    else:
        scan.meant.add("P")
        scan.faults.append(Fault("E112", f"unexpected `{word}`", start, end))
