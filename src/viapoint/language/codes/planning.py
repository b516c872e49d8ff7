"""Catalogue entries of planning: geometry, reach, configuration, workspace (E3xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, entry

ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "E301",
        "three points that define no circle",
        """MC runs on the circle through its start, Q and its target. Points on one line, or two of them in the
        same place, have no such circle. Move Q off the line between start and target; for a full circle
        program H and a target elsewhere on it.""",
        "HOME F50\nMC X=1755 Y=200 Z=2660 QX=1755 QY=100 QZ=2660 F100\n",
    ),
)
