"""Where a tool's point and a workpiece's frame are, from poses in which the robot touched something. Pure.

A tool is found from one fixed point touched in several orientations, a frame from three points touched with a
known tool. What does not determine the answer is refused: an answer is as good as its measurements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime.records import Floats
from viapoint.runtime.rotations import make_pose

FEWEST: Final = 4
"""Poses for a tool. Three in different orientations determine it; the fourth shows how well."""

_LEAST_SPREAD: Final = np.sin(5.0 * DEG)
"""How far an axis of the flange must swing, root mean square: errors of touching count about 1 ÷ spread."""

_NOT_A_ROTATION: Final = 1e-6

_LEAST_SIDE: Final = 1.0 * MM
"""Points nearer to each other are the same: touching by hand is no better."""

_LEAST_ANGLE: Final = 1.0 * DEG
"""A third point nearer to the line through the others determines no plane."""


class CalibrationError(ValueError):
    """Measurements that do not determine what is to be found; the sentence says why, and what to do."""


@dataclass(frozen=True, slots=True, eq=False)
class ToolCalibration:
    """A tool's point `xyz` (3,) m in the flange frame, and the point touched (3,) m in the base.

    `residuals` (n,) m: how far the tool's point is from the point touched, pose by pose. `uncertainty` (3,)
    m: one standard deviation of `xyz`, if the residuals are errors of touching by chance.
    """

    xyz: Floats
    point: Floats
    residuals: Floats
    uncertainty: Floats

    @property
    def largest(self) -> float:
        """The largest residual, m."""
        return float(self.residuals.max())

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, m."""
        return float(np.sqrt(np.mean(self.residuals**2)))


def calibrate_tool(flanges: Sequence[Floats] | Floats) -> ToolCalibration:
    """The point of a tool that touched one fixed point in flange poses X_base_flange (n, 4, 4), n ≥ 4.

    Least squares of R_i·t + p_i = c over t and c: F 10-2 and 10-11, with the orientations besides the
    positions, so that no size is left open. Raises CalibrationError.
    """
    X = np.asarray(flanges, dtype=np.float64)
    if X.ndim != 3 or X.shape[1:] != (4, 4) or not np.isfinite(X).all():
        raise CalibrationError("flange poses are matrices of 4 by 4 finite numbers")
    if len(X) < FEWEST:
        raise CalibrationError(f"a tool takes at least {FEWEST} poses, {len(X)} are given")
    R, p = X[:, :3, :3], X[:, :3, 3]
    if np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() > _NOT_A_ROTATION:
        raise CalibrationError("the orientation of a flange pose is no rotation")
    _require_spread(R)
    columns = np.concatenate((R, np.broadcast_to(-np.eye(3), R.shape)), axis=2).reshape(-1, 6)
    solution: Floats = np.linalg.lstsq(columns, -p.reshape(-1), rcond=None)[0].astype(np.float64)
    errors = columns @ solution + p.reshape(-1)
    variance = float(errors @ errors) / (len(errors) - 6)
    covariance = variance * np.linalg.inv(columns.T @ columns)
    return ToolCalibration(
        xyz=solution[:3],
        point=solution[3:],
        residuals=np.linalg.norm(errors.reshape(-1, 3), axis=1),
        uncertainty=np.sqrt(np.diag(covariance)[:3]),
    )


def _require_spread(R: Floats) -> None:
    """Raises where a direction in the flange points the same way in all poses: along it nothing is known."""
    mean = R.mean(axis=0)
    swings, directions = np.linalg.eigh(np.eye(3) - mean.T @ mean)  # of each direction, mean square sine
    if np.sqrt(max(float(swings[-1]), 0.0)) < _LEAST_SPREAD:
        raise CalibrationError(
            "the poses have all but one orientation: turn the tool about the point it touches"
        )
    if np.sqrt(max(float(swings[0]), 0.0)) < _LEAST_SPREAD:
        x, y, z = directions[:, 0] * np.sign(directions[np.abs(directions[:, 0]).argmax(), 0]) + 0.0
        raise CalibrationError(
            "the poses turn the flange about one axis only, "
            f"({x:.2f}, {y:.2f}, {z:.2f}) of its own: tilt the tool about another one too"
        )


def calibrate_frame(points: Sequence[Floats] | Floats, *, two_on_x: bool = False) -> Floats:
    """X_base_frame (4, 4) of a frame from three TCP positions (3, 3) m in the base.

    They are its origin, a point on its +X axis, and one in its X-Y plane on the +Y side. With `two_on_x` they
    are two points on X, in its sense, and one on +Y: the origin is then the foot of the third on the first
    two (F 10-22 … 10-27). Raises CalibrationError.
    """
    P = np.asarray(points, dtype=np.float64)
    if P.shape != (3, 3) or not np.isfinite(P).all():
        raise CalibrationError("a frame takes three points of three finite numbers")
    for i, j in ((0, 1), (0, 2), (1, 2)):
        apart = float(np.linalg.norm(P[j] - P[i]))
        if apart < _LEAST_SIDE:
            raise CalibrationError(
                f"points {i + 1} and {j + 1} are {apart / MM:.3f} mm apart: touch two places"
            )
    along = P[1] - P[0]
    x = along / np.linalg.norm(along)
    foot = P[0] + ((P[2] - P[0]) @ x) * x
    aside = P[2] - foot
    height = float(np.linalg.norm(aside))
    if height < np.sin(_LEAST_ANGLE) * float(np.linalg.norm(P[2] - P[0])):
        raise CalibrationError(
            f"point 3 is only {height / MM:.3f} mm beside the line through points 1 and 2: "
            "touch one farther away from it"
        )
    y = aside / height
    return make_pose(foot if two_on_x else P[0], np.column_stack((x, y, np.cross(x, y))))
