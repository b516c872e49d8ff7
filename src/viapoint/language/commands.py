"""The one table of commands and parameters.

From it come the grammar's terminals and rules (`grammar.py`), the fast path (`shapes.py`), the checks
of parameters (`checks.py`), the reserved names and the suggestions of "did you mean", and the command
reference. No parsing here.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, unique
from typing import Final


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


MAX_INDEX: Final = 65_535
"""Largest index of a point, frame, tool, signal …: tables of a cell are far smaller; fits 16 bits."""

MAX_TIMES: Final = 1_000_000_000
"""Largest repeat count of GOTO and SUB."""

MAX_NUMBER: Final = 1e9
"""Largest magnitude of a coordinate, speed or time: 1000 km, 30 years; its square is far from overflow."""

MIN_POSITIVE: Final = 1e-6
"""Smallest value where only positive ones are allowed: a nanometre per second is no speed."""

MAX_AXIS: Final = 32
"""Largest axis number of J and E."""


@unique
class Form(Enum):
    """How a parameter is written; the values are examples."""

    GLUED = "P3"
    ASSIGNED = "X=1755"
    NUMBERED = "J1=-90"


@unique
class Kind(Enum):
    """What a value is: a whole number that names something, a count, or a real number."""

    INDEX = "index"
    COUNT = "count"
    SWITCH = "0 or 1"
    NUMBER = "number"


@dataclass(frozen=True, slots=True, kw_only=True)
class Domain:
    """The values allowed, both ends included; `text` completes "… must be"."""

    kind: Kind
    low: float
    high: float
    text: str
    nonzero: bool = False

    def holds(self, value: float) -> bool:
        """Whether `value` is allowed; integrality is judged by the kind."""
        if self.kind is not Kind.NUMBER and not float(value).is_integer():
            return False
        return self.low <= value <= self.high and not (self.nonzero and value == 0)

    @property
    def is_whole(self) -> bool:
        """Whether values are int."""
        return self.kind is not Kind.NUMBER


INDEX: Final = Domain(kind=Kind.INDEX, low=0, high=MAX_INDEX, text=f"a whole number from 0 to {MAX_INDEX}")
COUNT: Final = Domain(kind=Kind.COUNT, low=1, high=MAX_TIMES, text="a whole number, 1 or more")
SWITCH: Final = Domain(kind=Kind.SWITCH, low=0, high=1, text="0 or 1")
REAL: Final = Domain(kind=Kind.NUMBER, low=-MAX_NUMBER, high=MAX_NUMBER, text="a number between -1E9 and 1E9")
TURN: Final = Domain(
    kind=Kind.NUMBER, low=-MAX_NUMBER, high=MAX_NUMBER, text="an angle other than 0", nonzero=True
)
POSITIVE: Final = Domain(
    kind=Kind.NUMBER, low=MIN_POSITIVE, high=MAX_NUMBER, text="greater than 0 (1E-6 to 1E9)"
)
NOT_NEGATIVE: Final = Domain(kind=Kind.NUMBER, low=0.0, high=MAX_NUMBER, text="0 or greater (at most 1E9)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One parameter of a command; `excludes` are the keys that must not stand beside it."""

    code: str
    form: Form
    domain: Domain
    unit: str
    doc: str
    excludes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """The code as written, with its `=`: Z (frame) and Z= (coordinate) differ. J stays J."""
        return f"{self.code}=" if self.form is Form.ASSIGNED else self.code

    @property
    def shown(self) -> str:
        """How it is named to a user: P, X=, J1=."""
        return f"{self.code}1=" if self.form is Form.NUMBERED else self.key


def _glued(code: str, domain: Domain, unit: str, doc: str, *excludes: str) -> Parameter:
    return Parameter(code=code, form=Form.GLUED, domain=domain, unit=unit, doc=doc, excludes=excludes)


def _assigned(code: str, unit: str, doc: str, *excludes: str) -> Parameter:
    return Parameter(code=code, form=Form.ASSIGNED, domain=REAL, unit=unit, doc=doc, excludes=excludes)


