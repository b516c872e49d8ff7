"""What is programmed on the pieces of the route: speeds and frames, from where each piece begins.

Grows at the end and is forgotten from the start. Not here: the axes' rates, with which speeds become bounds.
"""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from viapoint.runtime.kernel.growing import GrowingRows
from viapoint.runtime.kernel.speeds import SpeedRule
from viapoint.runtime.records import Floats, Ints


class OnPiece(NamedTuple):
    """What holds along a piece: its motion's speeds, whether that moves in joint space, and its frame."""

    rule: SpeedRule
    joint_space: bool
    frame: int


class Programmed:
    """Pieces by s where they begin, ascending."""

    def __init__(self) -> None:
        self._begins: list[float] = []
        self._rules = GrowingRows(len(SpeedRule._fields))
        self._fastest: list[float] = []  # the speed programmed there, in its motion's measure
        self._frames: list[int] = []

    @property
    def begin(self) -> float:
        """s where the first piece kept begins; 0 where there is none."""
        return self._begins[0] if self._begins else 0.0

    def append(self, begins: Sequence[float], pieces: Sequence[OnPiece]) -> None:
        """The next pieces, at least one."""
        self._begins += begins
        self._rules.append(np.array([rule.on(joint_space=joint) for rule, joint, _ in pieces]))
        self._fastest += [rule.joint if joint else rule.fallback_linear for rule, joint, _ in pieces]
        self._frames += [piece.frame for piece in pieces]

    def breaks(self, s_from: float, s_to: float) -> Floats:
        """Places (N,) inside (s_from, s_to) where higher derivatives or the programmed speed may jump."""
        first, last = bisect.bisect_right(self._begins, s_from), bisect.bisect_left(self._begins, s_to)
        return np.array(self._begins[first:last])

    def between(self, low: float, high: float) -> tuple[Floats, Floats]:
        """Begins (B,) and rules (B, 6) of the pieces from low to high."""
        first, last = self._at(low), bisect.bisect_right(self._begins, high)
        last = max(first + 1, last)
        return np.array(self._begins[first:last]), self._rules.rows[first:last]

    def whole(self, s_from: float, s_to: float) -> tuple[Floats, Floats] | None:
        """Begins (B,) and rules (B, 6) of the pieces that begin from s_from on, before s_to; None where none
        begins at s_from.
        """
        first, last = bisect.bisect_left(self._begins, s_from), bisect.bisect_left(self._begins, s_to)
        if self._begins[first : first + 1] != [s_from]:
            return None
        return np.array(self._begins[first:last]), self._rules.rows[first:last]

    def frames(self, s: Floats) -> Ints:
        """Frame (N,) of the motion at each s (N,); 0 where there is no path yet."""
        if not self._frames:
            return np.zeros(len(s), dtype=np.int64)
        k = np.searchsorted(self._begins, s, side="right") - 1
        return np.asarray(self._frames, dtype=np.int64)[np.maximum(k, 0)]

    def fastest(self, s: float, pieces: int) -> float:
        """The largest speed programmed on so many pieces from s on, in each motion's measure; inf: none."""
        first = self._at(s)
        return max(self._fastest[first : first + pieces], default=np.inf)

    def forget(self, s: float) -> None:
        """Drop the pieces that end before s."""
        k = self._at(s)
        self._rules.drop(k)
        del self._begins[:k], self._fastest[:k], self._frames[:k]

    def _at(self, s: float) -> int:
        """Number of the piece at s, or of the first."""
        return max(0, bisect.bisect_right(self._begins, s) - 1)
