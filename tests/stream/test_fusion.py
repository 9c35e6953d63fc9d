"""Fusion by time stamp: what comes late, twice, out of order, backwards, or not at all."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.errors import StreamError
from dynakin.recordings.resampling import resample
from dynakin.stream.fusion import Fusion
from dynakin.stream.sources.packets import MarkerPacket, PlatePacket, StreamInfo
from support.stream.made import MARKERS, PLATES, block, frame, play, times


def test_frames_in_order_are_not_delayed() -> None:
    fusion = Fusion(MARKERS, None)
    for k in range(20):
        assert times(play(fusion, [frame(k / 100)])) == [k / 100]


def test_a_frame_waits_for_the_plates_of_its_time_and_no_longer() -> None:
    fusion = Fusion(MARKERS, PLATES)
    play(fusion, [block(0.0), frame(0.005)])
    assert play(fusion, [frame(0.015, arrived_s=0.016)]) == []
    found = play(fusion, [block(0.010, arrived_s=0.021)])
    assert times(found) == [0.015]
    assert found[0].wrenches is not None and found[0].arrived_s == 0.021


def test_frames_out_of_order_are_put_right_within_the_delay() -> None:
    fusion = Fusion(MARKERS, None, delay_s=0.05)
    order = [0, 1, 3, 2, 4, 7, 6, 5, 8]
    found = play(fusion, [frame(k / 100, arrived_s=n / 100) for n, k in enumerate(order)])
    assert times(found) == [k / 100 for k in range(9)]
    assert fusion.marker_counts.lost == fusion.marker_counts.late == 0


def test_a_lost_frame_is_waited_for_no_longer_than_declared() -> None:
    fusion = Fusion(MARKERS, None, delay_s=0.05)
    play(fusion, [frame(0.0), frame(0.01)])
    found = play(fusion, [frame(k / 100) for k in range(3, 9)])
    assert times(found)[0] == 0.03 and fusion.marker_counts.lost == 1
    assert found[0].sample.time_s == 0.03


def test_duplicates_zero_and_negative_steps_are_left_out() -> None:
    fusion = Fusion(MARKERS, None)
    stamps = [0.0, 0.01, 0.01, 0.005, 0.02, -0.3, 0.02, np.nan, 0.03]
    found = play(fusion, [frame(t, arrived_s=n / 100) for n, t in enumerate(stamps)])
    assert times(found) == [0.0, 0.01, 0.02, 0.03]
    counts = fusion.marker_counts
    assert (counts.duplicate, counts.late, counts.invalid) == (2, 2, 1)


def test_a_burst_of_500_late_packets_changes_nothing() -> None:
    fusion = Fusion(MARKERS, None)
    play(fusion, [frame(10 + k / 100) for k in range(100)])
    burst = [frame(5 + k / 100, arrived_s=11.0 + 1e-5 * k) for k in range(500)]
    assert play(fusion, burst) == []
    assert times(play(fusion, [frame(11.0, arrived_s=11.01)])) == [11.0]
    assert fusion.marker_counts.late == 500 and fusion.clock_restarts == 0


def test_a_clock_that_was_set_back_goes_on_where_it_was() -> None:
    fusion = Fusion(MARKERS, PLATES)
    for k in range(100):
        play(fusion, [block(100 + k / 100, arrived_s=50 + k / 100), frame(100 + k / 100, arrived_s=50 + k / 100)])
    found = []
    for k in range(100):  # the source comes back two seconds later, its clock at 0
        at = 53 + k / 100
        found += play(fusion, [block(k / 100, arrived_s=at), frame(k / 100, arrived_s=at)])
    assert fusion.clock_restarts == 1 and len(found) > 40
    assert (np.diff(times(found)) > 0).all() and 102.9 < found[0].sample.time_s < 103.6
    assert found[-1].wrenches is not None


def test_silent_plates_hold_nothing_up_and_come_back() -> None:
    fusion = Fusion(MARKERS, PLATES, delay_s=0.05)
    for k in range(50):
        play(fusion, [block(k / 100), frame(k / 100 + 0.005, arrived_s=k / 100 + 0.01)])
    without = [one for k in range(50, 150) for one in play(fusion, [frame(k / 100 + 0.005)])]
    assert len(without) > 90 and without[-1].wrenches is None and fusion.plates_silent(1.5)
    assert without[-1].sample.time_s == pytest.approx(1.495)
    again = [one for k in range(150, 160) for one in play(fusion, [block(k / 100), frame(k / 100 + 0.005)])]
    assert again[-1].wrenches is not None


def test_silent_markers_leave_steps_with_plates_alone() -> None:
    fusion = Fusion(MARKERS, PLATES)
    for k in range(50):
        play(fusion, [block(k / 100), frame(k / 100)])
    alone = [one for k in range(50, 200) for one in play(fusion, [block(k / 100)])]
    assert alone and all(np.isnan(one.positions).all() and one.wrenches is not None for one in alone)
    np.testing.assert_allclose(np.diff(times(alone)), 0.01, atol=1e-6)
    back = [one for k in range(200, 210) for one in play(fusion, [block(k / 100), frame(k / 100)])]
    assert np.isfinite(back[-1].positions).all() and back[-1].sample.time_s > alone[-1].sample.time_s


def test_wrenches_are_those_of_the_offline_causal_resampling() -> None:
    rng = np.random.default_rng(3)
    t = np.arange(2000) / 1000.0
    values = 500.0 + np.cumsum(rng.normal(size=(2000, 6)), axis=0)
    frames = np.arange(195) / 100.0
    expected = resample(values, t, frames, causal=True)
    fusion = Fusion(MARKERS, PLATES)
    found = []
    row = 0
    for k, now in enumerate(frames):
        size = int(rng.integers(1, 25))
        while row < 2000 and t[row] <= now + 1e-9:
            part = slice(row, row + size)
            found += play(fusion, [PlatePacket(t[part], values[part, None], float(now))])
            row += size
        found += play(fusion, [MarkerPacket(float(now), np.full((2, 3), float(k)), float(now))])
    found += fusion.poll(np.inf)
    assert len(found) == len(frames)
    got = np.stack([one.wrenches[0] for one in found if one.wrenches is not None])
    np.testing.assert_allclose(got, expected, atol=1e-9)


def test_clocks_with_nothing_in_common_are_put_together_by_arrival() -> None:
    rng = np.random.default_rng(1)
    fusion = Fusion(MARKERS, StreamInfo(("left",), 1000.0, "other"))
    found = []
    for k in range(300):
        now = k / 100
        late = abs(rng.normal(0.0, 0.004))
        found += play(fusion, [block(now - 7000.0 - 0.009, arrived_s=now + late), frame(now, arrived_s=now + 0.001)])
    assert fusion.clock_offset_s == pytest.approx(7000.0, abs=0.002)
    assert found[-1].wrenches is not None and found[10].wrenches is None


def test_without_markers_there_is_a_clear_error() -> None:
    with pytest.raises(StreamError, match="no stream of markers"):
        Fusion(None, PLATES)


def test_a_gap_in_the_plates_begins_the_filter_anew_and_leaves_the_wrench_out() -> None:
    fusion = Fusion(MARKERS, PLATES)
    for k in range(30):
        play(fusion, [block(k / 100), frame(k / 100)])
    found = []
    for k in range(30, 60):
        packets = [frame(k / 100)] if k < 40 else [block(k / 100), frame(k / 100)]
        found += play(fusion, packets)
    found += fusion.poll(np.inf)
    seen = {round(one.sample.time_s, 2): one.wrenches for one in found}
    assert seen[0.35] is None and seen[0.55] is not None
    np.testing.assert_allclose(seen[0.55], 500.0)