def _numbered(code: str, doc: str) -> Parameter:
    return Parameter(code=code, form=Form.NUMBERED, domain=REAL, unit="deg or mm", doc=doc)


COORDINATES: Final = ("X=", "Y=", "Z=", "A=", "B=", "C=")
"""Keys of an explicit target; those of an explicit circle point have a Q before them."""

_P = _glued("P", INDEX, "", "target point of the cell", *COORDINATES)
_TARGET = (
    _P,
    *(_assigned(code, "mm", f"target {code} in the frame", "P") for code in "XYZ"),
    *(_assigned(code, "deg", f"target rotation {code}, R = Rz(C) Ry(B) Rx(A)", "P") for code in "ABC"),
)
_SPEED = (
    _glued("F", POSITIVE, "mm/s or deg/s", "generic speed", "FC", "FA"),
    _glued("FC", POSITIVE, "mm/s", "speed of the TCP", "F", "FA"),
    _glued("FA", POSITIVE, "deg/s", "speed of the orientation", "F", "FC"),
)
_PLACE = (
    _glued("Z", INDEX, "", "frame of the target, 0: robot base"),
    _glued("T", INDEX, "", "tool of this motion, 0: none"),
)
_R = _glued("R", NOT_NEGATIVE, "mm or deg", "round edge at the end, 0: exact stop")
_E = _numbered("E", "position of an auxiliary axis at the target")
_J = _numbered("J", "joint of the target, or reference value that chooses the configuration")
_Q = (
    _glued("Q", INDEX, "", "point of the cell on the circle", *(f"Q{key}" for key in COORDINATES)),
    *(_assigned(f"Q{code}", "mm", f"{code} of the point on the circle", "Q") for code in "XYZ"),
    *(_assigned(f"Q{code}", "deg", f"rotation {code} of the point on the circle", "Q") for code in "ABC"),
)
_H_CIRCLE = _glued("H", TURN, "deg", "angle covered, signed, any number of turns")
H_TANGENT: Final = _glued("H", REAL, "deg", "offset between the path tangent and the tool")


@dataclass(frozen=True, slots=True, kw_only=True)
class Need:
    """A mandatory part of a statement: any one of `any_of`, or all of `all_of`."""

    name: str
    any_of: tuple[str, ...]
    all_of: tuple[str, ...] = ()
    example: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionCommand:
    """A command that moves the robot: a word and parameters in free order."""

    word: str
    doc: str
    parameters: tuple[Parameter, ...]
    needs: tuple[Need, ...] = ()


@unique
class Operand(Enum):
    """What an auxiliary command takes after its word."""

    NOTHING = "nothing"
    VALUE = "one number"
    LABEL_TIMES = "a label and a repeat count"
    CONDITION = "a condition"
    TANGENT = "0, or 1 and an offset"
    WAIT = "a number of seconds, or a condition"
    OUTPUT = "an output"
    LEVEL = "an output, an analog one with = and its value"
    PULSE = "an output and a number of seconds"
    LET = "a variable, = and its value"
    INC = "a variable, and the number to add"
    PLACE = "a place and an action"
    INTERRUPT = "a condition or ERROR, then SUB and a label"
    NEXT = "NEXT"
    LABEL = "a label"


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionCommand:
    """A command that does not move: words, then its operand. `domain` is that of the number."""

    words: tuple[str, ...]
    doc: str
    operand: Operand
    domain: Domain | None = None
    example: str

    @property
    def word(self) -> str:
        """The words joined by a blank: SET DO."""
        return " ".join(self.words)


_TARGET_NEED = Need(name="target", any_of=("P", *COORDINATES), example="`P1`, or coordinates such as `X=100`")
_JOINT_NEED = Need(name="target", any_of=("P", *COORDINATES, "J"), example="`P1`, or coordinates or joints")
_Q_NEED = Need(
    name="point on the circle",
    any_of=("Q",),
    all_of=("QX=", "QY=", "QZ="),
    example="`Q2`, or `QX=` `QY=` `QZ=`",
)

