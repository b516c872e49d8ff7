"""Catalogue entries of cell and robot files (E27x) and of scenario files (E29x)."""

from __future__ import annotations

from typing import Final

from viapoint.language.codes.entry import Entry, Example, entry

_ROBOT = '[robot]\nmodel = "frigeni6"\n'

# Last digit of the code, title, what it means and what to do, and the faulty end of a cell and of a scenario.
_FAULTS: Final = (
    (
        1,
        "not valid TOML",
        """The text breaks the rules of TOML, so nothing in it can be read. The line is the one where the
        reader gave up; the cause often stands just before it: a missing quote, bracket or comma.""",
        "[controller\n",
        "[[at]]\nt_s =\n",
    ),
    (
        2,
        "unknown key",
        """A key that means nothing here. Keys are never ignored silently: a misspelt limit would leave
        the robot with another one. Correct the spelling, or move the key to its table.""",
        "[controller]\ntik_s = 0.001\n",
        "[[at]]\nt_s = 1.0\nsett = { DI1 = true }\n",
    ),
    (
        3,
        "missing key",
        "A key that has no default is missing in its table. Add it.",
        "[[tools]]\nxyz = [0, 0, 100]\n",
        "[[at]]\nset = { DI1 = true }\n",
    ),
    (
        4,
        "wrong type",
        """The value is of another type than the key takes: a text instead of a number, a number instead
        of a list. Texts stand in quotes, true and false and numbers do not.""",
        '[controller]\ntick_s = "1 ms"\n',
        '[[at]]\nt_s = "soon"\nset = { DI1 = true }\n',
    ),
    (
        5,
        "value out of its domain",
        """The value is of the right type but not one the key can take: a limit must be finite and greater
        than zero, a number must not be NaN, a word must be one of those listed.""",
        "[limits.path]\nspeed_mm_s = nan\n",
        "[[at]]\nt_s = -1.0\nset = { DI1 = true }\n",
    ),
    (
        6,
        "wrong number of values",
        "A list has too few or too many values: a position has three, a list per joint one for each joint.",
        "[[frames]]\nindex = 1\nxyz = [1, 2]\n",
        "[[conveyor]]\nindex = 1\nspeed_mm_s = [[0.0]]\n",
    ),
    (
        7,
        "used twice",
        "Two entries have the same index or name, so that a program could not tell them apart. Renumber one.",
        "[[tools]]\nindex = 1\n[[tools]]\nindex = 1\n",
        "[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, 0]]\n[[conveyor]]\nindex = 1\nspeed_mm_s = [[0, 0]]\n",
    ),
    (
        8,
        "refers to something that does not exist",
        "The name or index stands for no robot, frame, signal or belt that is known here.",
        '[io]\nnames = { gripper = "DO99" }\n',
        "[[at]]\nt_s = 1.0\nset = { DI99 = true }\n",
    ),
    (
        9,
        "values contradict each other",
        """Each value alone would do, together they do not: a range whose end lies before its beginning, a
        point outside the joint ranges, a point with both joints and coordinates, times that run
        backwards.""",
        "[points]\nP1 = { j = [500, 0, 0, 0, 0, 0] }\n",
        "[[conveyor]]\nindex = 1\nspeed_mm_s = [[1.0, 0.0], [0.5, 100.0]]\n",
    ),
)

_UNREADABLE = """The file does not exist, may not be read, or is not UTF-8 text. Check its name, counted from
        the folder the command is run in (files named inside a cell: from the cell's folder), and save
        it as UTF-8."""


def _cell_example(end: str) -> Example:
    return Example(cell=_ROBOT + end)


def _scenario_example(text: str) -> Example:
    return Example(program="WAIT 0.1\n", scenario=text)


ENTRIES: Final[tuple[Entry, ...]] = (
    entry(
        "E270",
        "cell or robot file cannot be read",
        _UNREADABLE,
        Example(cell='points = "nowhere.toml"\n' + _ROBOT),
    ),
    *(
        entry(f"E27{n}", f"cell file: {title}", text, _cell_example(cell))
        for n, title, text, cell, _ in _FAULTS
    ),
    entry(
        "E290",
        "scenario file cannot be read",
        _UNREADABLE,
        Example(data=b"[[at]]\nt_s = 1 # \xff\n"),
    ),
    *(
        entry(f"E29{n}", f"scenario file: {title}", text, _scenario_example(scenario))
        for n, title, text, _, scenario in _FAULTS
    ),
)
