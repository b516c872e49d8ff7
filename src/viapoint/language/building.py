"""From what the grammar made of an auxiliary statement to its node; values are checked on the way.

What is wrong with a value is raised as a `Fault`, with offsets into the text behind the first word.
"""

from __future__ import annotations

from typing import NamedTuple, assert_never

from viapoint.language import tree
from viapoint.language.commands import (
    ACTION_BY_WORD,
    H_TANGENT,
    INDEX,
    POSITIVE,
    REAL,
    SETTLED,
    ActionCommand,
    Domain,
    Kind,
    Operand,
    Parameter,
)
from viapoint.language.grammar import (
    Fault,
    Given,
    Operands,
    Part,
    as_comparable,
    as_condition,
    as_number,
    as_value,
)
from viapoint.language.lexical import is_code, is_keyword
from viapoint.language.shapes import BARE_NODES, CONDITION_NODES, JUMP_NODES, value_node

PERCENT = Domain(kind=Kind.NUMBER, low=0.0, high=100.0, text="0 to 100 %")


class Place(NamedTuple):
    """Where a statement stands: line, start, end; `after` is the length of its first word."""

    line: int
    start: int
    end: int
    after: int


def build_action(operands: Operands, place: Place, text: str) -> tree.Statement:
    """The node of a statement; `text` is what stands behind its first word. Raises Fault."""
    command = ACTION_BY_WORD[operands.command]
    at = place[:3]
    match command.operand:
        case Operand.NOTHING:
            bare: tree.Statement = BARE_NODES[command.word](*at)
            return bare
        case Operand.VALUE:
            node, tail = value_node(command.word)
            single: tree.Statement = node(*at, _checked(command, operands.parts[0]), *tail)
            return single
        case Operand.TANGENT:
            on = int(_checked(command, operands.parts[0]))
            return tree.Tangent(*at, on, _offset(operands, on))
        case Operand.LABEL_TIMES:
            times = int(_checked(command, operands.parts[0])) if operands.parts else None
            jump: tree.Statement = JUMP_NODES[command.word](*at, _label(operands), times)
            return jump
        case Operand.CONDITION:
            condition = shift(as_condition(operands.parts[0]), place.after)
            branch: tree.Statement = CONDITION_NODES[command.word](*at, condition, operands.label is not None)
            return branch
        case Operand.WAIT:
            return _wait(command, operands, place)
        case Operand.OUTPUT | Operand.LEVEL | Operand.PULSE:
            return _output(command, operands, at)
        case Operand.LET | Operand.INC:
            return _variable(command, operands, place)
        case Operand.PLACE:
            return _placed(command, operands, place, text)
        case Operand.INTERRUPT if not operands.parts:
            return tree.OnError(*at, _label(operands))
        case Operand.NEXT:
            return tree.ResumeNext(*at)
        case Operand.INTERRUPT:
            watched = shift(as_condition(operands.parts[0]), place.after)
            _require_outside(watched, place.after, command.word)
            return tree.On(*at, watched, _label(operands))
        case Operand.LABEL:
            return tree.Off(*at, _label(operands))
        case _:
            assert_never(command.operand)


def build_search(operands: Operands, place: Place) -> tree.Until:
    """The node of what stands behind UNTIL. Raises Fault."""
    condition = shift(as_condition(operands.parts[0]), place.after)
    _require_outside(condition, place.after, "UNTIL")
    kept = operands.label
    if kept is None:
        return tree.Until(*place[:3], condition, None)
    number = operands.parts[1]
    if kept.upper() != "P" or kept.end_pos != number.start:
        message = f"`{kept}` is no point to keep the pose in"
        raise Fault("E113", message, kept.start_pos or 0, number.end, "for instance `CAPTURE P20`")
    value = as_number(number).value or 0.0
    if not INDEX.holds(value):
        code, message = _domain_text(INDEX, "the number of the point", value)
        raise Fault(code, message, number.start, number.end)
    return tree.Until(*place[:3], condition, int(value))


