"""What the kernel is doing, and what keeps it from going on."""

from __future__ import annotations

from enum import Enum, unique


@unique
class State(Enum):
    """What the kernel is doing."""

    READY = "ready"
    MOVING = "moving"
    DWELLING = "dwelling"
    WAITING = "waiting"
    POLLING = "polling"
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
