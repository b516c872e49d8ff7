"""Conversions between the units of the edges (mm, deg) and those of the inside (m, rad).

The language, cell files, printed output and the calls of the virtual machine speak mm, deg and s;
the runtime speaks SI and radians. Every conversion goes through the constants below: multiply when
coming in (`300 * MM`), divide when going out (`x / MM`). No arrays here: the constants work on them.
"""

from __future__ import annotations

import math

MM = 1e-3
"""One millimetre in metres."""

DEG = math.pi / 180.0
"""One degree in radians."""


def mm(metres: float) -> float:
    """Metres as millimetres, for output."""
    return metres / MM


def deg(radians: float) -> float:
    """Radians as degrees, for output."""
    return radians / DEG


def metres(millimetres: float) -> float:
    """Millimetres as metres, for input."""
    return millimetres * MM


def radians(degrees: float) -> float:
    """Degrees as radians, for input."""
    return degrees * DEG
