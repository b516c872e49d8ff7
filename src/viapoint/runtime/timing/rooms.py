"""How fast a curve may be run where nothing but one derivative bounds it: numpy twin of the core."""

from __future__ import annotations

import numpy as np

from viapoint.runtime.records import Floats


def ceilings(
    first: Floats,
    second: Floats,
    third: Floats,
    programmed: Floats,
    speed: Floats,
    acceleration: Floats,
    jerk: Floats,
) -> tuple[Floats, Floats, int]:
    """Bounds of ṡ (N,) by the programmed speed, q′ and q″; of ṡ³ by q‴; the first place that is not finite,
    or −1. Derivatives (N, m), limits (m,).
    """
    finite = np.isfinite(first + second + third).all(axis=1) & (programmed > 0.0)
    bad = -1 if finite.all() else int(np.argmin(finite))
    ceiling = np.minimum(np.minimum(programmed, room(first, speed)), np.sqrt(room(second, acceleration)))
    return ceiling, room(third, jerk), bad


def room(slope: Floats, limit: Floats) -> Floats:
    """Largest r (N,) with |slope|·r ≤ limit for every axis, slope (N, m), limit (m,); inf: nothing moves."""
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = limit / np.abs(slope)
    result: Floats = np.where(np.isnan(quotient), np.inf, quotient).min(axis=1, initial=np.inf)
    return result
