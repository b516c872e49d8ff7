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


@unique
class Mode(Enum):
    """What decides whether a command is taken: the state, and what it is about to become."""

    READY = "ready"
    RUNNING = "running"
    HALTED = "halted"  # or coming to a halt
    STOPPING = "stopping"
    BRAKING = "braking"  # for an emergency stop
    LATCHED = "latched"  # in emergency stop, at rest
    OVER = "over"

    @classmethod
    def of(cls, state: State, hold: Hold) -> Mode:
        """Of a kernel."""
        if state.over:
            return cls.OVER
        if state is State.EMERGENCY:
            return cls.LATCHED
        begun = cls.READY if state is State.READY else cls.RUNNING
        return {Hold.HALT: cls.HALTED, Hold.STOP: cls.STOPPING, Hold.EMERGENCY: cls.BRAKING}.get(hold, begun)


_NOTHING_HALTED: Final = "nothing is halted"
_NO_EMERGENCY: Final = "there is no emergency stop"
_STOPPING: Final = "the run is stopping, and ends"
_BRAKING: Final = "an emergency stop is under way"
_LATCHED: Final = "the robot is in emergency stop: reset it first"
_OVER: Final = "the run is over"

REFUSALS: Final[Mapping[Mode, Mapping[Command, str]]] = MappingProxyType(
    {
        Mode.READY: {Command.RESUME: _NOTHING_HALTED, Command.RESET: _NO_EMERGENCY},
        Mode.RUNNING: {Command.RESUME: _NOTHING_HALTED, Command.RESET: _NO_EMERGENCY},
        Mode.HALTED: {Command.HALT: "it is halted already", Command.RESET: _NO_EMERGENCY},
        Mode.STOPPING: {
            Command.HALT: _STOPPING,
            Command.RESUME: _STOPPING,
            Command.STOP: _STOPPING,
            Command.RESET: _NO_EMERGENCY,
        },
        Mode.BRAKING: {
            Command.HALT: _BRAKING,
            Command.RESUME: _BRAKING,
            Command.STOP: _BRAKING,
            Command.EMERGENCY_STOP: _BRAKING,
            Command.RESET: "the robot does not stand still yet",
        },
        Mode.LATCHED: {
            Command.HALT: _LATCHED,
            Command.RESUME: _LATCHED,
            Command.STOP: _LATCHED,
            Command.EMERGENCY_STOP: "it is in emergency stop already",
        },
        Mode.OVER: dict.fromkeys(Command, _OVER),
    }
)
"""Why a command is not taken in a mode; those that are not named are taken."""
