"""The viewer's end in the session: hands the newest frame to a process of its own, and never waits for it."""

from __future__ import annotations

import errno
import importlib.util
import json
import queue
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Mapping

import numpy as np

from dynakin.errors import ConfigError
from dynakin.filter.step import Labelled
from dynakin.stream.sinks.base import LiveFrame, Sink, Started, Status
from dynakin.stream.sinks.picture import Picture, status_text
from dynakin.stream.sources.packets import StreamInfo
from dynakin.stream.viewer.latest import Latest

_PORTS = 20  # that are tried from the one asked for
_PICTURES_S = 1.0 / 40.0


class Viewer(Sink):
    """A web page with the moving person.

    Args:
        host: address that the page is served at; 127.0.0.1 is seen by this machine alone. port: its port.

    Raises:
        ConfigError: viser is not installed, or no port is free.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 8080) -> None:
        if importlib.util.find_spec("viser") is None:
            raise ConfigError("--view needs viser, which is not installed; pip install 'dynakin[live]', or make live")
        port = _free_port(host, port)
        self.url = f"http://{'127.0.0.1' if host == '0.0.0.0' else host}:{port}"
        who = "this machine alone" if host in ("127.0.0.1", "localhost", "::1") else "everyone in the network"
        print(f"Viewer: {self.url} (seen by {who})", flush=True)
        self._picture: Picture | None = None
        self._latest: Latest | None = None
        self._drawn = -np.inf
        self._deviations: Mapping[str, Labelled] | None = None
        self._plates = 0
        self._closed = False
        self._wishes: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "dynakin.stream.viewer.process", host, str(port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            text=True,
        )
        self._threads = [threading.Thread(target=job, daemon=True) for job in (self._listen, self._send_status)]
        for thread in self._threads:
            thread.start()

    def opened(self, markers: StreamInfo, plates: StreamInfo | None) -> None:
        """Keeps how many plates there are."""
        self._plates = len(plates.names) if plates is not None else 0

    def started(self, started: Started) -> None:
        """Describes to the page what it will show."""
        self._picture = Picture(started, self._plates)
        if self._latest is not None:
            self._latest.close()
        self._latest = Latest(sum(self._picture.sizes.values()))
        self._drawn, self._deviations = -np.inf, None
        self._lines.put(json.dumps({"setup": self._picture.setup | {"path": self._latest.path}}))

    def frame(self, frame: LiveFrame) -> None:
        """Shows it, unless the last one was shown just before."""
        if self._picture is None or self._latest is None:
            return
        self._deviations = frame.deviations or self._deviations
        now = time.monotonic()
        if now - self._drawn < _PICTURES_S:
            return
        self._drawn = now
        numbers = self._picture.numbers(frame, self._deviations)
        self._latest.write(numbers, status_text(frame.status))

    def said(self, text: str, status: Status) -> None:
        """Shows what is said."""
        self._lines.put(json.dumps({"said": text, "phase": status.phase, "tracking": status.tracking}))

    def asked(self) -> list[str]:
        """Buttons that were pressed."""
        found = []
        while not self._wishes.empty():
            found.append(self._wishes.get())
        return found

    def failure(self) -> str | None:
        """That the page's process ended before the session."""
        if self._closed or (code := self._process.poll()) is None:
            return None
        return (
            f"The live page at {self.url} is gone (its process ended with {code}; an error it printed stands above). "
            "The session goes on without it; begin it anew to see the page."
        )

    def close(self) -> None:
        """The page ends with the session."""
        self._closed = True
        self._lines.put(None)
        try:
            self._process.wait(3.0)
        except subprocess.TimeoutExpired:
            self._process.terminate()
            self._process.wait(3.0)
        if self._latest is not None:
            self._latest.close()
            self._latest = None

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._wishes.put(line.strip())

    def _send_status(self) -> None:
        assert self._process.stdin is not None
        try:
            while (line := self._lines.get()) is not None:
                self._process.stdin.write(line + "\n")
                self._process.stdin.flush()
            self._process.stdin.close()
        except OSError:
            pass  # `failure` says that the page is gone


def _free_port(host: str, first: int) -> int:
    """The first port that nobody serves: another session may be open.

    Raises:
        ConfigError: none of them, or an address that is not this machine's.
    """
    error: OSError | None = None
    ports = range(first, min(first + _PORTS, 65536))
    for port in ports:
        try:
            with socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET):
                return port
        except OSError as found:
            if not isinstance(found, PermissionError) and found.errno != errno.EADDRINUSE:
                raise ConfigError(
                    f"--host {host}: no page can be served there ({found}), expected an address of this computer, such "
                    "as 127.0.0.1, or 0.0.0.0 for all of them"
                ) from found
            error = found
    raise ConfigError(f"--host {host}: no port from {first} to {ports[-1]} can be served ({error})")
