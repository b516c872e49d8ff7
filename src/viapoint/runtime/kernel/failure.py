"""Typed failures of the kernel: a catalogue code, a sentence, the source line."""

from __future__ import annotations

from typing import Final

from viapoint.runtime.records import Floats


class MotionError(Exception):
    """Something that stops a run: `code` of the catalogue, `message`, `line` of the program (0: none)."""

    def __init__(self, code: str, message: str, line: int, hint: str | None = None) -> None:
        super().__init__(f"{code}: {message}")
        self.code = code
        self.message = message
        self.line = line
        self.hint = hint


class PlanningError(MotionError):
    """E3xx: found while planning, before the robot moves there."""


_NEVER_HANDLED: Final = frozenset({"E390", "E392"})
"""Of planning: what cannot be run at all."""


def may_be_handled(error: MotionError) -> bool:
    """Whether a program may handle an error: it is one of planning, the robot stands on its path."""
    return error.code.startswith("E3") and error.code not in _NEVER_HANDLED


class OutOfReach(PlanningError):
    """A pose on a path is out of reach."""


class JointJump(PlanningError):
    """The joints cannot follow a stretch of path within one configuration: it breaks off at `place`, m.

    Where it does not join the path before it, `joints` (n,) are those in which it begins.
    """

    def __init__(
        self, code: str, message: str, line: int, hint: str | None, place: float, joints: Floats | None = None
    ) -> None:
        super().__init__(code, message, line, hint)
        self.place = place
        self.joints = joints


class ExecutionError(MotionError):
    """E4xx: found while running; the robot has been stopped on its path."""
