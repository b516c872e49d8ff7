"""TOML files checked against a schema: all errors at once, each with its key path and line.

Shared by cell, robot and scenario files; it knows the content of none of them. A schema is a pydantic
model made of `viapoint.runtime.tables.Table`; pydantic itself is imported only where one is checked.
"""

from __future__ import annotations

import copy
import difflib
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum, unique
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, get_args

from viapoint.language.diagnostics import Diagnostic, sort_key

if TYPE_CHECKING:
    from pydantic import BaseModel
    from pydantic_core import ErrorDetails

Key = tuple[str | int, ...]


@unique
class Fault(IntEnum):
    """What can be wrong with a file."""

    UNREADABLE = 0
    SYNTAX = 1
    UNKNOWN_KEY = 2
    MISSING_KEY = 3
    TYPE = 4
    DOMAIN = 5
    LENGTH = 6
    DUPLICATE = 7
    REFERENCE = 8
    CONTRADICTION = 9


Codes = Mapping[Fault, str]
CELL_CODES: Codes = dict(
    zip(Fault, ("E270", "E271", "E272", "E273", "E274", "E275", "E276", "E277", "E278", "E279"), strict=True)
)
SCENARIO_CODES: Codes = dict(
    zip(Fault, ("E290", "E291", "E292", "E293", "E294", "E295", "E296", "E297", "E298", "E299"), strict=True)
)


class DocumentError(Exception):
    """A file that cannot be used; `diagnostics` holds every reason."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(sorted(diagnostics, key=sort_key))
        super().__init__("\n".join(f"{d.file}:{d.line or 1}: {d.code} {d.message}" for d in self.diagnostics))


@dataclass(frozen=True, slots=True)
class Document:
    """A parsed TOML file: name and text as given, its data, and the line of every key."""

    name: str
    text: str
    codes: Codes
    data: dict[str, Any]
    lines: Mapping[Key, int]
    parts: Mapping[str | int, Document] = field(
        default_factory=dict
    )  # top-level keys with a file of their own
    origins: Mapping[Key, Key] = field(default_factory=dict)  # keys that stand elsewhere in the file

    def line(self, key: Key) -> int:
        """Line of the key, or of the nearest table around it."""
        while key and key not in self.lines:
            key = key[:-1]
        return self.lines.get(key, 1)

    def with_part(self, key: str, part: Document) -> Document:
        """This document with another one's content under a top-level key."""
        return replace(self, data={**self.data, key: part.data}, parts={**self.parts, key: part})

    def fault(self, fault: Fault, key: Key, message: str, hint: str | None = None) -> Diagnostic:
        """A diagnostic at a key of this file, or of the file that this part of it stands in."""
        if key and key[0] in self.parts:
            return self.parts[key[0]].fault(fault, key[1:], message, hint)
        return Diagnostic(
            code=self.codes[fault],
            message=message,
            file=self.name,
            line=self.line(key),
            key=dotted(self.origin(key)),
            hint=hint,
        )

    def origin(self, key: Key) -> Key:
        """Where a key stands in the file: as it is, but in a document made of parts of one."""
        for k in range(len(key), 0, -1):
            if key[:k] in self.origins:
                return (*self.origins[key[:k]], *key[k:])
        return key


def dotted(key: Key) -> str:
    """A key path as the user would write it: `tools[0].xyz`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in key)
    return text.removeprefix(".")


def read_document(path: Path, codes: Codes) -> Document:
    """Read and parse a file. Raises DocumentError: unreadable, not UTF-8, not TOML."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
    except UnicodeDecodeError as error:
        reason = f"it is not UTF-8 (byte {error.start})"
    else:
        return parse_document(str(path), text, codes)
    message = f"cannot read {path}: {reason}"
    raise DocumentError([Diagnostic(code=codes[Fault.UNREADABLE], message=message, file=str(path))])


