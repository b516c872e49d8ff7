"""Catalogue entries of files: compiled programs (E25x), cells and robots (E27x, E28x), scenarios (E29x)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry

ENTRIES: Final[tuple[Entry, ...]] = ()
