"""The signals of a cell with their present values, and forcing. No time and no scenario."""

from __future__ import annotations

from collections.abc import Iterator

from viapoint.runtime.cell import Io, Signal, SignalKind

Value = bool | float

_DIGITAL = (SignalKind.DIGITAL_INPUT, SignalKind.DIGITAL_OUTPUT)


class SignalBank:
    """Digital and analog inputs and outputs, numbered from 1; all false or 0 at first.

    A forced signal reads as the forced value whatever is written; unforced it shows what was last written.
    """

    def __init__(self, io: Io) -> None:
        self._io = io
        self._values: dict[Signal, Value] = {}
        self._forced: dict[Signal, Value] = {}

    def resolve(self, name: str) -> Signal:
        """`DI3`, or a name of the cell. Raises KeyError for a signal the cell has not."""
        found = self._io.names.get(name)
        if found is not None:
            return found
        code, number = name[:2].upper(), name[2:]
        known = {kind.value: kind for kind in SignalKind}
        if code not in known or not number.isdecimal():
            raise KeyError(f"no signal {name}")
        return self.existing(Signal(known[code], int(number)))

    def existing(self, signal: Signal) -> Signal:
        """The signal itself. Raises KeyError where the cell has it not."""
        if not 1 <= signal.index <= self._io.counts[signal.kind]:
            raise KeyError(f"no signal {signal}")
        return signal

    def of_kind(self, kind: SignalKind) -> Iterator[Signal]:
        """All signals of a kind, by their number."""
        return (Signal(kind, index) for index in range(1, self._io.counts[kind] + 1))

    def at_work(self) -> Iterator[tuple[Signal, Value]]:
        """Signals that are not at rest, or forced, with their values."""
        for kind in SignalKind:
            for signal in self.of_kind(kind):
                value = self.read(signal)
                if value or signal in self._forced:
                    yield signal, value

    def read(self, signal: Signal) -> Value:
        """Present value. Raises KeyError for a signal the cell has not."""
        self.existing(signal)
        if signal in self._forced:
            return self._forced[signal]
        return self._values.get(signal, _rest(signal))

    def write(self, signal: Signal, value: Value) -> bool:
        """Set a value; True if what is read changed."""
        before = self.read(signal)
        self._values[signal] = value
        return self.read(signal) != before

    def force(self, signal: Signal, value: Value) -> bool:
        """Hold a signal at a value; True if what is read changed."""
        before = self.read(signal)
        self._forced[signal] = value
        return value != before

    def release(self, signal: Signal) -> bool:
        """End forcing; True if what is read changed."""
        before = self.read(signal)
        self._forced.pop(signal, None)
        return self.read(signal) != before

    @property
    def forced(self) -> frozenset[Signal]:
        """The signals that are forced."""
        return frozenset(self._forced)


def _rest(signal: Signal) -> Value:
    return False if signal.kind in _DIGITAL else 0.0
