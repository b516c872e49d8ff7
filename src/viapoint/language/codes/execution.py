"""Catalogue entries of execution (E4xx)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

_ROBOT: Final = '[robot]\nmodel = "frigeni6"\n'

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
        "E410",
        "wait that nothing can end",
        """The program waits for an input, for the reset of an M flag, or asks the same question in a loop,
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
        "E490",
        "set point that is no number",
        """A set point came out infinite or undefined and was held back: the drives never get one. Something
        in the cell is so large that arithmetic overflows, such as a tool of astronomic length. If every
        figure of the cell is plausible, please report the program.""",
        Example(
            program="MJ J1=10 F50 T1\n",
            cell=f"{_ROBOT}[[tools]]\nindex = 1\nxyz = [1e300, 0, 0]\n",
        ),
    ),
)
