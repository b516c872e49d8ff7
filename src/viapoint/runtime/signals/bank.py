"""The signals and variables of a cell with their present values, and forcing. No time and no scenario."""

from __future__ import annotations

from collections.abc import Iterator

from viapoint.runtime.cell import Io, Signal, SignalKind

Value = bool | float


class SignalBank:
    """Digital and analog inputs and outputs, numbered from 1, all false or 0 at first; and variables.

    A forced signal reads as the forced value whatever is written; unforced it shows what was last written.
    """

    def __init__(self, io: Io) -> None:
        self._io = io
        self._values: dict[Signal, Value] = {}
        self._forced: dict[Signal, Value] = {}

    def resolve(self, name: str) -> Signal:
        """`DI3`, `$count`, or a name of the cell. Raises KeyError for a signal the cell has not."""
        found = self._io.find(name)
        if found is None:
            raise KeyError(f"no signal {name}")
        return self.existing(found)

    def existing(self, signal: Signal) -> Signal:
        """The signal itself. Raises KeyError where the cell has it not."""
        if not self._io.exists(signal):
            raise KeyError(f"no signal {signal}")
        return signal

    def of_kind(self, kind: SignalKind) -> Iterator[Signal]:
        """All signals of a kind, by their number."""
        return self._io.of_kind(kind)

    def at_work(self) -> Iterator[tuple[Signal, Value]]:
        """Signals that are not at rest, or forced, and all variables, with their values."""
        for kind in SignalKind:
            for signal in self.of_kind(kind):
                value = self.read(signal)
                if value or signal in self._forced or kind is SignalKind.VARIABLE:
                    yield signal, value

    def read(self, signal: Signal) -> Value:
        """Present value. Raises KeyError for a signal the cell has not."""
        if signal in self._forced:
            return self._forced[signal]
        value = self._values.get(signal)
        return self._io.at_first(self.existing(signal)) if value is None else value

    def written(self, signal: Signal) -> Value:
        """What was written last, also where another value is forced."""
        value = self._values.get(signal)
        return self._io.at_first(signal) if value is None else value

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
