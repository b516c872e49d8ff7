"""Lines to and from clients, in a thread of its own: whoever is slow or dead keeps nobody waiting.

What comes in waits in `incoming`; what goes out waits in each client's outbox. Where it gets `full`, the
sender leaves out what it can; where it overflows, the client is let go.
"""

from __future__ import annotations

import selectors
import socket
import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum, unique
from queue import SimpleQueue
from typing import Final

MOST_CLIENTS: Final = 32
LONGEST_LINE: Final = 65_536
"""Bytes; a longer line is an error, and its client is let go."""

SOFT_LIMIT: Final = 262_144
"""Bytes waiting for a client from which on its outbox counts as full: some 500 monitors."""

HARD_LIMIT: Final = 4_194_304
"""Bytes waiting for a client at which it is let go."""

_CHUNK: Final = 65_536
_GRACE_S: Final = 1.0
"""How long the end of a run waits for clients to take what is left."""


@unique
class What(Enum):
    """What came in from a client."""

    JOINED = "joined"
    LINE = "line"
    LEFT = "left"


@dataclass(frozen=True, slots=True)
class Incoming:
    """Something from a client: a line as bytes, or that it came or went."""

    client: int
    what: What
    line: bytes = b""


@dataclass(slots=True)
class _Connection:
    """One client: its socket, what it has sent of a line, and what waits to be sent."""

    socket: socket.socket
    received: bytearray = field(default_factory=bytearray)
    waiting: deque[bytes] = field(default_factory=deque)
    size: int = 0
    closing: bool = False


class Hub:
    """Listens at once; raises OSError where it cannot. Port 0: the system chooses, see `address`."""

    def __init__(self, host: str, port: int) -> None:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._listener = socket.create_server((host, port), family=family)
        self._listener.setblocking(False)
        self.address: tuple[str, int] = self._listener.getsockname()[:2]
        self.incoming: SimpleQueue[Incoming] = SimpleQueue()
        self._connections: dict[int, _Connection] = {}
        self._count = 0
        self._lock = threading.Lock()
        self._wake_in, self._wake_out = socket.socketpair()
        self._wake_in.setblocking(False)
        self._wake_out.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ, None)
        self._selector.register(self._wake_out, selectors.EVENT_READ, None)
        self._ending: float | None = None
        self._thread = threading.Thread(target=self._serve, name="viapoint server", daemon=True)
        self._thread.start()

    # --- from the robot's thread -------------------------------------------------------------------

    def send(self, client: int, line: bytes) -> None:
        """Put a line into a client's outbox; never waits. A client that has gone is no error."""
        with self._lock:
            connection = self._connections.get(client)
            if connection is None or connection.closing:
                return
            connection.waiting.append(line + b"\n")
            connection.size += len(line) + 1
            if connection.size > HARD_LIMIT:
                connection.closing = True
                connection.waiting.clear()
        self._wake()

    def full(self, client: int) -> bool:
        """Whether so much waits for a client that what it can do without should be left out."""
        with self._lock:
            connection = self._connections.get(client)
            return connection is not None and connection.size > SOFT_LIMIT

    def close(self) -> None:
        """Let clients take what waits for them, for a moment; then close everything."""
        self._ending = time.monotonic() + _GRACE_S
        self._wake()
        self._thread.join()

    def _wake(self) -> None:
        with suppress(BlockingIOError):  # it has been woken and did not get to it yet
            self._wake_in.send(b"\0")

    # --- the server's own thread -------------------------------------------------------------------

    def _serve(self) -> None:
        while not self._done():
            self._watch_outboxes()
            timeout = None if self._ending is None else 0.02
            for key, events in self._selector.select(timeout):
                if key.fileobj is self._listener:
                    self._accept()
                elif key.fileobj is self._wake_out:
                    self._wake_out.recv(_CHUNK)
                else:
                    self._attend(key.data, events)
        for client in list(self._connections):
            self._drop(client)
        self._selector.close()
        for each in (self._listener, self._wake_in, self._wake_out):
            each.close()

    def _done(self) -> bool:
        if self._ending is None:
            return False
        with self._lock:
            waiting = any(connection.waiting for connection in self._connections.values())
        return not waiting or time.monotonic() > self._ending

    def _watch_outboxes(self) -> None:
        with self._lock:
            connections = list(self._connections.items())
        for client, connection in connections:
            if connection.closing and not connection.waiting:
                self._drop(client)
                continue
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if connection.waiting else 0)
            self._selector.modify(connection.socket, events, client)

    def _accept(self) -> None:
        with suppress(OSError):  # it went away before it was let in
            accepted, _ = self._listener.accept()
            if len(self._connections) >= MOST_CLIENTS:
                accepted.close()
                return
            accepted.setblocking(False)
            accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._count += 1
            with self._lock:
                self._connections[self._count] = _Connection(accepted)
            self._selector.register(accepted, selectors.EVENT_READ, self._count)
            self.incoming.put(Incoming(self._count, What.JOINED))

    def _attend(self, client: int, events: int) -> None:
        connection = self._connections.get(client)
        if connection is None:
            return
        try:
            if events & selectors.EVENT_WRITE:
                self._write(connection)
            if events & selectors.EVENT_READ:
                self._read(client, connection)
        except BlockingIOError:
            pass
        except OSError:
            self._drop(client)

    def _write(self, connection: _Connection) -> None:
        while True:
            with self._lock:
                if not connection.waiting:
                    return
                line = connection.waiting[0]
            sent = connection.socket.send(line)
            with self._lock:
                if not connection.waiting:  # let go meanwhile
                    return
                connection.size -= sent
                if sent < len(line):
                    connection.waiting[0] = line[sent:]
                    return
                connection.waiting.popleft()

    def _read(self, client: int, connection: _Connection) -> None:
        data = connection.socket.recv(_CHUNK)
        if not data:
            self._drop(client)
            return
        if connection.closing:
            return
        *lines, rest = (bytes(connection.received) + data).split(b"\n")
        connection.received = bytearray(rest[: LONGEST_LINE + 1])
        for line in lines:
            self.incoming.put(Incoming(client, What.LINE, line[: LONGEST_LINE + 1]))
        if len(rest) > LONGEST_LINE:
            self.incoming.put(Incoming(client, What.LINE, bytes(connection.received)))
            connection.received.clear()

    def let_go(self, client: int) -> None:
        """Close a client's connection as soon as it has taken what waits for it."""
        with self._lock:
            connection = self._connections.get(client)
            if connection is not None:
                connection.closing = True
        self._wake()

    def _drop(self, client: int) -> None:
        with self._lock:
            connection = self._connections.pop(client, None)
        if connection is None:
            return
        with suppress(KeyError, ValueError):
            self._selector.unregister(connection.socket)
        connection.socket.close()
        self.incoming.put(Incoming(client, What.LEFT))
