"""Checks of a program's indices against a cell. Without a cell none of this runs."""

from __future__ import annotations

from collections.abc import Callable, Collection

from viapoint.compiler.cell_names import CellNames
from viapoint.compiler.conditions import Read
from viapoint.compiler.findings import Findings, defined_are
from viapoint.language.lexical import parameter_spans
from viapoint.language.source import Source, Span
from viapoint.language.tree import Motion, Signal, statement_span


def live_places(motion: Motion, cell: CellNames) -> tuple[str, ...]:
    """The points and the frame of a motion that are live in a cell: P7, Z2."""
    if not cell.live_points and not cell.live_frames:
        return ()
    live = {"P": cell.live_points, "Q": cell.live_points, "Z": cell.live_frames}
    found = (
        f"{'P' if code == 'Q' else code}{value:g}"
        for code, value in zip(motion.layout.codes, motion.values, strict=True)
        if code in live and value in live[code]
    )
    return tuple(dict.fromkeys(found))


_Check = Callable[[Motion, int], None]


class CellChecks:
    """Says what a program names that its cell does not have."""

    def __init__(self, cell: CellNames, findings: Findings, source: Source) -> None:
        self._cell = cell
        self._findings = findings
        self._source = source

    def _index(
        self, code: str, kind: str, letter: str, index: int, defined: Collection[int], span: Span
    ) -> None:
        if index not in defined and not self._findings.full:
            self._findings.add(
                code,
                span,
                f"{kind} {letter}{index} is not defined in the cell",
                defined_are(kind, letter, index, defined),
            )

    def _parameter(self, motion: Motion, at: int) -> Span:
        return parameter_spans(self._source, motion)[at]

    def point(self, motion: Motion, at: int) -> None:
        """P or Q at position `at` of the motion's values."""
        index = int(motion.values[at])
        if index not in self._cell.points and not self._findings.full:
            self._index("E220", "point", "P", index, self._cell.points, self._parameter(motion, at))

    def kept_point(self, index: int, span: Span) -> None:
        """P of CAPTURE."""
        self._index("E220", "point", "P", index, self._cell.points, span)

    def frame(self, motion: Motion, at: int) -> None:
        """Z: 0 is the base, which every cell has."""
        index = int(motion.values[at])
        if index and index not in self._cell.frames:
            self._index("E221", "frame", "Z", index, self._cell.frames, self._parameter(motion, at))

    def motion_tool(self, motion: Motion, at: int) -> None:
        """T on a motion: 0 is no tool."""
        index = int(motion.values[at])
        if index and index not in self._cell.tools:
            self._index("E222", "tool", "T", index, self._cell.tools, self._parameter(motion, at))

    def joint(self, motion: Motion, at: int) -> None:
        """J i=."""
        number = int(motion.layout.codes[at][1:-1])
        if number > self._cell.joints:
            self._findings.add(
                "E226",
                self._parameter(motion, at),
                f"the robot has no joint J{number}",
                f"its joints are J1 to J{self._cell.joints}",
            )

    def axis(self, motion: Motion, at: int) -> None:
        """E i=."""
        number = int(motion.layout.codes[at][1:-1])
        span = self._parameter(motion, at)
        self._index("E227", "auxiliary axis", "E", number, self._cell.auxiliary, span)

    def references(self, motion: Motion, at: int) -> None:
        """Joint references beside the point at position `at`: it must be one of the path space."""
        index = int(motion.values[at])
        if index in self._cell.joint_points:
            self._findings.add(
                "E211",
                statement_span(motion),
                f"P{index} was taught in joint space: joint references have nothing to choose there",
                "leave the J parameters out",
            )

    def of_layout(self, codes: tuple[str, ...]) -> tuple[tuple[_Check, int], ...]:
        """The checks that motions of one layout need, each with the position it looks at."""
        checks: list[tuple[_Check, int]] = []
        referenced = any(code[0] == "J" for code in codes)
        for at, code in enumerate(codes):
            if code in ("P", "Q"):
                checks.append((self.point, at))
                if referenced:
                    checks.append((self.references, at))
            elif code == "Z":
                checks.append((self.frame, at))
            elif code == "T":
                checks.append((self.motion_tool, at))
            elif code[0] == "J":
                checks.append((self.joint, at))
            elif code[0] == "E":
                checks.append((self.axis, at))
        return tuple(checks)

    def tool(self, index: int, span: Span) -> None:
        """T n."""
        if index:
            self._index("E222", "tool", "T", index, self._cell.tools, span)

    def conveyor(self, index: int, span: Span) -> None:
        """TRK n."""
        if index:
            self._index("E223", "conveyor", "", index, self._cell.conveyors, span)

    def signal(self, kind: str, index: int, span: Span) -> None:
        """A signal, wherever it is read or written; every M function exists."""
        match kind:
            case "DI":
                self._index("E224", "digital input", kind, index, self._cell.inputs, span)
            case "DO":
                self._index("E225", "digital output", kind, index, self._cell.outputs, span)
            case "AI":
                self._index("E231", "analog input", kind, index, self._cell.analog_inputs, span)
            case "AO":
                self._index("E232", "analog output", kind, index, self._cell.analog_outputs, span)

    def condition(self, reads: tuple[Read, ...], start: int) -> None:
        """The signals that are read in the statement at `start`; variables are found by their names."""
        for read in reads:
            if isinstance(read, Signal):
                self.signal(read.kind, read.number, Span(start + read.start, start + read.end))

    def live_places(self, motion: Motion) -> tuple[str, ...]:
        """The points and the frame of a motion that the application may move while the program runs."""
        return live_places(motion, self._cell)

    def is_synchronous(self, function: int) -> bool:
        """How the cell declares an M function."""
        return function not in self._cell.asynchronous