def parse_document(name: str, text: str, codes: Codes) -> Document:
    """Parse TOML text. Raises DocumentError with the line of the syntax error."""
    try:
        data = tomllib.loads(text)
    except RecursionError:
        message, line = "values are nested too deeply", 1
    except ValueError as error:  # TOMLDecodeError, and integers too long for Python
        found = re.search(r"\(at line (\d+)", str(error))
        line = int(found[1]) if found else text.count("\n") + 1
        message = re.sub(r" \(at .*\)$", "", str(error))
        if not isinstance(error, tomllib.TOMLDecodeError):
            message = "a whole number is too long"
    else:
        return Document(name, text, codes, data, key_lines(text))
    code = codes[Fault.SYNTAX]
    raise DocumentError([Diagnostic(code=code, message=f"not valid TOML: {message}", file=name, line=line)])


# --- lines of keys -----------------------------------------------------------------------------------

_PART = r"""(?:"[^"\n]*"|'[^'\n]*'|[A-Za-z0-9_-]+)"""
_DOTTED = rf"{_PART}(?:[ \t]*\.[ \t]*{_PART})*"
_HEADER = re.compile(rf"[ \t]*(\[\[?)[ \t]*({_DOTTED})[ \t]*\]")
_ASSIGNMENT = re.compile(rf"[ \t]*({_DOTTED})[ \t]*=")
# What matters inside a value: strings and comments, which hide brackets, and the brackets.
_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}|'
    + r"'''.*?'{3,5}"
    + r'|"(?:\\.|[^"\\\n])*"'
    + r"|'[^'\n]*'|#[^\n]*|[\[\]{}\n]",
    re.S,
)


def key_lines(text: str) -> dict[Key, int]:
    """Line (from 1) of each table header and of each key at the start of a line, of valid TOML."""
    lines: dict[Key, int] = {}
    counts: dict[Key, int] = {}
    table: Key = ()
    position, line = 0, 1
    while position < len(text):
        if header := _HEADER.match(text, position):
            table = _resolve(_parts(header[2]), counts, new=len(header[1]) == 2)
            lines.setdefault(table, line)
        elif assignment := _ASSIGNMENT.match(text, position):
            path = table
            for part in _parts(assignment[1]):
                path = (*path, part)
                lines.setdefault(path, line)
        end = _statement_end(text, position)
        line += text.count("\n", position, end)
        position = end
    return lines


def _parts(text: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(_PART, text)]


def _resolve(parts: list[str], counts: dict[Key, int], *, new: bool) -> Key:
    """Key path of a table header, with the index of every array of tables on the way."""
    path: Key = ()
    for depth, part in enumerate(parts):
        path = (*path, part)
        if new and depth == len(parts) - 1:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path


def _statement_end(text: str, position: int) -> int:
    """Offset after the line end that closes the statement beginning at `position`."""
    depth = 0
    header = _HEADER.match(text, position)
    for token in _TOKEN.finditer(text, header.end() if header else position):
        match token[0]:
            case "[" | "{":
                depth += 1
            case "]" | "}":
                depth -= 1
            case "\n" if depth <= 0:
                return token.end()
            case _:
                pass
    return len(text)


# --- checking against a schema -----------------------------------------------------------------------


_Model = TypeVar("_Model", bound="BaseModel")


@dataclass(frozen=True, slots=True)
class Checked(Generic[_Model]):
    """A document against a schema: its faults, and a model of what is left without the faulty parts.

    `dropped` are the keys left out, so that further checks keep silent about what hangs on them.
    No model: nothing usable is left.
    """

    model: _Model | None
    faults: list[Diagnostic]
    dropped: frozenset[Key]


def check(document: Document, schema: type[_Model]) -> Checked[_Model]:
    """Validate; with faults, once more without the faulty parts, so that checks across tables still run."""
    from pydantic import ValidationError

    faults: list[Diagnostic] = []
    dropped: set[Key] = set()
    data = document.data
    while True:
        try:
            return Checked(schema.model_validate(data), faults, frozenset(dropped))
        except ValidationError as error:
            found = error.errors(include_url=False)
        if not dropped:
            faults = [_diagnostic(document, schema, details) for details in found]
            data = copy.deepcopy(data)
        drops = {_drop(data, details["loc"]) for details in found}
        if drops <= dropped:
            return Checked(None, faults, frozenset(dropped))
        dropped |= drops


