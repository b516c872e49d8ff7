"""IF blocks while a program is read from top to bottom: what is open, and which block lies in which."""

from __future__ import annotations

from dataclasses import dataclass, field

from viapoint.language.tree import If

OUTSIDE = 0
"""The block of statements outside any IF."""


@dataclass(slots=True)
class OpenIf:
    """An IF whose ENDIF has not come yet.

    `block` is the branch being read; `false_patch` the operand of the last condition's jump, None behind
    ELSE; `end_patches` those of the jumps that leave finished branches; `arrived` whether the path is
    known to stand still where the next condition is read.
    """

    statement: If
    block: int
    false_patch: int | None
    arrived: bool
    end_patches: list[int] = field(default_factory=list)
    else_line: int | None = None
    runs_on: bool = False  # some finished branch reaches ENDIF
    tracking_before: bool = False
    tracking_after: bool = True  # in every finished branch
    live_before: bool = True


class Blocks:
    """Numbers every branch. A branch's descendants are the numbers given out while it is open."""

    def __init__(self) -> None:
        self.open: list[OpenIf] = []
        self._count = 1
        self._ends = {OUTSIDE: 0}

    @property
    def current(self) -> int:
        """The innermost branch being read."""
        return self.open[-1].block if self.open else OUTSIDE

    def enter(self) -> int:
        """Number a new branch."""
        block = self._count
        self._count += 1
        return block

    def leave(self, block: int) -> None:
        """The branch is over."""
        self._ends[block] = self._count

    def contains(self, outer: int, inner: int) -> bool:
        """Whether `inner` is `outer` or lies in it; both may still be open."""
        return outer == OUTSIDE or outer <= inner < self._ends.get(outer, self._count)
