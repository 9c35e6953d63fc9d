"""`dynakin live --view --record` as a process of its own, killed with -9 while a person moves."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from pathlib import Path

import pytest

from dynakin.cli.app import main
from dynakin.stream.sinks.recorder import recorded

LIVE = "import sys; from dynakin.cli import main; sys.exit(main(sys.argv[1:]))"


class Session:
    """The command, and the times at which its lines came."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-c", LIVE, "live", *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
        )  # fmt: skip
        self.said: list[tuple[float, str]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.append((time.monotonic(), line.strip()))

    def wait_for(self, pattern: str, seconds: float = 90.0) -> tuple[float, re.Match[str]]:
        """When a line with the pattern came, and its match."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline and self.process.poll() is None:
            for at, line in list(self.said):
                if found := re.search(pattern, line):
                    return at, found
            time.sleep(0.05)
        raise AssertionError(f"no {pattern!r} within {seconds:g} s; said: {[line for _, line in self.said]}")

    def kill(self) -> None:
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self._reader.join(5.0)


@pytest.mark.nightly
def test_all_but_the_last_second_is_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("viser")
    folder, output = tmp_path / "recording", tmp_path / "results"
    source = "simulate:squat,model=sagittal7,duration=60"
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = str(probe.getsockname()[1])
    session = Session("--source", source, "--model", "sagittal7", "--view", "--port", port, "--record", str(folder))
    try:
        begun, _ = session.wait_for("^Streams: ")
        _, viewer = session.wait_for(r"Viewer: (http://127\.0\.0\.1:\d+)")
        session.wait_for("Ready: move")
        page, deadline = b"", time.monotonic() + 60.0
        while not page and time.monotonic() < deadline:
            try:
                page = urllib.request.urlopen(viewer[1], timeout=5.0).read()
            except OSError:
                time.sleep(0.2)
        assert b"<html" in page.lower()
        time.sleep(3.0)
        lasted = time.monotonic() - begun
    finally:
        session.kill()
    kept = recorded(folder)
    assert kept.time[-1] - kept.time[0] > lasted - 1.0
    assert main(["live", "--finish", str(folder), "-o", str(output)]) == 0
    assert (output / "report.html").exists() and "Report" in capsys.readouterr().out
