"""What a client may ask: one table of requests and their values. A line in, a request or a sentence out."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from viapoint.language.suggestions import did_you_mean
from viapoint.serving.hub import LONGEST_LINE

Scalar = str | int | float | bool | None


class Refused(Exception):
    """A request that cannot be done; `identity` is the `id` it came with."""

    def __init__(self, sentence: str, identity: Scalar = None) -> None:
        super().__init__(sentence)
        self.identity = identity


@dataclass(frozen=True, slots=True)
class Request:
    """A line of a client, checked: what to do, with which values."""

    do: str
    values: Mapping[str, Any]
    identity: Scalar = None


@dataclass(frozen=True, slots=True)
class Value:
    """One value of a request: what it must be, a test, and the default where it may be left out."""

    must_be: str
    holds: Callable[[Any], bool]
    default: Any = field(default=...)


@dataclass(frozen=True, slots=True)
class Spec:
    """One request: its values and what it does."""

    values: Mapping[str, Value]
    doc: str


def _is_number(value: Any) -> bool:
    """A finite one: a whole number of JSON may be larger than any float."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= sys.float_info.max


def _whole(low: int, high: int) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def _between(low: float, high: float) -> Callable[[Any], bool]:
    return lambda value: _is_number(value) and low <= value <= high


def _one_of(*words: str) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, str) and value in words


def _are_axes(value: Any) -> bool:
    return isinstance(value, dict) and len(value) > 0 and all(map(_is_number, value.values()))


LONGEST_HOLD_S: Final = 1.0
"""s that a jog goes on after the last request for it: a client may fall silent."""

MOST_HZ: Final = 10_000.0
MOST_TICKS: Final = 100_000_000

_SIGNAL: Final = Value("the code or name of a signal", lambda value: isinstance(value, str))
_LEVEL: Final = Value("true, false or a number", lambda value: isinstance(value, bool) or _is_number(value))
_ROBOT: Final = {
    "robot": Value(
        "the number or name of a robot",
        lambda value: isinstance(value, str | int) and not isinstance(value, bool),
        None,
    )
}
"""Of several: which one is meant."""

_SWITCH: Final = Value("true or false", lambda value: isinstance(value, bool))

REQUESTS: Final[Mapping[str, Spec]] = {
    "start": Spec({}, "begin the run, where it was started with `--await-client`"),
    "subscribe": Spec(
        {
            "monitor_hz": Value("a number from 0 to 10000", _between(0.0, MOST_HZ), 0.0),
            "events": Value("true or false", lambda value: isinstance(value, bool), False),
            **_ROBOT,
        },
        "be told the monitor so often per second of the robot's time, and every event",
    ),
    "monitor": Spec(_ROBOT, "the monitor now"),
    "read": Spec({"signal": _SIGNAL}, "a signal's present value"),
    "set": Spec({"signal": _SIGNAL, "value": _LEVEL}, "set an input or a variable"),
    "force": Spec({"signal": _SIGNAL, "value": _LEVEL}, "hold any signal or variable at a value"),
    "release": Spec({"signal": _SIGNAL}, "end forcing a signal"),
    "reset_m": Spec({"index": Value("a whole number", _whole(0, 65_535)), **_ROBOT}, "answer an M function"),
    "variable": Spec(
        {
            "name": Value("the name of a variable", lambda value: isinstance(value, str)),
            "value": Value("true, false or a number", _LEVEL.holds, None),
        },
        "a variable's present value; with `value`, set it",
    ),
    "override": Spec(
        {"percent": Value("a number from -100 to 100", _between(-100.0, 100.0)), **_ROBOT}, "scale all speeds"
    ),
    "halt": Spec(_ROBOT, "stop on the path"),
    "continue": Spec(_ROBOT, "go on after a halt"),
    "stop": Spec(_ROBOT, "stop on the path and end the run"),
    "estop": Spec(_ROBOT, "emergency stop on the path"),
    "reset": Spec(_ROBOT, "acknowledge an emergency stop; the run is then halted"),
    "jog": Spec(
        {
            "axis": Value("J1…, E1…, X, Y, Z, A, B or C", lambda value: isinstance(value, str)),
            "direction": Value("1 or -1", lambda value: value in (1, -1) and not isinstance(value, bool)),
            "space": Value("joint, base, frame or tool", _one_of("joint", "base", "frame", "tool"), "base"),
            "frame": Value("a whole number", _whole(0, 65_535), 0),
            "speed": Value("a number of mm/s or deg/s", _between(1e-6, 1e6), None),
            "seconds": Value("a number from 0.02 to 1", _between(0.02, LONGEST_HOLD_S), 0.2),
        },
        "before the run begins: move on along an axis for `seconds`; ask again in time to go on",
    ),
    "let_go": Spec({}, "end a jog"),
    "reference": Spec(
        {"axes": Value('an object such as {"J1": 12.5, "E1": 300}, deg or mm', _are_axes), **_ROBOT},
        "before the run begins: say where axes stand, as their encoders read; nothing moves",
    ),
    "lockstep": Spec({"on": _SWITCH}, "let time pass only by `advance`"),
    "advance": Spec(
        {"ticks": Value("a whole number from 1", _whole(1, MOST_TICKS))},
        "let so many ticks pass; answered when they have",
    ),
    "ping": Spec({}, "an answer, nothing else"),
}


def parse(line: bytes) -> Request:
    """The request of a line. Raises Refused with what is wrong with it."""
    if len(line) > LONGEST_LINE:
        raise Refused(f"a line is longer than {LONGEST_LINE} bytes")
    try:
        given = json.loads(line)
    except (ValueError, RecursionError):
        raise Refused('this is not JSON; a request looks like {"do": "halt"}') from None
    if not isinstance(given, dict):
        raise Refused('a request is an object, such as {"do": "halt"}')
    identity = given.pop("id", None)
    if isinstance(identity, dict | list):
        raise Refused("`id` is a text or a number")
    do = given.pop("do", None)
    if not isinstance(do, str) or do not in REQUESTS:
        word = do if isinstance(do, str) else ""
        hint = did_you_mean(word, REQUESTS) or f"requests are {', '.join(REQUESTS)}"
        raise Refused(f"`do` is not a known request; {hint}", identity)
    return Request(do, _values(do, given, identity), identity)


def _values(do: str, given: dict[str, Any], identity: Scalar) -> dict[str, Any]:
    spec = REQUESTS[do]
    for key in given:
        if key not in spec.values:
            known = ", ".join(spec.values) or "nothing more"
            raise Refused(f"`{do}` takes {known}, not `{key}`", identity)
    result = {}
    for key, value in spec.values.items():
        one = given.get(key, value.default)
        if one is ...:
            raise Refused(f"`{do}` needs `{key}`: {value.must_be}", identity)
        if key in given and not value.holds(one):
            raise Refused(f"`{key}` must be {value.must_be}", identity)
        result[key] = one
    return result
