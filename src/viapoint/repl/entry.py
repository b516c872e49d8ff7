"""Lines as they are typed, collected until they make something that can be executed. Text only.

A block is collected up to its end word, a label up to END (a subroutine) or to the GOTO back to it (a
loop). A line that ends with a backslash goes on with the next; a blank line closes what is open.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum, unique
from typing import Final

from viapoint.language.lexical import NAME, code_end
from viapoint.language.tree import name_key

_LABEL: Final = re.compile(rf"\s*({NAME})\s*:")
_WORD: Final = re.compile(r"\s*([A-Za-z]+)")
_JUMP: Final = re.compile(rf"\s*GOTO\s+({NAME})", re.IGNORECASE)
_REFERENCE: Final = re.compile(rf"\b(?:GOTO|SUB|OFF)\s+({NAME})", re.IGNORECASE)
_OPENS: Final = frozenset({"IF", "WHILE", "FOR"})
_CLOSES: Final = frozenset({"ENDIF", "ENDWHILE", "ENDFOR"})
_BELONGS_TO_NEXT: Final = "AT"


@unique
class Kind(Enum):
    """What was entered."""

    NOTHING = "nothing"
    COMMAND = "command"
    PROGRAM = "program"
    SUBROUTINE = "subroutine"


@dataclass(frozen=True, slots=True)
class Entry:
    """Something complete: a command without its colon, or program text with its line ends."""

    kind: Kind
    text: str


def code_of(line: str) -> str:
    """A line without its comment."""
    return line[: code_end(line)[0]]


def label_of(line: str) -> str | None:
    """The name of the label that a line declares."""
    found = _LABEL.match(code_of(line))
    return found[1] if found else None


def references(text: str) -> list[str]:
    """Labels that a text jumps to or calls."""
    return [name for line in text.splitlines() for name in _REFERENCE.findall(code_of(line))]


class Collector:
    """Takes lines; gives an entry back when one is complete."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._depth = 0
        self._labels: set[str] = set()

    @property
    def pending(self) -> bool:
        """Whether lines wait for more."""
        return bool(self._lines)

    def drop(self) -> None:
        """Forget what waits."""
        self._lines.clear()
        self._labels.clear()
        self._depth = 0

    def feed(self, line: str) -> Entry | None:
        """The entry that `line` completes; None if more must come."""
        if line.lstrip().startswith(":"):  # no statement does: it is done at once, and the block goes on
            return Entry(Kind.COMMAND, line.strip()[1:])
        if not line.strip():
            return self._complete(Kind.PROGRAM) if self.pending else Entry(Kind.NOTHING, "")
        goes_on = line.rstrip().endswith("\\")
        line = line.rstrip().removesuffix("\\")
        self._lines.append(line)
        ended = self._follow(code_of(line))
        if ended and label_of(self._lines[0]) is not None:
            return self._complete(Kind.SUBROUTINE)
        if goes_on or (not ended and self._open):
            return None
        return self._complete(Kind.PROGRAM)

    def rest(self) -> Entry | None:
        """What was never closed, when nothing more will come."""
        return self._complete(Kind.PROGRAM) if self.pending else None

    @property
    def _open(self) -> bool:
        first = _WORD.match(code_of(self._lines[-1]))
        waits = first is not None and first[1].upper() == _BELONGS_TO_NEXT
        return bool(self._depth or self._labels or waits)

    def _follow(self, code: str) -> bool:
        """Count what a line opens and closes; True if it ends a subroutine, or a program."""
        label = _LABEL.match(code)
        if label is not None:
            self._labels.add(name_key(label[1]))
            code = code[label.end() :]
        word = _WORD.match(code)
        first = word[1].upper() if word else ""
        jump = _JUMP.match(code)
        if first in _OPENS:
            self._depth += 1
        elif first in _CLOSES:
            self._depth = max(0, self._depth - 1)
        elif jump is not None:
            self._labels.discard(name_key(jump[1]))
        return first == "END" and self._depth == 0

    def _complete(self, kind: Kind) -> Entry:
        text = "".join(f"{line}\n" for line in self._lines)
        self.drop()
        return Entry(kind, text)
