"""Catalogue entries of planning: geometry, reach, configuration, workspace (E3xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

_ROBOT: Final = '[robot]\nmodel = "frigeni6"\n'

_POST: Final = """[[zones]]
name = "post"
corner_1 = [1400, -100, 0]
corner_2 = [1600, 100, 1600]
"""

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
        "joints cannot follow the path",
        """A path goes through singular poses, and past them however closely. But here no joints follow it
        continuously: it meets two singularities at once, with the wrist on the axis of J1 and J4 and J6 in
        line, or it would have to turn about a joint that is not free. Pass such a pose with MJ, or lead the
        path around it. A jog that is held keeps its configuration and stops next to any singular pose; jog
        single joints past it.""",
        "MJ J2=30 J3=-165.1631 F50\nML Y=200 F100\n",
    ),
    entry(
        "E305",
        "path does not lead into the joint move",
        """A path motion passes smoothly into a joint move, and on its way it goes around a singular pose on
        the other side than the motion as programmed, without its round edges and its neighbours, would. J4
        and J6 then arrive turned against where the joint move sets out. Where that is possible the robot
        stops before the joint move, and no program is known in which that is not enough: please report one.
        Let the robot stop in between, with WAIT 0.""",
    ),
    entry(
        "E306",
        "three points that define no circle",
        """MC runs on the circle through its start, Q and its target. Points on one line, or two of them in
        the same place, have no such circle. Move Q off the line between start and target; for a full circle
        program H and a target elsewhere on it.""",
        "HOME F50\nMC X=1755 Y=200 Z=2660 QX=1755 QY=100 QZ=2660 F100\n",
    ),
    entry(
        "E307",
        "auxiliary axis leaves its range",
        """An auxiliary axis E would move beyond the range that the cell gives it, by the value of the
        statement, of the point, or, on a spline that swings, between them. Correct the value, or the
        range.""",
        Example(
            program="ML X=1700 E1=3500 F100\n",
            cell=f"{_ROBOT}[auxiliary_axes.E1]\nkind = 'linear'\nrange = [0, 3000]\nspeed = 500\n"
            "acceleration = 1000\n",
        ),
    ),
    entry(
        "E308",
        "path without heading",
        """While TANG is on, the tool turns with the heading of the path in the X-Y plane of its frame. Here
        the path runs along Z, where it has none. Switch TANG off for the way up or down, or lead the path a
        little aside.""",
        "MJ X=1400 Y=0 Z=1500 A=0 B=90 C=0 F60\nTANG 1\nML X=1500 F200\nML Z=1400\n",
    ),
    entry(
        "E309",
        "tangential tool winds up",
        """While TANG is on, every turn of the path turns the tool and the wrist once. Along closed contours
        that adds up until a joint would leave its range; the message says after how many turns. Unwind with
        an MJ between two contours, or travel one of them the other way round.""",
        "MJ X=1400 Y=0 Z=1500 A=0 B=90 C=0 F60\nTANG 1\nMC X=1500 Y=100 QX=1450 QY=80 QZ=1500 H1080 F200\n",
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
        """The program writes an output or a variable that the cell does not have, or has of another kind.
        Correct the number, or digital_outputs, analog_outputs or [variables].""",
        "SET DO 99\n",
    ),
    _elsewhere(
        "E315",
        "joint the robot does not have",
        "A J parameter names a joint beyond the robot's last one. Leave it out.",
        "MJ J7=10 F50\n",
    ),
    _elsewhere(
        "E316",
        "auxiliary axis not in this cell",
        "An E parameter names an auxiliary axis that the cell does not have. Add it there, or leave it out.",
        "ML X=1700 E1=100 F100\n",
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
        "E321",
        "action outside its motion",
        """AT names a place that the next motion does not have: it is shorter than that. The length is that
        of the TCP's path as it is run, from the middle of the round edge at its start to the middle of the
        one at its end. A motion that only turns has none: use percent.""",
        "AT D200 SET DO1\nML X=1700 F100\n",
    ),
    entry(
        "E322",
        "conveyor in an interrupt",
        """A subroutine that interrupts the program calls another one that follows a conveyor, or leaves
        one. It begins and ends where the robot has stopped on its path, and cannot couple to a belt. Follow
        the conveyor in the program itself.""",
        Example(
            program="ON DI1 SUB LOST\nWAIT 1\nEND\nLOST:\nSUB FETCH\nEND\n"
            "FETCH:\nTRK 1\nML Y=100 F100\nTRK 0\nEND\n",
            cell=f"{_ROBOT}[[conveyors]]\nindex = 1\ncounts_per_mm = 100\n",
            scenario="[[at]]\nt_s = 0.5\nset = { DI1 = true }\n",
        ),
    ),
    entry(
        "E330",
        "path through a forbidden zone",
        """Somewhere on the motion a link of the robot, or its tool, would be in a forbidden zone of the cell.
        All of the way is looked at, not only its ends, before the robot sets out. The message says which part
        of the robot, where on the way, and how deep. Links are counted from the base and are as thick as
        radius_mm of [body] says; a tool is its capsule, or the line from the flange to the TCP. Lead the path
        around the zone, by more points or by MJ, or correct the zone.""",
        Example(
            program="MJ X=1500 Y=-600 Z=1500 A=0 B=90 C=0 F50\nML Y=600 F200\n",
            cell=_ROBOT + _POST + 'kind = "forbidden"\n',
        ),
    ),
    entry(
        "E331",
        "path out of the safe zones",
        """Where a cell has safe zones, every part of the robot that moves must stay inside of them, links in
        their full thickness. Several safe zones are one room: a part may be in two of them at once where they
        overlap or adjoin. The message says which part leaves, where on the way, and how far. Keep the motion
        inside, or enlarge the zones.""",
        Example(
            program="MJ J2=20 F50\nMJ J1=90\n",
            cell=f"""{_ROBOT}[[zones]]
