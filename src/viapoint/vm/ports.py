"""What the virtual machine needs of the world: two protocols and the calls that pass through them.

The machine knows no robot. It hands *calls* (motions and path actions, in program order, in the
language's own units: mm, deg, s) to a `MotionPort` and reads the outside world through a `WorldPort`.
Anything that implements both can run a program: the motion kernel, or the printer of canonical calls
that the golden tests use.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, unique
from typing import Final, NamedTuple, Protocol

from viapoint.vm.conditions import Condition, Reading


@unique
class MotionKind(Enum):
    """The five motion commands, by their word in the language."""

    LINE = "ML"
    JOINT = "MJ"
    CIRCLE = "MC"
    SPLINE = "MS"
    HOME = "HOME"


@unique
class SpeedKind(Enum):
    """How a programmed speed is to be read: generic, of the TCP (mm/s), of its orientation (deg/s)."""

    GENERIC = "F"
    LINEAR = "FC"
    ANGULAR = "FA"


@dataclass(frozen=True, slots=True)
class Speed:
    """A programmed speed, in mm/s or deg/s as its kind and the motion decide."""

    kind: SpeedKind
    value: float


class Modal(NamedTuple):
    """What holds from statement to statement: the programmed speed, None before the first one, the tool."""

    speed: Speed | None = None
    tool: int = 0


BEGINNING: Final = Modal()
"""What holds where a program begins."""


@dataclass(frozen=True, slots=True)
class Target:
    """Where a motion goes, as programmed: a point of the cell, or coordinates, or joints.

    `point` is the index of a point of the cell; otherwise `coordinates` holds the programmed ones of
    X Y Z A B C (mm, deg; a missing key keeps the previous value), and `joints` those of J1… (deg or mm).
    With a point or coordinates, `joints` are the reference values of an MJ.
    """

    point: int | None = None
    coordinates: tuple[tuple[str, float], ...] = ()
    joints: tuple[tuple[int, float], ...] = ()
    auxiliary: tuple[tuple[int, float], ...] = ()


@unique
class Origin(Enum):
    """What the place of an action on a motion counts from; the values are the instruction's."""

    START = 0  # mm behind its start
    END = 1  # mm before its end
    TIME = 2  # s before its end
    PART = 3  # % of its length


@dataclass(frozen=True, slots=True)
class PathAction:
    """AT: `call` takes effect at a place of the motion that carries it."""

    origin: Origin
    value: float
    call: SetOutput | SetLevel | SetVariable | Pulse | RaiseM

    def __str__(self) -> str:
        """The place as a program writes it: AT D-20."""
        before, behind = {
            Origin.START: ("D", ""),
            Origin.END: ("D-", ""),
            Origin.TIME: ("S-", ""),
            Origin.PART: ("", "%"),
        }[self.origin]
        return f"AT {before}{self.value:g}{behind}"


