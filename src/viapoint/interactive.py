"""A session that takes one program after the other: the robot, its signals and the time go on between them.

Tool and speed carry on from program to program, and so does the path: it can be travelled back over
what was executed before. What the prompt types, what a loaded program says and what a jog moves are
all programs here. Not here: reading commands, printing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from viapoint.jogging import HeldJog, Jog, statement
from viapoint.runtime.cell import Cell, Frame, Point, Tool
from viapoint.runtime.kernel import Start, State
from viapoint.runtime.kernel.breaks import HERE
from viapoint.runtime.kernel.buffer import MotionBuffer
from viapoint.runtime.kernel.dialogue import Dialogue
from viapoint.runtime.kernel.trace import Trace
from viapoint.runtime.records import Window
from viapoint.runtime.rotations import invert_pose
from viapoint.runtime.signals import Scenario
from viapoint.session import Listener, Loaded, Session, Status, compile_text
from viapoint.starting import Approaching, LineStart
from viapoint.vm import BEGINNING, Machine, Modal
from viapoint.vm.ports import Dwell, Motion

Question = Callable[[], bool]

_BUSY: Final = (State.MOVING, State.JOGGING, State.EMERGENCY)
"""States in which no program can begin."""

_NOTHING: Final = compile_text("", "<nothing>")


class Interactive(Session):
    """A robot that stands at home at tick 0 and runs what it is given.

    The points of its cell can be taught. Whoever drives it looks at windows with `run`, which comes to
    an end when nothing goes on by itself: the program is over, halted, or waits for somebody outside.
    """

    def __init__(
        self,
        cell: Cell,
        *,
        scenario: Scenario | None = None,
        override: float = 1.0,
        listeners: Sequence[Listener] = (),
    ) -> None:
        self.points: dict[int, Point] = dict(cell.points)
        """The points of `cell`: what is taught goes here."""
        self.modal = BEGINNING
        """What holds for the next program."""
        self._keeps_modal = False
        super().__init__(
            replace(cell, points=self.points),
            _NOTHING,
            scenario=scenario,
            override=override,
            patient=True,
            listeners=listeners,
        )
        self.kernel.goes_on = True
        self.finish()

    # --- programs ----------------------------------------------------------------------------------

    def take_on(
        self,
        program: Loaded,
        *,
        breakpoints: Mapping[int, Question] | None = None,
        keep_modal: bool = False,
        steps: int | None = None,
        start: LineStart | None = None,
    ) -> None:
        """Begin a program where the robot stands; `run` goes on with it.

        With `steps` it halts when so many statements have been executed. With `keep_modal` tool and speed
        are afterwards what they were. A `start` of `starting.start_at` is a line from which it begins, with
        what the lines above leave; the robot goes there first. Raises RuntimeError while another one is
        under way, or the robot moves.
        """
        if self.under_way or self.kernel.state in _BUSY:
            raise RuntimeError(f"{self.program.source.name} is {self.kernel.state.value}")
        if self.kernel.state is not State.FINISHED or start is not None:
            self._renew(None if start is None else replace(self.kernel.here, tool=start.tool))
        self.program, self._keeps_modal, self.status = program, keep_modal, Status.RUNNING
        ports = self.kernel.dialogue
        if start is None:
            self._machine = Machine(program.program, ports, ports, modal=self.modal)
        else:
            self._machine = start.machine.twin(Approaching(ports, start), ports)
        self.set_breakpoints(breakpoints or {})
        self.kernel.take_on(self._machine, steps)
        self._note_end()

    def jog(self, jog: Jog) -> None:
        """Begin a move by an increment from where the robot stands; `run` does it, `stop` ends it early.

        Tool and speed stay what they are. What leads past limits, out of reach or into a zone is refused
        before the robot moves, as any motion: `failure` says why. Raises JogError for what the robot has
        not, CompileError for a number too large, and RuntimeError as `take_on`.
        """
        self.take_on(compile_text(statement(self, jog), "<jog>", self.cell), keep_modal=True)

    def hold(self, held: HeldJog) -> str | None:
        """Jog from the next tick on, between programs, for as long as it is held; `run` does it.

        As in a `Session`. The path before it is forgotten.
        """
        return self._program_in_the_way() or super().hold(held)

    def reference(self, axes: Mapping[str, float]) -> str | None:
        """Say where the axes stand, between programs. As in a `Session`; the path before it is forgotten."""
        return self._program_in_the_way() or super().reference(axes)

    def _program_in_the_way(self) -> str | None:
        """Of what is done between programs: which one is under way. Then nothing lies behind the robot."""
        if self.under_way:
            return f"{self.program.source.name} is {self.kernel.state.value}"
        if self.kernel.state is State.HALTED:  # on the way back over a program that is over
            self._stand_anew()
        return None

    def _stand_anew(self, here: Start | None = None) -> None:
        self._renew(here)
        ports = self.kernel.dialogue
        self._machine = Machine(_NOTHING.program, ports, ports, modal=self.modal)
        self.kernel.take_on(self._machine)

    @property
    def under_way(self) -> bool:
        """Whether a program has begun and is not over."""
        return self.status is Status.RUNNING

    def run(self, most: int | None = None, *, at_least: int = 0) -> Iterator[Window]:
        """Windows up to where nothing goes on by itself, `most` ticks in all.

        So many ticks as are asked for `at_least` pass in any case.
        """
        if self.kernel.state is State.READY:
            yield from super().run()
        begin = self.kernel.tick
        while (passed := self.kernel.tick - begin) < at_least or not self.at_rest:
            left = self._window if most is None else min(self._window, most - passed)
            if self.at_rest:
                left = min(left, at_least - passed)
            if left <= 0:
                return
            yield self.advance(left)
            self._note_end()
        if (
            self.kernel.over
            and most is None
            and self._world.next_change(self.kernel.tick) == self.kernel.tick + 1
        ):
            yield self.advance(1)  # so that the next program sees what this one has written

    @property
    def next_line(self) -> int:
        """Source line of what is executed next, as far as it is known; of the place where the robot is."""
        entry = self.kernel.execution.front
        return self.kernel.line_here if entry is None or self.kernel.astray else entry.call.line

    @property
    def robot_line(self) -> int:
        """Source line of the place where the robot is, also when it went back."""
        return self.kernel.line_here

    @property
    def between(self) -> bool:
        """Whether the robot is at a place between two motions, not within one."""
        s = self.kernel.mover.s
        return s - self.kernel.planner.route.place_before(s + HERE) < HERE

    @property
    def interpreter_line(self) -> int:
        """Source line the interpreter has reached."""
        return self.kernel.dialogue.line

    # --- commands ----------------------------------------------------------------------------------

    def resume(self) -> str | None:
        """Go on along the path after a halt, a step or a step back, to the next breakpoint."""
        refused = super().resume()
        self._note_end()
        return refused

    def step_on(self, statements: int = 1) -> str | None:
        """Go on, and halt on the path when so many statements have been executed; `run` does it."""
        refused = self.kernel.step(statements)
        self._note_end()
        return refused

    def step_back(self) -> str | None:
        """Back along the path to where the motion before began; `run` does it."""
        return self.kernel.step_back()

    def stop(self) -> str | None:
        """Stop on the path within the limits and leave the program there; `run` does it."""
        refused = super().stop()
        self._note_end()
        return refused

    def set_breakpoints(self, lines: Mapping[int, Question]) -> None:
        """Lines of the program under way before which the robot halts, if what is asked there says so."""
        self.kernel.breaks.lines = lines

    def question(self, condition: str) -> Question:
        """A condition of the language, to be asked at any time. Raises CompileError."""
        loaded = compile_text(f"IF {condition}\nWAIT 1\nENDIF\n", "<condition>", self.cell)
        return lambda: self._answer(loaded)

    def _answer(self, loaded: Loaded) -> bool:
        """Whether the branch of `loaded` is taken now; what it reads leaves no trace."""
        buffer = MotionBuffer(2)  # the barrier and the wait
        silent = Trace(lambda event: None, self.cell.tick)
        ports = Dialogue(self.cell, self._world, buffer, silent, lambda: 0.0, patient=True)
        machine = Machine(loaded.program, ports, ports)
        machine.run()
        machine.run()
        while (entry := buffer.to_plan()) is not None and not isinstance(entry.call, Dwell):
            buffer.planned()
        return entry is not None

    # --- points --------------------------------------------------------------------------------------

    def teach(self, index: int, *, frame: int = 0, joints: bool = False, name: str | None = None) -> Point:
        """Make where the robot stands a point: its pose in a frame, or its joints. Raises KeyError.

        A point that had a name keeps it.
        """
        known = self.points.get(index)
        point = Point(
            index=index,
            name=name or (known.name if known is not None else None),
            pose=None if joints else invert_pose(self.frame(frame)) @ self.pose,
            joints=self.kernel.telemetry.joints.copy() if joints else None,
            auxiliary=tuple(self.kernel.telemetry.auxiliary.tolist()),
        )
        self.points[index] = point
        self.kernel.place(point)  # also over one that was captured
        return point

    def equip(self, *, tools: Sequence[Tool] = (), frames: Sequence[Frame] = ()) -> None:
        """From now on the cell has these tools and frames, by their index; the path before it is forgotten.

        Raises RuntimeError while a program is under way or the robot moves.
        """
        if self.under_way or self.kernel.state in _BUSY:
            raise RuntimeError(f"the robot is {self.kernel.state.value}")
        self.cell = replace(
            self.cell,
            tools={**self.cell.tools, **{tool.index: tool for tool in tools}},
            frames={**self.cell.frames, **{frame.index: frame for frame in frames}},
        )
        self._stand_anew()

    # --- the end of a program ----------------------------------------------------------------------

    def _note_end(self) -> None:
        if not self.kernel.over or not self.under_way:
            return
        self.status = self.final_status()
        if not self._keeps_modal:
            self.modal = self._modal_here()

    def _modal_here(self) -> Modal:
        """What holds at the robot's place: the interpreter may have been ahead of it."""
        modal = self._machine.modal
        if self.status is Status.FINISHED:
            return modal
        entry = self.kernel.execution.front
        speed = entry.call.speed if entry is not None and isinstance(entry.call, Motion) else modal.speed
        return Modal(speed, self.kernel.tool)
