"""Whole programmed segments and round edges: a curve with its orientation, measured. Nothing is cut here.

A segment is evaluable over all of 0 … `length`; a piece of path is an interval of one. Where poses define it,
`_curves` evaluates it compiled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from viapoint.runtime.core import chosen
from viapoint.runtime.path.curves import Bezier, Curve, Profile
from viapoint.runtime.path.moves import Floats, Kinematics, Poses, Space, Tangential
from viapoint.runtime.path.packing import pack
from viapoint.runtime.path.travel import EvenTravel, TableTravel, Travel, tabulate, tabulate_nodes
from viapoint.runtime.path.turns import KeyedTurn, Turn, UniformTurn
from viapoint.runtime.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)

# Speeds below this (per unit of w) have no direction: |v|′ is then taken as zero.
NO_SPEED = 1e-12
# Step (rad or m of joint-space length) of the central differences through the forward kinematics: eighth
# order leaves 1e-13, rounding 1e-12 in the second derivative.
STENCIL_STEP = 0.02
# Greatest distance of the nodes where a joint move's TCP speed is tabulated: quadrature error 1e-7.
NODE_STEP = 0.03
FEWEST_NODES = 16
_FIRST = np.array([3.0, -32.0, 168.0, -672.0, 0.0, 672.0, -168.0, 32.0, -3.0]) / 840.0
_SECOND = np.array([-9.0, 128.0, -1008.0, 8064.0, -14350.0, 8064.0, -1008.0, 128.0, -9.0]) / 5040.0
_REACH = len(_FIRST) // 2
_CORE = "path._curves"


@dataclass(frozen=True, slots=True)
class Jet:
    """A pose with its first two derivatives by the segment's parameter, base axes."""

    position: Floats  # (3,) m
    velocity: Floats  # (3,)
    acceleration: Floats  # (3,)
    quaternion: Floats  # (4,)
    rate: Floats  # (3,) ω, rad per unit of w
    rate_change: Floats  # (3,) dω/dw


@dataclass(frozen=True)
class PoseSegment:
    """A curve of the TCP and the turn of its orientation, of one parameter."""

    curve: Curve
    turn: Turn
    turns_in_place: bool = False  # w is then the angle turned, 1 m per rad
    auxiliary: Profile | None = None  # of the auxiliary axes (k,); None: there are none
    tangential: Tangential | None = None  # set where the tool keeps to the tangent
    base: Turn | None = None  # and then the turn without the heading of the path
    space = Space.POSE

    @property
    def length(self) -> float:
        """The range of w."""
        return self.curve.length

    @cached_property
    def packed(self) -> Floats:
        """The segment as the compiled module reads it."""
        return pack(self.curve, self.turn)

    def poses(self, w: Floats) -> Poses:
        """(N,) → N poses of the TCP."""
        if chosen(_CORE) is not None:
            return sample([self], [len(w)], w)[0]
        return Poses(self.curve.points(w), self.turn.quaternions(w))

    def jet(self, w: float) -> Jet:
        """Pose and derivatives at one w."""
        if (core := chosen(_CORE)) is not None:
            return Jet(*core.jet(self.packed, w))
        return Jet(*self.curve.derivatives(w), *self.turn.derivatives(w))

    def rates(self, w: Floats) -> tuple[Floats, Floats]:
        """|dp/dw| and |ω| at w (N,), (N,) each."""
        if chosen(_CORE) is not None:
            linear, angular = sample([self], [len(w)], w)[1].T
            return linear, angular
        linear = np.linalg.norm(self.curve.velocities(w), axis=1)
        angular = np.linalg.norm(self.turn.rates(w)[0], axis=1)
        return linear, angular

    @cached_property
    def arc(self) -> Travel:
        """TCP arc length (m) by w."""
        if isinstance(self.curve, Bezier):
            return tabulate(self._speed, self.length)
        return EvenTravel(float(np.linalg.norm(self.curve.velocities(np.zeros(1))[0])))

    @cached_property
    def angle(self) -> Travel:
        """Rotation angle (rad) by w."""
        match self.turn:
            case UniformTurn(rate=rate):
                return EvenTravel(float(np.linalg.norm(rate)))
            case KeyedTurn():
                return tabulate(lambda w: _norm_with_derivative(*self._rates(w)), self.length)

    def _speed(self, w: Floats) -> tuple[Floats, Floats]:
        return _norm_with_derivative(self.curve.velocities(w), self.curve.accelerations(w))

    def _rates(self, w: Floats) -> tuple[Floats, Floats]:
        return self.turn.rates(w)


