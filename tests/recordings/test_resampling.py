"""Resampling: what passes, what must not, no delay offline, the same live and offline."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from dynakin.errors import RecordingError
from dynakin.recordings.resampling import CausalLowPass, both_ways, low_pass, resample

FINE = np.arange(4000) / 2000.0
COARSE = np.arange(200) / 100.0
INSIDE = slice(30, -30)


def tone(time: np.ndarray, hz: float) -> np.ndarray:
    return np.cos(2 * np.pi * hz * time + 0.3)[:, None]


@pytest.mark.parametrize("hz", [0.0, 3.0, 20.0, 38.0])
def test_slow_tones_pass_without_delay(hz: float) -> None:
    np.testing.assert_allclose(resample(tone(FINE, hz), FINE, COARSE)[INSIDE], tone(COARSE, hz)[INSIDE], atol=2e-3)


@pytest.mark.parametrize("hz", [63.0, 90.0, 101.0, 197.0, 512.0])
@pytest.mark.parametrize("causal", [False, True])
def test_fast_tones_do_not_fold_back(hz: float, causal: bool) -> None:
    found = resample(tone(FINE, hz), FINE, COARSE, causal=causal)[INSIDE]
    limit = 1.5 / np.sqrt(1 + (np.tan(np.pi * hz / 2000) / np.tan(np.pi * 40 / 2000)) ** 8) if causal else 2e-3
    assert np.abs(found).max() < limit


def test_constant_stays_to_the_edges() -> None:
    np.testing.assert_allclose(resample(np.full((4000, 2), 7.5), FINE, COARSE), 7.5, rtol=1e-3)
    np.testing.assert_allclose(resample(np.full((40, 1), 7.5), FINE[:40], COARSE[:2]), 7.5, rtol=1e-3)


def test_same_times_are_the_same_array() -> None:
    samples = tone(COARSE, 3.0)
    assert resample(samples, COARSE, COARSE.copy()) is samples


def test_rates_without_a_common_grid() -> None:
    odd = np.arange(1000) / 480.0
    np.testing.assert_allclose(resample(tone(odd, 5.0), odd, COARSE)[INSIDE], tone(COARSE, 5.0)[INSIDE], atol=3e-3)


def test_uneven_or_short_input_is_refused() -> None:
    uneven = FINE.copy()
    uneven[1000:] += 0.01
    with pytest.raises(RecordingError, match="unevenly"):
        resample(tone(FINE, 1.0), uneven, COARSE)
    with pytest.raises(RecordingError, match="do not cover"):
        resample(tone(FINE, 1.0)[:2000], FINE[:2000], COARSE)


@settings(max_examples=25, deadline=None)
@given(cuts=st.lists(st.integers(0, 400), max_size=8))
def test_blocks_give_what_the_whole_gives(cuts: list[int]) -> None:
    samples = np.random.default_rng(1).normal(size=(400, 6)) + 500.0
    whole = CausalLowPass(2000.0, 40.0).push(samples)
    live = CausalLowPass(2000.0, 40.0)
    edges = [0, *sorted(cuts), 400]
    parts = [live.push(samples[a:b]) for a, b in pairwise(edges)]
    np.testing.assert_array_equal(np.vstack(parts), whole)


def test_causal_resampling_equals_live_use_and_never_looks_ahead() -> None:
    samples = np.random.default_rng(2).normal(size=(4000, 2))
    offline = resample(samples, FINE, COARSE, causal=True)
    live = CausalLowPass(2000.0, 40.0)
    streamed = np.array([live.push(samples[max(0, 20 * k - 19) : 20 * k + 1])[-1] for k in range(200)])
    np.testing.assert_allclose(offline, streamed, atol=1e-12)
    changed = samples.copy()
    changed[2001:] += 100.0
    np.testing.assert_array_equal(resample(changed, FINE, COARSE, causal=True)[:101], offline[:101])


def test_causal_delay_is_what_it_says() -> None:
    ramp = np.arange(4000.0)[:, None] / 2000.0
    filtered = CausalLowPass(2000.0, 40.0)
    late = ramp[-1, 0] - filtered.push(ramp)[-1, 0]
    assert late == pytest.approx(filtered.delay_s, rel=1e-3)


def test_zero_lag_filter_is_3_db_at_its_cutoff() -> None:
    found = low_pass(tone(FINE, 10.0), 2000.0, 10.0)[1000:3000]
    np.testing.assert_allclose(found, tone(FINE, 10.0)[1000:3000] / np.sqrt(2), atol=2e-3)
    with pytest.raises(RecordingError, match="expected less than 1000 Hz"):
        low_pass(tone(FINE, 10.0), 2000.0, 1000.0)


@pytest.mark.parametrize(("frames", "rate", "cutoff"), [(1400, 100.0, 6.0), (5000, 2000.0, 20.0), (7, 100.0, 2.0)])
def test_zero_lag_filter_is_scipys(frames: int, rate: float, cutoff: float) -> None:
    samples = 900.0 + np.cumsum(np.random.default_rng(0).normal(size=(frames, 3)), axis=0)
    beyond = min(frames - 1, int(rate / cutoff))
    expected = scipy.signal.sosfiltfilt(
        scipy.signal.butter(2, cutoff, fs=rate, output="sos"), samples, axis=0, padlen=beyond
    )
    np.testing.assert_allclose(both_ways(samples, rate, cutoff, beyond), expected, rtol=1e-12)
