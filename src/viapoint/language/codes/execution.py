"""Catalogue entries of execution (E4xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, entry

ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "E401",
        "endless loop without motion",
        """The program ran a great many instructions without a motion and without anything to wait for, so it
        would never go on. The line is one of the loop. Put a motion, a WAIT or a condition that reads a
        signal into it.""",
        "ML P1 F100\nLOOP:\nSET DO 1\nGOTO LOOP\n",
    ),
    entry(
        "E402",
        "subroutines nested too deep",
        """Subroutines may call subroutines to a depth of 64. A subroutine that calls itself without an end
        is the usual cause.""",
        "SUB A\nEND\nA:\nSUB A\nEND\n",
    ),
)
