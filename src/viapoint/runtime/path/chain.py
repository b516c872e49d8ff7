"""Moves in program order to finished pieces of path. No robot beyond injected kinematics, no time.

A piece is finished when both corners of its motion are decided: with the next motion, for a spline's
neighbour with the one after. Finished pieces never change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from viapoint.runtime.path.alignment import aligned, alignment, in_place, same
from viapoint.runtime.path.corners import Corners, Passage, Reason
from viapoint.runtime.path.errors import GeometryError
from viapoint.runtime.path.moves import Corner, Floats, Move, MoveKind, Pose, Tangential, require_finite
from viapoint.runtime.path.piece import Piece
from viapoint.runtime.path.rates import norm
from viapoint.runtime.path.segments import PoseSegment, Segment
from viapoint.runtime.path.shapes import end_pose, is_zero, shape_alone, turns_in_place
from viapoint.runtime.path.splines import Neighbour, spline

# A motion may start so far (m) from where the one before ended: conversions through joints and back.
LARGEST_GAP = 1e-6
# An interval of a segment shorter than this share of it between two round edges is rounding, not path.
NOTHING_LEFT = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Transition:
    """One row of the blend report: how a motion passes into the next."""

    tag: int
    next_tag: int | None  # None: nothing followed
    asked: float | None  # R, m of TCP path or rad of joint-space length; None where not programmed
    effective: float  # distance before and after the corner that the edge takes; 0 without one
    stop: bool
    reason: Reason


@dataclass(frozen=True, slots=True)
class Mark:
    """The end of a motion: the boundary after the `pieces`-th piece, counted from the chain's first."""

    tag: int
    pieces: int


@dataclass(slots=True)
class _Link:
    """A motion whose end is still open."""

    move: Move
    segment: Segment | None  # None: a spline whose neighbours are not known yet
    corner: Corner
    last_tag: int  # of this motion, or of the last motion of zero length after it
    followers: list[int]  # tags of motions of zero length at its end
    before: Floats | None = None  # orientation it begins with at rest, where its tool is to be aligned first
    begin: float = 0.0  # parameter where the round edge before it ends


