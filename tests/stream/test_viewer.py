"""The queue of one, and the page in its own process."""

from __future__ import annotations

import json
import socket
import time
import urllib.request

import numpy as np
import pytest

import dynakin
from dynakin.errors import ConfigError
from dynakin.recordings import Recording
from dynakin.simulation import simulate_squat
from dynakin.stream import Callback, Live, LiveFrame, Replay, Started
from dynakin.stream.latest import Latest
from dynakin.stream.picture import Picture, arrow, in_words, split, status_text
from dynakin.stream.sinks import Status


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
    assert live.estimator.initial is not None
    picture = Picture(Started(live.estimator.initial, live.estimator.core_model, 100.0), plates=len(squat.plates))
    part = split(picture.numbers(frames[-1], live.estimator.deviations()), picture.sizes)
    np.testing.assert_allclose(part["angles"], frames[-1].estimate.coordinates)
    measured, estimated = part["measured"].reshape(-1, 3), part["estimated"].reshape(-1, 3)
    assert np.nanmax(np.abs(measured - estimated)[:, :2]) < 0.05
    weight = part["arrows"].reshape(-1, 6)[-1, 4]
    assert 400.0 < weight < 1000.0 and np.isfinite(part["moment_sd"]).all()


def test_the_page_is_served_to_this_machine_and_ends_with_the_session(
    squat: Recording, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("viser")
    from dynakin.stream.viewer import Viewer

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    viewer = Viewer(port=port)
    assert "seen by this machine alone" in capsys.readouterr().out
    session(squat, [viewer], speed=0.0)  # not run: the page is there before the person
    deadline, page = time.monotonic() + 60.0, b""
    while not page and time.monotonic() < deadline:
        try:
            page = urllib.request.urlopen(viewer.url, timeout=5.0).read()
        except OSError:
            time.sleep(0.2)
    assert b"<html" in page.lower()
    live = session(squat, [viewer])
    live.run()
    assert viewer._process.poll() == 0  # it ended by itself and without an error


def test_without_viser_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    from dynakin.stream import viewer

    monkeypatch.setattr(viewer.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"needs viser, which is not installed; pip install 'dynakin\[live\]'"):
        viewer.Viewer()


def test_a_port_in_use_is_passed_over() -> None:
    from dynakin.stream.viewer import _free_port

    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert _free_port("127.0.0.1", port) > port
    with pytest.raises(ConfigError, match="none of 20 ports can be served"):
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
