"""Labels: where they stand, who refers to them, and what is wrong with that."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from viapoint.compiler.blocks import Blocks
from viapoint.compiler.findings import Findings
from viapoint.language.suggestions import did_you_mean
from viapoint.language.tree import Goto, Label, Off, On, OnError, Sub, WaitFor, name_key, statement_span
from viapoint.vm.instructions import SIZES, Instruction

COMPARISONS = 20_000
"""Comparisons of names made for hints in one program: a third of a second at most."""


@dataclass(slots=True)
class Definition:
    """A label with what is known where it stands."""

    statement: Label
    index: int
    address: int
    block: int
    fallen_into: bool
    progress: int  # statements before it that take time or may leave
    jumped_to: bool = False
    called: bool = False
    counted: Goto | None = None  # the first counted GOTO back to it


Referring: TypeAlias = Goto | Sub | WaitFor | On | OnError | Off
"""Statements that name a label."""


class Reference(NamedTuple):
    """A statement whose label may come later: where the operand stands that gets the address."""

    statement: Referring
    block: int
    operand: int

    @property
    def label(self) -> str:
        """The label's name as written."""
        assert self.statement.label is not None
        return self.statement.label


class Labels:
    """The labels of one program, and the jumps waiting for them."""

    def __init__(self, findings: Findings, blocks: Blocks) -> None:
        self._findings = findings
        self._blocks = blocks
        self._references: list[Reference] = []
        self._unknown_labels = 0
        self.defined: dict[str, Definition] = {}

    def define(self, statement: Label, address: int, *, fallen_into: bool, progress: int) -> int:
        """A label stands at `address`; its index."""
        key = name_key(statement.name)
        earlier = self.defined.get(key)
        if earlier is not None:
            self._findings.add(
                "E202",
                statement_span(statement),
                f"label `{statement.name}` is declared twice",
                f"it stands in line {earlier.statement.line} already; give one of them another name",
                (statement_span(earlier.statement), "first declared here"),
            )
            return earlier.index
        index = len(self.defined)
        self.defined[key] = Definition(statement, index, address, self._blocks.current, fallen_into, progress)
        return index

    def find(self, name: str) -> Definition | None:
        """The label, if it stands above."""
        return self.defined.get(name_key(name))

    def refer(self, statement: Referring, operand: int) -> None:
        """`statement` names its label; `operand` is where the address goes at the end."""
        self._references.append(Reference(statement, self._blocks.current, operand))

    def resolve(self, patch: Callable[[int, int], None], excused: frozenset[str]) -> None:
        """Fill in all addresses with `patch(operand, address)`, or say what is wrong.

        `excused` are keys of labels on lines that the parser refused.
        """
        for reference in self._references:
            statement = reference.statement
            definition = self.defined.get(name_key(reference.label))
            if definition is None:
                if name_key(reference.label) not in excused:
                    self._unknown(reference)
                continue
            self._check(reference, definition)
            if isinstance(statement, Sub | On | OnError):
                definition.called = True
            elif not isinstance(statement, Off):
                definition.jumped_to = True
            counted = isinstance(statement, Goto) and statement.times is not None
            patch(reference.operand, definition.address + (SIZES[Instruction.LABEL] if counted else 0))

    def _unknown(self, reference: Reference) -> None:
        label = reference.label
        if self._findings.full:
            return
        self._unknown_labels += 1
        near = None
        if self._unknown_labels * len(self.defined) <= COMPARISONS:
            near = did_you_mean(label, (each.statement.name for each in self.defined.values()))
        self._findings.add(
            "E201",
            self._findings.label_span(reference.statement, label),
            f"unknown label `{label}`",
            near or f"declare it with `{label}:` on a line",
        )

    def _check(self, reference: Reference, definition: Definition) -> None:
        statement = reference.statement
        if not self._blocks.contains(definition.block, reference.block):
            self._findings.add(
                "E204",
                self._findings.label_span(statement, reference.label),
                f"label `{definition.statement.name}` stands inside an IF block that this line is not in",
                "put the label in front of the IF or behind its ENDIF",
                (statement_span(definition.statement), "the label is here"),
            )
        elif (
            isinstance(statement, Goto)
            and statement.times is not None
            and definition.statement.start > statement.start
        ):
            self._findings.add(
                "E203",
                self._findings.label_span(statement, reference.label),
                f"a GOTO with a count goes back, but label `{definition.statement.name}` stands below",
                "leave the count out, or put the label in front of the lines to repeat",
                (statement_span(definition.statement), "the label is here"),
            )

    def count(self, statement: Goto, label: Definition | None) -> None:
        """A counted GOTO: two of them to one label start each other's count afresh."""
        if label is None:
            return
        if label.counted is not None:
            self._findings.add(
                "W508",
                statement_span(statement),
                f"this GOTO and the one in line {label.counted.line} count to the same label:"
                " each jump starts the other's count afresh",
                f"give each its own label: put a second one beside `{label.statement.name}:`",
                (statement_span(label.counted), "the other counted GOTO"),
            )
        label.counted = statement

    @property
    def first_called(self) -> int:
        """Index of the first label that a SUB calls; the number of labels if none does."""
        called = (each.index for each in self.defined.values() if each.called)
        return next(called, len(self.defined))

    def lint(self) -> None:
        """What is odd about labels once all references are known."""
        for definition in self.defined.values():
            name = definition.statement.name
            if not definition.called and not definition.jumped_to:
                self._findings.add(
                    "W503",
                    statement_span(definition.statement),
                    f"label `{name}` is never used",
                    "remove it, or jump to it with GOTO or SUB",
                )
            elif definition.called and definition.fallen_into:
                self._findings.add(
                    "W502",
                    statement_span(definition.statement),
                    f"execution runs from the line above into subroutine `{name}`",
                    "put END in front of it if that is not meant",
                )
