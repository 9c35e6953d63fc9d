"""The viewer's own process: a page by viser that shows the newest numbers."""

from __future__ import annotations

import json
import queue
import sys
import threading
import time
from collections import deque
from typing import Any

import numpy as np
import viser
from viser import uplot

from dynakin.results.measures.sources import MEANINGS, MEASURED
from dynakin.results.records import NO_ESTIMATE
from dynakin.stream.sinks.picture import as_text, in_words, split
from dynakin.stream.viewer.latest import Latest
from dynakin.stream.viewer.own_origin import OwnOrigin

_PERIOD_S = 1.0 / 30.0
_PLOT_S = 0.1
_HISTORY_S = 10.0
_M_PER_N = 1.0 / 1000.0
_MEASURED, _ESTIMATED, _BONE = (222, 120, 31), (33, 102, 172), (60, 68, 82)
_PLATE, _TOTAL = (34, 139, 84), (120, 90, 160)
_NARROW = 0.9  # width over height
_LEGEND = "Markers: orange measured, blue estimated. Arrows: green plates, violet estimated total, 1 m for 1000 N."


class Page:
    """The page: a scene on the left, words, buttons and plots on the right."""

    def __init__(self, host: str, port: int) -> None:
        with OwnOrigin(host) as own:
            self.server = viser.ViserServer(host=host, port=port, label="dynakin live", verbose=False)
        if not own.guards:  # a viser that serves in another way
            raise RuntimeError(f"viser {viser.__version__} cannot be kept to its own origin; the page is not served")
        self.server.scene.set_up_direction("+y")
        self.server.gui.configure_theme(show_logo=False, show_share_button=False)
        self.server.scene.add_grid("/floor", 4.0, 4.0, plane="xz", cell_size=0.25, section_size=1.0)
        self.server.initial_camera.position = (1.35, 1.2, 1.7)
        self.server.initial_camera.look_at = (0.2, 0.8, 0.0)
        self.server.on_client_connect(_place_camera)
        gui = self.server.gui
        self.words = gui.add_markdown("**dynakin live**: waiting")
        self.status = gui.add_markdown("")
        buttons = gui.add_button_group("Session", ("restart", "recalibrate", "record"))
        buttons.on_click(lambda event: print(event.target.value, flush=True))
        self.said: deque[str] = deque(maxlen=3)
        self.setup: dict[str, Any] = {}
        self.latest: Latest | None = None
        self.history: deque[dict[str, np.ndarray]] = deque()
        self.plots: dict[str, Any] = {}
        self.plotted = 0.0

    def begin(self, setup: dict[str, Any]) -> None:
        """A model was measured."""
        try:
            latest = Latest(sum(setup["sizes"].values()), path=setup["path"])
        except FileNotFoundError:  # the session has begun anew since: its next setup is on the way
            return
        if self.latest is not None:
            self.latest.close()
        self.setup, self.latest = setup, latest
        self.history.clear()
        scene = self.server.scene
        bones = len(setup["bones"]) + len(setup["ends"])
        self.bones = scene.add_line_segments("/bones", np.zeros((bones, 2, 3)), _BONE, thickness=0.022)
        empty = np.zeros((len(setup["markers"]), 3))
        self.measured = scene.add_point_cloud("/measured", empty, _MEASURED, point_size=0.019, point_shape="circle")
        self.estimated = scene.add_point_cloud("/estimated", empty, _ESTIMATED, point_size=0.013, point_shape="circle")
        arrows = setup["sizes"]["arrows"] // 6
        colours = np.array([_PLATE] * (arrows - 1) + [_TOTAL], dtype=np.uint8)
        self.arrows = scene.add_arrows(
            "/forces", np.zeros((arrows, 2, 3)), colours, shaft_radius=0.008,
            head_radius=0.02, head_length=0.05,
        )  # fmt: skip
        if not self.plots:
            self._add_plots()

    def _add_plots(self) -> None:
        gui, setup = self.server.gui, self.setup
        free = [name for name, locked in zip(setup["coordinates"], setup["locked"], strict=True) if not locked]
        knees = [name for name in free if "knee" in name]
        self.chosen = gui.add_dropdown("Coordinate", free, initial_value=(knees or free)[0])
        line = uplot.Series(label="angle, deg (m)", stroke="#2166ac", width=2)
        self._add_plot("angle", "Angle, deg (m)", [line])
        line = uplot.Series(label="moment, N m", stroke="#b2182b", width=2)
        other = uplot.Series(label="derived or prior", stroke="#8c8c8c", width=2, dash=(6, 4))
        band = [uplot.Series(label=f"{sign} 2 sd", stroke="#e3a3a9", width=1) for sign in "-+"]
        title = "Moment, N m (N), with two standard deviations; dashed: not measured"
        self._add_plot("moment", title, [line, *band, other])
        gui.add_markdown(_LEGEND)
        if setup["constants"]:
            lengths = [name for name in setup["constants"] if name.startswith("length/")] or setup["constants"]
            self.constant = gui.add_dropdown("Constant", setup["constants"], initial_value=lengths[0])
            line = uplot.Series(label="m or kg", stroke="#4d7d3b", width=2)
            self._add_plot("constant", "Constant, m or kg", [line])

    def _add_plot(self, name: str, title: str, lines: list[uplot.Series]) -> None:
        """A plot over time; with several lines the area between the second and the third is filled."""
        bands = (uplot.Band(series=(3, 2), fill="rgba(178,24,43,0.15)"),) if len(lines) > 1 else None
        self.plots[name] = self.server.gui.add_uplot(
            (np.zeros(2), *[np.full(2, np.nan)] * len(lines)),
            (uplot.Series(label="s"), *lines),
            bands=bands,
            title=title,
            legend=uplot.Legend(show=False),
            scales={"x": uplot.Scale(time=False)},
            aspect=2.2,
        )

    def say(self, text: str, phase: str, tracking: str) -> None:
        """Shows a sentence."""
        self.said.append(as_text(text))
        lines = [*list(self.said)[:-1], f"**{self.said[-1]}**"]
        motion = f", motion {tracking}" if tracking in NO_ESTIMATE else ""
        self.words.content = f"### dynakin live: {as_text(phase + motion)}\n" + "  \n".join(lines)

    def draw(self) -> None:
        """Shows the newest numbers, where there are any."""
        found = self.latest.read() if self.latest is not None else None
        if found is None:
            return
        numbers, text = found
        try:
            status = json.loads(text)
        except ValueError:  # torn, on a processor that orders stores in another way: the next picture comes soon
            return
        part = split(numbers, self.setup["sizes"])
        joints, estimated = part["joints"].reshape(-1, 3), part["estimated"].reshape(-1, 3)
        measured = part["measured"].reshape(-1, 3)
        lines = [[joints[a], joints[b]] for a, b in self.setup["bones"]]
        lines += [[joints[a], estimated[m]] for a, m in self.setup["ends"]]
        arrows = part["arrows"].reshape(-1, 2, 3)
        arrows[:, 1] = arrows[:, 0] + _M_PER_N * arrows[:, 1]
        with self.server.atomic():
            self.bones.points = np.nan_to_num(np.array(lines)).astype(np.float32)
            self.measured.points = _shown(measured)
            self.estimated.points = _shown(estimated)
            self.arrows.points = _shown(arrows)
        self.history.append(part)
        now = float(part["time"][0])
        while now - self.history[0]["time"][0] > _HISTORY_S or now < self.history[0]["time"][0]:
            self.history.popleft()
        if time.monotonic() - self.plotted > _PLOT_S:
            self.plotted = time.monotonic()
            self._plot()
            self._show_status(status)

    def _plot(self) -> None:
        if len(self.history) < 2:
            return
        k = self.setup["coordinates"].index(self.chosen.value)
        factor = 180.0 / np.pi if self.setup["rotation"][k] else 1.0
        t = np.array([part["time"][0] for part in self.history])
        value, moment, sd, source = (
            np.array([part[name][k] for part in self.history])
            for name in ("angles", "moments", "moment_sd", "moment_sources")
        )
        measured = source == MEASURED
        self.plots["angle"].data = (t, factor * value)
        self.plots["moment"].data = (
            t,
            np.where(measured, moment, np.nan),
            moment - 2.0 * sd,
            moment + 2.0 * sd,
            np.where(measured, np.nan, moment),
        )
        if "constant" in self.plots:
            c = self.setup["constants"].index(self.constant.value)
            self.plots["constant"].data = (t, np.array([part["constants"][c] for part in self.history]))

    def _source(self) -> str:
        """Where the chosen coordinate's newest moment comes from."""
        k = self.setup["coordinates"].index(self.chosen.value)
        return MEANINGS[int(self.history[-1]["moment_sources"][k])]

    def _show_status(self, status: dict[str, Any]) -> None:
        rows = [
            ("Rate", f"{status['rate_hz']:.0f} Hz, latency {status['latency_ms']:.1f} ms"),
            ("Fit (NIS; 1: noise as declared)", f"{status['nis']:.2f}, {status['tracking']}"),
            ("Plates", status["plates"]),
            ("Moment", f"{self.chosen.value}: {self._source()}"),
            ("Markers", f"{status['missing']['count']} missing, refused: {in_words(status['refused'])}"),
            ("Packets", f"late {status['late']}, lost {status['lost']}, twice {status['duplicate']}"),
            ("At a bound", in_words(status["at_bound"])),
            ("Constants", "settled" if status["settled"] else "settling"),
        ]
        if status["left_out"]:
            rows.append(("Left out", f"{status['left_out']} frames: this computer is too slow"))
        if status["delay_s"]:
            rows.append(("Angles, moments", f"{1e3 * status['delay_s']:.0f} ms late, from the frames until then"))
        self.status.content = "\n".join(["| | |", "|---|---|", *(f"| {a} | {as_text(b)} |" for a, b in rows)])