def _require_outside(condition: tree.Condition, after: int, word: str) -> None:
    """Raise Fault where FOUND or ERRNO stands in what is waited for: it never changes meanwhile."""
    match condition:
        case tree.Signal(kind=kind, start=start, end=end) if kind in SETTLED:
            message = f"`{kind}` does not change while `{word}` waits for it"
            raise Fault("E112", message, start - after, end - after, "test it with IF")
        case tree.Compare(left=left, right=right):
            for side in (left, right):
                if isinstance(side, tree.Signal):
                    _require_outside(side, after, word)
        case tree.Not(operand=operand):
            _require_outside(operand, after, word)
        case tree.And(operands=operands) | tree.Or(operands=operands):
            for each in operands:
                _require_outside(each, after, word)
        case _:
            pass


def _label(operands: Operands) -> str:
    label = operands.label
    assert label is not None
    refused = label_fault(str(label), label.start_pos or 0)
    if refused is not None:
        raise refused
    return str(label)


def _wait(command: ActionCommand, operands: Operands, place: Place) -> tree.Statement:
    at, (awaited, *limit) = place[:3], operands.parts
    timeout = None
    if limit:
        assert command.domain is not None
        timeout = _within(command.domain, "the number of `TIMEOUT`", limit[0], command)
    elif awaited.value is not None:
        return tree.Wait(*at, _checked(command, awaited))
    condition = shift(as_condition(awaited), place.after)
    _require_outside(condition, place.after, command.word)
    label = None if operands.label is None else _label(operands)
    if isinstance(condition, tree.Signal) and condition.kind == "DI" and timeout is None:
        return tree.WaitInput(*at, condition.number)
    return tree.WaitFor(*at, condition, timeout, label)


def _output(command: ActionCommand, operands: Operands, at: tuple[int, int, int]) -> tree.PathAction:
    label, parts = operands.label, list(operands.parts)
    assert label is not None
    kind = label.upper()
    output: int | str = str(label)
    if kind in ("DO", "AO"):
        output = int(_within(INDEX, f"the number of `{command.word} {kind}`", parts.pop(0), command))
    if command.operand is Operand.PULSE:
        return tree.Pulse(*at, output, _within(POSITIVE, "the time of a pulse", parts[0], command))
    if parts:
        return tree.SetLevel(*at, output, _within(REAL, "the value of the output", parts[0], command))
    return tree.SetOutput(*at, output, command.word == "SET")


def _variable(command: ActionCommand, operands: Operands, place: Place) -> tree.Let | tree.Inc:
    name, at = operands.label, place[:3]
    assert name is not None
    start, end = (name.start_pos or 0) + place.after, (name.end_pos or 0) + place.after
    variable = tree.Variable(start, end, str(name)[1:])
    what = f"the number of `{command.word}`"
    for part in operands.parts:
        if part.value is not None:
            _within(REAL, what, part, command)
    if command.operand is Operand.LET:
        value = as_value(operands.parts[0])
        if isinstance(value, tree.Number):
            return tree.Let(*at, variable, _moved(value, place.after))
        return tree.Let(*at, variable, shift(value, place.after))
    by: tree.Comparable = tree.Number(end, end, 1.0)
    if operands.parts:
        by = _moved(as_comparable(operands.parts[0]), place.after)
    return tree.Inc(*at, variable, by)


def _placed(command: ActionCommand, operands: Operands, place: Place, text: str) -> tree.At:
    at = place[:3]
    label, part, inner = operands.label, operands.parts[0], operands.action
    assert label is not None
    assert inner is not None
    origin = label.upper()
    if origin == "%":
        value = _within(PERCENT, "a part of the length", part, command)
    else:
        if label.end_pos != part.start:
            hint = f"write the number directly after `{label}`"
            raise Fault("E126", f"`{label}` and its value stand apart", label.start_pos or 0, part.end, hint)
        value = _within(REAL, "the place", part, command)
        backward = value < 0 or (value == 0 and text[part.start] == "-")
        if origin == "S" and not backward:
            hint = "for instance `AT S-0.1 SET DO1`"
            raise Fault(
                "E125", "`AT S` counts seconds before the end: they are negative", part.start, part.end, hint
            )
        origin, value = f"{origin}-" if backward else origin, abs(value)
    action = build_action(inner, Place(*at, place.after), text)
    assert isinstance(action, tree.PathAction)
    if isinstance(action, tree.Let | tree.Inc):
        given = action.value if isinstance(action, tree.Let) else action.by
        if not isinstance(given, tree.Number | tree.Truth):
            message = "what is written on a motion has to be known before it; this is read"
            hint = "write the number itself, or put the line behind the motion, without AT"
            raise Fault("E132", message, given.start - place.after, given.end - place.after, hint)
    return tree.At(*at, origin, value, action)