MOTIONS: Final = (
    MotionCommand(
        word="ML",
        doc="straight line of the TCP",
        parameters=(*_TARGET, *_SPEED, *_PLACE, _R, _E),
        needs=(_TARGET_NEED,),
    ),
    MotionCommand(
        word="MJ",
        doc="straight line in joint space, all joints start and end together",
        parameters=(*_TARGET, *_SPEED, *_PLACE, _R, _J, _E),
        needs=(_JOINT_NEED,),
    ),
    MotionCommand(
        word="MC",
        doc="circle through the start, Q and the target",
        parameters=(*_TARGET, *_Q, *_SPEED, *_PLACE, _H_CIRCLE, _R, _E),
        needs=(_TARGET_NEED, _Q_NEED),
    ),
    MotionCommand(
        word="MS",
        doc="spline through the targets of consecutive MS",
        parameters=(*_TARGET, *_SPEED, *_PLACE, _R, _E),
        needs=(_TARGET_NEED,),
    ),
    MotionCommand(word="HOME", doc="joint move to the home position", parameters=_SPEED),
)


def _value(words: str, domain: Domain, doc: str, example: str) -> ActionCommand:
    return ActionCommand(
        words=tuple(words.split()), doc=doc, operand=Operand.VALUE, domain=domain, example=example
    )


def _condition(word: str, doc: str) -> ActionCommand:
    return ActionCommand(words=(word,), doc=doc, operand=Operand.CONDITION, example=f"{word} DI3")


def _jump(word: str, doc: str) -> ActionCommand:
    return ActionCommand(
        words=(word,), doc=doc, operand=Operand.LABEL_TIMES, domain=COUNT, example=f"{word} LOOP 5"
    )


def _bare(word: str, doc: str) -> ActionCommand:
    return ActionCommand(words=(word,), doc=doc, operand=Operand.NOTHING, example=word)


ACTIONS: Final = (
    _value("T", INDEX, "active tool becomes n, without motion; 0: none", "T 1"),
    _value("TRK", INDEX, "follow conveyor n; 0: no longer", "TRK 1"),
    ActionCommand(
        words=("TANG",),
        doc="keep the tool along the path tangent, offset by H; 0: off",
        operand=Operand.TANGENT,
        domain=SWITCH,
        example="TANG 1 H45",
    ),
    ActionCommand(
        words=("WAIT",),
        doc="stop and wait: a number of seconds, or until a condition is true; not longer than TIMEOUT says",
        operand=Operand.WAIT,
        domain=NOT_NEGATIVE,
        example="WAIT DI3 TIMEOUT 2 GOTO LATE",
    ),
    ActionCommand(
        words=("SET",),
        doc="digital output on, or analog output to a value, when the path gets here",
        operand=Operand.LEVEL,
        domain=INDEX,
        example="SET DO 1",
    ),
    ActionCommand(
        words=("RESET",),
        doc="digital output off when the path gets here",
        operand=Operand.OUTPUT,
        domain=INDEX,
        example="RESET DO 1",
    ),
    ActionCommand(
        words=("PULSE",),
        doc="digital output on when the path gets here, and off after a number of seconds",
        operand=Operand.PULSE,
        domain=INDEX,
        example="PULSE DO 1 0.2",
    ),
    _value("M", INDEX, "M function, synchronous or not as the cell declares it", "M 5"),
    ActionCommand(
        words=("LET",),
        doc="variable to a value when the path gets here",
        operand=Operand.LET,
        domain=REAL,
        example="LET $count = 0",
    ),
    ActionCommand(
        words=("INC",),
        doc="add a number to a variable when the path gets here; without one, add 1",
        operand=Operand.INC,
        domain=REAL,
        example="INC $count",
    ),
    ActionCommand(
        words=("AT",),
        doc="SET, RESET, PULSE, M, LET or INC at a place of the next motion: mm behind its start or before "
        "its end, seconds before its end, or a part of its length",
        operand=Operand.PLACE,
        domain=REAL,
        example="AT D-20 SET DO1",
    ),
    _bare("SYNC", "stop and wait until the path has arrived here"),
    _condition("IF", "branch on a condition, read when the path arrives; IF AHEAD: read ahead of the path"),
    _condition("ELSEIF", "the next branch; AHEAD as with IF"),
    _bare("ELSE", "the last branch"),
    _bare("ENDIF", "end of the branches"),
    _jump("GOTO", "jump to a label; with a count, run the body that many times in all"),
    _jump("SUB", "run the subroutine at a label, with a count that many times"),
    ActionCommand(
        words=("ON",),
        doc="from here on, when a condition turns true: stop on the path, run the subroutine at a label, "
        "come back, go on; ON ERROR: when an error would end the run",
        operand=Operand.INTERRUPT,
        example="ON DI3 SUB LOST",
    ),
    ActionCommand(
        words=("OFF",),
        doc="from here on, the subroutine at a label interrupts no longer",
        operand=Operand.LABEL,
        example="OFF LOST",
    ),
    _bare("RETRY", "in a subroutine that handles an error: the statement with the error again"),
    ActionCommand(
        words=("RESUME",),
        doc="in a subroutine that handles an error: go on with the statement behind it",
        operand=Operand.NEXT,
        example="RESUME NEXT",
    ),
    _bare("STOP", "in a subroutine that handles an error: the error ends the run, as it would have"),
    _bare("END", "end of the program, or return from a subroutine"),
)

