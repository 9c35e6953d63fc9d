"""Low-pass, derivatives and gaps against signals whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from dynakin.errors import RecordingError
from dynakin.recordings.smoothing import smooth

TIME = np.arange(1001) / 100.0


def wave(hertz: float) -> np.ndarray:
    return np.sin(2.0 * np.pi * hertz * TIME)[:, None]


@pytest.mark.parametrize("cutoff_hz", [4.0, 6.0, 12.0])
def test_the_cutoff_is_minus_three_decibels_after_both_passes_and_nothing_lags(cutoff_hz: float) -> None:
    signal = wave(cutoff_hz)
    inner = slice(200, 801)  # whole periods
    filtered = smooth(TIME, signal, cutoff_hz).values[inner, 0]
    gain = np.linalg.lstsq(
        np.column_stack([signal[inner, 0], np.cos(2.0 * np.pi * cutoff_hz * TIME[inner])]), filtered, rcond=None
    )[0]
    np.testing.assert_allclose(gain, [np.sqrt(0.5), 0.0], atol=1e-4)


def test_derivatives_without_filter_are_those_of_the_signal() -> None:
    found = smooth(TIME, wave(1.0), None)
    w = 2.0 * np.pi
    np.testing.assert_array_equal(found.values, wave(1.0))
    assert np.abs(found.rates[:, 0] - w * np.cos(w * TIME))[5:-5].max() < 1e-4 * w
    assert np.abs(found.seconds[:, 0] + w**2 * np.sin(w * TIME))[5:-5].max() < 1e-4 * w**2


def test_a_slow_signal_passes_and_noise_does_not() -> None:
    noise = np.random.default_rng(0).standard_normal((1001, 1))
    slow = smooth(TIME, wave(0.5), 6.0).values - wave(0.5)
    assert np.abs(slow).max() < 1e-3
    assert smooth(TIME, noise, 6.0).values.std() < 0.45 * noise.std()


def test_a_short_gap_is_filled_and_said() -> None:
    signal = wave(0.5)
    signal[400:408] = np.nan
    found = smooth(TIME, signal, 6.0, names=["knee"])
    assert np.abs(found.values - wave(0.5)).max() < 1e-3
    assert found.notes == ("knee: 8 frames in gaps of at most 0.1 s interpolated.",)


def test_a_long_gap_and_the_ends_stay_open_and_are_said() -> None:
    signal = wave(0.5)
    signal[:5] = signal[400:430] = np.nan
    found = smooth(TIME, signal, 6.0, names=["knee"])
    for array in (found.values, found.rates, found.seconds):
        assert np.isnan(array[:, 0]).nonzero()[0].tolist() == [*range(5), *range(400, 430)]
    assert found.notes == ("knee: 35 frames missing, in longer gaps or at the ends.",)


def test_each_side_of_a_gap_is_filtered_on_its_own() -> None:
    """What comes after a gap cannot change what comes before it."""
    a, b = wave(0.5), wave(0.5)
    a[400:430] = b[400:430] = np.nan
    b[430:] += 3.0
    np.testing.assert_array_equal(smooth(TIME, a).values[:400], smooth(TIME, b).values[:400])


def test_a_stretch_shorter_than_a_period_of_the_cutoff_is_left_out_and_said() -> None:
    signal = wave(0.5)
    signal[30:60] = signal[65:] = np.nan
    found = smooth(TIME, signal, 6.0)
    assert np.isnan(found.values[30:]).all() and np.isfinite(found.values[:30]).all()
    assert "signal 1: 5 frames from 0.60 s on are too few, left out." in found.notes


def test_a_signal_that_is_never_seen_stays_missing() -> None:
    assert np.isnan(smooth(TIME, np.full((1001, 1), np.nan)).values).all()


def test_times_rounded_by_a_file_are_even_enough() -> None:
    exact = np.arange(600) / 120.0
    signal = np.sin(exact)[:, None]
    np.testing.assert_allclose(smooth(np.round(exact, 3), signal).rates, smooth(exact, signal).rates, atol=1e-3)


def test_dropped_frames_are_refused_by_time() -> None:
    with pytest.raises(RecordingError, match=r"frame \d+ \(.* s\) lies .* ms off an even spacing"):
        smooth(np.delete(TIME, slice(300, 320)), np.delete(wave(1.0), slice(300, 320), axis=0))


def test_a_cutoff_above_half_the_rate_is_refused() -> None:
    with pytest.raises(RecordingError, match="60 Hz is not possible at 100 Hz"):
        smooth(TIME, wave(1.0), 60.0)
