"""Catalogue entries of lint (W5xx) and information (I6xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "W501",
        "line never reached",
        """The line stands behind an END or a GOTO without a count, and no label in front of it lets a jump
        arrive there. It is never executed.""",
        "ML P1 F100\nEND\nML P2\n",
    ),
    entry(
        "W502",
        "running into a subroutine",
        """A label that SUB calls is also reached from the line above. The body then runs in line, and its
        END ends the program, or returns from the subroutine around it. Put END in front of the label if
        that is not meant.""",
        "ML P1 F100\nSUB CUT\nCUT:\nML P2\nEND\n",
    ),
    entry(
        "W503",
        "label never used",
        """No GOTO and no SUB names the label. It does nothing; perhaps a jump was forgotten or has been
        misspelt.""",
        "A:\nML P1 F100\n",
    ),
    entry(
        "W504",
        "no speed programmed",
        """The first motion says no speed, and nothing before it does: it runs at the default speed of the
        cell, which another cell may set differently.""",
        "ML P1\nML P2 F100\n",
    ),
    entry(
        "W505",
        "R without effect",
        """A round edge needs a motion that follows without a stop. Behind this motion the path stops in any
        case: a statement waits or reads the outside world there, the tool changes, or nothing follows.""",
        "ML P1 F100 R10\nWAIT 1\nML P2\n",
    ),
    entry(
        "W506",
        "R between two MS",
        """Consecutive MS form one spline, which passes its points smoothly. A round edge between two of them
        is ignored.""",
        "MS P1 F100 R10\nMS P2\n",
    ),
    entry(
        "W507",
        "endless loop without motion",
        """The GOTO goes back over lines with neither motion nor waiting, and no way leads out: run, it is
        stopped with E401.""",
        "ML P1 F100\nLOOP:\nSET DO 1\nGOTO LOOP\n",
    ),
    entry(
        "W508",
        "two counts at one label",
        """A count starts afresh whenever its label is reached in any other way than by its own jump. Two
        counted GOTOs to one label therefore restart each other, and the outer one never comes to its end.
        Give each its own label.""",
        "A:\nML P1 F100\nGOTO A 2\nGOTO A 3\n",
    ),
    entry(
        "W509",
        "OFF without its ON",
        """OFF names a subroutine that no ON lets interrupt, so it does nothing. The label may be meant to be
        another one.""",
        "ML X=1700 F100\nOFF LOST\nSUB LOST\nEND\nLOST:\nSET DO1\nEND\n",
    ),
    entry(
        "W510",
        "an error that the program handles",
        """The statement cannot be planned, and an ON ERROR that is on there handles the error. Its subroutine
        decides what becomes of it when the robot comes to the place; the check leaves the statement out and
        plans on behind it. If it is not meant to fail, its own code says what is wrong with it.""",
        Example(
            program="MJ J1=10 F50\nON ERROR SUB FAULT\nML X=9000\nMJ J1=0\nEND\nFAULT:\nRESUME NEXT\nEND\n",
            cell='[robot]\nmodel = "frigeni6"\n',
        ),
    ),
    entry(
        "I601",
        "not every way was planned",
        """`check` follows both answers of every read, and plans on from every place the robot may then be in.
        Where that becomes too much (10000 different places to stand at, 20000 motions and actions, or some
        ten times those of a long program, or 10 reads in one place) it plans on no further. A run finds what
        is wrong there, before the robot moves there.""",
        Example(
            program="LOOP:\nMJ J1=10 F50\nMJ J1=0\nWAIT 0.1\nGOTO LOOP 20000\n",
            cell='[robot]\nmodel = "frigeni6"\n',
        ),
    ),
    entry(
        "I602",
        "a stop that costs time",
        """The statement makes the path stop at a corner that it would otherwise pass without a stop, because
        the motion before it has R or leads on tangentially. The time is what braking and setting out again
        lose; a wait comes on top. Move the statement to a place where the path stops anyway if the time is
        needed.""",
        Example(
            program="MJ J1=10 F50\nML X=1700 Y=0 F200 R20\nIF DI1\nSET DO1\nENDIF\nML Y=200\nML Z=2500\n",
            cell='[robot]\nmodel = "frigeni6"\n',
        ),
    ),
    entry(
        "I603",
        "slowed near a singular pose",
        """The path passes close by a singular pose of the robot, where one joint has to turn far for little
        way. It slows down there so that the joint keeps its limits, and speeds up again behind. Lead the path
        past it at a distance, change the orientation a little, or go that way with MJ.""",
        Example(
            program="MJ J4=5 J5=5 F100\nML Z=2200 F300\n",
            cell='[robot]\nmodel = "frigeni6"\n',
        ),
    ),
    entry(
        "I604",
        "planned with the belt standing",
        """A check does not know how the belt will move: it plans a tracked section as if the belt stood
        where it was latched. It then shifts the motions along the belt and says how far it may have
        travelled, and how fast it may run, with all of them within reach and the joint ranges. Zones are
        looked at for the standing belt only, and coupling, which takes time too, is not counted.""",
        Example(
            program="MJ J1=0 F50\nTRK 1\nML Y=100 F200\nTRK 0\n",
            cell='[robot]\nmodel = "frigeni6"\n[[conveyors]]\nindex = 1\ncounts_per_mm = 100\n',
        ),
    ),
)
