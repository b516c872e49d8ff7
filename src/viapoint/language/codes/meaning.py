"""Catalogue entries of meaning: names, labels, blocks (E20x to E24x)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

_SHARED = '[robot]\nmodel = "frigeni6"\n\n[variables]\ncount = 0\n'

_NAMED: Final = """[robot]
model = "frigeni6"

[points]
P7 = { name = "pick", x = 1500, y = 0, z = 1500, a = 0, b = 90, c = 0 }

[io]
names = { gripper = "DO1", part_present = "DI3" }
"""

ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "E201",
        "unknown label",
        """GOTO and SUB name a label of the same program. No line declares this one. Labels are compared
        without regard to case.""",
        "LOOP:\nML P1 F100\nGOTO LOPO\n",
    ),
    entry(
        "E202",
        "label declared twice",
        """A jump must have one target, so every label stands once. Rename one of the two; names differing in
        case only are the same.""",
        "A:\nML P1 F100\na:\nGOTO A\n",
    ),
    entry(
        "E203",
        "GOTO with a count goes forward",
        """A count says how often the lines between the label and the GOTO run in all, so the label stands
        above the GOTO. A jump down takes no count.""",
        "GOTO DOWN 3\nML P1 F100\nDOWN:\n",
    ),
    entry(
        "E204",
        "jump into a block",
        """The label stands inside a branch of an IF, and the GOTO or SUB outside of it: the condition would
        be passed by. Jump to a label outside, or move the label.""",
        "GOTO INSIDE\nIF DI1\nINSIDE:\nML P1 F100\nENDIF\n",
    ),
    entry(
        "E205",
        "IF without ENDIF",
        """Every IF is closed by an ENDIF on a line of its own. The place shown is the IF that is still open
        at the end of the program.""",
        "IF DI1\nML P1 F100\n",
    ),
    entry(
        "E206",
        "ELSE or ELSEIF without IF",
        """ELSE and ELSEIF begin a branch of an IF above them. None is open here: the IF is missing, or an
        ENDIF stands too early.""",
        "ELSE\nML P1 F100\n",
    ),
    entry(
        "E207",
        "ENDIF without IF",
        """ENDIF closes an IF above it. None is open here: the IF is missing, or it has been closed
        already.""",
        "ML P1 F100\nENDIF\n",
    ),
    entry(
        "E208",
        "branch behind ELSE",
        """ELSE takes whatever no condition above took, so it is the last branch of its IF and stands once.
        No ELSEIF may follow it.""",
        "IF DI1\nELSE\nELSEIF DI2\nENDIF\n",
    ),
    entry(
        "E209",
        "HOME while tracking",
        """HOME is a joint move to a place in the room; between TRK n and TRK 0 the robot moves with the
        belt. End tracking first.""",
        "MJ P1 F50\nTRK 1\nHOME\nTRK 0\n",
    ),
    entry(
        "E211",
        "joint references on a joint-space point",
        """J parameters beside a point choose one of the joint configurations that reach its pose. A point
        that was taught in joint space has one configuration only: leave the J parameters out.""",
        Example(
            program="MJ P1 J1=90 F50\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E212",
        "name without a cell",
        """Points and signals have their names in the cell file, and variables are declared there. Compiled
        without one, nobody knows what is meant. Compile with --cell, or write the number.""",
        "ML pick F100\n",
    ),
    entry(
        "E213",
        "synchronous M on the path",
        """At a place on a motion only what needs no stop can happen. A synchronous M stops the robot and
        waits for the reset of its flag. Declare it async under [m_functions], or put it behind the
        motion.""",
        Example(
            program="AT D20 M5\nML X=1700 F100\n",
            cell='[robot]\nmodel = "frigeni6"\n',
        ),
    ),
    entry(
        "E214",
        "jump out of a subroutine that interrupts",
        """A subroutine that an ON names runs while the program stands somewhere on its path, and the program
        goes on from there afterwards. It has to come to its END, and so has every subroutine that it calls: a
        GOTO, or the GOTO of a WAIT, that leads out of one would leave that place behind for ever. Set an
        output in it, or an M flag, and let the program ask for that where it can act on it.""",
        "HOME F50\nON DI1 SUB LOST\nML X=1700 F100\nAGAIN:\nML X=1600\nEND\nLOST:\nGOTO AGAIN\nEND\n",
    ),
    entry(
        "E215",
        "conveyor in a subroutine that interrupts",
        """A subroutine that an ON names begins and ends where the robot has stopped on its path. It cannot
        couple to a belt, or leave one. On a belt interrupts wait until the robot has left it.""",
        "ON DI1 SUB LOST\nML X=1700 F100\nEND\nLOST:\nTRK 1\nML X=1600\nTRK 0\nEND\n",
    ),
    entry(
        "E216",
        "decision where no error is handled",
        """RETRY, RESUME NEXT and STOP say what becomes of an error. They stand in the subroutine that an ON
        ERROR names, between its label and its END, and nowhere else; a subroutine that it calls has none.""",
        "ML X=1700 F100\nRETRY\n",
        "ON ERROR SUB FAULT\nML X=1700 F100\nEND\nFAULT:\nSUB HELP\nEND\nHELP:\nRESUME NEXT\nEND\n",
    ),
    entry(
        "E220",
        "undefined point",
        "The cell file has no such point. Teach it, add it under [points], or correct the index.",
        Example(
            program="ML P2 F100\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E221",
        "undefined frame",
        """The cell file has no such frame. Add it under [[frames]] or correct the index; Z0, the robot base,
        always exists.""",
        Example(
            program="ML P1 F100 Z3\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E222",
        "undefined tool",
        """The cell file has no such tool. Add it under [[tools]] or correct the index; 0, no tool, always
        exists.""",
        Example(
            program="T 4\nML P1 F100\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E223",
        "undefined conveyor",
        """The cell file has no such conveyor. Add it under [[conveyors]] or correct the index; TRK 0 ends
        tracking.""",
        Example(
            program="MJ P1 F50\nTRK 2\nTRK 0\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E224",
        "undefined digital input",
        "The cell has fewer digital inputs. Correct the index, or raise digital_inputs under [io].",
        Example(
            program="WAIT DI 9999\nML P1 F100\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E225",
        "undefined digital output",
        "The cell has fewer digital outputs. Correct the index, or raise digital_outputs under [io].",
        Example(
            program="SET DO 9999\nML P1 F100\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E226",
        "joint that the robot does not have",
        "The robot of the cell has fewer joints than this J parameter names.",
        Example(
            program="MJ J9=10 F50\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E227",
        "undefined auxiliary axis",
        "The cell has no such auxiliary axis. Declare it under [auxiliary_axes] or correct the number.",
        Example(
            program="ML P1 E2=100 F50\n",
            cell='[robot]\nmodel = "frigeni6"\n\n[points]\nP1 = { j = [0, 0, 0, 0, 0, 0] }\n',
        ),
    ),
    entry(
        "E228",
        "unknown name of a point",
        """No point of the cell has this name. Points get theirs in the cell file: P7 = { name = "pick", … }.
        Names are compared without regard to case.""",
        Example(program="ML pik F100\n", cell=_NAMED),
    ),
    entry(
        "E229",
        "unknown name of a signal",
        """No signal of the cell has this name. Signals get theirs in the cell file, under [io]:
        names = { gripper = "DO1" }. Names are compared without regard to case.""",
        Example(program="SET griper\n", cell=_NAMED),
    ),
    entry(
        "E230",
        "signal of another kind",
        """The name belongs to a signal that cannot stand here: only outputs are set, only digital ones are
        true or false by themselves, and only analog ones are numbers.""",
        Example(program="SET part_present\n", cell=_NAMED),
    ),
    entry(
        "E231",
        "undefined analog input",
        "The cell has fewer analog inputs. Correct the index, or raise analog_inputs under [io].",
        Example(program="WAIT AI99 > 1\n", cell='[robot]\nmodel = "frigeni6"\n'),
    ),
    entry(
        "E232",
        "undefined analog output",
        "The cell has fewer analog outputs. Correct the index, or raise analog_outputs under [io].",
        Example(program="SET AO99 = 1\n", cell='[robot]\nmodel = "frigeni6"\n'),
    ),
    entry(
        "E233",
        "undeclared variable",
        """A variable that is shared with the application is declared in the cell file, with the value it has
        at first: count = 0 under [variables]. Names are compared without regard to case.""",
        Example(program="INC $cuont\n", cell=_SHARED),
    ),
    entry(
        "E234",
        "variable of another kind",
        """A variable is a number, or it is true or false, as its first value in the cell file says. A number
        is compared and counted; what is true or false stands by itself, as a signal does.""",
        Example(program="IF $count\nENDIF\n", cell=_SHARED),
    ),
)
