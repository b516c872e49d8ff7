"""How a command says no: wrong usage (exit code 2) or a refused input (exit code 1). Prints nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viapoint.language.diagnostics import Diagnostic


class UsageError(Exception):
    """The command line itself is wrong; `usage` shows how it is written."""

    def __init__(self, message: str, usage: str = "") -> None:
        super().__init__(message)
        self.usage = usage


class Refusal(Exception):
    """What was asked cannot be done with this input: a sentence for the user, or diagnostics, or both."""

    def __init__(self, message: str, diagnostics: Sequence[Diagnostic] = ()) -> None:
        super().__init__(message)
        self.diagnostics = tuple(diagnostics)