@dataclass(frozen=True)
class JointSegment:
    """A curve in joint space, in weighted joint-space length; TCP poses through forward kinematics."""

    curve: Profile  # of the weighted joints
    weights: Floats  # (n,) rad of joint-space length per rad or m of a joint
    fk: Kinematics
    auxiliary: Profile | None = None
    stands: bool = False  # auxiliary axes move alone; w is then the length they travel
    turns_in_place = False
    space = Space.JOINT

    @property
    def length(self) -> float:
        """The range of w."""
        return self.curve.length

    def joints(self, w: Floats) -> Floats:
        """(N,) → (N, n) rad or m."""
        return self.curve.points(w) / self.weights

    def joint_rates(self, w: Floats) -> Floats:
        """(N,) → their derivatives by w (N, n)."""
        return self.curve.velocities(w) / self.weights

    def poses(self, w: Floats) -> Poses:
        """(N,) → N poses of the TCP."""
        return Poses(*self.fk(self.joints(w)))

    def jet(self, w: float) -> Jet:
        """Pose and derivatives at one w, by differences through the forward kinematics."""
        offsets = STENCIL_STEP * np.arange(-_REACH, _REACH + 1.0)
        p, q = self.poses(w + offsets)
        turns = quaternion_to_rotation_vector(quaternion_multiply(q, quaternion_conjugate(q[_REACH])))
        # About the pose itself the rotation vector is zero, so its derivatives are ω and dω/dw.
        return Jet(
            p[_REACH],
            _FIRST @ p / STENCIL_STEP,
            _SECOND @ (p - p[_REACH]) / STENCIL_STEP**2,
            q[_REACH],
            _FIRST @ turns / STENCIL_STEP,
            _SECOND @ turns / STENCIL_STEP**2,
        )

    def rates(self, w: Floats) -> tuple[Floats, Floats]:
        """|dp/dw| and |ω| of the TCP at w (N,), (N,) each."""
        return self.arc.rates(w), self.angle.rates(w)

    @cached_property
    def arc(self) -> Travel:
        """TCP arc length (m) by w."""
        return self._travels[0]

    @cached_property
    def angle(self) -> Travel:
        """Rotation angle (rad) of the TCP by w."""
        return self._travels[1]

    @cached_property
    def _travels(self) -> tuple[TableTravel, TableTravel]:
        panels = max(FEWEST_NODES, int(np.ceil(self.length / NODE_STEP)))
        step = self.length / panels
        p, q = self.poses(step * np.arange(-_REACH, panels + 1.0 + _REACH))
        around = np.arange(panels + 1)[:, None] + np.arange(2 * _REACH + 1)
        middle = quaternion_conjugate(q[_REACH:-_REACH])[:, None]
        turns = quaternion_to_rotation_vector(quaternion_multiply(q[around], middle))
        moves = p[around] - p[_REACH:-_REACH, None]
        linear, angular = (
            tabulate_nodes(
                *_norm_with_derivative(
                    np.einsum("j,kjd->kd", _FIRST, x) / step, np.einsum("j,kjd->kd", _SECOND, x) / step**2
                ),
                step,
            )
            for x in (moves, turns)
        )
        return linear, angular


Segment = PoseSegment | JointSegment


def sample(segments: Sequence[PoseSegment], counts: Sequence[int], w: Floats) -> tuple[Poses, Floats]:
    """Poses, and |dp/dw| and |ω| (N, 2), at w (N,): so many places on each segment, in their order."""
    if (core := chosen(_CORE)) is not None:
        rows = [segment.packed for segment in segments]
        position, quaternion, rates = core.sample(rows, np.array(counts), np.ascontiguousarray(w))
        return Poses(position, quaternion), rates
    places = np.split(w, np.cumsum(counts)[:-1])
    poses = [segment.poses(at) for segment, at in zip(segments, places, strict=True)]
    rates = [np.stack(segment.rates(at), axis=1) for segment, at in zip(segments, places, strict=True)]
    position, quaternion = (np.concatenate(parts) for parts in zip(*poses, strict=True))
    return Poses(position, quaternion), np.concatenate(rates)


def _norm_with_derivative(v: Floats, dv: Floats) -> tuple[Floats, Floats]:
    """|v| and its derivative, (N,) each."""
    norm = np.sqrt(np.einsum("ni,ni->n", v, v))
    change = np.einsum("ni,ni->n", v, dv) / np.where(norm > NO_SPEED, norm, np.inf)
    return norm, change
