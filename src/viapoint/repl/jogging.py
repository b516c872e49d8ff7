"""Words of `:jog` as a jog: by an increment, or held."""

from __future__ import annotations

from viapoint.interactive import Interactive
from viapoint.jogging import HeldJog, Jog, JogError, JogSpace
from viapoint.jogging import statement as motion
from viapoint.repl import values
from viapoint.repl.console import Complaint


def statement(session: Interactive, words: list[str]) -> str:
    """`[base|tool|frame N] AXIS BY [at F]` as a motion from where the robot stands. Raises Complaint."""
    try:
        return motion(session, _jog(session, list(words)))
    except JogError as error:
        raise Complaint(str(error)) from None


def held(session: Interactive, words: list[str]) -> HeldJog | None:
    """`[base|tool|frame N] AXIS+|AXIS- [for S] [at F]`; None for words of an increment. Raises Complaint."""
    words = list(words)
    space, frame = _space(session, words)
    speed, seconds = _ending(words, "at", "a speed"), _ending(words, "for", "a time in s")
    speed = _ending(words, "at", "a speed") if speed is None else speed
    if len(words) != 1 or words[0][-1:] not in ("+", "-"):
        return None
    axis, space = _axis(words[0][:-1], space)
    return HeldJog(axis, 1 if words[0].endswith("+") else -1, space, frame, speed, seconds)


def _jog(session: Interactive, words: list[str]) -> Jog:
    space, frame = _space(session, words)
    speed = _ending(words, "at", "a speed")
    if len(words) != 2:
        raise Complaint("say which axis and how far, or how long: `:jog J2 -10`, `:jog tool Z+ for 2`")
    axis, space = _axis(words[0], space)
    return Jog(axis, values.number(words[1], "an increment in mm or deg"), space, frame, speed)


def _space(session: Interactive, words: list[str]) -> tuple[JogSpace, int]:
    """Taken from the beginning of the words."""
    if not words or words[0].lower() not in ("base", "tool", "frame"):
        return JogSpace.BASE, 0
    space = JogSpace(words.pop(0).lower())
    return space, _frame(session, words) if space is JogSpace.FRAME else 0


def _ending(words: list[str], key: str, what: str) -> float | None:
    """A number behind its key, taken from the end of the words."""
    if len(words) < 3 or words[-2].lower() != key:
        return None
    value = values.positive(words[-1], what)
    del words[-2:]
    return value


def _axis(word: str, space: JogSpace) -> tuple[str, JogSpace]:
    axis = word.upper()
    if axis[:1] in ("J", "E") and axis[1:].isdecimal():
        if space is not JogSpace.BASE:
            raise Complaint(f"{axis} belongs to the robot, not to the {space.value}")
        return axis, JogSpace.JOINT
    if axis not in tuple("XYZABC"):
        raise Complaint(f"`{word}` is no axis: J1…, E1…, X, Y, Z, A, B or C")
    return axis, space


def _frame(session: Interactive, words: list[str]) -> int:
    word = words.pop(0) if words else ""
    if not word.isdecimal() or int(word) not in session.cell.frames:
        known = ", ".join(str(each) for each in sorted(session.cell.frames))
        raise Complaint(f"`{word}` is no frame of the cell: {known}")
    return int(word)
