"""Catalogue entries of planning: geometry, reach, configuration, workspace (E3xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

_ROBOT: Final = '[robot]\nmodel = "frigeni6"\n'

_OTHER_CELL: Final = """A program that was compiled without this cell, or for another one, is checked against
        the cell only when it runs."""


def _elsewhere(code: str, title: str, explanation: str, program: str, cell: str = "") -> Entry:
    """What the compiler already refuses where it knows the cell, found by the planner where it did not."""
    return entry(code, title, f"{explanation} {_OTHER_CELL}", Example(program=program, cell=_ROBOT + cell))


ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "E301",
        "target out of reach",
        """No joint configuration puts the TCP to where the joint move leads: the target is too far away, or
        too close to the robot's own column. Check the point, the frame Z it is meant in, and the tool T,
        whose length counts.""",
        "MJ X=3000 Y=0 Z=1500 A=0 B=90 C=0 F50\n",
    ),
    entry(
        "E302",
        "path leaves the reach",
        """A path move has to pass, or to end in, a pose that the arm cannot take. The message says where. The
        start counts too: a path keeps the configuration in which it begins. Move the target closer, or go
        part of the way with MJ.""",
        "MJ X=1500 Y=0 Z=1500 A=0 B=90 C=0 F50\nML X=3000 F200\n",
    ),
    entry(
        "E303",
        "joint leaves its range",
        """The motion would turn a joint beyond its range, at its end or on the way. A path move keeps its
        configuration and follows the joints continuously, so that wrist and base may wind up although the
        end alone could be reached otherwise. Begin the path in another configuration, with MJ and joint
        references, or unwind with an MJ in between.""",
        "MJ J1=200 F50\n",
        "MJ J1=120 J5=90 F50\nML Y=-900 F200\n",
    ),
    entry(
        "E304",
        "path too close to a singular pose",
        """The path passes a pose where two joint axes line up, or where the wrist stands on the axis of J1,
        not exactly, but so closely that joints would have to turn far within less than a micrometre. Pass
        such a pose with MJ, lead the path around it, or exactly through it.""",
        "MJ J4=0.00001 J5=20 F50\nML X=1700 B=-20 F50\n",
    ),
    entry(
        "E305",
        "round edge into another configuration",
        """A path motion is rounded into a joint move, and the joint move passes a singular pose while it is
        still within the round edge. The edge is a path and keeps its configuration, the joint move does
        not, so the two do not meet. Make R smaller, or leave it out.""",
        "HOME F50\nML X=1700 Y=-100 Z=2600 B=0 R50 F200\nMJ J1=0 J5=20\n",
    ),
    entry(
        "E306",
        "three points that define no circle",
        """MC runs on the circle through its start, Q and its target. Points on one line, or two of them in
        the same place, have no such circle. Move Q off the line between start and target; for a full circle
        program H and a target elsewhere on it.""",
        "HOME F50\nMC X=1755 Y=200 Z=2660 QX=1755 QY=100 QZ=2660 F100\n",
    ),
    _elsewhere(
        "E310",
        "point not in this cell",
        "The motion goes to a point that the cell does not have. Teach it, or name another.",
        "ML P1 F100\n",
    ),
    _elsewhere(
        "E311",
        "joint references for a point taught in joints",
        """J parameters choose among the joint solutions of a pose; a point taught in joint space has none to
        choose from. Leave them out.""",
        "MJ P1 J1=0 F50\n",
        "[points]\nP1 = { j = [10, 0, 0, 0, 0, 0] }\n",
    ),
    _elsewhere(
        "E312",
        "frame not in this cell",
        "The Z of the motion names a frame that the cell does not have. Add it there, or use another.",
        "ML X=100 Z3 F100\n",
    ),
    _elsewhere(
        "E313",
        "tool not in this cell",
        "The program uses a tool that the cell does not have. Add it there, or use another.",
        "T 3\n",
    ),
    _elsewhere(
        "E314",
        "output not in this cell",
        "The program sets an output that the cell does not have. Correct the number, or digital_outputs.",
        "SET DO 99\n",
    ),
    _elsewhere(
        "E315",
        "joint the robot does not have",
        "A J parameter names a joint beyond the robot's last one. Leave it out.",
        "MJ J7=10 F50\n",
    ),
    entry(
        "E320",
        "motion cannot be timed",
        """No speed along the path could be found that keeps every limit at every tick. The message says what
        is missing: usually a speed or a limit of the cell that is so small, or so large, that it means
        nothing. Give the cell the figures of the real robot.""",
        Example(
            program="ML X=1700\n",
            cell=f"{_ROBOT}[controller]\ndefault_speed = {{ path_mm_s = 1e-323 }}\n",
        ),
    ),
    entry(
        "E390",
        "conveyor tracking",
        """TRK compiles, but this version cannot run it: the path would have to follow the belt. Run the
        program without the tracked section.""",
        Example(
            program="MJ J5=30 F50\nTRK 1\nML X=1700 F100\nTRK 0\n",
            cell=f"{_ROBOT}[[conveyors]]\nindex = 1\ncounts_per_mm = 100\n",
        ),
    ),
    entry(
        "E391",
        "tangential control",
        """TANG 1 compiles, but this version cannot run it: the tool would have to turn with the path. Program
        the orientations in the points instead.""",
        "TANG 1\nMC X=1700 Z=2650 QX=1720 QY=0 QZ=2660 F100\nTANG 0\n",
    ),
    entry(
        "E392",
        "cannot be run yet",
        """The cell or the scenario asks for something that is understood but not there yet. It is refused
        before anything moves, since the run would not be what the file says. Take the key out.""",
        Example(program="MJ J1=10 F20\n", cell=_ROBOT + '[controller]\nprofile = "bezier"\n'),
    ),
)
