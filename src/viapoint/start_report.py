"""What holds where a run starts from a line, for people and as data. Shown before anything moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from viapoint.narration import fixed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from viapoint.starting import LineStart
    from viapoint.vm.ports import Speed

UNKNOWN: Final = ("outputs", "belts")
"""What a start from a line leaves as it is, since nobody knows how it should be."""


def start_data(start: LineStart) -> dict[str, Any]:
    """As the JSON report has it."""
    approach = start.approach
    return {
        "line": start.line,
        "tool": start.tool,
        "speed": None if start.speed is None else _speed(start.speed),
        "tangent_deg": None if start.tangent is None else start.tangent.offset,
        "interrupts": [{"line": each.line, "label": each.handler.label} for each in start.interrupts],
        "counters": dict(start.counters),
        "assumed": [_row(each.line, each.what, each.value) for each in start.assumed],
        "not_switched": [_row(each.line, f"DO{each.index}", each.value) for each in start.skipped],
        "not_written": [
            {"line": each.line, "variable": f"${each.name}", "adds" if each.adds else "value": each.value}
            for each in start.unwritten
        ],
        "not_known": list(UNKNOWN),
        "approach": None if approach is None else [round(q, 6) + 0.0 for _, q in approach.target.joints],
    }


def _row(line: int, signal: str, value: bool) -> dict[str, Any]:
    return {"line": line, "signal": signal, "value": value}


def _speed(speed: Speed) -> str:
    return f"{speed.kind.value}{speed.value:g}"


def start_lines(start: LineStart, source: Sequence[str]) -> Iterator[str]:
    """What is restored, what was assumed, what is not known, and how the robot gets there."""
    text = source[start.line - 1].partition("//")[0].strip() if start.line <= len(source) else ""
    yield f"start from line {start.line}  {text}".rstrip()
    for label, said in _rows(start):
        yield f"  {label:<13}{said}"


def _rows(start: LineStart) -> Iterator[tuple[str, str]]:
    speed = "none programmed" if start.speed is None else _speed(start.speed)
    tangent = "off" if start.tangent is None else f"on, {start.tangent.offset:g} deg"
    yield "restored", f"tool T{start.tool}, speed {speed}, TANG {tangent}"
    for each in start.interrupts:
        yield "", f"ON {each} of line {each.line}"
    for label, runs in start.counters:
        yield "", f"loop {label}: run {runs}"
    for read in start.assumed:
        where = f" in line {read.line}" if read.line > 0 else ""
        yield "assumed", f"{read.what} {_on_off(read.value)}{where}"
    for output in start.skipped:
        yield "not switched", f"DO{output.index} {_on_off(output.value)} of line {output.line}"
    for write in start.unwritten:
        value = f"{write.value:g}" if isinstance(write.value, float) else str(write.value).upper()
        what = f"INC ${write.name} {value}" if write.adds else f"LET ${write.name} = {value}"
        yield "not written", f"{what} of line {write.line}"
    yield "not known", ", ".join(UNKNOWN)
    if start.approach is None or start.approach.speed is None:
        yield "approach", "none: no motion stands above"
    else:
        joints = "  ".join(fixed(value, 1) for _, value in start.approach.target.joints)
        yield "approach", f"joint move to {joints} at {start.approach.speed.value:g} deg/s"


def _on_off(value: bool) -> str:
    return "on" if value else "off"
