"""Tangential tool: an orientation that turns about the frame's Z as the path does, seen on its X-Y plane.

A pose's rotation about Z, its C, is taken off; A and B stay as programmed and go on along the motion as
any orientation does (the base turn). On top of it the tool is turned by the heading of the path and the
offset. Where the heading has no constant rate the turn is kept as quintics between keys on the curve:
continuous to the second derivative, and within 1e-6 rad of the heading.
Not here: where the path stops for the tool to be aligned (chain).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from viapoint.runtime.path.curves import Arc, Curve, Straight
from viapoint.runtime.path.errors import GeometryError
from viapoint.runtime.path.moves import Floats, Move, Pose, Tangential
from viapoint.runtime.path.rates import cross, exponential, norm, product, rotation_from
from viapoint.runtime.path.turns import STILL, Key, Turn, UniformTurn, turn_through
from viapoint.runtime.rotations import GIMBAL_LOCK, abc_to_matrix, matrix_to_abc, matrix_to_quaternion

# Sine of the angle to the frame's Z below which a path has no heading: 0.1°.
UPRIGHT = math.radians(0.1)
# Intervals of a turn that follows a curve: doubled until it is as near to the heading as NEAR (rad).
FEWEST, MOST = 4, 4096
NEAR = 1e-6
# Intervals over a round edge. In the first and the last the turn passes from the neighbour's change of rate
# to the edge's own, which differ: position is C² there and no more, so the heading is only C¹.
ON_AN_EDGE = 8
# Part of a curve over which its third derivative is differenced.
STEP = 1e-4


@dataclass(frozen=True, slots=True)
class Heading:
    """ψ and its first two derivatives by w, (N,) each; ψ without jumps."""

    angle: Floats
    rate: Floats
    change: Floats


def without_heading(quaternion: Floats, how: Tangential) -> Floats:
    """The orientation (4,) in the base with its C in the frame made zero.

    Where B is ±90°, A and C turn about one axis: then the whole of it is taken for C.
    """
    R_base_frame = how.R_base_frame
    R = R_base_frame.T @ _matrix(quaternion)
    a, b, _ = matrix_to_abc(R)
    locked = math.cos(b) < GIMBAL_LOCK
    R_plain = abc_to_matrix(np.array((0.0 if locked else a, b, 0.0)))
    return np.asarray(matrix_to_quaternion(R_base_frame @ R_plain))


def tangential_move(move: Move, start: Floats, how: Tangential) -> Move:
    """A move with its orientations freed of their heading; `start` (4,) is that programmed for its start."""

    def freed(pose: Pose, quaternion: Floats | None) -> Pose:
        return pose if quaternion is None else Pose(pose.position, without_heading(quaternion, how))

    return replace(
        move,
        start=freed(move.start, start),
        target=freed(move.target, move.target.quaternion),
        via=None if move.via is None else freed(move.via, move.via.quaternion),
        tangential=how,
    )


def aligned_turn(curve: Curve, base: Turn, how: Tangential) -> Turn:
    """The base turn, turned on by the heading of the curve and the offset.

    Raises GeometryError E308 where the curve runs along the frame's Z.
    """
    z, length = how.R_base_frame[:, 2], curve.length
    at = _heading(curve, np.array([0.0]), how)
    even = isinstance(curve, Straight) or (isinstance(curve, Arc) and _level(curve, z) and _rests(base))
    if even and isinstance(base, UniformTurn):
        about_z = exponential(z * float(at.angle[0] + how.offset))
        rate = float(at.rate[0]) * z
        rate = rate + _rotated(about_z, base.rate)
        return UniformTurn(product(about_z, base.start), rate)
    count = FEWEST
    while True:
        turn = turn_through(_linked(_keys(curve, base, how, count)))
        between = np.linspace(0.0, length, 2 * count + 1)[1::2]
        if count >= MOST or _off(turn, curve, base, how, between) < NEAR:
            return turn
        count *= 2


def turned_by(angle: float, base: Turn, how: Tangential) -> Turn:
    """The base turn, turned on by one constant angle about Z: where a motion has no heading of its own."""
    about_z = exponential(how.R_base_frame[:, 2] * angle)
    if isinstance(base, UniformTurn):
        return UniformTurn(product(about_z, base.start), _rotated(about_z, base.rate))
    keys = []
    for w in base.knots:
        q, rate, change = base.derivatives(float(w))
        keys.append(Key(float(w), product(about_z, q), _rotated(about_z, rate), _rotated(about_z, change)))
    return turn_through(_linked(keys))


def edge_turn(curve: Curve, base: Turn, how: Tangential, left: Key, right: Key) -> Turn:
    """The turn over a round edge whose ends are those of its neighbours, with their rates."""
    keys = _keys(curve, base, how, ON_AN_EDGE)
    return turn_through(_linked([left, *keys[1:-1], right]))


def heading_of(quaternion: Floats, base: Floats, how: Tangential) -> float:
    """The angle about Z by which an orientation (4,) is turned from a base orientation (4,)."""
    return float(rotation_from(base, quaternion) @ how.R_base_frame[:, 2])


def _keys(curve: Curve, base: Turn, how: Tangential, count: int) -> list[Key]:
    w = np.linspace(0.0, curve.length, count + 1)
    heading, z = _heading(curve, w, how), how.R_base_frame[:, 2]
    keys = []
    for k, at in enumerate(w):
        q, rate, change = base.derivatives(float(at))
        about_z = exponential(z * float(heading.angle[k] + how.offset))
        rate, change = _rotated(about_z, rate), _rotated(about_z, change)
        first, second = float(heading.rate[k]), float(heading.change[k])
        keys.append(
            Key(
                float(at),
                product(about_z, q),
                first * z + rate,
                second * z + first * cross(z, rate) + change,
            )
        )
    return keys


def _linked(keys: list[Key]) -> list[Key]:
    """Keys with what turns each into the next, less than half a turn."""
    linked = [
        Key(a.w, a.quaternion, a.rate, a.rate_change, rotation_from(a.quaternion, b.quaternion))
        for a, b in pairwise(keys)
    ]
    return [*linked, keys[-1]]


def _heading(curve: Curve, w: Floats, how: Tangential) -> Heading:
    R = how.R_base_frame
    v, a = curve.velocities(w) @ R, curve.accelerations(w) @ R
    step = STEP * curve.length
    j = (curve.accelerations(w + step) - curve.accelerations(w - step)) @ R / (2.0 * step)
    flat = v[:, 0] ** 2 + v[:, 1] ** 2
    if (flat <= UPRIGHT**2 * np.einsum("ni,ni->n", v, v)).any():
        raise GeometryError("E308", "the path runs along the Z axis of its frame, where it has no heading")
    turning = v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0]
    rate = turning / flat
    change = (v[:, 0] * j[:, 1] - v[:, 1] * j[:, 0]) / flat
    change -= 2.0 * rate * (v[:, 0] * a[:, 0] + v[:, 1] * a[:, 1]) / flat
    return Heading(np.unwrap(np.arctan2(v[:, 1], v[:, 0])), rate, change)


def _off(turn: Turn, curve: Curve, base: Turn, how: Tangential, w: Floats) -> float:
    """Largest angle between a turn and what it stands for, at w (N,)."""
    heading, z = _heading(curve, w, how), how.R_base_frame[:, 2]
    made, plain = turn.quaternions(w), base.quaternions(w)
    worst = 0.0
    for k, angle in enumerate(heading.angle):
        wanted = product(exponential(z * float(angle + how.offset)), plain[k])
        worst = max(worst, norm(rotation_from(wanted, made[k])))
    return worst


def _level(arc: Arc, z: Floats) -> bool:
    """The arc lies in a plane square to z: its heading turns evenly."""
    return max(abs(float(arc.u @ z)), abs(float(arc.v @ z))) < STILL


def _rests(base: Turn) -> bool:
    return isinstance(base, UniformTurn) and norm(base.rate) < STILL


def _rotated(q: Floats, v: Floats) -> Floats:
    """v (3,) turned by q (4,)."""
    side = 2.0 * cross(q[1:], v)
    turned: Floats = v + q[0] * side + cross(q[1:], side)
    return turned


def _matrix(quaternion: Floats) -> Floats:
    w, x, y, z = quaternion.tolist()
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )
