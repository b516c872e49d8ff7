"""Distance of set points from the path as geometry laid it, by kinematics that are not the kernel's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from programs_at_random import Arm, Floats

from viapoint.runtime.path import Piece
from viapoint.session import Session

LEVER = 0.3
"""m per unit of quaternion difference: how orientation counts in finding the nearest place."""

SAMPLES = 1025
POINTS, SHRINK, ZOOMS = 17, 0.25, 18
"""Closer looks around the nearest sample, to 1e-12 of a piece: Newton's method fails where a spline turns
sharply."""
CANDIDATES = 3
"""Pieces looked at for the nearest place; neighbours have an end in common."""


@dataclass(frozen=True)
class _Laid:
    """A piece and what leads from its TCP to the flange."""

    piece: Piece
    X_tool_flange: Floats

    def places(self, w: Floats) -> Floats:
        """(N, 7): flange position and quaternion, weighted, at w (N,)."""
        position, quaternion = self.piece.poses(np.clip(w, 0.0, self.piece.length))
        turn = pin.SE3ToXYZQUAT(pin.SE3(self.X_tool_flange))
        tool = np.array([turn[6], *turn[3:6]])
        w0, xyz = quaternion[:, :1], quaternion[:, 1:]
        doubled = np.cross(xyz, turn[:3]) + w0 * turn[:3]
        flange = position + turn[:3] + 2.0 * np.cross(xyz, doubled)
        q0 = w0[:, 0] * tool[0] - xyz @ tool[1:]
        q1 = w0 * tool[1:] + tool[0] * xyz + np.cross(xyz, tool[1:])
        return np.concatenate((flange, LEVER * q0[:, None], LEVER * q1), axis=1)


class PathOracle:
    """Listens to the planner of a session; `deviations` compares the joints of another with what was laid."""

    def __init__(self, session: Session) -> None:
        self._laid: list[_Laid] = []
        self._session = session
        self._arm = Arm()
        session.kernel.planner.laid = self._take

    def _take(self, pieces: Sequence[Piece]) -> None:
        kernel = self._session.kernel
        for piece in pieces:
            tool = self._session.cell.tools[kernel.planner.route.tool_of(piece.tag)]
            self._laid.append(_Laid(piece, np.linalg.inv(tool.X_flange_tool)))

    def deviations(self, joints: Floats) -> tuple[float, float]:
        """Largest distance (m) and angle (rad) of the flange at joints (N, 6) from the nearest place laid."""
        asked = np.array([self._flange(q) for q in joints])
        samples = np.stack([p.places(np.linspace(0.0, p.piece.length, SAMPLES)) for p in self._laid])
        gaps = np.stack([_gaps(asked, sample) for sample in samples], axis=1)  # (N, pieces, SAMPLES)
        ranked = np.argsort(gaps.min(axis=2), axis=1)[:, :CANDIDATES]
        best = np.full((len(asked), 2), np.inf)
        for k, laid in enumerate(self._laid):
            rows = np.flatnonzero((ranked == k).any(axis=1))
            if rows.size:
                begin = gaps[rows, k].argmin(axis=1) * laid.piece.length / (SAMPLES - 1)
                found = _nearest(laid, begin, asked[rows])
                better = found @ (1.0, LEVER) < best[rows] @ (1.0, LEVER)
                best[rows[better]] = found[better]
        distance, angle = best.max(axis=0)
        return float(distance), float(angle)

    def _flange(self, q: Floats) -> Floats:
        x, y, z, qx, qy, qz, qw = pin.SE3ToXYZQUAT(pin.SE3(self._arm.flange(q)))
        return np.array([x, y, z, LEVER * qw, LEVER * qx, LEVER * qy, LEVER * qz])


def _gaps(asked: Floats, sample: Floats) -> Floats:
    """(N, M) rough distances; q and −q are one orientation."""
    away = np.square(asked[:, None, :3] - sample[None, :, :3]).sum(axis=2)
    turned = 2.0 * LEVER**2 - 2.0 * np.abs(asked[:, 3:] @ sample[:, 3:].T)
    return np.asarray(away + turned)


def _nearest(laid: _Laid, w: Floats, asked: Floats) -> Floats:
    """(N, 2): distance and angle at the place of a piece nearest to each asked one, from w (N,) on."""
    length, rows = laid.piece.length, np.arange(len(w))
    reach = length / (SAMPLES - 1)
    for _ in range(ZOOMS):
        around = np.clip(w[:, None] + reach * np.linspace(-1.0, 1.0, POINTS), 0.0, length)
        there = _aligned(laid.places(around.ravel()), np.repeat(asked, POINTS, axis=0))
        gaps = np.linalg.norm(there.reshape(len(w), POINTS, 7) - asked[:, None], axis=2)
        w = around[rows, gaps.argmin(axis=1)]
        reach *= SHRINK
    gap = asked - _aligned(laid.places(w), asked)
    distance = np.linalg.norm(gap[:, :3], axis=1)
    return np.stack((distance, 2.0 * np.linalg.norm(gap[:, 3:], axis=1) / LEVER), axis=1)


def _aligned(places: Floats, asked: Floats) -> Floats:
    sign = np.where(np.einsum("ni,ni->n", places[:, 3:], asked[:, 3:]) < 0.0, -1.0, 1.0)
    return np.concatenate((places[:, :3], sign[:, None] * places[:, 3:]), axis=1)
