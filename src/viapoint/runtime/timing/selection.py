"""Which rows a solve needs. Most axes stay far below their limits all along a section: their rows only cost.

Left out are the rows of an axis that, at the solver's start, nowhere come near the largest row beside them
(where that is over its limit) or the limit. After a solve every row is looked at, and those that were
missed are taken in. Acceleration and jerk of an axis are chosen apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from viapoint.runtime.records import Bools, Floats
from viapoint.runtime.timing.rows import Problem

_NEAR: Final = 0.5
"""Part of the largest row, or of the limit, from which on an axis's rows are taken."""

_MISSED: Final = 1.003
"""Ratio from which on a row that was left out is violated; FEASIBLE of the solver, for the same reason."""

_TAKEN_TOO: Final = 0.9
"""Ratio from which on rows are taken in when others were missed."""


@dataclass(frozen=True, slots=True)
class Selection:
    """The axes whose acceleration and whose jerk rows a solve is given, (m,) each."""

    acceleration: Bools
    jerk: Bools


def select(used: tuple[Floats, Floats]) -> Selection:
    """The rows needed from a start with this `usage` on."""
    acceleration, jerk = used
    return Selection(_near(acceleration), _near(jerk))


def missed(used: tuple[Floats, Floats], given: Selection) -> Selection | None:
    """From the `usage` of a solution of the rows `given`: those that it should have been given; None if it
    keeps all."""
    acceleration, jerk = (x.max(axis=1, initial=0.0) for x in used)
    if not ((acceleration > _MISSED) & ~given.acceleration | (jerk > _MISSED) & ~given.jerk).any():
        return None
    return Selection(given.acceleration | (acceleration > _TAKEN_TOO), given.jerk | (jerk > _TAKEN_TOO))


def cut(p: Problem, to: Selection) -> Problem:
    """The problem with the selected rows, and the bounds of x and c."""
    if to.acceleration.all() and to.jerk.all():
        return p
    knots, pieces = np.append(to.acceleration, True), np.tile(to.jerk, 2)
    return replace(
        p,
        lo=p.lo[knots],
        hi=p.hi[knots],
        above=p.above[knots],
        below=p.below[knots],
        jm=p.jm[pieces],
        j0=p.j0[pieces],
        jp=p.jp[pieces],
    )


def usage(p: Problem, c: Floats) -> tuple[Floats, Floats]:
    """Ratios of acceleration (m, n+1) and jerk (m, n) to their limits at c, as the solver sees them."""
    m = len(p.jm) // 2
    before, behind = np.append(0.0, c), np.append(c, 0.0)
    y = p.lo[:m] * before + p.hi[:m] * behind
    j = np.abs(p.jm * before[:-1] + p.j0 * c + p.jp * behind[1:])
    return np.maximum(y / p.above[:m], -y / p.below[:m]), np.maximum(j[:m], j[m:]) * np.sqrt(c)


def _near(ratio: Floats) -> Bools:
    largest = np.maximum(ratio.max(axis=0, initial=0.0), 1.0)
    near: Bools = (ratio >= _NEAR * largest).any(axis=1)
    return near
