"""Catalogue entries of planning: geometry, reach, configuration, workspace (E3xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry

ENTRIES: Final[tuple[Entry, ...]] = ()