def shift(node: tree.Condition, by: int) -> tree.Condition:
    """The condition with its offsets moved by `by`. Depth is bounded by the grammar."""
    start, end = node.start + by, node.end + by
    match node:
        case tree.Signal() | tree.Named() | tree.Variable() | tree.Truth():
            return node._replace(start=start, end=end)
        case tree.Not():
            return tree.Not(start, end, shift(node.operand, by))
        case tree.Compare():
            return tree.Compare(start, end, node.operator, _moved(node.left, by), _moved(node.right, by))
        case tree.And():
            return tree.And(start, end, tuple(shift(each, by) for each in node.operands))
        case tree.Or():
            return tree.Or(start, end, tuple(shift(each, by) for each in node.operands))


def _moved(each: tree.Comparable, by: int) -> tree.Comparable:
    return each._replace(start=each.start + by, end=each.end + by)


def label_fault(name: str, start: int) -> Fault | None:
    """Why a label cannot be called `name`; None if it can."""
    end = start + len(name)
    if is_keyword(name):
        hint = f"choose another name, such as `{name}_1`"
        return Fault("E114", f"`{name}` is a word of the language and cannot be a label", start, end, hint)
    if is_code(name):
        digits = len(name.rstrip("0123456789"))
        hint = f"choose another name, such as `{name[:digits]}_{name[digits:]}`"
        return Fault(
            "E115", f"`{name}` reads as a parameter or signal and cannot be a label", start, end, hint
        )
    return None


def _domain_text(domain: Domain, shown: str, value: float) -> tuple[str, str]:
    code = "E125" if domain.is_whole and (value < 0 or not float(value).is_integer()) else "E124"
    return code, f"{shown} must be {domain.text}, not {value:.15g}"


def domain_fault(given: Given, parameter: Parameter) -> Fault:
    """A parameter whose value is outside its domain."""
    code, message = _domain_text(parameter.domain, f"`{given.key}` ({parameter.doc})", given.value)
    return Fault(code, message, given.start, given.end)


def _checked(command: ActionCommand, part: Part) -> float:
    """The number of `part` in the command's domain; an int where the domain is of whole numbers."""
    shown = f"the number of `{command.word}`"
    if command.operand is Operand.LABEL_TIMES:
        shown = "the repeat count"
    assert command.domain is not None
    return _within(command.domain, shown, part, command)


def _within(domain: Domain, shown: str, part: Part, command: ActionCommand) -> float:
    """The number of `part`, called `shown`, if it is in the domain."""
    value = as_number(part).value or 0.0
    if not domain.holds(value):
        code, message = _domain_text(domain, shown, value)
        raise Fault(code, message, part.start, part.end, f"for instance `{command.example}`")
    return int(value) if domain.is_whole else value


def _offset(operands: Operands, on: int) -> float:
    given = operands.given
    if given is None:
        return 0.0
    if given.key != H_TANGENT.key:
        message = f"`TANG` has no parameter `{given.key}`"
        raise Fault("E121", message, given.start, given.end, "its only parameter is H, as in `TANG 1 H45`")
    if not on:
        raise Fault("E121", "`H` has no meaning with `TANG 0`", given.start, given.end, "write `TANG 0`")
    if not H_TANGENT.domain.holds(given.value):
        raise domain_fault(given, H_TANGENT)
    return given.value
