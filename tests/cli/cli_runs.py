"""What a command line that was run in this process has left."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def transcript(self) -> str:
        """As a golden file shows it."""
        parts = [f"exit code {self.code}"]
        for name, text in (("standard output", self.out), ("standard error", self.err)):
            if text:
                parts.append(f"--- {name}\n{text.rstrip()}")
        return "\n".join(parts)


RunCli = Callable[..., Outcome]