@dataclass(frozen=True, slots=True)
class Search:
    """UNTIL: the motion ends when the condition is true; `point` of the cell keeps the pose of that tick."""

    condition: Condition
    point: int | None

    def __str__(self) -> str:
        """As a program writes it."""
        return self.condition.text + ("" if self.point is None else f" CAPTURE P{self.point}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """One motion statement with the modal state of its place, and the actions that stand on it."""

    line: int
    kind: MotionKind
    target: Target
    via: Target | None = None  # MC only
    speed: Speed | None = None  # None: the cell's default
    frame: int = 0
    tool: int = 0
    angle: float | None = None  # H of MC, deg
    round_edge: float | None = None  # R, mm (deg between joint moves); None: not programmed
    actions: tuple[PathAction, ...] = ()
    search: Search | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SetOutput:
    """SET DO n / RESET DO n, effective where the path gets to its place."""

    line: int
    index: int
    value: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class SetLevel:
    """SET AO n = v, effective where the path gets to its place."""

    line: int
    index: int
    value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SetVariable:
    """LET $n = v, or with `adds` INC $n v; effective where the path gets to its place."""

    line: int
    name: str
    value: bool | float
    adds: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Pulse:
    """PULSE DO n s: on where the path gets to its place, off `seconds` later."""

    line: int
    index: int
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectTool:
    """T n: the active tool from here on."""

    line: int
    tool: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Dwell:
    """WAIT s: exact stop, then stand for `seconds`."""

    line: int
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RaiseM:
    """M n. `synchronous`: exact stop first; the machine then waits for the reset itself."""

    line: int
    index: int
    synchronous: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """TRK n (0: off)."""

    line: int
    conveyor: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Tangent:
    """TANG 1 [H] / TANG 0; offset in deg."""

    line: int
    on: bool
    offset: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Barrier:
    """Exact stop of the path here; the machine resumes in the tick in which the path has arrived."""

    line: int
    reason: str  # the statement that reads, as the user would name it: "IF DI3", "WAIT DI 2", "M 5"


@unique
class Decision(Enum):
    """What becomes of an error; the values are the instruction's."""

    STOP = 0  # it ends the run
    RETRY = 1  # the statement again
    RESUME_NEXT = 2  # the statement behind it

    def __str__(self) -> str:
        """As a program writes it."""
        return self.name.replace("_", " ")


@dataclass(frozen=True, slots=True)
class Handler:
    """A subroutine that interrupts: its label, and the address at which it begins."""

    label: str
    address: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchOn:
    """ON c SUB L: from here on the handler runs when the condition turns true."""

    line: int
    condition: Condition
    handler: Handler

    def __str__(self) -> str:
        """As a program writes it."""
        return f"{self.condition.text} SUB {self.handler.label}"


@dataclass(frozen=True, slots=True, kw_only=True)
class HandleErrors:
    """ON ERROR SUB L: from here on the handler runs when an error would end the run."""

    line: int
    handler: Handler

    def __str__(self) -> str:
        """As a program writes it."""
        return f"ERROR SUB {self.handler.label}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchOff:
    """OFF L: from here on the handler does not."""

    line: int
    handler: Handler


@dataclass(frozen=True, slots=True, kw_only=True)
class End:
    """The program is over here; nothing follows. A handler of errors says what becomes of the error."""

    line: int
    decision: Decision | None = None


Write = SetOutput | SetLevel | SetVariable | Pulse
"""What changes a signal or a variable where the path gets to its place."""

Call = (
    Motion
    | Write
    | SelectTool
    | Dwell
    | RaiseM
    | Track
    | Tangent
    | SwitchOn
    | HandleErrors
    | SwitchOff
    | Barrier
    | End
)


class MotionPort(Protocol):
    """Takes calls in program order."""

    def submit(self, call: Call) -> bool:
        """Accept `call`, or answer False and change nothing: no room now, submit it again later."""
        ...


class WorldPort(Protocol):
    """The outside world, read only after a barrier (or ahead, where the program says so)."""

    def read(self, reading: Reading, *, line: int, ahead: bool) -> float:
        """A signal, the flag of an M function, or a variable. Every read is traced with its line."""
        ...

    def holds(self, condition: Condition, *, line: int) -> bool:
        """Whether `condition` is true where the path has arrived; every read is traced."""
        ...

    def live_place(
        self, points: tuple[int | None, ...], frame: int, *, line: int, arrived: bool
    ) -> str | None:
        """What of a motion's points and frame may change while the program runs: P7, Z2; None: nothing.

        Where the path has `arrived`, it is read now, and traced.
        """
        ...

    def found(self) -> bool:
        """Whether the search that ended last has found what it looked for."""
        ...

    def m_is_synchronous(self, index: int) -> bool:
        """How the cell declares M function `index`."""
        ...


@dataclass(frozen=True, slots=True)
class BufferFull:
    """The motion buffer had no room; resume when a slot is free."""


@dataclass(frozen=True, slots=True)
class AtBarrier:
    """A barrier was submitted; resume in the tick in which the path has arrived there."""

    line: int
    reason: str


@dataclass(frozen=True, slots=True)
class AwaitInput:
    """WAIT DI n, the path has arrived and the input is still false; resume each tick it may have changed."""

    line: int
    index: int


@dataclass(frozen=True, slots=True)
class AwaitCondition:
    """WAIT c, the path has arrived and c does not hold; resume when it does or `seconds` have passed."""

    line: int
    condition: Condition
    seconds: float | None


@dataclass(frozen=True, slots=True)
class AwaitReset:
    """A synchronous M was submitted; resume when its flag has been raised and reset."""

    line: int
    index: int


@dataclass(frozen=True, slots=True)
class Ended:
    """END of the main program was executed and submitted."""

    line: int


@dataclass(frozen=True, slots=True)
class Failed:
    """The program cannot go on: a catalogue code, its message, and the line."""

    line: int
    code: str
    message: str


Suspension = BufferFull | AtBarrier | AwaitInput | AwaitCondition | AwaitReset | Ended | Failed
