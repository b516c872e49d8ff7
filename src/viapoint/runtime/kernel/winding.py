"""How far a tangential tool has been wound up by the path, for the refusal of one turn too many."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from viapoint.runtime.kernel.failure import MotionError, PlanningError
from viapoint.runtime.path import Piece, PoseSegment

_SAMPLES: Final = 65
"""Places of a piece at which its rate of turning is looked at: good to a hundredth of a turn."""

_WORTH_SAYING: Final = 0.25
"""Turns below which a joint beyond its range has another reason."""


class Winding:
    """Turns of the tool about the frame's Z since it began to keep to the tangent."""

    def __init__(self) -> None:
        self._turns = 0.0

    def begin(self) -> None:
        """From here on turns count."""
        self._turns = 0.0

    def explained(
        self, error: MotionError, pieces: Sequence[Piece], line_of: Callable[[int], int]
    ) -> MotionError:
        """A joint beyond its range, told as the winding up that it is; another error as it was."""
        last = max((k for k, piece in enumerate(pieces) if line_of(piece.tag) == error.line), default=-1)
        wound = np.cumsum([self._turns, *(_turned(piece) for piece in pieces[: last + 1])])
        turns = float(np.abs(wound).max())
        tangential = last >= 0 and _is_tangential(pieces[last])
        if error.code != "E303" or not tangential or turns < _WORTH_SAYING:
            return error
        return PlanningError(
            "E309",
            f"the tool would have followed the tangent for {turns:.1f} turns; {error.message}",
            error.line,
            "unwind with an MJ before it, or go the other way round in between",
        )

    def take(self, pieces: Sequence[Piece]) -> None:
        """Count what has been laid. A joint move may turn back, and what is known begins anew."""
        for piece in pieces:
            self._turns = self._turns + _turned(piece) if isinstance(piece.segment, PoseSegment) else 0.0


def _is_tangential(piece: Piece) -> bool:
    return isinstance(piece.segment, PoseSegment) and piece.segment.tangential is not None


def _turned(piece: Piece) -> float:
    """Turns of a piece about the Z of its frame, signed; 0 where its tool is free."""
    segment = piece.segment
    if not isinstance(segment, PoseSegment) or segment.tangential is None:
        return 0.0
    w = piece.begin + piece.length * (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    rate, _ = segment.turn.rates(w)
    mean = float((rate @ segment.tangential.R_base_frame[:, 2]).mean())
    return mean * piece.length / (2.0 * np.pi)
