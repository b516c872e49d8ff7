"""What the kernel is doing, what keeps it from going on, and which commands it takes when."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, unique
from types import MappingProxyType
from typing import Final


@unique
class State(Enum):
    """What the kernel is doing."""

    READY = "ready"
    MOVING = "moving"
    DWELLING = "dwelling"
    WAITING = "waiting"
    POLLING = "polling"
    COUPLING = "coupling"
    JOGGING = "jogging"
    HALTED = "halted"
    EMERGENCY = "emergency stop"
    STOPPED = "stopped"
    FINISHED = "finished"
    FAILED = "failed"

    @property
    def over(self) -> bool:
        """The run has ended, well or not."""
        return self in (State.STOPPED, State.FINISHED, State.FAILED)


@unique
class Hold(Enum):
    """Why the path is kept from going on, from the mildest to the strongest."""

    NONE = 0
    HALT = 1
    STOP = 2
    EMERGENCY = 3


@unique
class Command(Enum):
    """What may be asked of a kernel."""

    HALT = "halt"
    RESUME = "resume"
    STOP = "stop"
    EMERGENCY_STOP = "emergency stop"
    RESET = "reset"
    OVERRIDE = "override"
    STEP = "step"
    STEP_BACK = "step back"
    JOG = "jog"
    LET_GO = "let go"
    REFERENCE = "reference"


@unique
class Mode(Enum):
    """What decides whether a command is taken: the state, and what it is about to become."""

    READY = "ready"
    RUNNING = "running"
    JOGGING = "jogging"
    HELD = "held at no speed"  # at rest by its override, or where nothing is further back
    HALTING = "coming to a halt"  # or waiting, and halted
    HALTED = "halted"
    STOPPING = "stopping"
    BRAKING = "braking"  # for an emergency stop
    LATCHED = "latched"  # in emergency stop, at rest
    OVER = "over"
    FINISHED = "finished, and takes another program"
    BROKEN_OFF = "broken off, and takes another program"

    @classmethod
    def of(cls, state: State, hold: Hold, *, goes_on: bool = False) -> Mode:
        """Of a kernel; one that `goes_on` takes another program after the end of one."""
        if state.over:
            ended = cls.FINISHED if state is State.FINISHED else cls.BROKEN_OFF
            return ended if goes_on else cls.OVER
        if state is State.EMERGENCY:
            return cls.LATCHED
        at_rest = state is State.HALTED
        begun = {State.READY: cls.READY, State.JOGGING: cls.JOGGING, State.HALTED: cls.HELD}.get(
            state, cls.RUNNING
        )
        halted = cls.HALTED if at_rest else cls.HALTING
        return {Hold.HALT: halted, Hold.STOP: cls.STOPPING, Hold.EMERGENCY: cls.BRAKING}.get(hold, begun)


_NOTHING_HALTED: Final = "nothing is halted"
_NO_EMERGENCY: Final = "there is no emergency stop"
_STOPPING: Final = "the run is stopping, and ends"
_BRAKING: Final = "an emergency stop is under way"
_LATCHED: Final = "the robot is in emergency stop: reset it first"
_OVER: Final = "the run is over"
_NOT_BEGUN: Final = "the run has not begun"
_NOT_AT_REST: Final = "the robot is not halted"
_HALTED: Final = "it is halted already"
_JOGGING: Final = "the robot is being jogged"
_UNDER_WAY: Final = "a program is under way"
_NOT_JOGGED: Final = "nothing is being jogged"

_BETWEEN: Final = {Command.OVERRIDE, Command.STEP_BACK, Command.JOG, Command.REFERENCE}

_ENDED: Final = MappingProxyType(
    {
        **dict.fromkeys(set(Command) - _BETWEEN, _OVER),
        Command.LET_GO: _NOT_JOGGED,
    }
)
"""Between two programs: the override is that of the next one, the path behind can be travelled back, and the
robot can be jogged and referenced."""

REFUSALS: Final[Mapping[Mode, Mapping[Command, str]]] = MappingProxyType(
    {
        Mode.READY: {
            Command.RESUME: _NOTHING_HALTED,
            Command.RESET: _NO_EMERGENCY,
            Command.STEP: _NOT_BEGUN,
            Command.STEP_BACK: _NOT_BEGUN,
            Command.LET_GO: _NOT_JOGGED,
        },
        Mode.RUNNING: {
            Command.RESUME: _NOTHING_HALTED,
            Command.RESET: _NO_EMERGENCY,
            Command.STEP_BACK: _NOT_AT_REST,
            Command.JOG: _UNDER_WAY,
            Command.LET_GO: _NOT_JOGGED,
            Command.REFERENCE: _UNDER_WAY,
        },
        Mode.JOGGING: {
            Command.HALT: _JOGGING,
            Command.RESUME: _NOTHING_HALTED,
            Command.RESET: _NO_EMERGENCY,
            Command.STEP: _JOGGING,
            Command.STEP_BACK: _JOGGING,
            Command.REFERENCE: _JOGGING,
        },
        Mode.HELD: {
            Command.RESUME: _NOTHING_HALTED,
            Command.RESET: _NO_EMERGENCY,
            Command.JOG: _UNDER_WAY,
            Command.LET_GO: _NOT_JOGGED,
            Command.REFERENCE: _UNDER_WAY,
        },
        Mode.HALTING: {
            Command.HALT: _HALTED,
            Command.RESET: _NO_EMERGENCY,
            Command.STEP_BACK: _NOT_AT_REST,
            Command.JOG: _UNDER_WAY,
            Command.LET_GO: _NOT_JOGGED,
            Command.REFERENCE: _UNDER_WAY,
        },
        Mode.HALTED: {
            Command.HALT: _HALTED,
            Command.RESET: _NO_EMERGENCY,
            Command.JOG: _UNDER_WAY,
            Command.LET_GO: _NOT_JOGGED,
            Command.REFERENCE: _UNDER_WAY,
        },
        Mode.STOPPING: {
            Command.HALT: _STOPPING,
            Command.RESUME: _STOPPING,
            Command.STOP: _STOPPING,
            Command.RESET: _NO_EMERGENCY,
            Command.STEP: _STOPPING,
            Command.STEP_BACK: _STOPPING,
            Command.JOG: _STOPPING,
            Command.LET_GO: _STOPPING,
            Command.REFERENCE: _STOPPING,
        },
        Mode.BRAKING: {
            Command.HALT: _BRAKING,
            Command.RESUME: _BRAKING,
            Command.STOP: _BRAKING,
            Command.EMERGENCY_STOP: _BRAKING,
            Command.RESET: "the robot does not stand still yet",
            Command.STEP: _BRAKING,
            Command.STEP_BACK: _BRAKING,
            Command.JOG: _BRAKING,
            Command.LET_GO: _BRAKING,
            Command.REFERENCE: _BRAKING,
        },
        Mode.LATCHED: {
            Command.HALT: _LATCHED,
            Command.RESUME: _LATCHED,
            Command.STOP: _LATCHED,
            Command.EMERGENCY_STOP: "it is in emergency stop already",
            Command.STEP: _LATCHED,
            Command.STEP_BACK: _LATCHED,
            Command.JOG: _LATCHED,
            Command.LET_GO: _NOT_JOGGED,
            Command.REFERENCE: _LATCHED,
        },
        Mode.OVER: {**dict.fromkeys(Command, _OVER), Command.LET_GO: _NOT_JOGGED},
        Mode.FINISHED: _ENDED,
        Mode.BROKEN_OFF: {**_ENDED, Command.STEP_BACK: _OVER},
    }
)
"""Why a command is not taken in a mode; those that are not named are taken."""
