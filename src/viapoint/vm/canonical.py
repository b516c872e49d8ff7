"""The canonical-call printer: runs a program with no robot at all and prints every call, one per line.

The golden tests of the language read its output. Motion takes no time and every barrier is reached at
once; the world answers from a script.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import assert_never

from viapoint.vm.conditions import Condition, Reading
from viapoint.vm.machine import Machine
from viapoint.vm.ports import (
    AtBarrier,
    AwaitCondition,
    AwaitInput,
    AwaitReset,
    Barrier,
    BufferFull,
    Call,
    Dwell,
    End,
    Ended,
    Failed,
    HandleErrors,
    Motion,
    Pulse,
    RaiseM,
    SelectTool,
    SetLevel,
    SetOutput,
    SetVariable,
    SwitchOff,
    SwitchOn,
    Tangent,
    Target,
    Track,
)
from viapoint.vm.program import Program

CALL_LIMIT = 10_000
"""Calls after which an endless program is cut off."""


def _target(target: Target, point: str) -> str:
    words = [] if target.point is None else [f"{point}{target.point}"]
    prefix = "Q" if point == "Q" else ""
    words += [f"{prefix}{axis}={value:.3f}" for axis, value in target.coordinates]
    words += [f"J{axis}={value:.3f}" for axis, value in target.joints]
    words += [f"E{axis}={value:.3f}" for axis, value in target.auxiliary]
    return " ".join(words)


def _motion(call: Motion) -> str:
    words = [call.kind.value, _target(call.target, "P")]
    if call.via is not None:
        words.append(_target(call.via, "Q"))
    words.append("F-" if call.speed is None else f"{call.speed.kind.value}{call.speed.value:.3f}")
    words += [f"Z{call.frame}", f"T{call.tool}"]
    if call.angle is not None:
        words.append(f"H{call.angle:.3f}")
    if call.round_edge is not None:
        words.append(f"R{call.round_edge:.3f}")
    words += [f"{action}: {_text(action.call)};" for action in call.actions]
    if call.search is not None:
        words.append(str(call.search))
    return " ".join(word for word in words if word)


def describe(call: Call) -> str:
    """One call as one line of text with three fixed decimals, its source line in front."""
    return f"{call.line:4d} {_text(call)}"


def _value(value: bool | float) -> str:
    return f"{value:.3f}" if isinstance(value, float) else "true" if value else "false"


def _text(call: Call) -> str:
    match call:
        case Motion():
            return _motion(call)
        case SetOutput():
            return f"{'SET' if call.value else 'RESET'} DO{call.index}"
        case SetLevel():
            return f"SET AO{call.index} = {call.value:.3f}"
        case SetVariable(name=name, value=value, adds=adds):
            return f"INC ${name} {value:.3f}" if adds else f"LET ${name} = {_value(value)}"
        case Pulse():
            return f"PULSE DO{call.index} {call.seconds:.3f}"
        case SelectTool():
            return f"TOOL {call.tool}"
        case Dwell():
            return f"DWELL {call.seconds:.3f}"
        case RaiseM():
            return f"RAISE M{call.index} {'sync' if call.synchronous else 'async'}"
        case Track():
            return f"TRACK {call.conveyor}"
        case Tangent():
            return f"TANGENT {'on' if call.on else 'off'} {call.offset:.3f}"
        case SwitchOn() | HandleErrors():
            return f"ON {call}"
        case SwitchOff():
            return f"OFF {call.handler.label}"
        case Barrier():
            return f"BARRIER {call.reason}"
        case End():
            return "END" if call.decision is None else str(call.decision)
        case _:
            assert_never(call)


@dataclass(slots=True)
class ScriptedWorld:
    """A world that answers from a script and notes every read.

    `inputs` holds per digital input the values of its successive reads, the last one for ever (an input
    not named is false); `levels` those of analog inputs (0 otherwise);
    `asynchronous` the M functions that the cell declares so.
    """

    inputs: Mapping[int, Sequence[bool]] = field(default_factory=dict)
    asynchronous: frozenset[int] = frozenset()
    levels: Mapping[int, float] = field(default_factory=dict)
    log: list[str] = field(default_factory=list)
    outputs: dict[int, bool] = field(default_factory=dict)
    analog: dict[int, float] = field(default_factory=dict)
    variables: dict[str, float] = field(default_factory=dict)
    flags: dict[int, bool] = field(default_factory=dict)
    _reads: dict[int, int] = field(default_factory=dict)

    def read(self, reading: Reading, *, line: int, ahead: bool) -> float:
        """As the script says, or as the program has set it."""
        value = self._present(reading)
        shown = _value(bool(value) if reading.is_switch else float(value))
        self.log.append(f"{line:4d} {reading} is {shown}{' ahead' if ahead else ''}")
        return value

    def _present(self, reading: Reading) -> float:
        match reading.kind:
            case "DI":
                values = self.inputs.get(reading.number) or (False,)
                turn = self._reads.get(reading.number, 0)
                self._reads[reading.number] = turn + 1
                return values[min(turn, len(values) - 1)]
            case "DO":
                return self.outputs.get(reading.number, False)
            case "M":  # raised by an asynchronous one; a synchronous one is reset at once
                return self.flags.get(reading.number, False)
            case "AI" | "AO" as kind:
                return (self.levels if kind == "AI" else self.analog).get(reading.number, 0.0)
            case _:
                return self.variables.get(reading.name, 0.0)

    def holds(self, condition: Condition, *, line: int) -> bool:
        """By the script."""
        return condition.holds(lambda reading: self.read(reading, line=line, ahead=False))

    def live_place(
        self, points: tuple[int | None, ...], frame: int, *, line: int, arrived: bool
    ) -> str | None:
        """Everything stays where it is."""
        return None

    def found(self) -> bool:
        """No search finds anything here."""
        return False

    def m_is_synchronous(self, index: int) -> bool:
        """As the script says; synchronous otherwise."""
        return index not in self.asynchronous

    def hopeless(self, index: int) -> bool:
        """Whether no later read of this input can be true."""
        values = self.inputs.get(index) or (False,)
        return not any(values[self._reads.get(index, 0) :]) and not values[-1]


@dataclass(slots=True)
class CanonicalPort:
    """A motion port that prints what it is given and performs it at once.

    `refuse_every` n ≥ 2: each n-th submission is refused once, as a full buffer would; from `limit`
    lines of the log on, every one is.
    """

    world: ScriptedWorld
    calls: list[Call] = field(default_factory=list)
    refuse_every: int = 0
    limit: int = CALL_LIMIT
    _submissions: int = 0

    def submit(self, call: Call) -> bool:
        """Take `call`, unless it is this submission's turn to be refused."""
        self._submissions += 1
        if self.refuse_every and self._submissions % self.refuse_every == 0:
            return False
        if len(self.world.log) >= self.limit:
            return False
        self.calls.append(call)
        self.world.log.append(describe(call))
        if isinstance(call, SetOutput):
            self.world.outputs[call.index] = call.value
        elif isinstance(call, SetLevel):
            self.world.analog[call.index] = call.value
        elif isinstance(call, SetVariable):
            before = self.world.variables.get(call.name, 0.0) if call.adds else 0.0
            self.world.variables[call.name] = before + call.value
        elif isinstance(call, RaiseM):
            self.world.flags[call.index] = not call.synchronous
        return True


def run_canonical(
    program: Program,
    world: ScriptedWorld | None = None,
    *,
    refuse_every: int = 0,
    call_limit: int = CALL_LIMIT,
) -> list[str]:
    """Run `program` to its end and return its canonical calls and reads, one line each."""
    world = world or ScriptedWorld()
    port = CanonicalPort(world, refuse_every=refuse_every, limit=call_limit)
    machine = Machine(program, port, world)
    while len(world.log) < call_limit:
        outcome = machine.run()
        match outcome:
            case BufferFull() | AtBarrier() | AwaitReset():
                continue
            case AwaitInput(line=line, index=index):
                if world.hopeless(index):
                    return [*world.log, f"{line:4d} STUCK DI{index}"]
            case AwaitCondition(line=line, condition=condition, seconds=None):
                if all(world.hopeless(each.number) for each in condition.readings if each.kind == "DI"):
                    return [*world.log, f"{line:4d} STUCK {condition.text}"]
            case AwaitCondition():
                continue
            case Ended():
                return world.log
            case Failed(line=line, code=code, message=message):
                return [*world.log, f"{line:4d} {code} {message}"]
            case _:
                assert_never(outcome)
    return [*world.log[:call_limit], f"     cut off after {call_limit} lines"]
