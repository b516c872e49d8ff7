"""The call stack of the machine: what is kept of every subroutine that runs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


class ActiveCall(NamedTuple):
    """One level of the call stack as shown to the user."""

    line: int  # of the SUB statement
    label_line: int  # where the subroutine starts
    remaining: int  # runs still to come, the present one included


@dataclass(slots=True)
class Frame:
    """A running subroutine, or the main program at the bottom. Counters are keyed by label."""

    entry: int
    returns_to: int
    call_line: int
    remaining: int = 1
    counters: dict[int, tuple[int, int]] = field(default_factory=dict)  # label: (address of REPEAT, runs)
