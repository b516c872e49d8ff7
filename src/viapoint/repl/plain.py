"""The prompt without a terminal: lines from a stream, what came of them on standard output, nothing else.

Every line read is printed behind its prompt, so that the output of a session reads like the session.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from viapoint.repl.console import Console

READY, MORE = "via> ", "...> "


def prompt_of(console: Console) -> str:
    """What stands before the next line."""
    return MORE if console.collector.pending else READY


def typed(console: Console) -> Iterator[str]:
    """Lines from a terminal that can do nothing but print. Ctrl-C drops a line, Ctrl-D ends."""
    while True:
        try:
            yield input(prompt_of(console))
        except KeyboardInterrupt:
            console.collector.drop()
            console.say("")
        except EOFError:
            return


def converse(console: Console, lines: Iterable[str], *, echo: bool) -> None:
    """Enter all lines, up to `:quit`."""
    for line in lines:
        line = line.rstrip("\r\n")
        if echo:
            console.say(f"{prompt_of(console)}{line}".rstrip())
        console.enter(line)
        if console.leaving:
            break
    console.close()
