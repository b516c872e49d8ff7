"""Geometry of the path: moves in, pieces out. No robot but injected kinematics, and no time."""

from viapoint.runtime.path.chain import Chain, Mark, Transition
from viapoint.runtime.path.corners import Corners, Reason
from viapoint.runtime.path.errors import GeometryError
from viapoint.runtime.path.moves import Corner, Move, MoveKind, Pose, Poses, Space, Tangential
from viapoint.runtime.path.piece import Piece
from viapoint.runtime.path.rates import cross
from viapoint.runtime.path.segments import PoseSegment, Segment
from viapoint.runtime.path.segments import sample as sample_segments
from viapoint.runtime.path.shapes import auxiliary_alone, end_pose
from viapoint.runtime.path.splines import programmed
from viapoint.runtime.path.tangential import tangential_move

__all__ = [
    "Chain",
    "Corner",
    "Corners",
    "GeometryError",
    "Mark",
    "Move",
    "MoveKind",
    "Piece",
    "Pose",
    "PoseSegment",
    "Poses",
    "Reason",
    "Segment",
    "Space",
    "Tangential",
    "Transition",
    "auxiliary_alone",
    "cross",
    "end_pose",
    "programmed",
    "sample_segments",
    "tangential_move",
]
