"""The rules of a workspace and how far a robot is from breaking them: zones, its own body, the tool's cone.

Stateless: joints in, clearances out. Clearances are signed and change by no more than the robot moves, so
that one of them vouches for all that is near; `viapoint.runtime.workspace.watch` makes use of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, unique
from typing import Any, Final, assert_never

import numpy as np

from viapoint.language.units import DEG, MM
from viapoint.runtime import core
from viapoint.runtime.cell import Cell, Tool
from viapoint.runtime.memo import Memo
from viapoint.runtime.records import Floats
from viapoint.runtime.workspace.body import Body, body_of
from viapoint.runtime.workspace.boxes import Union, boxes_of
from viapoint.runtime.workspace.distances import segment_segment

TOUCH: Final = 1e-7
"""m (or its like in angle). Touching is allowed; joints kept as polynomials place a link to 1e-10 m."""

CONE_RADIUS: Final = 0.5
"""m per rad: an angle is counted as the way of a point so far from its vertex."""

_SLOWEST: Final = 1e3
"""Scales are no larger than this; a clearance that nothing changes stays a number."""

UNLIMITED: Final = 1e9
"""m: the clearance of a robot without rules."""


@unique
class Rule(Enum):
    """What may be broken."""

    FORBIDDEN = "forbidden zone"
    SAFE = "safe zones"
    SELF = "own body"
    CONE = "orientation cone"


@dataclass(frozen=True, slots=True)
class Violation:
    """A rule broken in row `row` of the joints asked about, by `part`, with its zone or the other part.

    `depth`: how far it is beyond, m (rad for the cone). `column`: of the clearances.
    """

    row: int
    rule: Rule
    part: str
    other: str
    depth: float
    column: int

    @property
    def extent(self) -> str:
        """The depth in words."""
        if self.rule is Rule.CONE:
            return f"{self.depth / DEG:.2f} deg"
        return f"{self.depth / MM:.1f} mm"

    def __str__(self) -> str:
        match self.rule:
            case Rule.FORBIDDEN:
                return f"{self.part} enters the forbidden zone {self.other}"
            case Rule.SAFE:
                zones = "zone" if "," not in self.other else "zones"
                return f"{self.part} leaves the safe {zones} {self.other}"
            case Rule.SELF:
                return f"{self.part} runs into {self.other} of the robot itself"
            case Rule.CONE:
                return f"the X axis of {self.part} leaves its cone"
            case _:
                assert_never(self.rule)


@dataclass(frozen=True, slots=True)
class _Term:
    """A column of clearances: the rule, who may break it, and against whom."""

    rule: Rule
    part: str
    other: str


_BODIES: Final[Memo[Body]] = Memo()
"""Robots with tools: every planner has a monitor of its own, and every session its planners."""


class Monitor:
    """The rules of one cell. `active` is False where it has none: then nothing needs to be asked."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._forbidden = boxes_of(cell, "forbidden")
        self._safe = Union(boxes_of(cell, "safe"))
        self._exclusive = boxes_of(cell, "exclusive")
        self._cone = cell.orientation_cone
        self._bodies: dict[Tool, Body] = {}
        self._scales: dict[int, Floats] = {}
        self._terms: dict[int, tuple[_Term, ...]] = {}
        self._rules: dict[int, Any] = {}
        self.exclusive_zones = self._exclusive.names
        has_body = cell.robot.body_radius is not None and bool((cell.robot.body_radius > 0.0).any())
        self.active = bool(cell.zones) or self._cone is not None or has_body

    def body(self, tool: int) -> Body:
        """The robot's capsules with a tool of the cell."""
        robot, held = self._cell.robot, self._cell.tools[tool]
        if held not in self._bodies:
            self._bodies[held] = _BODIES.get((robot, held), lambda: body_of(robot, held))
        return self._bodies[held]

    def pace(self, tool: int) -> Floats:
        """(n,) m per rad: clearances change by no more than Σ pace·|Δq|."""
        pace = self.body(tool).pace
        return pace if self._cone is None else np.maximum(pace, self._turning)

    @property
    def _turning(self) -> Floats:
        """(n,) m per rad: how the way that stands for the tool's angle grows with the joints."""
        return np.where(self._cell.robot.prismatic, 0.0, CONE_RADIUS)

    def room(self, clearances: Floats, tool: int) -> Floats:
        """(N, K) → (N,) m: Σ pace·|Δq| for which none of the clearances can be used up."""
        least: Floats = (clearances * self._scale(tool)).min(axis=1)
        return least

    def _scale(self, tool: int) -> Floats:
        """(K,) how many times slower than the pace each clearance can change, at least."""
        if tool not in self._scales:
            self._scales[tool] = self._scale_of(self.body(tool), tool)
        return self._scales[tool]

    def _scale_of(self, body: Body, tool: int) -> Floats:
        parts = body.part_pace[body.moving]
        own = [
            np.repeat(parts, len(self._forbidden), axis=0),
            parts if len(self._safe.boxes) else parts[:0],
            body.pair_pace,
            *((self._turning[None],) if self._cone is not None else ()),
        ]
        paces = np.concatenate(own)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = np.where(paces > 0.0, self.pace(tool) / paces, np.inf)
        scale = np.minimum(ratios.min(axis=1), _SLOWEST)
        return scale if len(scale) else np.ones(1)

    def tcp(self, q: Floats, tool: int) -> Floats:
        """TCP position (3,) in the base at joints (n,)."""
        X: Floats = self._cell.robot.fk(q) @ self._cell.tools[tool].X_flange_tool
        return X[:3, 3]

    def clearances(self, joints: Floats, tool: int) -> tuple[Floats, Floats]:
        """Joints (N, n) → clearances (N, K) of every rule, and (N, E) of every exclusive zone; m.

        Negative where a rule is broken, or a part is in the exclusive zone; which rule is `_terms[K]`.
        """
        rules = self.rules(tool)
        if rules is not None:
            found: tuple[Floats, Floats] = rules.clearances(joints)
            return found
        body = self.body(tool)
        points = body.points(joints)
        start, end = points[:, :-1], points[:, 1:]
        moving = body.moving
        columns = []
        if len(self._forbidden):
            radius = np.broadcast_to(body.radius[moving], (len(joints), len(moving)))
            gaps = self._forbidden.clearance(start[:, moving], end[:, moving], radius)
            columns.append(gaps.reshape(len(joints), -1))
        if len(self._safe.boxes):
            radius = np.tile(body.radius[moving], len(joints))
            a, b = start[:, moving].reshape(-1, 3), end[:, moving].reshape(-1, 3)
            columns.append(self._safe.clearance(a, b, radius).reshape(len(joints), -1))
        if len(body.pairs):
            i, j = body.pairs.T
            gaps = segment_segment(start[:, i], end[:, i], start[:, j], end[:, j])
            columns.append(gaps - body.radius[i] - body.radius[j])
        if self._cone is not None:
            columns.append(CONE_RADIUS * self._within_cone(body.robot.fk(joints), tool))
        if not columns:
            columns.append(np.full((len(joints), 1), UNLIMITED))
        return np.concatenate(columns, axis=1), self._to_exclusive(start[:, moving], end[:, moving], body)

    def rules(self, tool: int) -> Any | None:
        """The rules as the compiled core wants them; None where it is not in use, or cannot be."""
        module = core.chosen("workspace._core")
        if module is None:
            return None
        if tool not in self._rules:
            body, cone = self.body(tool), None
            if body.chain is None:
                return None
            if self._cone is not None:
                pointing = body.chain.R_base_flange @ self._cell.tools[tool].X_flange_tool[:3, 0]
                cone = self._cone.axis, pointing, self._cone.half_angle
            zones = self._forbidden, self._safe, self._exclusive
            self._rules[tool] = module.Rules(body.chain, body, *zones, cone, self._scale(tool))
        return self._rules[tool]

    def _to_exclusive(self, start: Floats, end: Floats, body: Body) -> Floats:
        """Clearance (N, E) of the nearest part from every exclusive zone."""
        if not len(self._exclusive):
            return np.empty((len(start), 0))
        radius = np.broadcast_to(body.radius[body.moving], start.shape[:2])
        nearest: Floats = self._exclusive.clearance(start, end, radius).min(axis=1)
        return nearest

    def _within_cone(self, X_base_flange: Floats, tool: int) -> Floats:
        """(N, 1) rad between the tool's X axis and the cone's surface, positive inside.

        The axes are compared, not the orientations: a turn about the tool's own axis does no harm. From
        sine and cosine, so that small angles keep their digits.
        """
        assert self._cone is not None, "asked only where there is a cone"
        axis = X_base_flange[:, :3, :3] @ self._cell.tools[tool].X_flange_tool[:3, 0]
        sine = np.linalg.norm(np.cross(axis, self._cone.axis), axis=-1)
        angle = np.arctan2(sine, axis @ self._cone.axis)
        within: Floats = self._cone.half_angle - angle
        return within[:, None]

    def check(self, joints: Floats, tool: int) -> Violation | None:
        """The first of the rows (N, n) that breaks a rule, and the rule it breaks most; None if none does."""
        clearances, _ = self.clearances(joints, tool)
        broken = (clearances < -TOUCH).any(axis=1)
        return self.violation(clearances, int(np.argmax(broken)), tool) if broken.any() else None

    def violation(self, clearances: Floats, row: int, tool: int) -> Violation:
        """The worst that `clearances` (N, K), with that tool, show in a row."""
        column = int(np.argmin(clearances[row]))
        term = self._terms_of(tool)[column]
        scale = CONE_RADIUS if term.rule is Rule.CONE else 1.0
        return Violation(
            row, term.rule, term.part, term.other, -float(clearances[row, column]) / scale, column
        )

    def deepest(self, violation: Violation, joints: Floats, tool: int) -> Violation:
        """The same violation, as deep as it is in the worst of the rows (N, n)."""
        clearances, _ = self.clearances(joints, tool)
        scale = CONE_RADIUS if violation.rule is Rule.CONE else 1.0
        depth = -float(clearances[:, violation.column].min()) / scale
        return replace(violation, depth=max(depth, violation.depth))

    def _terms_of(self, tool: int) -> tuple[_Term, ...]:
        """What the columns of `clearances` are about."""
        if tool not in self._terms:
            body, safe = self.body(tool), ", ".join(self._safe.boxes.names)
            parts = [body.names[k] for k in body.moving]
            self._terms[tool] = (
                *(_Term(Rule.FORBIDDEN, part, zone) for part in parts for zone in self._forbidden.names),
                *(_Term(Rule.SAFE, part, safe) for part in parts if safe),
                *(_Term(Rule.SELF, body.names[j], body.names[i]) for i, j in body.pairs.tolist()),
                *((_Term(Rule.CONE, "the tool", "cone"),) if self._cone is not None else ()),
            )
        return self._terms[tool]
