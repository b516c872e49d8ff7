"""Motions with actions on them, while the route is laid: what must be known of their length, and when.

A place that counts from the end is known when the end is. Until then the motion is held back from the
route, so that the robot cannot be past the place before.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from viapoint.runtime.kernel.failure import PlanningError
from viapoint.runtime.kernel.onpath import check_places
from viapoint.runtime.kernel.route import Route
from viapoint.runtime.path import Mark, Move, MoveKind, Piece
from viapoint.vm.ports import Origin, PathAction


class _Acting(NamedTuple):
    """A motion with actions, and the tag of the one before it (-1: none)."""

    actions: tuple[PathAction, ...]
    before: int


class ActingMotions:
    """Keeps the motions with actions until their ends are decided."""

    def __init__(self, route: Route) -> None:
        self._route = route
        self._acting: dict[int, _Acting] = {}
        self._pieces: list[Piece] = []
        self._marks: list[Mark] = []
        self._passed = 0  # pieces handed on so far

    def announce(self, actions: tuple[PathAction, ...], tag: int, before: int, move: Move) -> None:
        """Motion `tag` comes behind motion `before`. Raises PlanningError for a place outside a line."""
        if not actions:
            return
        if move.kind is MoveKind.LINE:
            check_places(actions, float(np.linalg.norm(move.target.position - move.start.position)))
        self._acting[tag] = _Acting(actions, before)

    def hold_back(self, pieces: Sequence[Piece], marks: Sequence[Mark]) -> tuple[list[Piece], list[Mark]]:
        """Of what has come and is waiting, the pieces and marks that the route may have."""
        self._pieces += pieces
        self._marks += marks
        decided = {mark.tag for mark in self._marks}
        held = {tag for tag, each in self._acting.items() if tag not in decided and _from_end(each.actions)}
        count = next((k for k, piece in enumerate(self._pieces) if piece.tag in held), len(self._pieces))
        ready, self._pieces = self._pieces[:count], self._pieces[count:]
        self._passed += count
        known = [mark for mark in self._marks if mark.pieces <= self._passed]
        self._marks = [mark for mark in self._marks if mark.pieces > self._passed]
        return ready, known

    def begin_anew(self) -> None:
        """The chain of geometry begins anew: nothing is held back, and pieces are counted from 0."""
        self._acting, self._pieces, self._marks, self._passed = {}, [], [], 0

    def check(self) -> None:
        """Judge the places of the motions whose ends are laid. Raises PlanningError."""
        for tag in [tag for tag in self._acting if self._route.place(tag) is not None]:
            each = self._acting.pop(tag)
            begin, end = self._route.place(each.before) or 0.0, self._route.place(tag)
            assert end is not None
            try:
                check_places(each.actions, self._route.travelled(end) - self._route.travelled(begin))
            except PlanningError:
                self._route.unplace(tag)
                raise


def _from_end(actions: tuple[PathAction, ...]) -> bool:
    return any(action.origin is not Origin.START for action in actions)
