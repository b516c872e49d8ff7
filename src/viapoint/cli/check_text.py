"""The report of a check for people: tables of what planning shows, line by line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from viapoint.cli.output import fixed, print_table, shortened

if TYPE_CHECKING:
    from viapoint.checking import CheckReport

    Row = dict[str, Any]


def print_tables(report: CheckReport, lines: Sequence[str]) -> None:
    """All tables that have rows; `lines` is the program's text."""
    seen = report.outlook
    if seen is not None:
        _table("corners", _CORNERS, seen.blends, _corner)
        _table("times", _TIMES, seen.statements, lambda row: _time(row, lines))
        _table("slowed by an axis", _SLOWDOWNS, seen.slowdowns, _slowdown)
        _table("exclusive zones", _ZONES, seen.zones, _zone)
        _table("configurations change", _CONFIGURATIONS, seen.configurations, _configuration)
        _table("belts, their sections planned with the belt standing", _BELTS, seen.tracking, _belt)
    _table("reads of the outside world", _READS, report.decisions, _read)
    if seen is not None and seen.cycle is not None:
        print(f"{_cycle(seen.cycle)}\n")


_CORNERS = (("line", "next", "R asked mm", "R effective mm", "passes", "why"), ">>>><<")
_TIMES = (("line", "statement", "time s", "stopping s", "length mm", "peak mm/s", "limited by"), "><>>>><")
_SLOWDOWNS = (("line", "by", "after mm", "asked", "slowed to", "", "near a singular pose"), "><>>><<")
_ZONES = (("line", "", "zone"), "><<")
_CONFIGURATIONS = (("line", "from", "to"), "><<")
_BELTS = (("line", "conveyor", "from mm", "to mm", "slowest mm/s", "fastest mm/s"), ">>>>>>")
_READS = (("line", "reads", "when"), "><<")


def _table(
    title: str,
    shape: tuple[tuple[str, ...], str],
    rows: Sequence[Row],
    words: Callable[[Row], list[str]],
) -> None:
    if rows:
        print(f"{title}:")
        print_table(shape[0], shortened([words(row) for row in rows]), shape[1], indent="  ")
        print()


def _corner(row: Row) -> list[str]:
    return [
        str(row["line"]),
        "end" if row["next_line"] is None else str(row["next_line"]),
        "–" if row["asked_mm"] is None else f"{row['asked_mm']:g}",
        f"{row['effective_mm']:g}",
        "stops" if row["stop"] else "runs through",
        _why(row),
    ]


def _why(row: Row) -> str:
    forced = row["forced_by_line"]
    reason: str = row["reason"]
    elsewhere = forced not in (None, row["line"])  # its own line: the program's text ends with it
    return f"line {forced} requires the stop" if elsewhere and row["stop"] else reason


def _time(row: Row, lines: Sequence[str]) -> list[str]:
    from viapoint.cli.report_text import statement

    seconds, shortest = fixed(row["time_s"], 3), fixed(row["shortest_s"], 3)
    standing = row["length_mm"] == 0.0
    return [
        str(row["line"]),
        statement(list(lines), row["line"], row["command"]),
        seconds if seconds == shortest else f"{shortest}–{seconds}",
        fixed(row["stopping_s"], 2) if row["stopping_s"] else "",
        "" if standing else fixed(row["length_mm"], 2),
        "" if standing else fixed(row["peak_mm_s"], 1),
        row["limited_by"],
    ]


def _slowdown(row: Row) -> list[str]:
    return [
        str(row["line"]),
        row["axis"],
        fixed(row["place_mm"], 1),
        fixed(row["asked"], 1),
        fixed(row["slowed_to"], 1),
        row["unit"],
        row["singular"] or "",
    ]


def _zone(row: Row) -> list[str]:
    return [str(row["line"]), row["action"], row["zone"]]


def _configuration(row: Row) -> list[str]:
    return [str(row["line"]), row["from"], row["to"]]


def _belt(row: Row) -> list[str]:
    limits = (row[name] for name in ("from_mm", "to_mm", "slowest_mm_s", "fastest_mm_s"))
    shown = ["–" if limit is None else fixed(limit, 1) for limit in limits]
    return [str(row["line"]), str(row["conveyor"]), *shown]


def _read(row: Row) -> list[str]:
    when = "waits for the path" if row["barrier"] else "from there on" if row["watched"] else "ahead"
    return [str(row["line"]), ", ".join(row["reads"]), when]


def _cycle(row: Row) -> str:
    shortest, longest = row["shortest_s"], row["longest_s"]
    if longest is None:
        times = f"{fixed(shortest, 3)} s or more"
    elif fixed(shortest, 3) == fixed(longest, 3):
        times = f"{fixed(shortest, 3)} s"
    else:
        times = f"{fixed(shortest, 3)} to {fixed(longest, 3)} s"
    what = "the program" if row["of"] == "program" else "each pass of the endless loop"
    return f"estimated time of {what}: {times}, waits for signals not counted"