def _drop(data: dict[str, Any], key: Key) -> Key:
    """Take the faulty key out; where it is missing, or an item of a list, the nearest key around it.

    Items of lists stay: without one the places of those behind it would no longer be right.
    """
    here: Any = data
    tables: list[Any] = []
    for part in key:
        if not (part in here if isinstance(here, dict) else isinstance(here, list)):
            break
        tables.append(here)
        here = here[part]
    while tables and isinstance(tables[-1], list):
        tables.pop()
    path = key[: len(tables)]
    if path:
        del tables[-1][path[-1]]
    return path


# pydantic's error type, by prefix → fault and what the value should have been; {…} is its context.
_FAULTS: tuple[tuple[str, Fault, str], ...] = (
    ("finite_number", Fault.DOMAIN, "a finite number"),
    ("greater_than_equal", Fault.DOMAIN, "at least {ge:g}"),
    ("greater_than", Fault.DOMAIN, "greater than {gt:g}"),
    ("less_than_equal", Fault.DOMAIN, "at most {le:g}"),
    ("less_than", Fault.DOMAIN, "less than {lt:g}"),
    ("literal_error", Fault.DOMAIN, "{expected}"),
    ("too_short", Fault.LENGTH, "{min_length} values"),
    ("too_long", Fault.LENGTH, "{max_length} values"),
    ("float", Fault.TYPE, "a number"),
    ("int", Fault.TYPE, "a whole number"),
    ("bool", Fault.TYPE, "true or false"),
    ("string", Fault.TYPE, "a text"),
    ("list", Fault.TYPE, "a list"),
    ("dict", Fault.TYPE, "a table"),
    ("model", Fault.TYPE, "a table"),
)


def _diagnostic(document: Document, schema: type[BaseModel], details: ErrorDetails) -> Diagnostic:
    key, kind = details["loc"], details["type"]
    name = dotted(document.origin(key))
    if kind == "missing":
        return document.fault(Fault.MISSING_KEY, key, f"the key {name} is missing")
    if kind == "extra_forbidden":
        return unknown_key(document, key, _keys_allowed(schema, key[:-1]))
    for prefix, fault, wanted in _FAULTS:
        if kind.startswith(prefix):
            wanted = wanted.format(**details.get("ctx", {}))
            return document.fault(
                fault, key, f"{name} must be {wanted}, not {_shown(details['input'], fault)}"
            )
    return document.fault(Fault.DOMAIN, key, f"{name}: {details['msg']}")


def unknown_key(document: Document, key: Key, allowed: Iterable[str]) -> Diagnostic:
    """The diagnostic of a key nobody knows, with the nearest known one."""
    last, allowed = str(key[-1]), list(allowed)
    near = difflib.get_close_matches(last, allowed, n=1)
    hint = f"did you mean `{near[0]}`?" if near else f"known here: {', '.join(sorted(allowed))}"
    return document.fault(Fault.UNKNOWN_KEY, key, f"unknown key {dotted(document.origin(key))}", hint)


def _shown(value: Any, fault: Fault) -> str:
    """A wrong value as a message shows it: as it is, or only its kind or length."""
    if fault is Fault.LENGTH:
        return str(len(value))
    match value:
        case bool():
            return "true" if value else "false"
        case int() | float():
            return f"{value:.12g}" if isinstance(value, float) or abs(value) < 1e300 else "one so long"
        case str():
            return f'"{value}"' if len(value) <= 40 else f'"{value[:37]}..."'
        case list():
            return "a list"
        case dict():
            return "a table"
        case _:
            return f"a {type(value).__name__}"


def _keys_allowed(schema: type[BaseModel], path: Key) -> list[str]:
    """Keys of the table that stands at `path` of the schema."""
    here = schema
    for part in path:  # indices of lists and free keys of tables lead no deeper into the schema
        if part in here.model_fields:
            inner = _table_in(here.model_fields[str(part)].annotation)
            here = inner if inner is not None else here
    return list(here.model_fields)


def _table_in(annotation: Any) -> type[BaseModel] | None:
    """The table that a field holds: itself, optional, or in a list or a mapping."""
    from pydantic import BaseModel

    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((table for each in get_args(annotation) if (table := _table_in(each)) is not None), None)
