"""The queue of one, and the page in its own process."""

from __future__ import annotations

import html
import json
import multiprocessing
import socket
import time
import urllib.error
import urllib.request
from importlib.metadata import version

import numpy as np
import pytest

import dynakin
from dynakin.errors import ConfigError
from dynakin.recordings.recording import Recording
from dynakin.simulation.trial import simulate_squat
from dynakin.stream.session import Live
from dynakin.stream.sinks.base import Callback, LiveFrame, Started, Status
from dynakin.stream.sinks.picture import Picture, arrow, as_text, in_words, split, status_text
from dynakin.stream.sources.replay import Replay
from dynakin.stream.viewer.latest import Latest


def test_the_reader_gets_the_newest_once() -> None:
    writer = Latest(3)
    reader = Latest(3, path=writer.path)
    assert reader.read() is None
    writer.write(np.array([1.0, 2.0, 3.0]), b"one")
    writer.write(np.array([4.0, 5.0, np.nan]), b"second")
    found = reader.read()
    assert found is not None and found[1] == b"second"
    np.testing.assert_array_equal(found[0], [4.0, 5.0, np.nan])
    assert reader.read() is None
    reader.close()
    writer.close()


def hammered(path: str) -> None:
    """Writes as fast as it can for a second."""
    writer, until, k = Latest(200, path=path), time.monotonic() + 1.0, 0
    while time.monotonic() < until:
        k += 1
        writer.write(np.full(200, float(k)), json.dumps({"a": "x" * (k % 600)}).encode())


def test_a_reader_never_sees_half_of_what_is_written() -> None:
    """The page died of it within minutes: a counter that is 0 for an instant passed as even."""
    mine = Latest(200)
    reader = Latest(200, path=mine.path)
    writing = multiprocessing.get_context("spawn").Process(target=hammered, args=(mine.path,))
    writing.start()
    reads = 0
    try:
        while writing.is_alive():
            if (found := reader.read()) is not None:
                reads += 1
                assert (found[0] == found[0][0]).all() and set(json.loads(found[1])) == {"a"}
    finally:
        writing.join()
        reader.close()
        mine.close()
    assert reads > 5 and writing.exitcode == 0


def test_an_arrow_stands_where_the_wrench_acts() -> None:
    force, point = np.array([10.0, 500.0, -20.0]), np.array([0.1, 0.0, -0.2])
    np.testing.assert_allclose(arrow(np.hstack([force, np.cross(point, force)])), [*point, *force], atol=1e-12)
    assert np.isnan(arrow(np.array([0.0, 5.0, 0.0, 0.0, 0.0, 0.0]))).all()


@pytest.fixture(scope="module")
def squat() -> Recording:
    return simulate_squat(seed=1, duration_s=5.0).recording


def session(squat: Recording, sinks: list[object], speed: float = 0.0) -> Live:
    subject = dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male")
    estimator = dynakin.Estimator(dynakin.load_model("sagittal7", subject=subject, markers="opencap"))
    return Live(estimator, [Replay(squat, speed=speed)], sinks, say=lambda text: None)  # type: ignore[arg-type]


def test_the_picture_holds_what_is_estimated_and_measured(squat: Recording) -> None:
    frames: list[LiveFrame] = []
    live = session(squat, [Callback(frames.append)])
    live.run()
    picture = Picture(Started(live.tracker.calibrated, live.tracker.core_model, 100.0), plates=len(squat.plates))
    part = split(picture.numbers(frames[-1], live.tracker.deviations(delayed=True)), picture.sizes)
    late = frames[-1].published
    assert late is not None and part["time"][0] == late.time_s < frames[-1].estimate.time_s
    np.testing.assert_allclose(part["angles"], late.coordinates)
    np.testing.assert_allclose(part["moments"], late.moments)
    measured, estimated = part["measured"].reshape(-1, 3), part["estimated"].reshape(-1, 3)
    assert np.nanmax(np.abs(measured - estimated)[:, :2]) < 0.05
    weight = part["arrows"].reshape(-1, 6)[-1, 4]
    assert 400.0 < weight < 1000.0 and np.isfinite(part["moment_sd"]).all()


def wait_for_page(url: str) -> bytes:
    deadline, page = time.monotonic() + 60.0, b""
    while not page and time.monotonic() < deadline:
        try:
            page = urllib.request.urlopen(url, timeout=5.0).read()
        except OSError:
            time.sleep(0.2)
    return page


