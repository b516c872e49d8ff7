"""The report of a run for people: what each statement took and why, the events, how near the limits came."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from viapoint.cli.output import note, print_table, shortened
from viapoint.narration import event_text, fixed, number

if TYPE_CHECKING:
    from viapoint.cli.running import Peaks
    from viapoint.language.diagnostics import Diagnostic
    from viapoint.realtime import Punctuality
    from viapoint.runtime.records import Event
    from viapoint.session import Session

SHOWN_TEXT = 44  # characters of a statement


def print_report(session: Session, peaks: Peaks, diagnostics: list[Diagnostic], name: str) -> None:
    from viapoint.report import deviation_report, in_time_order, limits_report

    events = in_time_order(session.events)
    blocks = [event for event in events if event.kind == "block"]
    others = [event for event in events if event.kind != "block"]
    lines = session.program.source.text.splitlines()
    if blocks:
        head = ("line", "statement", "start s", "time s", "length mm", "mean mm/s", "peak mm/s", "limited by")
        rows = [_block_row(event, lines, speeds) for event, speeds in _with_speeds(blocks, peaks, session)]
        print_table(head, shortened(rows), "><>>>>><")
        print()
    if others:
        rows = [_event_row(event) for event in others]
        print_table(("t s", "line", "event", ""), shortened(rows), ">><<")
        print()
    _print_limits(limits_report(session))
    if session.kernel.outlet.feed.leads_off:
        _print_deviation(deviation_report(session))
    print(_summary(session, name))
    if diagnostics:
        from viapoint.language.render import render

        sys.stdout.flush()
        note("\n" + render(diagnostics, colour=sys.stderr.isatty()))


def _with_speeds(blocks: list[Event], peaks: Peaks, session: Session) -> list[tuple[Event, float]]:
    """Each block with the fastest TCP speed of its ticks, m/s; those of its interrupts are not its own."""
    import numpy as np

    speeds = np.concatenate(peaks.speeds)
    tick_s = session.cell.tick
    beside = _interrupts(session.events)
    result = []
    for block in blocks:
        last = max(round(number(block, "t_end") / tick_s), block.tick)
        own = speeds[block.tick : last + 1].copy()
        for begun, back in beside:
            if block.tick <= begun and back <= last:
                own[begun + 1 - block.tick : back + 1 - block.tick] = 0.0
        result.append((block, float(own.max(initial=0.0))))
    return result


def _interrupts(events: list[Event]) -> list[tuple[int, int]]:
    """Ticks in which subroutines that interrupt began, and in which the robot was back."""
    told: dict[str, list[int]] = {"begun": [], "returned": []}
    for event in events:
        if event.kind == "interrupt" and event.data["action"] in told:
            told[str(event.data["action"])].append(event.tick)
    return list(zip(told["begun"], told["returned"], strict=False))


def statement(lines: list[str], line: int, otherwise: str) -> str:
    """The text of a statement for a table."""
    text = lines[line - 1].partition("//")[0].strip() if 0 < line <= len(lines) else otherwise
    return text if len(text) <= SHOWN_TEXT else text[: SHOWN_TEXT - 1] + "…"


def _block_row(block: Event, lines: list[str], peak: float) -> list[str]:
    from viapoint.language.units import MM

    seconds = number(block, "t_end") - block.t
    length = number(block, "length_mm")
    mean = length / seconds if seconds > 0.0 else 0.0
    command = str(block.data.get("command", ""))
    return [
        str(block.line),
        statement(lines, block.line, command),
        fixed(block.t, 3),
        fixed(seconds, 3),
        fixed(length, 2),
        fixed(mean, 1),
        fixed(peak / MM, 1),
        str(block.data.get("limited_by") or ""),
    ]


def _event_row(event: Event) -> list[str]:
    return [fixed(event.t, 3), str(event.line) if event.line > 0 else "", event.kind, event_text(event)]


def _print_limits(limits: dict[str, Any]) -> None:
    """Peak ÷ limit: the worst joint of each row, and the path."""
    parts = []
    for key, label in (
        ("joint_speed", "joint speed"),
        ("joint_acceleration", "joint acceleration"),
        ("joint_jerk", "joint jerk"),
    ):
        values = limits[key]
        worst = max(range(len(values)), key=values.__getitem__)
        parts.append(f"{label} {values[worst]:.3f} (J{worst + 1})")
    parts += [
        f"{key.replace('_', ' ')} {limits[key]:.3f}"
        for key in ("path_speed", "path_acceleration", "path_jerk", "programmed_speed")
    ]
    print("peak ÷ limit:  " + "   ".join(parts[:3]))
    print("               " + "   ".join(parts[3:]))


def _print_deviation(deviation: dict[str, Any]) -> None:
    """How far filter and corrections led the robot from its path."""
    values = deviation["joints_deg"]
    worst = max(range(len(values)), key=values.__getitem__)
    tcp, joint = fixed(deviation["tcp_mm"], 3), fixed(values[worst], 3)
    print(f"off the path:  TCP {tcp} mm   joints {joint} deg (J{worst + 1})")


def _summary(session: Session, name: str) -> str:
    kernel = session.kernel
    return (
        f"{name}: {session.status.value} after {kernel.tick * session.cell.tick:.3f} s, "
        f"{_count(kernel.tick, 'tick')}, {_count(kernel.statements, 'statement')}, "
        f"{session.realtime_factor:.0f} × real time"
    )


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def punctuality_text(kept: Punctuality) -> str:
    """How a run in real time kept its time, in a line."""
    late = kept.late_us
    missed = f"{_count(kept.missed, 'deadline')} missed"
    if kept.missed:
        missed += f" ({kept.starved} not computed in time), {kept.slip_s * 1e3:.1f} ms lost"
    return (
        f"real time: {_count(kept.ticks, 'tick')}, {missed}; late by {late['p50']:.0f} µs (median), "
        f"{late['p99']:.0f} µs (99 %), {late['p99_9']:.0f} µs (99.9 %), {late['max']:.0f} µs at most; "
        f"priority {kept.priority}"
    )
