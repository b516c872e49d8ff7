"""The tree of a program: one node per statement, in the order of the text.

Nodes are immutable tuples with names: a program of 100,000 lines is built in a fraction of a second
and stays small. Blocks are not nested here: IF, ELSEIF, ELSE and ENDIF are statements of their own,
so that one bad line never hides the errors of others; the compiler nests them.

Every statement begins with `line` (from 1), `start`, `end` (character offsets). Parameters and
conditions keep no absolute place: see `parameter_spans` in `lexical.py`, `condition_span` below.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from viapoint.language.source import Source, Span


class Layout(NamedTuple):
    """What a motion statement is made of, without its numbers; statements share equal layouts.

    `codes` are the parameters' codes as written, upper case, in order, with `=` where it is written:
    P, Q, X=, QX=, F, FC, Z (frame), Z= (coordinate), J1=, E1= … Checks and lowering that depend on the
    codes alone can be done once per layout.
    """

    command: str
    codes: tuple[str, ...]


class Motion(NamedTuple):
    """ML, MJ, MC, MS, HOME. `values[i]` belongs to `layout.codes[i]`; indices (P Q Z T) are int.

    A point that is named stands in `names` with its position in the values, where a 0 holds its place.
    """

    line: int
    start: int
    end: int
    layout: Layout
    values: tuple[float, ...]
    names: tuple[tuple[int, str], ...] = ()

    @property
    def command(self) -> str:
        """ML, MJ, MC, MS or HOME."""
        return self.layout.command

    @property
    def parameters(self) -> dict[str, float]:
        """Values by code, in the order written."""
        return dict(zip(self.layout.codes, self.values, strict=True))


class Until(NamedTuple):
    """UNTIL c [CAPTURE Pn] of the motion that follows. Its place is the words themselves."""

    line: int
    start: int
    end: int
    condition: Condition
    capture: int | None


class SelectTool(NamedTuple):
    """T n."""

    line: int
    start: int
    end: int
    tool: int


class Track(NamedTuple):
    """TRK n; 0 ends tracking."""

    line: int
    start: int
    end: int
    conveyor: int


class Tangent(NamedTuple):
    """TANG 1 [H], TANG 0. `offset` in deg."""

    line: int
    start: int
    end: int
    on: int
    offset: float


class Wait(NamedTuple):
    """WAIT s."""

    line: int
    start: int
    end: int
    seconds: float


class WaitInput(NamedTuple):
    """WAIT DI n."""

    line: int
    start: int
    end: int
    input: int


class WaitFor(NamedTuple):
    """WAIT c [TIMEOUT s [GOTO L]]: any condition but a digital input alone."""

    line: int
    start: int
    end: int
    condition: Condition
    timeout: float | None
    label: str | None


class SetOutput(NamedTuple):
    """SET DO n (`value` True), RESET DO n (False). An output may be named."""

    line: int
    start: int
    end: int
    output: int | str
    value: bool


class SetLevel(NamedTuple):
    """SET AO n = v. The output may be named."""

    line: int
    start: int
    end: int
    output: int | str
    value: float


class Pulse(NamedTuple):
    """PULSE DO n s. The output may be named."""

    line: int
    start: int
    end: int
    output: int | str
    seconds: float


class Let(NamedTuple):
    """LET $n = v. `value` is worked out, or read where the path has arrived."""

    line: int
    start: int
    end: int
    variable: Variable
    value: Value


class Inc(NamedTuple):
    """INC $n [by]."""

    line: int
    start: int
    end: int
    variable: Variable
    by: Comparable


class MFunction(NamedTuple):
    """M n."""

    line: int
    start: int
    end: int
    function: int


PathAction: TypeAlias = SetOutput | SetLevel | Pulse | MFunction | Let | Inc
"""What may stand at a place of a motion."""


class At(NamedTuple):
    """AT where action. `origin` says what `value` counts from: see `Origin` in the machine's ports.

    It is D (mm behind the start), D- (mm before the end), S- (s before the end) or % (of the length).
    """

    line: int
    start: int
    end: int
    origin: str
    value: float
    action: PathAction


class Sync(NamedTuple):
    """SYNC."""

    line: int
    start: int
    end: int


class Number(NamedTuple):
    """A number in a condition, constants folded."""

    start: int
    end: int
    value: float


class Signal(NamedTuple):
    """A signal in a condition. `kind` is DI, DO or M, in a comparison AI or AO; or FOUND, number 0."""

    start: int
    end: int
    kind: str
    number: int


class Named(NamedTuple):
    """A signal by its name in the cell."""

    start: int
    end: int
    name: str


class Variable(NamedTuple):
    """A variable shared with the application, `$name`; `name` is without the sign.

    `switch`: it is true or false, as far as the cell is known; the parser leaves it False.
    """

    start: int
    end: int
    name: str
    switch: bool = False


class Truth(NamedTuple):
    """TRUE or FALSE."""

    start: int
    end: int
    value: bool


Comparable: TypeAlias = Number | Signal | Named | Variable
"""What stands on either side of a comparison."""


class Compare(NamedTuple):
    """A comparison of two numbers; `operator` is one of = <> < <= > >=."""

    start: int
    end: int
    operator: str
    left: Comparable
    right: Comparable


class Not(NamedTuple):
    """NOT operand."""

    start: int
    end: int
    operand: Condition


class And(NamedTuple):
    """Two or more operands, flat: a AND b AND c is one node."""

    start: int
    end: int
    operands: tuple[Condition, ...]


class Or(NamedTuple):
    """Two or more operands, flat."""

    start: int
    end: int
    operands: tuple[Condition, ...]


Condition: TypeAlias = Signal | Named | Variable | Truth | Compare | Not | And | Or
"""Offsets of condition nodes count from the start of their statement."""

Value: TypeAlias = Comparable | Condition
"""What a variable can be given: a number, or what is true or false."""


class If(NamedTuple):
    """IF [AHEAD] c."""

    line: int
    start: int
    end: int
    condition: Condition
    ahead: bool = False


class ElseIf(NamedTuple):
    """ELSEIF [AHEAD] c, ELSE IF c."""

    line: int
    start: int
    end: int
    condition: Condition
    ahead: bool = False


class Else(NamedTuple):
    """ELSE."""

    line: int
    start: int
    end: int


class EndIf(NamedTuple):
    """ENDIF."""

    line: int
    start: int
    end: int


class Goto(NamedTuple):
    """GOTO L [n]. `label` as written here; compare with `name_key`."""

    line: int
    start: int
    end: int
    label: str
    times: int | None


class Sub(NamedTuple):
    """SUB L [n]."""

    line: int
    start: int
    end: int
    label: str
    times: int | None


class On(NamedTuple):
    """ON c SUB L."""

    line: int
    start: int
    end: int
    condition: Condition
    label: str


class OnError(NamedTuple):
    """ON ERROR SUB L."""

    line: int
    start: int
    end: int
    label: str


class Retry(NamedTuple):
    """RETRY."""

    line: int
    start: int
    end: int


class ResumeNext(NamedTuple):
    """RESUME NEXT."""

    line: int
    start: int
    end: int


class Stop(NamedTuple):
    """STOP in a subroutine that handles errors."""

    line: int
    start: int
    end: int


Decision: TypeAlias = Retry | ResumeNext | Stop
"""What becomes of an error."""


class Off(NamedTuple):
    """OFF L."""

    line: int
    start: int
    end: int
    label: str


class End(NamedTuple):
    """END."""

    line: int
    start: int
    end: int


class Label(NamedTuple):
    """NAME: — `start`, `end` cover the name without the colon. A statement may follow on its line."""

    line: int
    start: int
    end: int
    name: str


Statement: TypeAlias = (
    Motion
    | Until
    | SelectTool
    | Track
    | Tangent
    | Wait
    | WaitInput
    | WaitFor
    | SetOutput
    | SetLevel
    | Pulse
    | Let
    | Inc
    | MFunction
    | At
    | Sync
    | If
    | ElseIf
    | Else
    | EndIf
    | Goto
    | Sub
    | On
    | OnError
    | Off
    | Retry
    | ResumeNext
    | Stop
    | End
    | Label
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A parsed program; statements with errors are left out (their diagnostics are not)."""

    source: Source
    statements: tuple[Statement, ...]


def statement_span(statement: Statement) -> Span:
    """Place of a statement, without its label, comment and surrounding blanks."""
    return Span(statement.start, statement.end)


def name_key(name: str) -> str:
    """What names are compared by: they are case-insensitive."""
    return name.upper()


def condition_span(statement: If | ElseIf | WaitFor | On, node: Value) -> Span:
    """Absolute place of a node of `statement`'s condition."""
    return Span(statement.start + node.start, statement.start + node.end)