name = "cage"
kind = "safe"
corner_1 = [-1000, -1500, 0]
corner_2 = [3000, 1500, 3500]
""",
        ),
    ),
    entry(
        "E332",
        "robot runs into itself",
        """On the motion two parts of the robot that are not neighbours would touch: links, or the tool and a
        link. They are as thick as radius_mm of [body], or of the robot's own file, and the tool's capsule
        say. Neighbours are links with a common joint, and those joined by something shorter than they are
        thick. Choose another configuration or another way, or correct the radii.""",
        Example(program="MJ J2=-80 F50\n", cell=_ROBOT),
    ),
    entry(
        "E333",
        "tool axis leaves its cone",
        """The X axis of the tool must stay within half_angle_deg of the axis of [orientation_cone]; turning
        about itself does no harm. On the motion it would lean farther. Keep the tool upright on the way, go
        with ML instead of MJ, or widen the cone.""",
        Example(
            program="MJ J5=40 F50\n",
            cell="""[robot]
model = "frigeni6"
home = [0, 0, 0, 0, 90, 0]
[orientation_cone]
axis = [0, 0, -1]
half_angle_deg = 30
""",
        ),
    ),
    entry(
        "E390",
        "conveyor tracking on a track",
        """TRK compiles, but this version cannot run it in a cell with an auxiliary axis that carries the
        robot: belt and base would both move. Run the program without the tracked section.""",
        Example(
            program="MJ J5=30 F50\nTRK 1\nML X=1700 F100\nTRK 0\n",
            cell=f"""{_ROBOT}[[conveyors]]
index = 1
counts_per_mm = 100
[auxiliary_axes.E1]
kind = "linear"
carries_robot = true
range = [0, 3000]
speed = 1000
acceleration = 3000
""",
        ),
    ),
    entry(
        "E392",
        "cannot be run yet",
        """The cell or the scenario asks for something that is understood but not there yet. It is refused
        before anything moves, since the run would not be what the file says. Take the key out.""",
        Example(program="MJ J1=10 F20\n", cell=_ROBOT + '[drives]\nkind = "servo"\n'),
    ),
)
