"""A finished piece of path: flange poses, TCP lengths, how path limits apply. No joints."""

from __future__ import annotations

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
        position, quaternion = self.curve.poses(w)
        X = np.zeros((len(w), 4, 4))
        X[:, :3, :3] = quaternion_to_matrix(quaternion)
        X[:, :3, 3] = position
        X[:, 3, 3] = 1.0
        return np.asarray(X @ self.X_tool_flange)


@dataclass(frozen=True)
class Stretch(FlangePath):
    """A finished piece of path with its source line, and how path limits apply to it.

    Joint moves are free of them; a round edge between a joint move and a path motion ramps them in or out
    on the half that belongs to the path motion.
    """

    curve: Piece
    line: int
    limits: PathLimits

    def rates(self, w: Floats) -> Floats:
        """(N, 4): limited TCP length and angle, travelled TCP length and angle, per parameter at w (N,)."""
        travelled = np.stack(self.curve.rates(w), axis=1)
        match self.limits:
            case PathLimits.APPLY:
                limited = travelled
            case PathLimits.FREE:
                limited = np.zeros_like(travelled)
            case PathLimits.RAMP_IN:
                limited = travelled * _smooth_step(w / self.length)[:, None]
            case PathLimits.RAMP_OUT:
                limited = travelled * _smooth_step(1.0 - w / self.length)[:, None]
            case _:
                assert_never(self.limits)
        return np.concatenate((limited, travelled), axis=1)


def _smooth_step(u: Floats) -> Floats:
    """0 … 1 over u = 0 … 1, with first and second derivative zero at both ends."""
    result: Floats = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return result
