"""Finished pieces end to end under one parameter s, for tests that look at a path as a whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from viapoint.runtime.path.chain import Chain, Transition
from viapoint.runtime.path.moves import Floats, Poses
from viapoint.runtime.path.piece import Piece

Ints = npt.NDArray[np.int64]
Rows = slice | Ints
Measure = Callable[[Piece, Floats], Floats]


class Path:
    """Pieces in travel order. s (m) grows through all of them from 0, across stops too.

    Old pieces can be dropped; s, σ and θ of the rest stay what they were.
    """

    def __init__(self) -> None:
        self.pieces: list[Piece] = []
        self._breaks: list[float] = [0.0]
        self._breaks_array: Floats | None = None
        self._arcs, self._angles = _Tally(Piece.arc_length), _Tally(Piece.angle_length)
        self._places: dict[int, float] = {}
        self._appended = 0

    @property
    def start(self) -> float:
        """s where the oldest kept piece begins."""
        return self._breaks[0]

    @property
    def end(self) -> float:
        """s where the last piece ends."""
        return self._breaks[-1]

    @property
    def breaks(self) -> Floats:
        """(K + 1,) s of all piece boundaries."""
        if self._breaks_array is None:
            self._breaks_array = np.array(self._breaks)
        return self._breaks_array

    @property
    def stops(self) -> Floats:
        """s of all exact stops among the boundaries."""
        return np.array([s for piece, s in zip(self.pieces, self._breaks[1:], strict=True) if piece.stop])

    def append(self, piece: Piece) -> None:
        """One more finished piece at the end."""
        self.pieces.append(piece)
        self._appended += 1
        self._breaks.append(self._breaks[-1] + piece.length)
        self._breaks_array = None
        if piece.ends:
            self._places[piece.tag] = self._breaks[-1]

    def extend(self, chain: Chain) -> list[Transition]:
        """Take over all that `chain` has finished; its report of corners is returned.

        One chain feeds one path, and all of it.
        """
        pieces, marks, transitions = chain.take()
        waiting = iter(marks)
        mark = next(waiting, None)
        for piece in (*pieces, None):
            while mark is not None and mark.pieces == self._appended:
                self._places[mark.tag] = self.end
                mark = next(waiting, None)
            if piece is not None:
                self.append(piece)
        return transitions

    def drop_before(self, s: float) -> None:
        """Forget the pieces that end at or before s, and the places on them."""
        count = sum(1 for end in self._breaks[1:] if end <= s)
        for tally in (self._arcs, self._angles):
            tally.drop(count, self.pieces)
        del self.pieces[:count]
        del self._breaks[:count]
        self._breaks_array = None
        self._places = {tag: at for tag, at in self._places.items() if at >= self.start}

    def locate(self, s: Floats) -> tuple[Ints, Floats]:
        """(N,) s → index (N,) into `pieces`, and w (N,) there. A boundary belongs to the piece after it."""
        breaks = self.breaks
        index = np.clip(np.searchsorted(breaks, s, side="right") - 1, 0, len(self.pieces) - 1)
        lengths = breaks[index + 1] - breaks[index]
        return index, np.clip(s - breaks[index], 0.0, lengths)

    def place(self, tag: int) -> float:
        """s of the place of a motion's actions: its end point, or the middle of the round edge after it.

        KeyError for a motion whose end is not on the kept path.
        """
        return self._places[tag]

    def has_place(self, tag: int) -> bool:
        """The end of the motion is finished and kept."""
        return tag in self._places

    def tags(self, s: Floats) -> Ints:
        """(N,) → tags (N,) of the motions that own these places."""
        index, _ = self.locate(s)
        return np.array([piece.tag for piece in self.pieces], dtype=np.int64)[index]

    def poses(self, s: Floats) -> Poses:
        """(N,) → poses of the TCP."""
        position, quaternion = np.empty((len(s), 3)), np.empty((len(s), 4))
        for _, piece, rows, w in self._groups(s):
            position[rows], quaternion[rows] = piece.poses(w)
        return Poses(position, quaternion)

    def sigma(self, s: Floats) -> Floats:
        """(N,) → TCP arc length (N,) m from the start of the path."""
        return self._travel(s, self._arcs, Piece.arc_length)

    def theta(self, s: Floats) -> Floats:
        """(N,) → rotation angle (N,) rad travelled from the start of the path."""
        return self._travel(s, self._angles, Piece.angle_length)

    def _travel(self, s: Floats, tally: _Tally, measure: Measure) -> Floats:
        travelled = np.empty(len(s))
        for k, piece, rows, w in self._groups(s):
            travelled[rows] = tally.until(k, self.pieces) + measure(piece, w)
        return travelled

    def _groups(self, s: Floats) -> Iterator[tuple[int, Piece, Rows, Floats]]:
        """The rows of s on each piece that holds any, with their w."""
        index, w = self.locate(s)
        if len(s) == 0:
            return
        if (index == index[0]).all():
            yield int(index[0]), self.pieces[index[0]], slice(None), w
            return
        order = np.argsort(index, kind="stable")
        cuts = np.flatnonzero(np.diff(index[order])) + 1
        for rows in np.split(order, cuts):
            k = int(index[rows[0]])
            yield k, self.pieces[k], rows, w[rows]


class _Tally:
    """Sums of a length over whole pieces, made only as far as they are asked for."""

    def __init__(self, measure: Measure) -> None:
        self._measure = measure
        self._sums = [0.0]

    def until(self, k: int, pieces: Sequence[Piece]) -> float:
        """From the start of the path to the start of piece k."""
        for piece in pieces[len(self._sums) - 1 : k]:
            self._sums.append(self._sums[-1] + float(self._measure(piece, np.array([piece.length]))[0]))
        return self._sums[k]

    def drop(self, count: int, pieces: Sequence[Piece]) -> None:
        """Forget the first pieces, keep their sum."""
        self.until(count, pieces)
        del self._sums[:count]