def test_the_page_is_served_to_this_machine_and_ends_with_the_session(
    squat: Recording, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("viser")
    from dynakin.stream.viewer.sink import Viewer

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    viewer = Viewer(port=port)
    assert "seen by this machine alone" in capsys.readouterr().out
    session(squat, [viewer], speed=0.0)  # not run: the page is there before the person
    assert b"<html" in wait_for_page(viewer.url).lower()
    live = session(squat, [viewer])
    live.run()
    assert viewer._process.poll() == 0  # it ended by itself and without an error


def test_that_the_page_is_gone_is_said_once_and_the_session_goes_on(squat: Recording) -> None:
    pytest.importorskip("viser")
    from dynakin.stream.viewer.sink import Viewer

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    viewer, said, frames = Viewer(port=port), list[str](), list[LiveFrame]()
    live = session(squat, [viewer, Callback(frames.append)])
    live._say = said.append
    viewer._process.kill()
    viewer._process.wait(10.0)
    live.run()
    (gone,) = (text for text in said if "is gone" in text)
    assert "its process ended with -9" in gone and "goes on without it" in gone
    assert live.failures == [gone] and len(frames) > 100


def connects(url: str, origin: str | None, host: str | None = None) -> bool:
    """Whether a websocket is opened and something is sent on it."""
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect
    from websockets.typing import Origin, Subprotocol

    protocol = Subprotocol(f"viser-v{version('viser')}")
    address = url.removeprefix("http://").split(":")
    try:
        with connect(
            f"ws://{host or address[0]}:{address[1]}",
            sock=socket.create_connection((address[0], int(address[1]))),
            origin=None if origin is None else Origin(origin),
            subprotocols=[protocol],
            max_size=None,
        ) as socket_:
            return len(socket_.recv(timeout=20.0)) > 0
    except InvalidStatus as error:
        assert error.response.status_code == 403
        return False


def test_only_the_page_itself_reads_the_stream_and_presses_buttons(squat: Recording) -> None:
    """A page of another site that the browser has open, one under a name that was pointed here, and a bare client."""
    pytest.importorskip("viser")
    from dynakin.stream.viewer.sink import Viewer

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    viewer = Viewer(port=port)
    try:
        wait_for_page(viewer.url)
        assert connects(viewer.url, viewer.url)
        assert connects(viewer.url, f"http://localhost:{port}", host="localhost")
        for origin in ("http://evil.example", f"http://127.0.0.1:{port + 1}", "null", None):
            assert not connects(viewer.url, origin), origin
        assert not connects(viewer.url, f"http://evil.example:{port}", host="evil.example")
        request = urllib.request.Request(viewer.url, headers={"Host": f"evil.example:{port}"})
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(request, timeout=5.0)
        assert not {"restart", "recalibrate", "record"} & set(viewer.asked())
    finally:
        viewer.close()


@pytest.mark.parametrize(
    ("served", "host", "origin", "taken"),
    [
        ("127.0.0.1", "127.0.0.1:8080", "http://127.0.0.1:8080", True),
        ("127.0.0.1", "LocalHost:8080", "http://localhost:8080", True),
        ("127.0.0.1", "localhost:9000", "http://localhost:9000", True),  # another port that is led here
        ("127.0.0.1", "[::1]:8080", "http://[::1]:8080", True),
        ("127.0.0.1", "192.168.0.7:8080", "http://192.168.0.7:8080", False),
        ("127.0.0.1", "evil.example:8080", "http://evil.example:8080", False),
        ("127.0.0.1", "localhost:8080@evil.example", "http://localhost:8080@evil.example", False),
        ("127.0.0.1", "localhost.:8080", "http://localhost.:8080", False),
        ("127.0.0.1", "", "http://", False),
        ("0.0.0.0", "192.168.0.7:8080", "http://192.168.0.7:8080", True),
        ("0.0.0.0", "evil.example:8080", "http://evil.example:8080", False),
        ("0.0.0.0", f"{socket.gethostname()}:8080", f"http://{socket.gethostname()}:8080", True),
        ("lab-pc", "lab-pc:8080", "http://lab-pc:8080", True),
        ("192.168.0.7", "192.168.0.8:8080", "http://192.168.0.8:8080", False),
    ],
)
def test_hosts_and_origins_that_are_our_own(served: str, host: str, origin: str, taken: bool) -> None:
    pytest.importorskip("websockets")
    from dynakin.stream.viewer.own_origin import refusal

    assert (refusal(served, [host], [origin], websocket=True) is None) is taken
    assert (refusal(served, [host], [], websocket=False) is None) is taken
    assert refusal(served, [host], ["http://evil.example"], websocket=True) is not None
    assert refusal(served, [host], [origin, origin], websocket=True) is not None
    assert refusal(served, [host, host], [origin], websocket=True) is not None


def test_names_are_shown_as_they_are() -> None:
    strange = "<script>x()</script> ![a](/etc/passwd) **b** | _c_ [d](http://e) `f` &lt;\n# g"
    shown = as_text(strange)
    assert not set(shown) & set("<>![]()*|_`\n/") and html.unescape(shown) == strange.replace("\n", " ")
    assert as_text("knee Größe 3") == "knee Größe 3"


def test_without_viser_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    from dynakin.stream.viewer import sink as viewer

    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"needs viser, which is not installed; pip install 'dynakin\[live\]'"):
        viewer.Viewer()


def test_a_port_in_use_is_passed_over() -> None:
    from dynakin.stream.viewer.sink import _free_port

    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert _free_port("127.0.0.1", port) > port
    with socket.create_server(("127.0.0.1", 65535)), pytest.raises(ConfigError, match="no port from 65535 to 65535"):
        _free_port("127.0.0.1", 65535)


def test_an_address_of_another_computer_is_named() -> None:
    from dynakin.stream.viewer.sink import _free_port

    with pytest.raises(ConfigError, match=r"no page can be served there .*, expected an address of this computer"):
        _free_port("203.0.113.1", 8080)


def test_a_status_of_many_names_stays_short_and_whole() -> None:
    many = tuple(f"inertia/segment_{k}_{'x' * 60}" for k in range(300))
    writer = Latest(1)
    reader = Latest(1, path=writer.path)
    writer.write(np.zeros(1), status_text(Status(missing=many, at_bound=many, refused=many[:2], tracking="following")))
    found = reader.read()
    assert found is not None
    status = json.loads(found[1])
    assert status["missing"]["count"] == 300 and status["tracking"] == "following"
    assert in_words(status["at_bound"]).startswith("inertia/segment_0_x")
    assert in_words(status["at_bound"]).endswith(" and 296 more") and "more" not in in_words(status["refused"])
    assert in_words(json.loads(status_text(Status()))["refused"]) == "none"
    with pytest.raises(ValueError, match="the text has 5000 bytes, expected 4096 at most"):
        writer.write(np.zeros(1), b" " * 5000)
    reader.close()
    writer.close()
