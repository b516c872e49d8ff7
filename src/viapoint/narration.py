"""Events and figures in words, for people: what `run` and the prompt print. No layout, no colour."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from viapoint.runtime.records import Event


def event_text(event: Event) -> str:
    """What an event says, without its time, line and kind."""
    data = event.data
    place = f" at {fixed(number(event, 's_mm'), 2)} mm" if "s_mm" in data else ""
    match event.kind:
        case "output":
            return f"{data['signal']} {_on_off(data['value'])}{place}"
        case "input_read":
            ahead = " (ahead)" if data.get("ahead") else ""
            return f"{data['signal']} is {_on_off(data['value'])}{place}{ahead}"
        case "wait":
            in_vain = ", in vain" if data.get("timed_out") else ""
            return f"{data['reason']}: {fixed(number(event, 't_end') - event.t, 3)} s{in_vain}"
        case "block":
            length, seconds = fixed(number(event, "length_mm"), 2), fixed(number(event, "t_end") - event.t, 3)
            limited = f", limited by {data['limited_by']}" if data.get("limited_by") else ""
            return f"{data['command']} {length} mm in {seconds} s{limited}"
        case "command":
            values = [_plain(value) for key, value in data.items() if key not in ("do", "client")]
            return " ".join((str(data["do"]), *values, f"(client {data['client']})"))
        case "tool":
            return str(data["index"])
        case "place_read":
            return f"{data['place']}{place}"
        case "search":
            return f"{'found' if data['found'] else 'not found'}{place}"
        case "jog":
            why = f": {data['code']}: {data['reason']}" if "code" in data else ""
            return f"{data['axis']} {data['action']}{why}"
        case "interrupt":
            why = f": {data['code']}: {data['message']}" if "code" in data else ""
            then = f", {data['reason']}" if "reason" in data else ""
            return f"{data['label']} {data['action']}{place}{then}{why}"
        case "m" | "track":
            more = f", part {data['part']}" if "part" in data else ""
            more += f" to {fixed(number(event, 'percent'), 0)} %" if "percent" in data else ""
            return f"{data['index']} {data['action']}{more}"
        case "error":
            return f"{data['code']}: {data['message']}"
        case _:
            return "  ".join(f"{key} {_plain(value)}" for key, value in data.items())


def _on_off(value: object) -> str:
    """The value of a signal; an analog one is a number."""
    return _plain(value) if isinstance(value, float) else "on" if value else "off"


def _plain(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def number(event: Event, key: str) -> float:
    """A number of an event's data; 0 where it has none."""
    value = event.data.get(key)
    return float(value) if isinstance(value, (int, float)) else 0.0


def fixed(value: float, decimals: int) -> str:
    """A number with fixed decimals and never a minus before nothing but zeros."""
    text = f"{value:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text
