"""Outputs that go off by themselves: the pulses that are running. No signals are written here."""

from __future__ import annotations

from viapoint.vm.ports import Pulse


class Pulses:
    """At most one pulse an output; a new one, or SET and RESET, take the place of one that runs."""

    def __init__(self) -> None:
        self._running: dict[int, tuple[int, Pulse]] = {}  # by output: the tick in which it ends

    @property
    def next_end(self) -> int | None:
        """The tick in which the first of them ends."""
        return min(tick for tick, _ in self._running.values()) if self._running else None

    def start(self, pulse: Pulse, until: int) -> None:
        """The pulse begins, and ends in tick `until`."""
        self.cancel(pulse.index)
        self._running[pulse.index] = until, pulse

    def cancel(self, output: int) -> None:
        """The output is switched by something else: it stays so."""
        self._running.pop(output, None)

    def over(self, tick: int) -> list[Pulse]:
        """The pulses that end up to `tick`, in the order in which they end; they are forgotten."""
        ended = sorted((each for each in self._running.values() if each[0] <= tick), key=lambda each: each[0])
        for _, pulse in ended:
            del self._running[pulse.index]
        return [pulse for _, pulse in ended]
