"""A client of a run's server: one connection, requests and what is told in between. Standard library only.

with Client(port=4840) as client:
    client.request("set", signal="DI3", value=True)
"""

from __future__ import annotations

import json
import socket
from collections import deque
from types import TracebackType
from typing import Any, Self


class ServerError(Exception):
    """The server refused a request, or went away."""


class Client:
    """Speaks the protocol of docs/server.md. `hello` is what the server said first.

    Raises OSError where there is no server. `timeout` (s) bounds every wait.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0, *, timeout: float = 30.0) -> None:
        self._socket = socket.create_connection((host, port), timeout)
        self._file = self._socket.makefile("rb")
        self._count = 0
        self._told: deque[dict[str, Any]] = deque()
        self.hello: dict[str, Any] = self._read()["hello"]

    def request(self, do: str, **values: Any) -> dict[str, Any]:
        """Ask and wait for the answer; what is told meanwhile is kept for `told`. Raises ServerError."""
        self._count += 1
        asked = {"id": self._count, "do": do, **values}
        self._socket.sendall(json.dumps(asked).encode() + b"\n")
        while True:
            message = self._read()
            if message.get("id") == self._count and "ok" in message:
                if not message["ok"]:
                    raise ServerError(message["error"])
                return message
            self._told.append(message)

    def told(self) -> dict[str, Any]:
        """The next thing told without being asked: `monitor`, `event` or `end`. Raises ServerError."""
        return self._told.popleft() if self._told else self._read()

    def close(self) -> None:
        """Leave."""
        self._file.close()
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _read(self) -> dict[str, Any]:
        line = self._file.readline()
        if not line:
            raise ServerError("the server has gone")
        message: dict[str, Any] = json.loads(line)
        return message