def _place_camera(client: viser.ClientHandle) -> None:
    """On a narrow screen the words lie over the lower half: the person goes to the upper one."""
    for _ in range(50):
        try:
            narrow = client.camera.aspect < _NARROW
        except (AssertionError, AttributeError):  # the page has not sent its camera yet
            time.sleep(0.1)
            continue
        if narrow:
            client.camera.position = (2.8, 0.9, 3.6)
            client.camera.look_at = (0.0, -0.95, 0.0)
        return


def _shown(points: np.ndarray) -> np.ndarray:
    """What is not known goes below the floor, out of sight."""
    away = ~np.isfinite(points).reshape(len(points), -1).all(axis=1)
    points = np.array(points, dtype=np.float32)
    points[away] = (0.0, -1e3, 0.0)
    return points


def main(host: str, port: int) -> None:
    """Until the session closes its end."""
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()

    def listen() -> None:
        for line in sys.stdin:
            lines.put(line)
        lines.put(None)

    threading.Thread(target=listen, daemon=True).start()
    page = Page(host, port)
    while True:
        began = time.monotonic()
        while not lines.empty():
            line = lines.get()
            if line is None:
                return
            message = json.loads(line)
            if "setup" in message:
                page.begin(message["setup"])
            else:
                page.say(message["said"], message["phase"], message["tracking"])
        page.draw()
        time.sleep(max(0.002, _PERIOD_S - (time.monotonic() - began)))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
