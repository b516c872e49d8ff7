"""Colours, sizes and thinning that the panels share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from viapoint.runtime.records import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS: Final = ("#2f6db3", "#e8772e", "#3a9d5d", "#c8374a", "#7a5bb5", "#2aa0a8", "#8c6d46", "#b5a400")
INK, FAINT, LIMIT, SHADE = "#22303c", "#8794a0", "#c8374a", "#eef2f6"
ON, OFF = "#3a9d5d", "#d9dfe5"
DASHED: Final = (0, (5, 3))
POINTS: Final = 3000
"""Per curve; more than a screen has columns."""

RC: Final[dict[Any, Any]] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e9ee",
    "grid.linewidth": 0.6,
    "svg.hashsalt": "viapoint",
}


def colour(index: int) -> str:
    """Of an axis, by its index."""
    return COLOURS[index % len(COLOURS)]


def envelope(values: Floats) -> Any:
    """Rows to draw: all, or of each of many bins the lowest and the highest, so that no peak gets lost."""
    count = len(values)
    if count <= POINTS:
        return np.arange(count)
    size = -(-2 * count // POINTS)
    whole = count // size * size
    bins = values[:whole].reshape(-1, size)
    starts = np.arange(len(bins)) * size
    rows = np.concatenate((starts + bins.argmin(axis=1), starts + bins.argmax(axis=1), [0, count - 1]))
    return np.unique(rows)


def limit_line(panel: Axes, value: float) -> None:
    """A limit that holds everywhere."""
    panel.axhline(value, color=LIMIT, linewidth=1.0, linestyle=DASHED)
