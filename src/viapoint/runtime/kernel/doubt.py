"""Round edges beside singular poses: where rounding may lead a path around one on another side."""

from __future__ import annotations

from typing import Final

import numpy as np

from viapoint.language.units import MM
from viapoint.runtime.path import Move, MoveKind
from viapoint.runtime.records import Floats
from viapoint.runtime.robots import Robot

_SHARES: Final = np.linspace(0.0, 1.0, 25)
"""Samples on a joint move whose ends are looked at."""

_EDGE_REACH: Final = 1.5
"""Round edges are looked for singular poses over so many R."""

_SPLINE_SWING: Final = 0.3
"""Share of its chord by which a spline may swing out: its inner control points lie a third of it from its
ends in any direction, and have at most 4/9 of the weight each."""


def edge_in_doubt(robot: Robot, q_start: Floats, q_target: Floats, edge: float, end: int) -> bool:
    """Whether a round edge of `edge` mm between a joint move (its end 0 or −1) and a path motion may pass a
    singular pose on another side than the motions as programmed.
    """
    if edge == 0.0:
        return False
    q = q_start + _SHARES[:, None] * (q_target - q_start)
    position = robot.fk(q)[:, :3, 3]
    near = np.linalg.norm(position - position[end], axis=1) <= _EDGE_REACH * edge * MM
    return bool(robot.kinematics.clearance(q[near]).min() <= _EDGE_REACH * edge * MM)


def rounding_margin(move: Move, edge: float, tolerance: float) -> float:
    """How far, m, the path may be rounded away from a motion with R of `edge` mm at most."""
    margin = edge * MM + tolerance
    if move.kind is not MoveKind.SPLINE:
        return margin
    return margin + _SPLINE_SWING * float(np.linalg.norm(move.target.position - move.start.position))
