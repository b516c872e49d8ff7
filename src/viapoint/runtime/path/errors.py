"""The one error that geometry raises for what a user programmed; misuse by a caller is a ValueError."""

from __future__ import annotations


class GeometryError(Exception):
    """A motion has no geometry: a catalogue code (E3xx) and one sentence in the user's terms."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(f"{code}: {message}")
        self.code = code
        self.message = message
        self.tag: int | None = None
        """Of the motion, where another one is at hand when it is found."""
