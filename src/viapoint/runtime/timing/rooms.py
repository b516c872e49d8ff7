"""How fast a curve may be run where nothing but one derivative bounds it: numpy twin of the core."""

from __future__ import annotations

import numpy as np

from viapoint.runtime.records import Floats


def room(slope: Floats, limit: Floats) -> Floats:
    """Largest r (N,) with |slope|·r ≤ limit for every axis, slope (N, m), limit (m,); inf: nothing moves."""
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = limit / np.abs(slope)
    result: Floats = np.where(np.isnan(quotient), np.inf, quotient).min(axis=1, initial=np.inf)
    return result
