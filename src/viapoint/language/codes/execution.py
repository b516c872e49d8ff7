"""Catalogue entries of execution (E4xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

_ROBOT: Final = '[robot]\nmodel = "frigeni6"\n'

_POST: Final = """[[zones]]
name = "post"
kind = "forbidden"
corner_1 = [1700, -100, 0]
corner_2 = [2200, 100, 3000]
"""
_PAIR: Final = """[[robots]]
[robots.robot]
model = "frigeni6"
[[robots]]
[robots.robot]
model = "frigeni6"
zero_frame = { xyz = [6000, 0, 0], abc = [0, 0, 180] }
"""
_LONG_TOOL: Final = """[[tools]]
index = 1
xyz = [400, 0, 0]
capsule = { to = [400, 0, 0], radius = 40 }
"""

ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "E401",
        "endless loop without motion",
        """The program ran a great many instructions without a motion and without anything to wait for, so it
        would never go on. The line is one of the loop. Put a motion, a WAIT or a condition that reads a
        signal into it.""",
        "ML P1 F100\nLOOP:\nSET DO 1\nGOTO LOOP\n",
    ),
    entry(
        "E402",
        "subroutines nested too deep",
        """Subroutines may call subroutines to a depth of 64. A subroutine that calls itself without an end
        is the usual cause.""",
        "SUB A\nEND\nA:\nSUB A\nEND\n",
    ),
    entry(
        "E403",
        "action without its motion",
        """AT names a place on the next motion, and the program ended before there was one. Put the AT in
        front of the motion it belongs to.""",
        "ML X=1700 F100\nAT D20 SET DO1\n",
    ),
    entry(
        "E404",
        "synchronous M on the path",
        """At a place on a motion only what needs no stop can happen, and the cell declares this M function
        synchronous. A program compiled with the cell is told so by E213.""",
        Example(program="AT D20 M5\nML X=1700 F100\n", cell=_ROBOT),
    ),
    entry(
        "E405",
        "action before its motion begins",
        """AT S counts seconds before the end of the motion, and the motion does not take so long at the speed
        at which it is run. Choose a shorter time, a slower motion, or a place in mm or percent.""",
        "AT S-60 SET DO1\nML X=1700 F100\n",
    ),
    entry(
        "E410",
        "wait that nothing can end",
        """The program waits for a signal, for the reset of an M flag, or asks the same question in a loop,
        and nothing in the scenario will ever change the answer: the simulation would wait for ever. Add to
        the scenario what the real cell does there, an [[at]] for a time or a [[when]] for an answer to an
        output or an M.""",
        "WAIT DI 1\n",
        "M 5\n",
        "ASK:\nIF DI2\nEND\nENDIF\nGOTO ASK\n",
    ),
    entry(
        "E411",
        "signal not in this cell",
        """The program reads a signal that the cell does not have. Correct the number, or digital_inputs and
        digital_outputs in the cell. A program that was compiled without this cell, or for another one, is
        checked against the cell only when it runs.""",
        Example(program="WAIT DI 99\n", cell=_ROBOT),
        Example(program="ON DI99 SUB LOST\nML X=1700 F100\nEND\nLOST:\nSET DO1\nEND\n", cell=_ROBOT),
        Example(program="IF NOT DO99\nML X=1700 F100\nENDIF\n", cell=_ROBOT),
    ),
    entry(
        "E412",
        "endless loop of motions without length",
        """The program goes round in a loop whose motions all lead to where the robot stands already, so it
        would go round for ever without any time passing. Move somewhere in the loop, wait in it, or give
        the GOTO a count.""",
        "HOME F50\nLOOP:\nML X=1755\nGOTO LOOP\n",
    ),
    entry(
        "E413",
        "decision where no error is handled",
        """RETRY, RESUME NEXT or STOP was reached, and there is no error that it could be about: the
        subroutine that handles errors was called with SUB, or by an interrupt. Let ON ERROR alone run it, or
        ask for ERRNO first, which is 0 then.""",
        "SUB FAULT\nON ERROR SUB FAULT\nML X=1700 F100\nEND\nFAULT:\nRETRY\nEND\n",
    ),
    entry(
        "E414",
        "errors handled without end",
        """ON ERROR has handled a great many errors in one tick, and would go on so for ever: a RETRY of what
        cannot have changed, or a loop of statements that all fail. Wait in the subroutine for what is to
        change, and decide on something else where it does not.""",
        "ON ERROR SUB FAULT\nMJ X=9000 F50\nEND\nFAULT:\nRETRY\nEND\n",
    ),
    entry(
        "E420",
        "in a forbidden zone",
        """A part of the robot is in a forbidden zone: where it stands at the start, with a tool that it picks
        up, or by what was added to its path while it ran. A moving robot is then stopped on its path within
        the limits. Move the robot or the zone; put the tool on elsewhere.""",
        Example(program="WAIT 0.1\n", cell=_ROBOT + _POST),
        Example(program="WAIT 0.1\nT 1\n", cell=f"{_ROBOT}{_LONG_TOOL}{_POST.replace('1700', '2000')}"),
    ),
    entry(
        "E421",
        "outside the safe zones",
        """A part of the robot is outside the safe zones: where it stands at the start, with a tool that it
        picks up, or by what was added to its path while it ran. A moving robot is then stopped on its path
        within the limits. All parts that move count, in their full thickness. Move the robot, or enlarge
        the zones.""",
        Example(
            program="WAIT 0.1\n",
            cell=f"""{_ROBOT}[[zones]]
