"""Catalogue entries of lint (W5xx) and information (I6xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry

ENTRIES: Final[tuple[Entry, ...]] = ()