class Chain:
    """Grows one path between exact stops.

    `tolerance` (m) is how far the path may leave the programmed one at tangential transitions that are not
    C²; 0 makes them stops. `pieces`, `marks` and `transitions` only ever grow, until `take` empties them.
    """

    def __init__(self, *, tolerance: float, corners: Corners | None = None) -> None:
        """`corners` may be shared with an earlier chain of the same tolerance."""
        self._corners = corners or Corners(tolerance)
        self.pieces: list[Piece] = []
        self.marks: list[Mark] = []
        self.transitions: list[Transition] = []
        self._finished = 0
        self._open: list[_Link] = []
        self._before: Neighbour | None = None
        self._end: Pose | None = None

    def push(self, move: Move, segment: Segment | None = None) -> None:
        """Append a motion. May finish pieces of the motions before it.

        `segment` is its geometry where that is known already and needs no neighbours. Raises GeometryError
        E306 where a circle has no geometry; the chain is then unchanged.
        """
        if segment is None:
            require_finite(move)
        self._require_joined(move)
        if segment is None and is_zero(move):
            self._pass_over(move)
        else:
            how = move.tangential
            if segment is None:
                segment = None if how and turns_in_place(move) else shape_alone(move)
            if how is not None and segment is not None:
                segment = aligned(segment, how)
            self._end = end_pose(move)
            before = how.before if how and not self._open else None
            self._open.append(_Link(move, segment, move.corner, move.tag, [], before))
        self._advance(closing=False)

    def close(self) -> None:
        """The last motion ends in an exact stop; what follows knows nothing of what came before."""
        self._advance(closing=True)
        for link in self._open:
            self._finish_with_stop(link, None, Reason.END)
        self._open.clear()
        self._before = self._end = None

    def take(self) -> tuple[list[Piece], list[Mark], list[Transition]]:
        """Everything finished since the last call, handed over; the chain keeps none of it."""
        taken = self.pieces, self.marks, self.transitions
        self.pieces, self.marks, self.transitions = [], [], []
        return taken

    # ------------------------------------------------------------------------------------------------

    def _advance(self, *, closing: bool) -> None:
        """Decide every corner whose two segments are known."""
        while self._open:
            self._build(0, closing)
            if len(self._open) < 2:
                return
            self._build(1, closing)
            left, right = self._open[0], self._open[1]
            if left.segment is None or (right.segment is None and not left.corner.halts):
                return
            self._join(left, right)
            self._before = Neighbour(left.move, left.segment)
            del self._open[0]

    def _build(self, index: int, closing: bool) -> None:
        """Make the spline at `index` once its neighbours are known."""
        link, how = self._open[index], self._open[index].move.tangential
        followed = index + 1 < len(self._open)
        if link.segment is not None:
            return
        if how is not None and turns_in_place(link.move):
            heading = link.before if index == 0 else _last_orientation(self._open[0])
            if heading is not None:
                link.segment = in_place(link.move, how, heading)
        elif followed or closing:
            before = self._neighbour(index - 1) if index else self._before
            plain = spline(link.move, before, self._neighbour(index + 1) if followed else None)
            link.segment = plain if how is None else self._aligned(index, plain, how)

    def _aligned(self, index: int, plain: PoseSegment, how: Tangential) -> PoseSegment:
        """A spline with its tool along its tangent; where that cannot be, the path ends before it."""
        try:
            return aligned(plain, how)
        except GeometryError as error:
            error.tag = self._open[index].move.tag
            del self._open[index:]
            raise

    def _neighbour(self, index: int) -> Neighbour:
        return Neighbour(self._open[index].move, self._open[index].segment)

    def _join(self, left: _Link, right: _Link) -> None:
        next_tag = right.move.tag
        if left.segment is None or right.segment is None:
            reason = Reason.ASKED if left.corner.stop else Reason.R_ZERO
            self._stop_between(left, right, reason)
            return
        passage = Passage(Reason.TANGENT)
        if same(left.move.tangential, right.move.tangential):
            passage = self._corners.passage(left.segment, right.segment, _corner(left, right))
        if passage.reason.stops:
            self._stop_between(left, right, passage.reason)
            return
        self._record(left, next_tag, passage.radius, passage.reason)
        if passage.edge is None:
            self._emit(left, left.segment.length, ends=True)
            self._mark(left)
        else:
            self._finish_with_edge(left, right, passage, passage.edge)

    def _finish_with_edge(self, left: _Link, right: _Link, passage: Passage, edge: Segment) -> None:
        half = 0.5 * edge.length
        self._emit(left, passage.leave)
        self._append(Piece(edge, 0.0, half, left.move.tag, ends=True, is_edge=True))
        self._mark(left)
        self._append(Piece(edge, half, half, right.move.tag, is_edge=True))
        right.begin = passage.join

    def _stop_between(self, left: _Link, right: _Link, reason: Reason) -> None:
        self._finish_with_stop(left, right.move.tag, reason)
        if right.move.tangential is not None:
            right.before = _last_orientation(left)

    def _finish_with_stop(self, link: _Link, next_tag: int | None, reason: Reason) -> None:
        assert link.segment is not None
        self._record(link, next_tag, 0.0, reason)
        self._emit(link, link.segment.length, ends=True, stop=True)
        self._mark(link)

    def _emit(self, link: _Link, end: float, *, ends: bool = False, stop: bool = False) -> None:
        """The uncut interval of a segment, if the round edges left any."""
        assert link.segment is not None
        if link.before is not None:
            first = alignment(link.before, link.segment, link.move)
            link.before = None
            if first is not None:
                self._append(Piece(first, 0.0, first.length, link.move.tag, stop=True))
        left = end - link.begin
        if left > NOTHING_LEFT * link.segment.length:
            self._append(Piece(link.segment, link.begin, left, link.move.tag, ends, stop))

    def _append(self, piece: Piece) -> None:
        self.pieces.append(piece)
        self._finished += 1

    def _mark(self, link: _Link) -> None:
        self.marks.extend(Mark(tag, self._finished) for tag in (link.move.tag, *link.followers))

    def _record(self, link: _Link, next_tag: int | None, effective: float, reason: Reason) -> None:
        self.transitions.append(
            Transition(
                tag=link.last_tag,
                next_tag=next_tag,
                asked=link.corner.radius,
                effective=effective,
                stop=reason.stops,
                reason=reason,
            )
        )

    def _pass_over(self, move: Move) -> None:
        """A motion of zero length: the corner before it and the one after it become one."""
        if not self._open:
            self.marks.append(Mark(move.tag, self._finished))
            return
        link = self._open[-1]
        self._record(replace(link, followers=[]), move.tag, 0.0, Reason.ZERO_LENGTH)
        link.followers.append(move.tag)
        link.last_tag = move.tag
        link.corner = _merged(link.corner, move.corner)

    def _require_joined(self, move: Move) -> None:
        if self._end is not None:
            gap = norm(move.start.position - self._end.position)
            if gap > LARGEST_GAP:
                raise ValueError(f"motion {move.tag} starts {gap:.3g} m from the end of the one before")


def _last_orientation(link: _Link) -> Floats | None:
    """The orientation (4,) in which a link ends, once that is known."""
    segment = link.segment
    return None if segment is None else np.asarray(segment.poses(np.array([segment.length])).quaternion[0])


def _corner(left: _Link, right: _Link) -> Corner:
    """The corner in effect: R has no meaning between two splines, which are one curve already."""
    both = left.move.kind is right.move.kind is MoveKind.SPLINE
    return Corner(left.corner.stop, None) if both and not left.corner.halts else left.corner


def _merged(first: Corner, second: Corner) -> Corner:
    """One corner of two at the same place: a stop in either is a stop, else the first R programmed."""
    stop = first.stop or second.stop
    if first.radius == 0.0 or second.radius == 0.0:
        return Corner(stop, 0.0)
    rounded = second if first.radius is None else first
    return replace(rounded, stop=stop)
