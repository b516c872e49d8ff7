"""What is known of the program's course while it is read from top to bottom.

Everything here follows the text, not execution: where jumps make the course uncertain it says nothing
rather than something wrong.
"""

from __future__ import annotations

from dataclasses import dataclass

from viapoint.compiler.blocks import OpenIf
from viapoint.compiler.findings import Findings
from viapoint.language.source import Span
from viapoint.language.tree import Motion, Statement, statement_span


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionTraits:
    """What the checks of the course need of a motion's layout; positions in the values, -1: not given."""

    word: str
    has_speed: bool
    tool_at: int
    round_at: int


@dataclass(slots=True)
class _Rounded:
    """The motion before, if it asked for a round edge; `tool` is None where it is not known."""

    statement: Motion
    radius: float
    tool: int | None


class Flow:
    """Reachability, tracking, tool and the round edge that waits for its next motion."""

    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self.live = True  # the statement read next can be reached
        self.progress = 0  # statements so far that take time or may leave a loop
        self.tracking = False
        self._reported_dead = False
        self._tool: int | None = 0
        self._rounded: _Rounded | None = None
        self._speed_settled = False
        self._last: list[tuple[_Rounded, int]] = []

    def note_dead(self, statement: Statement) -> None:
        """`statement` cannot be reached: said once per stretch."""
        if not self._reported_dead:
            self._reported_dead = True
            self._findings.add(
                "W501",
                statement_span(statement),
                "this line is never reached",
                "remove it, or put a label in front",
            )

    def stop(self) -> None:
        """END or a GOTO: the next line is not reached from here."""
        self.live = False
        self._rounded = None
        self.progress += 1

    def motion(self, statement: Motion, traits: MotionTraits) -> None:
        """A motion: its speed, its tool, the corner before it."""
        self.progress += 1
        if not self._speed_settled:
            self._first_speed(statement, traits)
        tool = self._tool if traits.tool_at < 0 else int(statement.values[traits.tool_at])
        if self._rounded is not None:
            self._corner(self._rounded, tool, traits.word)
        self._rounded = None
        if traits.round_at >= 0:
            radius = statement.values[traits.round_at]
            if radius > 0:
                self._rounded = _Rounded(statement, radius, tool)
        if self.tracking and traits.word == "HOME":
            self._findings.add(
                "E209",
                statement_span(statement),
                "HOME while the robot follows a conveyor",
                "end tracking with TRK 0 first",
            )

    def _first_speed(self, statement: Motion, traits: MotionTraits) -> None:
        self._speed_settled = True
        if not traits.has_speed:
            self._findings.add(
                "W504",
                statement_span(statement),
                "no speed has been programmed before this motion: it runs at the cell's default",
                "add F, FC or FA",
            )

    def _corner(self, rounded: _Rounded, tool: int | None, word: str) -> None:
        if tool is not None and rounded.tool is not None and tool != rounded.tool:
            self._no_effect(rounded, "the tool changes behind it, which is an exact stop")
        elif word == "MS" and rounded.statement.command == "MS":
            self._findings.add(
                "W506",
                statement_span(rounded.statement),
                f"R{rounded.radius:g} between two MS is ignored: a spline is smooth there by itself",
                "leave R out",
            )

    def _no_effect(self, rounded: _Rounded, why: str) -> None:
        self._findings.add(
            "W505",
            statement_span(rounded.statement),
            f"R{rounded.radius:g} has no effect: {why}",
            "leave R out, or write R0 to say that the stop is meant",
        )

    def exact_stop(self, name: str) -> None:
        """A statement at which the path stops in any case."""
        if self._rounded is not None:
            self._no_effect(self._rounded, f"{name} behind it is an exact stop")
            self._rounded = None

    def takes_time(self) -> None:
        """A statement after which a loop is not endless work."""
        self.progress += 1

    def last(self, labels: int) -> None:
        """END, or the end of the text, with `labels` labels above: perhaps nothing follows."""
        if self._rounded is not None and self.live:
            self._last.append((self._rounded, labels))

    def finish(self, first_called: int) -> None:
        """Judge the last motions: an END behind label `first_called` may return and go on."""
        for rounded, labels in self._last:
            if labels <= first_called:
                self._no_effect(rounded, "no motion follows it")

    def select_tool(self, tool: int) -> None:
        """T n as a statement."""
        rounded = self._rounded
        if rounded is not None and rounded.tool is not None and tool != rounded.tool:
            self.exact_stop(f"the change to tool {tool}")
        self._tool = tool

    def label(self) -> None:
        """A label: execution may come from elsewhere."""
        if not self.live:
            self.tracking = False
        self.live = True
        self._reported_dead = False
        self._tool = None
        self._rounded = None

    def repeat(self) -> None:
        """A counted GOTO: the next motion is here or at its label."""
        self.progress += 1
        self._rounded = None

    def call(self) -> None:
        """A SUB: what it does to tool, speed and tracking is not followed."""
        self.progress += 1
        self._speed_settled = True
        self.tracking = False
        self._tool = None
        self._rounded = None

    # Branches. The rounded motion before an IF without reads could meet either branch: it is dropped.

    def enter_if(self, block: OpenIf) -> None:
        """Behind the condition of an IF."""
        self._rounded = None
        self.progress += 1
        block.live_before = self.live
        block.tracking_before = self.tracking

    def next_branch(self, block: OpenIf) -> None:
        """At ELSEIF or ELSE: the branch above is over, the next starts as the IF did."""
        self._finish_branch(block)
        self._restart(block.live_before, block.tracking_before, block.live_before)

    def leave_if(self, block: OpenIf) -> None:
        """At ENDIF."""
        self._finish_branch(block)
        live = block.runs_on
        tracking = block.tracking_after
        if block.false_patch is not None:  # no ELSE: the condition may be false
            live = live or block.live_before
            tracking = tracking and block.tracking_before
        self._restart(live, tracking, block.live_before)

    def _finish_branch(self, block: OpenIf) -> None:
        if self.live:
            block.runs_on = True
            block.tracking_after = block.tracking_after and self.tracking

    def _restart(self, live: bool, tracking: bool, reached: bool) -> None:
        """Go on behind a branch; in an IF that is not `reached` itself all has been said already."""
        self.live = live
        if reached:
            self._reported_dead = False
        self.tracking = tracking
        self._tool = None
        self._rounded = None


def loop_without_motion(findings: Findings, span: Span, label: str, line: int) -> None:
    """A GOTO back over lines that neither take time nor can leave."""
    findings.add(
        "W507",
        span,
        f"the loop from line {line} to here has neither motion nor waiting in it and never ends",
        f"put a motion or a WAIT between `{label}:` and this line",
    )
