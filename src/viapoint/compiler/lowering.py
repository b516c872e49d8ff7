"""From the tree to bytecode in one pass over the statements; the checks of meaning ride along.

One handler per kind of statement, no object per line: numbers go to one array, code to one buffer.
Places are added at the end (`span_map`), where they cost least.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass

from viapoint.compiler.actions import ActionLowering, Handler
from viapoint.compiler.blocks import Blocks, OpenIf
from viapoint.compiler.cell_checks import CellChecks
from viapoint.compiler.cell_names import CellNames
from viapoint.compiler.conditions import ConditionLowering
from viapoint.compiler.findings import Findings
from viapoint.compiler.flow import Flow, MotionTraits, loop_without_motion
from viapoint.compiler.handlers import check_handlers
from viapoint.compiler.labels import Labels
from viapoint.compiler.names import Names
from viapoint.compiler.places import span_map
from viapoint.language import tree
from viapoint.language.tree import statement_span
from viapoint.vm.instructions import SIZES, Instruction, operand_offset, packer
from viapoint.vm.instructions import Operand as Op
from viapoint.vm.ports import Decision
from viapoint.vm.program import Label, Program, hash_source
from viapoint.vm.shapes import INSTRUCTION_BY_WORD

_I = Instruction
_MOTION_CODES = {word: one.spec.code for word, one in INSTRUCTION_BY_WORD.items()}
_pack_motion = packer(_I.LINE)  # all motions are laid out alike
_JUMP_TARGET = operand_offset(_I.JUMP, Op.TARGET)
_BRANCH_TARGET = operand_offset(_I.JUMP_IF_FALSE, Op.TARGET)
_REPEAT_TARGET = operand_offset(_I.REPEAT, Op.TARGET)
_CALL_TARGET = operand_offset(_I.CALL, Op.TARGET)
_ON_HANDLER = operand_offset(_I.ON, Op.HANDLER)
_OFF_HANDLER = operand_offset(_I.OFF, Op.HANDLER)
_ERROR_HANDLER = operand_offset(_I.ON_ERROR, Op.HANDLER)
_DECISIONS = {
    tree.Stop: Decision.STOP,
    tree.Retry: Decision.RETRY,
    tree.ResumeNext: Decision.RESUME_NEXT,
}
_SPEEDS = frozenset({"F", "FC", "FA"})


@dataclass(frozen=True, slots=True)
class _MotionPlan:
    """All that is known of a motion from its layout alone."""

    code: int
    shape: int
    traits: MotionTraits
    checks: tuple[tuple[Callable[[tree.Motion, int], None], int], ...]


class Lowering(ActionLowering):
    """One program on its way to bytecode."""

    def __init__(self, program: tree.Program, findings: Findings, cell: CellNames | None) -> None:
        self._tree = program
        self._findings = findings
        self._cell = CellChecks(cell, findings, program.source) if cell is not None else None
        self._names = Names(cell, findings, program.source)
        super().__init__()
        self._addresses = array("I")
        self._plans: dict[tree.Layout, _MotionPlan] = {}
        self._shapes: dict[str, int] = {}
        self._blocks = Blocks()
        self._flow = Flow(findings)
        self.labels = Labels(findings, self._blocks)
        self._search: int | None = None  # text of the search that the motion being lowered makes
        self._conditions = ConditionLowering(self._numbers, self._text)
        self._handlers: dict[type, Handler] = {
            tree.Motion: self._motion,
            tree.Until: self._until,
            tree.SelectTool: self._select_tool,
            tree.Track: self._track,
            tree.Tangent: self._tangent,
            tree.Wait: self._wait,
            tree.WaitInput: self._wait_input,
            tree.WaitFor: self._wait_for,
            tree.SetOutput: self._set_output,
            tree.SetLevel: self._set_level,
            tree.Pulse: self._pulse,
            tree.Let: self._let,
            tree.Inc: self._inc,
            tree.At: self._at,
            tree.Sync: self._sync,
            tree.MFunction: self._m_function,
            tree.If: self._if,
            tree.ElseIf: self._else_if,
            tree.Else: self._else,
            tree.EndIf: self._end_if,
            tree.Goto: self._goto,
            tree.Sub: self._sub,
            tree.On: self._on,
            tree.OnError: self._on_error,
            tree.Off: self._off,
            **dict.fromkeys(_DECISIONS, self._decide),
            tree.End: self._end,
            tree.Label: self._label,
        }

    def run(self) -> None:
        """Lower every statement, then close the program with an END."""
        code, flow, handlers = self._code, self._flow, self._handlers
        at = self._addresses.append
        for statement in self._tree.statements:
            at(len(code))
            if not flow.live and statement.__class__ not in _NEVER_DEAD:
                flow.note_dead(statement)
            handlers[statement.__class__](statement)
        flow.last(len(self.labels.defined))
        for block in self._blocks.open:
            self._findings.add(
                "E205",
                statement_span(block.statement),
                "this IF has no ENDIF",
                "write ENDIF behind its last branch",
            )
        self._emit(_I.END)

    def finish(self, excused: frozenset[str]) -> None:
        """Resolve the labels and say what can only be said at the end."""
        self.labels.resolve(self._patch, excused)
        self.labels.lint()
        check_handlers(self._tree.statements, self.labels.defined, self._findings)
        self._flow.finish(self.labels.first_called)

    def program(self) -> Program:
        """The bytecode; only meaningful when nothing was an error."""
        source = self._tree.source
        return Program(
            name=source.name,
            code=bytes(self._code),
            numbers=self._numbers,
            shapes=tuple(self._shapes),
            texts=tuple(self._texts),
            labels=tuple(Label(each.statement.name, each.address) for each in self.labels.defined.values()),
            spans=span_map(self._tree, self._addresses),
            source_hash=hash_source(source.text),
            source_text=source.text,
        )

    # Motions and actions

    def _motion(self, statement: tree.Motion) -> None:
        if statement.names:
            statement = self._names.motion(statement)
        layout, values = statement.layout, statement.values
        plan = self._plans.get(layout) or self._plan(layout)
        numbers = self._numbers
        self._code += _pack_motion(plan.code, plan.shape, len(numbers))
        numbers.extend(values)
        if self._cell and (live := self._cell.live_places(statement)):
            self._flow.exact_stop(f"reading {live[0]}")
        self._flow.motion(statement, plan.traits)
        checks = plan.checks
        if statement.names:  # unknown ones
            unknown = {at for at, _ in statement.names}
            checks = tuple(each for each in checks if each[1] not in unknown)
        for check, at in checks:
            check(statement, at)
        if self._search is not None:
            self._emit(_I.BARRIER, self._search)
            self._search = None
            self._flow.exact_stop("the search")

    def _until(self, statement: tree.Until) -> None:
        condition = self._names.condition(statement.condition, statement.start)
        lowered = self._conditions.lower(condition)
        self._search = self._text(f"UNTIL {lowered.text}")
        kept = 0 if statement.capture is None else statement.capture + 1
        self._emit(_I.UNTIL, len(self._code) + SIZES[_I.UNTIL] + len(lowered.code), self._search, kept)
        self._code += lowered.code
        if self._cell:
            self._cell.condition(lowered.reads, statement.start)
            if statement.capture is not None:
                self._cell.kept_point(statement.capture, statement_span(statement))

    def _plan(self, layout: tree.Layout) -> _MotionPlan:
        codes = layout.codes
        shape = self._shapes.setdefault(" ".join(codes), len(self._shapes))
        traits = MotionTraits(
            word=layout.command,
            has_speed=not _SPEEDS.isdisjoint(codes),
            tool_at=codes.index("T") if "T" in codes else -1,
            round_at=codes.index("R") if "R" in codes else -1,
        )
        checks = self._cell.of_layout(codes) if self._cell else ()
        plan = _MotionPlan(_MOTION_CODES[layout.command], shape, traits, checks)
        self._plans[layout] = plan
        return plan

    def _select_tool(self, statement: tree.SelectTool) -> None:
        self._emit(_I.SELECT_TOOL, statement.tool)
        self._flow.select_tool(statement.tool)
        if self._cell:
            self._cell.tool(statement.tool, statement_span(statement))

    def _track(self, statement: tree.Track) -> None:
        self._emit(_I.TRACK, statement.conveyor)
        self._flow.exact_stop("TRK")
        self._flow.tracking = statement.conveyor > 0
        if self._cell:
            self._cell.conveyor(statement.conveyor, statement_span(statement))

    def _tangent(self, statement: tree.Tangent) -> None:
        self._emit(_I.TANGENT, int(statement.on), self._number(statement.offset))

    def _wait(self, statement: tree.Wait) -> None:
        self._emit(_I.DWELL, self._number(statement.seconds))
        self._flow.exact_stop("WAIT")
        if statement.seconds > 0:
            self._flow.takes_time()

    def _wait_input(self, statement: tree.WaitInput) -> None:
        self._emit(_I.BARRIER, self._text(f"WAIT DI {statement.input}"))
        self._emit(_I.AWAIT_INPUT, statement.input)
        self._flow.exact_stop("WAIT DI")
        self._flow.takes_time()
        if self._cell:
            self._cell.signal("DI", statement.input, statement_span(statement))

    def _wait_for(self, statement: tree.WaitFor) -> None:
        condition = self._names.condition(statement.condition, statement.start)
        lowered = self._conditions.lower(condition)
        text = self._text(f"WAIT {lowered.text}")
        self._emit(_I.BARRIER, text)
        wait = _I.AWAIT if statement.timeout is None else _I.AWAIT_FOR
        behind = len(self._code) + SIZES[wait] + len(lowered.code)
        limit = () if statement.timeout is None else (self._number(statement.timeout),)
        self._emit(wait, behind, text, *limit)
        self._code += lowered.code
        if statement.timeout is not None:
            operand = len(self._code) + _BRANCH_TARGET
            self._emit(_I.JUMP_IF_FALSE, behind + SIZES[_I.JUMP_IF_FALSE])
            if statement.label is not None:
                self.labels.refer(statement, operand)
        self._flow.exact_stop("WAIT")
        self._flow.takes_time()
        if self._cell:
            self._cell.condition(lowered.reads, statement.start)

    def _sync(self, statement: tree.Sync) -> None:
        self._emit(_I.BARRIER, self._text("SYNC"))
        self._flow.exact_stop("SYNC")
        self._flow.takes_time()

    # Branches

    def _condition(self, statement: tree.If | tree.ElseIf, word: str, arrived: bool) -> tuple[int, bool]:
        """Barrier, condition and its jump: where the jump's target goes, and whether the path stands."""
        condition = self._names.condition(statement.condition, statement.start)
        lowered = self._conditions.lower(condition, ahead=statement.ahead)
        if lowered.reads and not arrived and not statement.ahead:
            self._emit(_I.BARRIER, self._text(f"{word} {lowered.text}"))
            self._flow.exact_stop(word)
            arrived = True
        if self._cell:
            self._cell.condition(lowered.reads, statement.start)
        self._code += lowered.code
        operand = len(self._code) + _BRANCH_TARGET
        self._emit(_I.JUMP_IF_FALSE, 0)
        return operand, arrived

    def _if(self, statement: tree.If) -> None:
        operand, arrived = self._condition(statement, "IF", False)
        block = OpenIf(statement, self._blocks.enter(), operand, arrived)
        self._blocks.open.append(block)
        self._flow.enter_if(block)

    def _innermost(self, statement: tree.ElseIf | tree.Else, word: str) -> OpenIf | None:
        """The IF that ELSEIF or ELSE belongs to, if it may."""
        if not self._blocks.open:
            self._findings.add(
                "E206", statement_span(statement), f"{word} without IF", "write IF in front of it"
            )
            return None
        block = self._blocks.open[-1]
        if block.else_line is not None:
            self._findings.add(
                "E208",
                statement_span(statement),
                f"{word} behind the ELSE of line {block.else_line}",
                "ELSE is the last branch: put it behind every ELSEIF, and only once",
                (statement_span(block.statement), "the IF"),
            )
            return None
        return block

    def _next_branch(self, block: OpenIf) -> None:
        """Leave the branch above; its condition's jump comes here."""
        block.end_patches.append(len(self._code) + _JUMP_TARGET)
        self._emit(_I.JUMP, 0)
        self._here(block)
        self._blocks.leave(block.block)
        block.block = self._blocks.enter()
        self._flow.next_branch(block)

    def _here(self, block: OpenIf) -> None:
        if block.false_patch is not None:
            self._patch(block.false_patch, len(self._code))

    def _else_if(self, statement: tree.ElseIf) -> None:
        block = self._innermost(statement, "ELSEIF")
        if block is not None:
            self._next_branch(block)
            block.false_patch, block.arrived = self._condition(statement, "ELSEIF", block.arrived)

    def _else(self, statement: tree.Else) -> None:
        block = self._innermost(statement, "ELSE")
        if block is not None:
            self._next_branch(block)
            block.false_patch = None
            block.else_line = statement.line

    def _end_if(self, statement: tree.EndIf) -> None:
        if not self._blocks.open:
            self._findings.add(
                "E207", statement_span(statement), "ENDIF without IF", "remove it, or write IF above"
            )
            return
        block = self._blocks.open.pop()
        self._here(block)
        for operand in block.end_patches:
            self._patch(operand, len(self._code))
        self._blocks.leave(block.block)
        self._flow.leave_if(block)

    # Jumps

    def _label(self, statement: tree.Label) -> None:
        flow = self._flow
        index = self.labels.define(statement, len(self._code), fallen_into=flow.live, progress=flow.progress)
        self._emit(_I.LABEL, index)
        flow.label()

    def _goto(self, statement: tree.Goto) -> None:
        above = self.labels.find(statement.label)
        if statement.times is not None:
            self.labels.refer(statement, len(self._code) + _REPEAT_TARGET)
            self._emit(_I.REPEAT, above.index if above else 0, 0, statement.times)
            self.labels.count(statement, above)
            self._flow.repeat()
            return
        self.labels.refer(statement, len(self._code) + _JUMP_TARGET)
        self._emit(_I.JUMP, 0)
        if above is not None and above.progress == self._flow.progress and not self._blocks.open:
            loop_without_motion(
                self._findings, statement_span(statement), above.statement.name, above.statement.line
            )
        self._flow.stop()

    def _sub(self, statement: tree.Sub) -> None:
        self.labels.refer(statement, len(self._code) + _CALL_TARGET)
        self._emit(_I.CALL, 0, 1 if statement.times is None else statement.times)
        self._flow.call()

    def _on(self, statement: tree.On) -> None:
        condition = self._names.condition(statement.condition, statement.start)
        lowered = self._conditions.lower(condition)
        self.labels.refer(statement, len(self._code) + _ON_HANDLER)
        behind = len(self._code) + SIZES[_I.ON] + len(lowered.code)
        self._emit(_I.ON, behind, self._text(lowered.text), 0)
        self._code += lowered.code
        if self._cell:
            self._cell.condition(lowered.reads, statement.start)

    def _on_error(self, statement: tree.OnError) -> None:
        self.labels.refer(statement, len(self._code) + _ERROR_HANDLER)
        self._emit(_I.ON_ERROR, 0)

    def _decide(self, statement: tree.Decision) -> None:
        self._emit(_I.DECIDE, _DECISIONS[type(statement)].value)
        self._flow.stop()

    def _off(self, statement: tree.Off) -> None:
        self.labels.refer(statement, len(self._code) + _OFF_HANDLER)
        self._emit(_I.OFF, 0)

    def _end(self, statement: tree.End) -> None:
        self._emit(_I.END)
        self._flow.last(len(self.labels.defined))
        self._flow.stop()


_NEVER_DEAD = frozenset({tree.Label, tree.ElseIf, tree.Else, tree.EndIf, tree.End})
"""Statements that need no way to be reached: they open a way, close a block, or only bound the text."""

assert len({SIZES[one] for one in INSTRUCTION_BY_WORD.values()}) == 1
