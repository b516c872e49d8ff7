"""The prompt in a terminal: history, completion, a status line below. The only user of prompt_toolkit."""

from __future__ import annotations

import os
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from prompt_toolkit import PromptSession
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.formatted_text import ANSI
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.shortcuts import CompleteStyle

from viapoint.repl import show
from viapoint.repl.completion import complete
from viapoint.repl.console import Console
from viapoint.repl.plain import prompt_of

REFRESH_S: Final = 0.1
_CLEAR: Final = "\r\x1b[2K"


class _Words(Completer):
    """Completion as prompt_toolkit wants it."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterator[Completion]:
        words, length = complete(self._console, document.text_before_cursor)
        for word in words:
            yield Completion(word, start_position=-length)


def converse_in_terminal(console: Console) -> None:
    """Prompt for lines until Ctrl-D or `:quit`. Ctrl-C drops a line; while the robot moves it halts it."""
    live = Live()
    console.live, console.say = live, live.say
    session: PromptSession[str] = PromptSession(
        history=history(),
        completer=_Words(console),
        complete_style=CompleteStyle.MULTI_COLUMN,
        bottom_toolbar=lambda: toolbar(console),
    )
    console.say("statements are executed at once; `:help` lists the commands, Ctrl-D leaves")
    while not console.leaving:
        try:
            line = session.prompt(ANSI(f"\x1b[1m{prompt_of(console)}\x1b[0m"))
        except KeyboardInterrupt:
            console.collector.drop()
            continue
        except EOFError:
            break
        console.enter(line)
    console.close()


def toolbar(console: Console) -> str:
    """The status line, cut to the width of the terminal."""
    width = shutil.get_terminal_size().columns
    text = show.status(console.session, console.speed)
    return text if len(text) <= width else f"{text[: width - 1]}…"


def history() -> History:
    """Of earlier sittings, where the user's state can be kept; else of this one."""
    folder = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "viapoint"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "history").touch()
    except OSError:
        return InMemoryHistory()
    return FileHistory(str(folder / "history"))


class Live:
    """The status line while the robot moves, in the place of the prompt."""

    def __init__(self) -> None:
        self._last = 0.0

    def say(self, text: str) -> None:
        """Print a text above the status line."""
        print(f"{_CLEAR}{text}" if self._last else text, flush=True)

    def __call__(self, text: str) -> None:
        """Show a text now and then; an empty one clears the line."""
        now = time.monotonic()
        if not text:
            if self._last:
                sys.stdout.write(_CLEAR)
            self._last = 0.0
        elif now - self._last >= REFRESH_S:
            self._last = now
            width = shutil.get_terminal_size().columns - 1
            sys.stdout.write(f"{_CLEAR}{text[:width]}")
        sys.stdout.flush()
