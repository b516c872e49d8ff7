"""Words of `:jog` as a jog."""

from __future__ import annotations

from viapoint.interactive import Interactive
from viapoint.jogging import Jog, JogError, JogSpace
from viapoint.jogging import statement as motion
from viapoint.repl import values
from viapoint.repl.console import Complaint


def statement(session: Interactive, words: list[str]) -> str:
    """`[base|tool|frame N] AXIS BY [at F]` as a motion from where the robot stands. Raises Complaint."""
    try:
        return motion(session, _jog(session, list(words)))
    except JogError as error:
        raise Complaint(str(error)) from None


def _jog(session: Interactive, words: list[str]) -> Jog:
    space = JogSpace.BASE
    if words and words[0].lower() in ("base", "tool", "frame"):
        space = JogSpace(words.pop(0).lower())
    frame = _frame(session, words) if space is JogSpace.FRAME else 0
    speed = None
    if len(words) > 2 and words[-2].lower() == "at":
        speed = values.positive(words[-1], "a speed")
        del words[-2:]
    if len(words) != 2:
        raise Complaint("say which axis and by how much: `:jog J2 -10`, `:jog tool Z 50`")
    axis, by = words[0].upper(), values.number(words[1], "an increment in mm or deg")
    if axis[:1] in ("J", "E") and axis[1:].isdecimal():
        if space is not JogSpace.BASE:
            raise Complaint(f"{axis} belongs to the robot, not to the {space.value}")
        space = JogSpace.JOINT
    elif axis not in tuple("XYZABC"):
        raise Complaint(f"`{words[0]}` is no axis: J1…, E1…, X, Y, Z, A, B or C")
    return Jog(axis, by, space, frame, speed)


def _frame(session: Interactive, words: list[str]) -> int:
    word = words.pop(0) if words else ""
    if not word.isdecimal() or int(word) not in session.cell.frames:
        known = ", ".join(str(each) for each in sorted(session.cell.frames))
        raise Complaint(f"`{word}` is no frame of the cell: {known}")
    return int(word)