MOTION_BY_WORD: Final = {command.word: command for command in MOTIONS}
ACTION_BY_WORD: Final = {command.word: command for command in ACTIONS}

SWITCHES: Final = {"DI": "digital input", "DO": "digital output", "M": "M flag"}
"""Signals that are true or false, as a condition reads them."""

LEVELS: Final = {"AI": "analog input", "AO": "analog output"}
"""Signals that are numbers; a condition compares them."""

FOUND: Final = "FOUND"
"""What the last search has come to, as a condition reads it."""

TRUTHS: Final = {"TRUE": True, "FALSE": False}
"""The values of what is true or false."""

ERRNO: Final = "ERRNO"
"""The number of the error that is handled, as a condition reads it."""

SETTLED: Final = frozenset({FOUND, ERRNO})
"""What is known without the outside world, once it has come about."""

NUMBERS: Final = frozenset({*LEVELS, ERRNO})
"""What a condition reads as a number."""

SIGNALS: Final = SWITCHES | LEVELS
"""All signals a condition may read."""


LATER_STATEMENTS: Final = _words("DIM WHILE ENDWHILE FOR ENDFOR BREAK CONTINUE GLOBAL USE ABORT PRINT")
"""First words of statements that the language reserves and this version does not run."""

LATER_WORDS: Final = LATER_STATEMENTS | _words(
    "TO STEP HERE TIME ABS MIN MAX SQRT SIN COS TAN ATAN2 ROUND FLOOR"
)
"""All words reserved for constructs to come."""

FIRST_WORDS: Final = tuple(dict.fromkeys([*MOTION_BY_WORD, *(c.words[0] for c in ACTIONS)]))
"""Words a statement can begin with, in table order."""

_BARE_LETTERS_ARE_NAMES = {"T", "M"}
KEYWORDS: Final = frozenset(
    {
        *FIRST_WORDS,
        *LATER_WORDS,
        *SIGNALS,
        "NOT",
        "AND",
        "OR",
        "MOD",
        "AHEAD",
        "TIMEOUT",
        "UNTIL",
        "CAPTURE",
        *SETTLED,
        "ERROR",
        "NEXT",
        *TRUTHS,
    }
    - _BARE_LETTERS_ARE_NAMES
)
"""Refused as names. T and M are commands only before a number: a bare letter is a name."""

CODES_BEFORE_DIGITS: Final = frozenset(
    {
        *(p.code for m in MOTIONS for p in m.parameters if p.form is not Form.ASSIGNED),
        *SIGNALS,
        "T",
    }
)
"""A name made of one of these and digits is refused: P1, DI3, J4."""

BARE_CODES: Final = frozenset(p.code for m in MOTIONS for p in m.parameters)
"""A single one of these is a parameter without its value rather than the name of a point."""
