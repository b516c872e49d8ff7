"""A finished piece of path: flange poses, TCP lengths, how path limits apply. No joints."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from enum import Enum, unique
from typing import Protocol, assert_never

import numpy as np

from viapoint.runtime.path import Piece, Poses
from viapoint.runtime.records import Floats
from viapoint.runtime.rotations import quaternion_to_matrix


@unique
class PathLimits(Enum):
    """Whether the limits of TCP speed, acceleration and jerk hold along a piece."""

    APPLY = "apply"
    FREE = "free"
    RAMP_IN = "ramp in"
    RAMP_OUT = "ramp out"


class Curve(Protocol):
    """A curve of TCP poses with its own parameter, 0 … length."""

    @property
    def length(self) -> float: ...
    def poses(self, w: Floats) -> Poses: ...


@dataclass(frozen=True)
class FlangePath:
    """A curve of TCP poses as the flange runs it: X_tool_flange (4, 4) is the inverse of the tool."""

    curve: Curve
    X_tool_flange: Floats

    @property
    def length(self) -> float:
        """Length in the curve's own parameter."""
        return self.curve.length

    def flange_poses(self, w: Floats) -> Floats:
        """X_base_flange (N, 4, 4) at w (N,)."""
        return flange_poses(self.curve.poses(w), self.X_tool_flange)


def flange_poses(tcp: Poses, X_tool_flange: Floats) -> Floats:
    """X_base_flange (N, 4, 4) of poses of the TCP."""
    X = np.zeros((len(tcp.position), 4, 4))
    X[:, :3, :3] = quaternion_to_matrix(tcp.quaternion)
    X[:, :3, 3] = tcp.position
    X[:, 3, 3] = 1.0
    return (X.reshape(-1, 4) @ X_tool_flange).reshape(-1, 4, 4)


@dataclass(frozen=True)
class Stretch(FlangePath):
    """A finished piece of path with its source line, and how path limits apply to it.

    Joint moves are free of them; a round edge between a joint move and a path motion ramps them in or out
    on the half that belongs to the path motion.
    """

    curve: Piece
    line: int
    limits: PathLimits

    @property
    def key(self) -> Hashable:
        """Equal for stretches of the same path, as long as they live."""
        piece = self.curve
        tool = self.X_tool_flange.tobytes()
        return id(piece.segment), piece.begin, piece.length, self.limits, tool, self.line

    def limited_share(self, w: Floats) -> Floats:
        """How far path limits apply at w (N,): (N,) from 0 to 1."""
        match self.limits:
            case PathLimits.APPLY:
                return np.ones_like(w)
            case PathLimits.FREE:
                return np.zeros_like(w)
            case PathLimits.RAMP_IN:
                return _smooth_step(w / self.length)
            case PathLimits.RAMP_OUT:
                return _smooth_step(1.0 - w / self.length)
            case _:
                assert_never(self.limits)


def _smooth_step(u: Floats) -> Floats:
    """0 … 1 over u = 0 … 1, with first and second derivative zero at both ends."""
    result: Floats = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return result
