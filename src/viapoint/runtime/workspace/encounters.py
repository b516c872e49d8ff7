"""Robots of one cell near each other: when their bodies would touch. Pure; no time, only rows of joints.

The bodies are the capsules of `body`, every one of a robot against every one of another, standing links too.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from viapoint.runtime.cell import Cell
from viapoint.runtime.records import Floats
from viapoint.runtime.workspace.body import Body, body_of
from viapoint.runtime.workspace.distances import segment_segment

_TOUCH: Final = 1e-9
"""m. Bodies nearer than this touch."""

_LEAST_TRAVEL: Final = 1e-4
"""m that near robots move between two looks at least; capsules are thicker by orders."""


@dataclass(frozen=True, slots=True)
class Meeting:
    """Two robots (places in the list given) touch in a row, with these parts."""

    row: int
    robots: tuple[int, int]
    parts: tuple[str, str]


class Encounters:
    """Looks at rows of all robots; only robots that have a body count."""

    def __init__(self, cells: Sequence[Cell]) -> None:
        self._cells = cells
        self._bodies: dict[tuple[int, int], Body] = {}
        thick = [_has_body(cell) for cell in cells]
        self._pairs = [
            (i, j) for i, j in itertools.combinations(range(len(cells)), 2) if thick[i] or thick[j]
        ]

    @property
    def active(self) -> bool:
        """Whether there are robots that could meet."""
        return bool(self._pairs)

    def first(self, axes: Sequence[Floats], tools: Sequence[int]) -> Meeting | None:
        """The first row in which two robots touch: per robot its axes (N, n + k) and its tool.

        Between two looks no part can have come nearer than was seen: the result is as if every row were
        looked at, to `_LEAST_TRAVEL`.
        """
        found: Meeting | None = None
        for pair in self._pairs:
            rows = len(axes[0]) if found is None else found.row
            met = self._first_of(pair, [axes[i][:rows] for i in pair], [tools[i] for i in pair])
            found = met or found
        return found

    def _first_of(self, pair: tuple[int, int], axes: list[Floats], tools: list[int]) -> Meeting | None:
        bodies = [self._body(i, tool) for i, tool in zip(pair, tools, strict=True)]
        travels = [self._travel(i, body, a) for i, body, a in zip(pair, bodies, axes, strict=True)]
        travel = travels[0] + travels[1]
        row = 0
        while row < len(travel):
            ends = [self._ends(i, b, a[row : row + 1]) for i, b, a in zip(pair, bodies, axes, strict=True)]
            gaps = _gaps(bodies, ends)
            if (room := float(gaps.min())) < _TOUCH:
                first, second = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
                return Meeting(row, pair, (bodies[0].names[first], bodies[1].names[second]))
            reached = float(travel[row]) + max(room, _LEAST_TRAVEL)
            row = max(row + 1, int(np.searchsorted(travel, reached, side="right")))
        return None

    def _body(self, robot: int, tool: int) -> Body:
        key = robot, tool
        if key not in self._bodies:
            self._bodies[key] = body_of(self._cells[robot].robot, self._cells[robot].tools[tool])
        return self._bodies[key]

    def _travel(self, robot: int, body: Body, axes: Floats) -> Floats:
        """(N,) m that no part of the robot has moved farther than since the first row."""
        pace = np.concatenate((body.pace, self._on_track(robot)))
        steps: Floats = np.abs(np.diff(axes, axis=0, prepend=axes[:1]))
        return np.asarray((steps @ pace).cumsum())

    def _on_track(self, robot: int) -> Floats:
        """(k,) m per m: 1 for the auxiliary axis that carries the robot."""
        axes = self._cells[robot].auxiliary_axes
        return np.array([float(axes[number].carries_robot) for number in sorted(axes)])

    def _ends(self, robot: int, body: Body, axes: Floats) -> Floats:
        """(P + 1, 3) ends of the capsules in the world."""
        cell = self._cells[robot]
        n = cell.robot.joint_count
        points = body.points(axes[:, :n])[0]
        shift = float(axes[0, n:] @ self._on_track(robot))
        points = points + np.array([shift, 0.0, 0.0])
        X = cell.X_world_base
        return np.asarray(points @ X[:3, :3].T + X[:3, 3])


def _has_body(cell: Cell) -> bool:
    radius = cell.robot.body_radius
    return (radius is not None and bool((radius > 0.0).any())) or any(
        tool.capsule is not None for tool in cell.tools.values()
    )


def _gaps(bodies: list[Body], ends: list[Floats]) -> Floats:
    """(P, Q) between the capsules of two robots."""
    (a, b), (p, q) = bodies, ends
    distance = segment_segment(p[:-1, None], p[1:, None], q[None, :-1], q[None, 1:])
    return np.asarray(distance - a.radius[:, None] - b.radius[None, :])
