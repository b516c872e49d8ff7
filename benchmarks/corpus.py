"""The fixed corpus of the language benchmarks: a program made by rule from a seed.

60 % motions with varied parameters, no number used twice if it can be helped; 20 % signals and waits;
15 % IF, GOTO, SUB and labels; 5 % comments. The program is right: it parses and compiles. The same
arguments give the same text on every machine. Not a realistic job: it is made to defeat caches.

    python benchmarks/corpus.py [--lines N] [--seed N] [-o FILE]
"""

from __future__ import annotations

import argparse
import random
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

SEED = 20260901
LINES = 100_000
HEAD = ("HOME F50", "MJ P1 F100")


class Corpus:
    """Writes statements; `lines` holds what stands so far."""

    def __init__(self, lines: int, seed: int) -> None:
        self._random = random.Random(seed)
        self._wanted = lines
        self._labels = 0
        self._open: list[str] = []
        self.lines: list[str] = list(HEAD)

    def build(self) -> str:
        """The text of the corpus."""
        kinds: list[tuple[float, Callable[[], Iterator[str]]]] = [
            (0.60, self._motion),
            (0.80, self._signal),
            (0.95, self._flow),
            (1.00, self._comment),
        ]
        tail = ["END", "CUT:", "ML P5 T2 Z2", "END"]
        while len(self.lines) < self._wanted - len(tail) - len(self._open):
            draw = self._random.random()
            make = next(make for share, make in kinds if draw < share)
            depth = len(self._open)
            texts = list(make())
            depth = min(depth, len(self._open))  # IF and ENDIF stand one level out
            self.lines.extend("  " * depth + text for text in texts)
        while self._open:
            self.lines.append("  " * (len(self._open) - 1) + self._open.pop())
        return "\n".join(self.lines + tail) + "\n"

    def _number(self, low: float, high: float, digits: int) -> str:
        return f"{self._random.uniform(low, high):.{digits}f}"

    def _index(self) -> int:
        return self._random.randrange(10_000)

    def _motion(self) -> Iterator[str]:
        word = self._random.choices(("ML", "MJ", "MC", "MS", "HOME"), (50, 25, 10, 14, 1))[0]
        if word == "HOME":
            yield f"HOME F{self._number(1, 100, 2)}"
            return
        yield " ".join([word, *self._target(), *self._circle(word), *self._rest(word)])

    def _target(self) -> list[str]:
        if self._random.random() < 0.6:
            return [f"P{self._index()}"]
        count = self._random.choice((3, 3, 6))
        return [f"{code}={self._number(-1800, 1800, 3)}" for code in "XYZABC"[:count]]

    def _circle(self, word: str) -> list[str]:
        if word != "MC":
            return []
        turn = [f"H{self._number(-720, 720, 1)}"] if self._random.random() < 0.3 else []
        return [f"Q{self._index()}", *turn]

    def _rest(self, word: str) -> list[str]:
        chance = self._random.random
        rest = []
        if chance() < 0.5:
            rest.append(f"{self._random.choice(('F', 'F', 'FC', 'FA'))}{self._number(1, 2000, 1)}")
        if chance() < 0.2:
            rest.append(f"Z{self._random.randrange(1, 64)}")
        if chance() < 0.2:
            rest.append(f"T{self._random.randrange(1, 32)}")
        if chance() < 0.3 and word != "MS":
            rest.append(f"R{self._number(0.1, 50, 2)}")
        if chance() < 0.1 and word == "MJ":
            rest.append(f"J1={self._number(-170, 170, 2)}")
        if chance() < 0.05:
            rest.append(f"E1={self._number(0, 3000, 1)}")
        return rest

    def _signal(self) -> Iterator[str]:
        index = self._random.randrange(1, 32)
        forms = (
            f"SET DO{index}",
            f"RESET DO{index}",
            f"SET DO {index}",
            f"WAIT {self._number(0.01, 5, 3)}",
            f"WAIT DI{index}",
            f"M {self._random.randrange(1, 90)}",
            f"T {self._random.randrange(1, 32)}",
        )
        yield self._random.choice(forms)

    def _flow(self) -> Iterator[str]:
        draw = self._random.random()
        index = self._random.randrange(1, 32)
        if self._open and draw < 0.45:
            yield self._open.pop()
        elif draw < 0.7 and len(self._open) < 4:
            self._open.append("ENDIF")
            yield self._random.choice((f"IF DI{index}", f"IF NOT DI {index}", f"IF DI{index} AND DO{index}"))
        elif draw < 0.8:
            yield f"SUB CUT {self._random.randrange(1, 20)}"
        elif not self._open:
            self._labels += 1
            yield f"LOOP_{self._labels}:"
            yield from self._motion()
            yield f"GOTO LOOP_{self._labels} {self._random.randrange(2, 50)}"
        else:
            yield "SUB CUT"

    def _comment(self) -> Iterator[str]:
        words = self._random.choices(("approach", "the", "part", "then", "cut", "1", "corner", "#2"), k=5)
        yield "// " + " ".join(words)


def corpus(lines: int = LINES, seed: int = SEED) -> str:
    """The text of a corpus of `lines` lines."""
    return Corpus(lines, seed).build()


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--lines", type=int, default=LINES)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("-o", "--output", type=Path)
    arguments = parser.parse_args()
    text = corpus(arguments.lines, arguments.seed)
    if arguments.output is None:
        sys.stdout.write(text)
    else:
        arguments.output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
