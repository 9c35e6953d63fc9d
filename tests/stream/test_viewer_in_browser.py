"""The page in a headless Chromium, fed with names that a file may hold."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

from dynakin.filter.build import estimator_of
from dynakin.settings.settings import Settings
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame, Started
from dynakin.stream.sources.replay import Replay

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SETTINGS = {"model": "sagittal7", "markers": "opencap", "mass_kg": 70.0, "height_m": 1.75, "sex": "male"}
MARKER = "<img src=x onerror=pwned=1>"
SENTENCE = "r<script>pwned=2</script> | <b>x</b> ![y](/etc/hostname) has 3 *frames*"

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here (apt-get install chromium)")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Browser:
    """One page, by Chromium's remote debugging."""

    def __init__(self, profile: str) -> None:
        from websockets.sync.client import connect

        assert CHROMIUM is not None
        port = free_port()
        graphics = ["--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"]
        command = [CHROMIUM, "--headless=new", "--no-sandbox", *graphics, f"--remote-debugging-port={port}"]
        command += ["--remote-allow-origins=*", f"--user-data-dir={profile}", "about:blank"]
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        tabs: list[dict[str, str]] = []
        for _ in range(120):
            try:
                tabs = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=5.0))
                break
            except OSError:
                time.sleep(0.5)
        if not tabs:
            self.close()
            pytest.skip("Chromium does not answer")
        url = next(tab for tab in tabs if tab["type"] == "page")["webSocketDebuggerUrl"]
        self.socket, self.count = connect(url, max_size=None), 0

    def call(self, method: str, **parameters: object) -> dict[str, Any]:
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self.socket.recv(timeout=120))
            if answer.get("id") == self.count:
                return dict(answer.get("result", answer))

    def value(self, expression: str) -> Any:
        return self.call("Runtime.evaluate", expression=expression, returnByValue=True)["result"].get("value")

    def close(self) -> None:
        self.process.terminate()
        self.process.wait()


@pytest.fixture
def browser() -> Iterator[Browser]:
    pytest.importorskip("viser")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        found = Browser(profile)
        yield found
        found.close()


def test_names_from_files_are_text_on_the_page(browser: Browser, tmp_path: Path) -> None:
    from dynakin.stream.viewer.sink import Viewer

    frames: list[LiveFrame] = []
    live = Live(
        estimator_of(Settings.of(SETTINGS, "live", ("model",))),
        [Replay(simulate_squat(seed=1, duration_s=5.0).recording, speed=0.0)],
        [Callback(frames.append)],
        say=lambda text: None,
    )
    live.run()
    viewer = Viewer(port=free_port())
    try:
        viewer.opened(live.fusion.markers, live.fusion.plates)
        viewer.started(Started(live.tracker.calibrated, live.tracker.core_model, 100.0))
        status = replace(frames[-1].status, refused=(MARKER,))
        viewer.said(SENTENCE, status)
        browser.call("Page.enable")
        text, deadline = "", time.monotonic() + 90.0
        loaded = False
        while (SENTENCE not in text or MARKER not in text) and time.monotonic() < deadline:
            viewer.frame(replace(frames[-1], status=status))
            if not loaded:
                try:
                    urllib.request.urlopen(viewer.url, timeout=5.0).read()
                    browser.call("Page.navigate", url=viewer.url)
                    loaded = True
                except OSError:
                    pass
            text = browser.value("document.body ? document.body.innerText : ''") or ""
            time.sleep(0.5)
        assert SENTENCE in text and MARKER in text, text[:2000]
        assert browser.value("typeof pwned") == "undefined"
        assert browser.value("document.querySelectorAll('img[src=x], b').length") == 0
        # A page of another origin in the same browser is not let in.
        browser.call("Page.navigate", url="data:text/html,<p>other")
        time.sleep(1.0)
        protocol = f"viser-v{version('viser')}"
        script = (
            f"window.answer = ''; const w = new WebSocket('ws{viewer.url.removeprefix('http')}', '{protocol}'); "
            "w.onmessage = () => {answer = 'read'}; w.onclose = () => {answer ||= 'refused'};"
        )
        browser.value(script)
        deadline = time.monotonic() + 30.0
        while not (answer := browser.value("window.answer")) and time.monotonic() < deadline:
            time.sleep(0.2)
        assert answer == "refused"
    finally:
        viewer.close()
