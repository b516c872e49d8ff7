"""Catalogue entries of meaning: names, labels, blocks (E20x to E24x)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry

ENTRIES: Final[tuple[Entry, ...]] = ()
