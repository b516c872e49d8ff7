"""The cell that is used when none is given: `frigeni6` with a table before it, a torch and a few points."""

from __future__ import annotations

from functools import cache

from viapoint.runtime.cell.load import parse_cell
from viapoint.runtime.cell.model import Cell

# P0 is where the robot's flange stands at HOME; the others lie on and above the table, tool down.
_TEXT = """\
[robot]
model = "frigeni6"

[[tools]]
index = 1
name = "torch"
xyz = [380, 0, 0]

[[tools]]
index = 2
name = "gripper"
xyz = [200, 0, 0]

[[frames]]
index = 1
name = "table"
xyz = [1400, -400, 700]

[points]
P0 = { x = 1755, y = 0, z = 2660, a = 0, b = 0, c = 0 }
P1 = { x = 1500, y = -300, z = 1500, a = 0, b = 90, c = 0 }
P2 = { x = 1500, y = 300, z = 1500, a = 0, b = 90, c = 0 }
P3 = { x = 1800, y = 300, z = 1500, a = 0, b = 90, c = 0 }
P4 = { x = 1800, y = -300, z = 1500, a = 0, b = 90, c = 0 }
P5 = { x = 1650, y = 0, z = 1800, a = 0, b = 90, c = 0 }
P6 = { j = [0, 0, 0, 0, 90, 0] }

[[conveyors]]
index = 1
name = "belt"
xyz = [1000, -1500, 500]
abc = [0, 0, 90]
counts_per_mm = 100.0
"""


@cache
def default_cell() -> Cell:
    """`frigeni6` with tools 1 and 2, frame 1, points P0 … P6 and one conveyor."""
    return parse_cell(_TEXT, "<default cell>")
