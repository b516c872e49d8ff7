"""The line that moves while a program runs: on a terminal only, and gone when the report comes."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from viapoint.language.units import MM

if TYPE_CHECKING:
    from rich.text import Text

    from viapoint.language.source import Source
    from viapoint.runtime.records import Window
    from viapoint.session import Session

    Live = Callable[[Window, Session], None]

REFRESH_S = 0.1


@contextmanager
def live_line(name: str, source: Source) -> Iterator[Live | None]:
    """A function to call with every window; None where nobody watches."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.live import Live as RichLive

    lines = source.text.splitlines()
    with RichLive(console=Console(stderr=True), transient=True, auto_refresh=False) as shown:
        last = 0.0

        def update(window: Window, session: Session) -> None:
            nonlocal last
            now = time.monotonic()
            if now - last >= REFRESH_S:
                last = now
                shown.update(_line(name, lines, window, session), refresh=True)

        yield update


def _line(name: str, lines: list[str], window: Window, session: Session) -> Text:
    from rich.text import Text

    number = int(window.line[-1])
    statement = lines[number - 1].strip() if 0 < number <= len(lines) else ""
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f" {name} ", style="bold reverse")
    text.append(f"  {float(window.time[-1]):9.3f} s", style="bold cyan")
    text.append(f"  {float(window.speed[-1]) / MM:7.1f} mm/s")
    text.append(f"  ×{session.realtime_factor:.0f} real time", style="dim")
    text.append(f"   {number:>4} ", style="yellow")
    text.append(statement)
    return text
