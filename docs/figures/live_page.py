"""Pictures of the running viewer for docs/live.md, by a headless Chromium and its remote debugging.

dynakin live --source simulate:squat --view &
python docs/figures/live_page.py http://127.0.0.1:8080 --wait 25
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path

from PIL import Image
from websockets.sync.client import connect  # comes with viser

PORT = 9337
SIZES = {"live_desktop": (1280, 800), "live_narrow": (375, 760)}
DISMISS = """[...document.querySelectorAll('.mantine-Notification-closeButton')].forEach(b => b.click())"""


def main() -> None:
    """Write pictures of the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("url")
    parser.add_argument("--wait", type=float, default=20.0, help="s from opening the page to the picture")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    asked = parser.parse_args()
    for name, (width, height) in SIZES.items():
        picture(asked.url, asked.out / f"{name}.png", width, height, asked.wait)


def picture(url: str, path: Path, width: int, height: int, wait_s: float) -> None:
    """One page of its own, at its own size from the beginning."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("no Chromium found; apt-get install chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        graphics = ["--enable-unsafe-swiftshader", "--use-gl=angle", "--use-angle=swiftshader"]
        command = [chromium, "--headless=new", "--no-sandbox", *graphics, f"--remote-debugging-port={PORT}"]
        command += ["--remote-allow-origins=*", f"--user-data-dir={profile}", "--hide-scrollbars", "about:blank"]
        browser = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            page = Page()
            size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
            page.call("Emulation.setDeviceMetricsOverride", **size)
            page.call("Page.navigate", url=url)
            time.sleep(wait_s)
            page.call("Runtime.evaluate", expression=DISMISS)
            time.sleep(1.5)
            data = base64.b64decode(page.call("Page.captureScreenshot", format="png")["data"])
            image = Image.open(io.BytesIO(data)).convert("RGB")
            image.quantize(256, Image.Quantize.MAXCOVERAGE).save(path, optimize=True)
            print(f"{path}: {width} x {height}, {path.stat().st_size / 1000:.0f} kB")
        finally:
            browser.terminate()
            browser.wait()


class Page:
    """The browser's first page."""

    def __init__(self) -> None:
        for _ in range(60):
            try:
                tabs = json.load(urllib.request.urlopen(f"http://127.0.0.1:{PORT}/json"))
                break
            except OSError:
                time.sleep(0.5)
        else:
            raise SystemExit("Chromium does not answer")
        url = next(tab for tab in tabs if tab["type"] == "page")["webSocketDebuggerUrl"]
        self.socket, self.count = connect(url, max_size=None), 0

    def call(self, method: str, **parameters: object) -> dict:
        """The browser's answer to one command."""
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self.socket.recv(timeout=120))
            if answer.get("id") == self.count:
                return answer.get("result", answer)


if __name__ == "__main__":
    main()
