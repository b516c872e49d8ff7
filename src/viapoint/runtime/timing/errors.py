"""What the time law raises; a law that cannot be made within the limits is never returned."""

from __future__ import annotations


class TimingError(Exception):
    """No time law: one sentence, and the path parameter it is about (nan: the whole section)."""

    def __init__(self, message: str, s: float = float("nan")) -> None:
        super().__init__(message)
        self.message = message
        self.s = s
