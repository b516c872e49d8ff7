"""A piece of path: an interval of a segment or of a round edge that belongs to one motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viapoint.runtime.path.moves import Floats, Poses, Space
from viapoint.runtime.path.segments import JointSegment, Segment


@dataclass(frozen=True, slots=True)
class Piece:
    """Finished geometry with a parameter w of its own in 0 … `length`.

    w is TCP arc length in m on lines and circles; on a turn in place the angle in rad, on a joint move the
    joint-space length in rad, each at 1 m per rad; where auxiliary axes move alone, their length; on splines
    and round edges a parameter in which position and orientation (in joint space: the joints), and the
    auxiliary axes, are C² across every boundary without a stop.
    """

    segment: Segment
    begin: float  # parameter of the segment at w = 0
    length: float
    tag: int  # of the motion it belongs to
    ends: bool = False  # the motion's own end, where its actions stand, is the end of this piece
    stop: bool = False  # the path stands still exactly at its end
    is_edge: bool = False  # half of a round edge

    @property
    def space(self) -> Space:
        """JOINT where the joints are given, POSE where the pose is."""
        return self.segment.space

    def poses(self, w: Floats) -> Poses:
        """(N,) → positions (N, 3) m and quaternions (N, 4) of the TCP; in JOINT through forward kinematics.

        q and −q are one orientation; the sign may change between pieces.
        """
        return self.segment.poses(self.begin + w)

    def joints(self, w: Floats) -> Floats:
        """(N,) → joints (N, n) rad or m, of a piece in JOINT space only."""
        if not isinstance(self.segment, JointSegment):
            raise ValueError("joints of a piece that is defined by poses")
        return self.segment.joints(self.begin + w)

    def joint_rates(self, w: Floats) -> Floats:
        """(N,) → derivatives of the joints by w (N, n), of a piece in JOINT space only."""
        if not isinstance(self.segment, JointSegment):
            raise ValueError("joints of a piece that is defined by poses")
        return self.segment.joint_rates(self.begin + w)

    def auxiliary(self, w: Floats) -> Floats:
        """(N,) → auxiliary axes (N, k) m or rad, where the motion has any."""
        if self.segment.auxiliary is None:
            raise ValueError("auxiliary axes of a piece that has none")
        return self.segment.auxiliary.points(self.begin + w)

    def tangents(self, w: Floats) -> Floats:
        """(N,) → dp/dw (N, 3), of a piece in POSE space only."""
        if isinstance(self.segment, JointSegment):
            raise ValueError("tangents of a piece that is defined by joints")
        return self.segment.curve.velocities(self.begin + w)

    def rates(self, w: Floats) -> tuple[Floats, Floats]:
        """dσ/dw and dθ/dw at w (N,), (N,) each: TCP speed and angular speed per parameter."""
        return self.segment.rates(self.begin + w)

    def arc_length(self, w: Floats) -> Floats:
        """σ: (N,) → TCP arc length (N,) m from the start of the piece; exact, or to 1e-6 of the segment's."""
        arc = self.segment.arc
        return arc.at(self.begin + w) - arc.at(np.array([self.begin]))

    def arc_rate(self, w: Floats) -> Floats:
        """dσ/dw, (N,) → (N,)."""
        return self.segment.arc.rates(self.begin + w)

    def angle_length(self, w: Floats) -> Floats:
        """θ: (N,) → rotation angle (N,) rad travelled from the start of the piece, as `arc_length`."""
        angle = self.segment.angle
        return angle.at(self.begin + w) - angle.at(np.array([self.begin]))

    def angle_rate(self, w: Floats) -> Floats:
        """dθ/dw, (N,) → (N,)."""
        return self.segment.angle.rates(self.begin + w)
