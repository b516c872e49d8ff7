"""Catalogue entries of syntax (E10x to E13x)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

_TEXT: Final = (
    entry(
        "E100",
        "file cannot be read",
        """The file does not exist, is a folder, may not be read, or is too large to be a program.
        Check its name and permissions.""",
        Example(path="no/such/part.via"),
    ),
    entry(
        "E101",
        "file is not UTF-8",
        """Program files are text in UTF-8. A byte of this file belongs to no character of that encoding:
        the file was saved in another one, or is no text at all. Save it as UTF-8.""",
        Example(data=b"ML P1 // gr\xfc\xdfe\n"),
    ),
    entry(
        "E102",
        "NUL character in a program",
        """A NUL character stands in the file. No editor writes one into a program; the file is probably
        binary, damaged, or UTF-16. Save the program as UTF-8 text.""",
        Example(data=b"ML P1\x00\n"),
    ),
    entry(
        "E103",
        "line too long",
        """A line has more than 4096 characters. A statement stands on one line and needs far fewer; the
        file is probably no program, or its line ends are lost.""",
        "ML P1 " + "// and so on " * 400 + "\n",
    ),
    entry(
        "E104",
        "character that cannot stand here",
        """Outside comments and strings a program is made of ASCII characters. Typographic quotes, dashes
        and special blanks come in with text copied from documents: replace them by `"`, `-` and the
        ordinary blank.""",
        "ML X=\u22125\n",
    ),
    entry(
        "E105",
        "string without its end",
        """A string begins with `"` and ends with `"` on the same line.""",
        'PRINT "part done\n',
    ),
    entry(
        "E106",
        "not a number",
        """Numbers are decimal: 12, -3.5, .5, 1E3. There is no decimal comma, no unit, no hexadecimal, no
        infinity; a sign touches its number. Units are fixed: mm, deg, s, mm/s, deg/s.""",
        "ML P1 F100mm\n",
    ),
    entry(
        "E107",
        "number too large to represent",
        """The number exceeds what a floating-point number can hold. A digit too many in the exponent is
        the usual cause.""",
        "ML X=1E999\n",
    ),
)

_STATEMENTS: Final = (
    entry(
        "E110",
        "unknown command",
        """A statement begins with a command, after its label if it has one. The word that stands here is
        none. A label is followed by a colon; a comment begins with `//`.""",
        "MLL P1\n",
    ),
    entry(
        "E111",
        "reserved for a construct this version does not have",
        """The word or form belongs to the language (values, loops, actions on the path, interrupts …) but
        this version cannot run it. Such words are reserved, so that programs keep their meaning.""",
        "LET speed = 100\n",
    ),
    entry(
        "E112",
        "unexpected text",
        """The statement could have ended, or something else had to come here. One statement stands on a
        line; parameters are separated by blanks alone, conditions are joined by AND and OR.""",
        "ENDIF DI3\n",
    ),
    entry(
        "E113",
        "something is missing",
        """The statement ends, or goes on with something else, where a label, a number, a signal or a
        condition has to stand.""",
        "GOTO\n",
    ),
    entry(
        "E114",
        "word of the language as a label",
        """Commands, operators and reserved words cannot be names. Choose another one; adding a digit and
        an underscore is enough: `WAIT_1`.""",
        "WAIT:\n",
    ),
    entry(
        "E115",
        "code followed by digits as a label",
        """P1, T2, DI3, M5, E1, J4 and the like read as parameters and signals, so they cannot be names.
        A bare letter (`A:`) and longer words (`PART1:`) can.""",
        "P1:\nML P1\n",
    ),
    entry(
        "E116",
        "blank missing between parameters",
        """Parameters are separated by blanks. Without one, `X=1E1=500` cannot be told from the number
        1E1.""",
        "ML X=1E1=500\n",
    ),
    entry(
        "E117",
        "parenthesis without its partner",
        "Every `(` needs its `)` on the same line, in the same parameter.",
        "ML P(1\n",
    ),
    entry(
        "E118",
        "name where a number has to stand",
        """A name stands where this version of the language takes a number. Points and signals have names, in
        the cell; values are written out.""",
        "ML P1 F(speed)\n",
    ),
    entry(
        "E119",
        "nested too deep",
        """Parentheses, NOT and signs may nest 64 levels deep in one statement.""",
        "IF " + "NOT " * 70 + "DI1\nENDIF\n",
    ),
)

_PARAMETERS: Final = (
    entry(
        "E120",
        "unknown parameter",
        """No motion command has a parameter of this code. A parameter is a letter code glued to a number
        (`P3`, `F100`, `R10`) or a coordinate, joint or axis with `=` (`X=1755`, `J1=-90`).""",
        "ML P1 V100\n",
    ),
    entry(
        "E121",
        "parameter of another command",
        """The parameter exists but has no meaning with this command: H belongs to MC and TANG 1, Q to MC,
        J1= … to MJ. HOME takes a speed only.""",
        "ML P1 H90\n",
    ),
    entry(
        "E122",
        "parameter given twice",
        "A parameter may be given once in a statement; keep the one that is meant.",
        "ML P1 F100 F200\n",
    ),
    entry(
        "E123",
        "mandatory parameter missing",
        """Every motion but HOME needs a target: `P1`, or at least one of X= Y= Z= A= B= C= (for MJ also
        J1= …). MC needs a point on the circle as well: `Q2`, or QX= QY= QZ=.""",
        "ML F100\n",
        "MC P1\n",
    ),
    entry(
        "E124",
        "value out of its domain",
        """The number is written well but the parameter does not take it: speeds are above 0, R and waiting
        times are not negative, H of MC is not 0, TANG takes 0 or 1, magnitudes end at 1E9.""",
        "ML P1 R-5\n",
    ),
    entry(
        "E125",
        "index or count that is not a whole number in range",
        """Indices of points, frames, tools, conveyors, signals and M functions are whole numbers from 0;
        repeat counts are whole numbers from 1.""",
        "ML P-1\n",
    ),
    entry(
        "E126",
        "parameter badly written",
        """The code and its value do not fit together: letter codes are glued to their number (`P3`),
        coordinates, joints and axes take `=` without blanks (`X=10`, `J1=-90`).""",
        "ML P 3\n",
    ),
    entry(
        "E127",
        "parameters that exclude each other",
        """A target is a point of the cell or coordinates, not both; the same holds for the point on a
        circle. A motion has one speed: F, FC or FA.""",
        "ML P1 X=100\n",
    ),
    entry(
        "E128",
        "division by zero",
        "A constant expression divides by zero.",
        "ML P1 F(100/0)\n",
    ),
)

_CONDITIONS: Final = (
    entry(
        "E130",
        "operator of another language",
        """Comparison is `=` `<>` `<` `<=` `>` `>=`; conditions are joined by AND, OR and NOT.""",
        "IF 1 == 1\nENDIF\n",
    ),
    entry(
        "E131",
        "number where a condition has to stand",
        "A condition tests signals (`DI3`, `DO1`, `M5`) or compares two numbers (`1 < 2`).",
        "IF 3\nENDIF\n",
    ),
    entry(
        "E132",
        "condition where a number has to stand",
        "Signals are true or false; they are neither compared nor computed with.",
        "IF DI3 = 1\nENDIF\n",
    ),
    entry(
        "E139",
        "too many errors",
        """More than 1000 errors were found and the rest of the file was not read: it is probably no
        program.""",
        "what is this\n" * 1001,
    ),
)

ENTRIES: Final[tuple[Entry, ...]] = (*_TEXT, *_STATEMENTS, *_PARAMETERS, *_CONDITIONS)