name = "cage"
kind = "safe"
corner_1 = [-1000, -1000, 0]
corner_2 = [1500, 1000, 3500]
""",
        ),
    ),
    entry(
        "E422",
        "robot touches itself",
        """Two parts of the robot that are not neighbours touch: as it stands at the start, with a tool it
        picks up, or by what was added to its path while it ran. A moving robot is then stopped on its path
        within the limits. Correct the home position, the tool's capsule, or the radii of [body].""",
        Example(program="WAIT 0.1\n", cell='[robot]\nmodel = "frigeni6"\nhome = [0, -80, 0, 0, 0, 0]\n'),
    ),
    entry(
        "E423",
        "tool axis outside its cone",
        """The X axis of the tool is outside [orientation_cone]: as the robot stands at the start, with a tool
        that it picks up, or by what was added to its path while it ran. A moving robot is then stopped on
        its path within the limits. Give the cell a home position in which the tool points into the cone.""",
        Example(
            program="WAIT 0.1\n",
            cell=f"{_ROBOT}[orientation_cone]\naxis = [0, 0, -1]\nhalf_angle_deg = 30\n",
        ),
    ),
    entry(
        "E430",
        "correction out of reach",
        """What is added to the path while it runs (a correction of the scenario, a sensor) would take the TCP
        where the robot does not reach, or a joint out of its range. The path cannot be held there: every
        axis brakes by itself within its limits, and the run ends. Limit the correction, or keep the path
        further inside.""",
        Example(
            program="WAIT 5\n",
            cell=f"{_ROBOT}home = [0, 0, 60, 0, 30, 0]\n",
            scenario='[[correction]]\nframe = "base"\nx_mm = [[0, 0], [5, -400]]\nmax_rate_mm_s = 100\n',
        ),
    ),
    entry(
        "E431",
        "correction too fast for a joint",
        """Path and correction together ask more of a joint than its limit of speed, acceleration or jerk.
        Every axis brakes by itself within its limits, and the run ends. Lower the correction's max_rate_mm_s,
        raise controller.tracking_reserve, which keeps a share of the limits free for what is added to the
        path, or keep away from singular poses, beside which small displacements turn joints far.""",
        Example(
            program="WAIT 2\n",
            cell=_ROBOT,
            scenario='[[correction]]\nframe = "base"\ny_mm = [[0, 0], [1, 50]]\nmax_rate_mm_s = 50\n',
        ),
    ),
    entry(
        "E432",
        "sensor without an answer",
        """A sensor given to the session must answer three finite numbers, an offset in metres. It answered
        something else. Every axis brakes by itself within its limits, and the run ends.""",
    ),
    entry(
        "E440",
        "belt leads out of reach",
        """Following a conveyor the robot would leave its reach, or a joint its range: when it has coupled, or
        later. Before coupling nothing has moved; later every axis brakes by itself within its limits. The
        message has the place of the belt. Begin or end the tracked section earlier, or work further in.""",
        Example(
            program="TRK 1\nWAIT 20\nTRK 0\n",
            cell=f"{_ROBOT}home = [0, 0, 60, 0, 30, 0]\n[[conveyors]]\nindex = 1\ncounts_per_mm = 100\n",
            scenario="[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, -100]]\n",
        ),
    ),
    entry(
        "E441",
        "belt too fast for a joint",
        """The belt, with the motion programmed on it, asks more of a joint than its limits allow. Slow
        belt or motion down, raise controller.tracking_reserve, or work where the joints turn less.""",
        Example(
            program="MJ J2=20 J5=30 F50\nTRK 1\nTRK 0\n",
            cell=_ROBOT + "[[conveyors]]\nindex = 1\ncounts_per_mm = 100\n",
            scenario="[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, 9000]]\n",
        ),
    ),
    entry(
        "E442",
        "belt left behind",
        """The robot, coupled to a conveyor, came further away from it than its max_lag_mm allows: the belt
        changes its speed faster than the reserve of the limits lets the robot follow. Every axis brakes by
        itself within its limits. Let the belt change its speed more slowly, raise
        controller.tracking_reserve or max_lag_mm.""",
        Example(
            program="MJ J2=20 J5=30 F50\nTRK 1\nWAIT 3\nTRK 0\n",
            cell=_ROBOT + "[[conveyors]]\nindex = 1\ncounts_per_mm = 100\n",
            scenario="[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, 0], [2.5, 0], [2.51, 200]]\n",
        ),
    ),
    entry(
        "E450",
        "robots that wait for each other",
        """Several robots of a cell wait, each for something that only another one of them could bring: a
        signal, the reset of an M flag, an exclusive zone. The message names all of them with their lines. Let
        one of them give first what the others wait for, take zones in the same order everywhere, or add the
        missing answer to the scenario.""",
        Example(program="WAIT DI 1\n", cell=_PAIR),
    ),
    entry(
        "E451",
        "robots that would touch",
        """The bodies of two robots of a cell touch, or would within the time that they need to stop. Both are
        stopped on their paths within the limits. Let one of them wait for the other: by an exclusive zone, a
        signal, or an M function that both raise.""",
        Example(program="WAIT 0.1\n", cell=_PAIR.replace("6000", "2000")),
    ),
    entry(
        "E452",
        "two robots start in one zone",
        """Two robots of a cell stand in the same exclusive zone when the run begins. Give one of them a home
        position outside, or make the zone smaller.""",
        Example(
            program="WAIT 0.1\n",
            cell=f"""{_PAIR}[[zones]]
name = "everywhere"
kind = "exclusive"
corner_1 = [-9000, -9000, -9000]
corner_2 = [9000, 9000, 9000]
""",
        ),
    ),
    entry(
        "E490",
        "set point that is no number",
        """A set point came out infinite or undefined and was held back: the drives never get one. No program
        and no cell is known that leads there; the check is the last door before the drives. If you meet it,
        please report the program and the cell.""",
    ),
)
