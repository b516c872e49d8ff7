"""Speed and memory of the way from source text to bytecode, beside the grammar alone.

Prints lines per second of parsing and of compiling the whole corpus, the same for lark alone on a slice
of it, ratios, and the memory of the tree per line. A fresh process also pays the first meeting of every
shape once; the first round shows that.

    python benchmarks/language_speed.py [--lines N] [--slice N] [--rounds N]
"""

from __future__ import annotations

import argparse
import time
import tracemalloc
from collections.abc import Callable

from corpus import LINES, corpus

from viapoint.compiler import compile_source
from viapoint.language.parser import parse
from viapoint.language.source import Source

GOAL = 100_000
"""Lines per second from source to bytecode to reach."""


def rate(lines: int, work: Callable[[], object]) -> float:
    """Lines per second of one call."""
    begin = time.perf_counter()
    work()
    return lines / (time.perf_counter() - begin)


def memory_per_line(text: str, lines: int) -> tuple[float, float]:
    """Bytes per line that a parse keeps, and its peak."""
    source = Source("corpus.via", text)
    tracemalloc.start()
    result = parse(source)
    kept, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert result.ok
    return kept / lines, peak / lines


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--lines", type=int, default=LINES)
    parser.add_argument("--slice", type=int, default=3000)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    text = corpus(arguments.lines)
    lines = text.count("\n")
    source = Source("corpus.via", text)
    piece = Source("slice.via", "\n".join(text.split("\n")[: arguments.slice]))

    first = rate(lines, lambda: compile_source(source))
    assert compile_source(source).ok
    compiled = max(rate(lines, lambda: compile_source(source)) for _ in range(arguments.rounds))
    parsed = max(rate(lines, lambda: parse(source)) for _ in range(arguments.rounds))
    parse(Source("warm.via", "ML P1"), use_shapes=False)
    alone = max(rate(arguments.slice, lambda: parse(piece, use_shapes=False)) for _ in range(2))
    half = corpus(arguments.lines // 2)
    kept, peak = memory_per_line(text, lines)
    kept_half, _ = memory_per_line(half, half.count("\n"))

    print(f"corpus                        {lines:>10,} lines")
    print(f"source to bytecode, first     {first:>10,.0f} lines/s   {first / GOAL:6.2f} of the goal")
    print(f"source to bytecode, best      {compiled:>10,.0f} lines/s   {compiled / GOAL:6.2f} of the goal")
    print(f"parse, best                   {parsed:>10,.0f} lines/s   {parsed / alone:6.1f} times lark alone")
    print(f"lark alone                    {alone:>10,.0f} lines/s")
    print(f"memory of the tree            {kept:>10,.0f} bytes a line, peak {peak:,.0f}")
    print(f"the same, half the lines      {kept_half:>10,.0f} bytes a line")


if __name__ == "__main__":
    main()
