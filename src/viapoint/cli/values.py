"""Words of the command line as values; what is wrong with one is said in the user's terms. Pure."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable
from pathlib import Path


def number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"`{text}` is not a number")
    return value


def positive(text: str) -> float:
    value = number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"must be greater than 0, not {text}")
    return value


def percent(text: str) -> float:
    value = number(text.removesuffix("%"))
    if not 0.0 < value <= 100.0:
        raise argparse.ArgumentTypeError(f"must be above 0 and at most 100 percent, not {text}")
    return value


def whole(text: str) -> int:
    if not re.fullmatch(r"[0-9]{1,9}", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1, not {text}")
    return int(text)


def address(text: str) -> tuple[str, int]:
    """`PORT` or `HOST:PORT`; without a host, this machine alone."""
    host, _, port = text.rpartition(":")
    if not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > 65_535:
        raise argparse.ArgumentTypeError(f"must be a port or HOST:PORT, not {text}")
    return host.strip("[]") or "127.0.0.1", int(port)


def axes(text: str) -> dict[str, float]:
    """`J1=10,E1=300`."""
    pairs = [pair.partition("=") for pair in text.split(",")]
    names = [name.strip().upper() for name, _, _ in pairs]
    if not all(names) or not all(given for _, given, _ in pairs) or len(set(names)) < len(names):
        raise argparse.ArgumentTypeError(f"must name each axis once, as in J1=10,E1=300, not {text}")
    return {name: number(value) for name, (_, _, value) in zip(names, pairs, strict=True)}


def path(text: str) -> Path:
    if not text or "\0" in text:
        raise argparse.ArgumentTypeError("is not the name of a file")
    return Path(text)


def one_of(*words: str) -> Callable[[str], str]:
    def choose(text: str) -> str:
        if text not in words:
            from viapoint.language.suggestions import did_you_mean

            hint = did_you_mean(text, words) or f"choose {' or '.join(words)}"
            raise argparse.ArgumentTypeError(f"`{text}` is unknown; {hint}")
        return text

    return choose
