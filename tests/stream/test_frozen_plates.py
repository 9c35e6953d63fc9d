"""Plates whose data stand still under a load that does not, and plates of which one alone is not measured, as samples
come."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dynakin.recordings.plates.stuck import frozen
from dynakin.stream.fusion import Fused, Fusion
from dynakin.stream.plate_samples import PlateSamples
from dynakin.stream.sinks.recorder import Recorder, recorded
from dynakin.stream.sources.packets import MarkerPacket, PlatePacket, StreamInfo

RATE_HZ = 1000.0
TIME = np.arange(3000) / RATE_HZ


def presses(noise_n: float = 0.3) -> np.ndarray:
    """(N, 2, 6) of two plates that somebody sways on."""
    rng = np.random.default_rng(1)
    share = 0.5 + 0.3 * np.sin(2.0 * np.pi * 0.7 * TIME)
    rows = np.zeros((len(TIME), 2, 6))
    for p, part in enumerate((share, 1.0 - share)):
        rows[:, p, 1] = 700.0 * part
        rows[:, p, [0, 2]] = (30.0 * np.cos(2.0 * np.pi * TIME))[:, None]
        rows[:, p, 3:] = 20.0 * part[:, None]
    return rows + noise_n * rng.standard_normal(rows.shape)


def at_frames(rows: np.ndarray, marker_rate_hz: float = 100.0) -> tuple[np.ndarray, np.ndarray, PlateSamples]:
    """Wrenches (T, P, 6) at the times (T,) of the markers, each asked for once its plates are there."""
    samples = PlateSamples(RATE_HZ, marker_rate_hz, 2)
    times, found = np.arange(10, len(TIME), 10) / RATE_HZ, []
    for k, time_s in enumerate(times):
        block = slice(10 * k + (k > 0), 10 * k + 11)
        samples.push(TIME[block], rows[block])
        found.append(samples.at(float(time_s)))
    return times, np.stack([np.full((2, 6), np.nan) if one is None else one for one in found]), samples


def test_a_plate_that_stands_still_is_not_measured_until_it_moves_again_and_the_other_is() -> None:
    whole, rows = presses(), presses()
    rows[1000:1500, 0] = rows[1000, 0]
    times, good, _ = at_frames(whole)
    _, found, samples = at_frames(rows)
    np.testing.assert_array_equal(found[:, 1], good[:, 1])
    lost = np.isnan(found[:, 0]).all(axis=1)
    assert lost[(times > 1.011) & (times < 1.5)].all()  # 10 equal rows are waited for
    assert not lost[times < 1.0].any() and not lost[times > 1.56].any()
    after = times > 1.56  # the low-pass has forgotten what was held
    np.testing.assert_allclose(found[after, 0], good[after, 0], atol=0.1)
    assert [(p, round(since, 2)) for p, since in samples.frozen] == [(0, 1.0)]


def test_what_a_file_calls_frozen_to_its_end_is_frozen_as_it_comes() -> None:
    rows = presses()
    rows[2400:, 0] = rows[2400, 0]
    assert frozen(rows[:, 0], rows[:, 0, 1], RATE_HZ)[-1]
    _, found, _ = at_frames(rows)
    assert np.isnan(found[-1, 0]).all() and np.isfinite(found[-1, 1]).all()


@pytest.mark.parametrize("rows", [presses(0.3).round(0), np.repeat(presses()[::10], 10, axis=0), 0.0 * presses()])
def test_coarse_repeated_and_empty_rows_are_measured(rows: np.ndarray) -> None:
    _, found, samples = at_frames(rows)
    assert np.isfinite(found).all() and samples.frozen == []


def test_one_plate_without_numbers_takes_none_from_the_other() -> None:
    rows = presses()
    rows[1000:2000, 0] = np.nan
    times, found, _ = at_frames(rows)
    _, good, _ = at_frames(presses())
    np.testing.assert_array_equal(found[:, 1], good[:, 1])
    lost = np.isnan(found[:, 0]).all(axis=1)
    assert lost[(times > 1.0) & (times < 2.0)].all() and not lost[(times < 1.0) | (times > 2.06)].any()


def test_plates_without_numbers_at_all_are_silent() -> None:
    rows = presses()
    rows[1000:2000] = np.nan
    times, found, _ = at_frames(rows)
    assert np.isnan(found[(times > 1.03) & (times < 2.0)]).all() and np.isfinite(found[times > 2.01]).all()


def test_a_recorded_session_is_read_as_a_file_is(tmp_path: Path) -> None:
    """Jumps and frozen plates are missing, and said, in what `finish` starts from."""
    names = tuple(f"m{k}" for k in range(6))
    markers, plates = StreamInfo(names, 100.0, "c", ordered=True), StreamInfo(("a", "b"), RATE_HZ, "c", ordered=True)
    places = np.random.default_rng(2).uniform(0.0, 1.0, (6, 3)) + np.array([0.0, 1.0, 0.0])
    rows = presses()
    rows[1000:1500, 0] = rows[1000, 0]
    recorder = Recorder(tmp_path / "r")
    recorder.opened(markers, plates)
    rng = np.random.default_rng(3)
    for k in range(290):
        frame = places + 0.1 * np.sin(0.05 * k) + 5e-4 * rng.standard_normal((6, 3))
        frame[2] += [0.0, 0.05 * (100 <= k < 130), 0.0]
        arrived: Any = k / 100.0
        recorder.packet(PlatePacket(TIME[10 * k : 10 * k + 10], rows[10 * k : 10 * k + 10], arrived))
        recorder.packet(MarkerPacket(k / 100.0, frame, arrived))
    recorder.close()
    found = recorded(tmp_path / "r")
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(found.markers[:, 2, 0])), np.arange(100, 130))
    assert np.isnan(found.plates[0].force[110:150]).all() and np.isfinite(found.plates[1].force[:280]).all()
    said = " ".join(map(str, found.notes))
    assert "m2 by" in said and "a repeats one and the same row" in said
    assert "from 1.01 to 1.49 s" in said and "its connection hung." in said and "as long as it does" not in said


def test_a_frame_shows_which_plate_is_not_measured() -> None:
    fusion = Fusion(StreamInfo(("m",), 100.0, "c", ordered=True), StreamInfo(("a", "b"), RATE_HZ, "c", ordered=True))
    rows, found = presses(), list[Fused]()
    rows[1000:, 0] = rows[1000, 0]
    for k in range(290):
        fusion.push(PlatePacket(TIME[10 * k : 10 * k + 10], rows[10 * k : 10 * k + 10], k / 100.0))
        fusion.push(MarkerPacket(k / 100.0, np.ones((1, 3)), k / 100.0))
        found += fusion.poll(k / 100.0)
    last = found[-1].wrenches
    assert last is not None and np.isnan(last[0]).all() and np.isfinite(last[1]).all()
    assert [(name, round(since, 2)) for name, since in fusion.frozen_plates] == [("a", 1.0)]
