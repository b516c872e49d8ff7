"""A cell of several robots taken apart: one document for each, as if it had the cell for itself.

What stands at the top of the file holds for every robot; a table of `[[robots]]` adds to it or replaces it
key by key. Signals, zones, variables and belts are one for all. Not here: what the tables mean (`load`).
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final

from viapoint.language.diagnostics import Diagnostic
from viapoint.runtime.documents import Document, Fault, Key

ROBOTS: Final = "robots"
_ONE_FOR_ALL: Final = ("io", "zones", "variables", "conveyors")
_JOINED: Final = ("tools", "frames")
"""Lists to which a robot adds its own."""


def has_several(document: Document) -> bool:
    """Whether the file describes its robots in `[[robots]]`."""
    return ROBOTS in document.data


def taken_apart(document: Document) -> tuple[list[Document], list[Diagnostic]]:
    """A document per robot, and what is wrong with how they stand together."""
    tables = document.data[ROBOTS]
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        message = "robots must be tables: one [[robots]] for each robot"
        return [], [document.fault(Fault.TYPE, (ROBOTS,), message)]
    faults = list(_misplaced(document, tables))
    return [_of_one(document, i, table) for i, table in enumerate(tables)], faults


def _misplaced(document: Document, tables: list[dict[str, Any]]) -> Iterator[Diagnostic]:
    if "robot" in document.data:
        message = "the file has both [robot] and [[robots]]"
        yield document.fault(
            Fault.CONTRADICTION, ("robot",), message, "move [robot] into the first [[robots]]"
        )
    for i, table in enumerate(tables):
        for key in _ONE_FOR_ALL:
            if key in table:
                message = (
                    f"{key} are shared by all robots" if key != "io" else "signals are shared by all robots"
                )
                hint = f"put {key} at the top of the file, outside [[robots]]"
                yield document.fault(Fault.CONTRADICTION, (ROBOTS, i, key), message, hint)


def _of_one(document: Document, number: int, table: dict[str, Any]) -> Document:
    shared = {k: v for k, v in document.data.items() if k not in (ROBOTS, "robot")}
    own = {k: v for k, v in table.items() if k not in _ONE_FOR_ALL}
    before = {key: len(shared[key]) for key in _JOINED if isinstance(shared.get(key), list)}
    places = dict(_places(document, number, before))
    lines = {key: line for key, line in document.lines.items() if key[:1] not in ((ROBOTS,), ("robot",))}
    lines |= {key: document.lines[origin] for key, origin in places.items()}
    lines[()] = document.lines.get((ROBOTS, number), 1)
    return replace(document, data=_merged(shared, own), lines=lines, origins=places)


def _places(document: Document, number: int, before: dict[str, int]) -> Iterator[tuple[Key, Key]]:
    """Keys of one robot's document and where they stand in the file."""
    for origin in document.lines:
        if origin[:2] == (ROBOTS, number) and len(origin) > 2:
            key = origin[2:]
            if len(key) > 1 and key[0] in before and isinstance(key[1], int):
                key = (key[0], key[1] + before[str(key[0])], *key[2:])
            yield key, origin


def _merged(shared: Any, own: Any, key: str = "") -> Any:
    """What is shared with what a robot has of its own laid over it."""
    if isinstance(shared, dict) and isinstance(own, dict):
        result = {k: copy.copy(v) for k, v in shared.items()}
        for name, value in own.items():
            result[name] = _merged(shared[name], value, name) if name in shared else value
        return result
    if key in _JOINED and isinstance(shared, list) and isinstance(own, list):
        return [*shared, *own]
    return own
