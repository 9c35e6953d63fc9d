"""Least squares along a known motion against the filter that it stands for."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from dynakin import load_model
from dynakin.bindings import _core
from dynakin.filter.augment import continuous_noise
from dynakin.filter.core_filter import filter_settings
from dynakin.filter.noise import process_variance
from dynakin.filter.tracker import Tracker
from dynakin.identification.observability.advice import GAIN
from dynakin.identification.observability.known_motion import RATE_HZ, Known, KnownMotion, transition
from dynakin.identification.observability.measured import MeasuredModel
from dynakin.identification.observability.simulated import tracker_of
from dynakin.settings.presets import preset

Array = npt.NDArray[np.float64]

FREE = {"marker_gate": 0.0, "wrench_gate": 0.0, "recover": False, "constraint": "none", "iterate_beyond_sd": None}


@pytest.fixture(scope="module", params=["sagittal7", "fullbody"])
def tracker(request: pytest.FixtureRequest) -> Tracker:
    return tracker_of(load_model(request.param))


def swinging(measured: MeasuredModel, time: Array, *, lively: float = 1.0) -> Known:
    """Every coordinate swings about the start, by 3 to 11 deg or cm about once a second, some markers have gaps, and so
    have the plates.

    Args:
        lively: on the size of the swing of the second half of the coordinates.
    """
    rng = np.random.default_rng(3)
    at = [measured.block(name) for name in ("coordinates", "speeds", "accelerations")]
    size, w = rng.uniform(0.05, 0.2, at[0].stop), 2.0 * np.pi * rng.uniform(0.5, 1.5, at[0].stop)
    size[len(size) // 2 :] *= lively
    angle = w * time[:, None] + rng.uniform(0.0, 2.0 * np.pi, at[0].stop)
    states = np.tile(measured.initial.x0, (len(time), 1))
    states[:, at[0]] += size * np.sin(angle)
    states[:, at[1]], states[:, at[2]] = size * w * np.cos(angle), -size * w**2 * np.sin(angle)
    missing, blind = np.zeros((len(time), len(measured.marker_sd)), dtype=bool), np.zeros(len(time), dtype=bool)
    missing[5:9, 0] = missing[12, 2] = missing[0, 1] = blind[15:20] = True
    return Known(states, missing, blind)


def filtered(tracker: Tracker, time: Array, *motions: Known) -> Array:
    """Standard deviations (n,) of the core's filter, its state put on the motions before each update."""
    core, noise, measured = tracker.core_model, tracker.noise.changed(**FREE), MeasuredModel.of(tracker)
    settings = filter_settings(tracker.calibrated, noise, core.layout, tracker.estimate)
    chain, P = slice(0, measured.block("lengths").start), measured.prior
    for motion in motions:
        kalman = _core.Filter(core, settings, motion.states[0], P)
        for k, (x, missing, blind) in enumerate(zip(*motion, strict=True)):
            if k:
                kalman.predict(time[k] - time[k - 1])
                kalman.reset(x, kalman.covariance)
            markers = np.where(missing[:, None], np.nan, _core.marker_positions(core, x))
            kalman.update(markers, np.where(blind, np.nan, _core.plates(core, x)))
        P = kalman.covariance
        sd = np.sqrt(np.diag(P))
        P[chain] = P[:, chain] = 0.0
        P[chain, chain] = measured.prior[chain, chain]
    return sd


def constants(measured: MeasuredModel) -> list[int]:
    """Places of what gains are reported of."""
    return [k for k, name in enumerate(measured.names) if name.startswith(("inertia/", "length/"))]


@pytest.mark.parametrize("noise", ["default", "paper"])
def test_without_skin_all_frames_give_the_filters_own_deviations(tracker: Tracker, noise: str) -> None:
    """Nothing is approximate then: gaps, drift, the plates' errors and delay, the total mass, another motion."""
    stiff = Tracker(tracker.calibrated, preset(noise).changed(soft_tissue_sd_fraction=0.0), tracker.estimate)
    measured, time = MeasuredModel.of(stiff), np.arange(25) / RATE_HZ
    motions = swinging(measured, time), swinging(measured, time, lively=2.0)
    found = KnownMotion(stiff, measured, 1.0 / RATE_HZ).deviations(*motions)
    known = np.isfinite(found)
    left_out = {name.partition("/")[0] for name, one in zip(measured.names, known, strict=True) if not one}
    assert left_out <= {"contact", "soft_tissue"}
    np.testing.assert_allclose(found[known], filtered(stiff, time, *motions)[known], rtol=1e-4)


def test_skin_is_eliminated(tracker: Tracker) -> None:
    """Only that cameras' noise is not white in the difference of two frames is left out; as of ten frames together."""
    noise = tracker.noise.changed(marker_sd_m=float(tracker.noise.marker_sd_m or 0.0) / np.sqrt(10.0))
    sharp = Tracker(tracker.calibrated, noise, tracker.estimate)
    measured, time = MeasuredModel.of(sharp), np.arange(25) / RATE_HZ
    motion = swinging(measured, time)
    found, at = KnownMotion(sharp, measured, 1.0 / RATE_HZ).deviations(motion), constants(measured)
    np.testing.assert_allclose(found[at], filtered(sharp, time, motion)[at], rtol=0.15)


def test_few_frames_show_as_much_as_all(tracker: Tracker) -> None:
    """What a livelier motion gains is what the filter gains at 100 Hz."""
    measured, time = MeasuredModel.of(tracker), np.arange(200) / 100.0
    motions = [swinging(measured, time, lively=lively) for lively in (0.1, 2.0)]
    known = KnownMotion(tracker, measured, 0.01)
    quiet, lively = (known.deviations(motion) for motion in motions)
    all_quiet, all_lively = (filtered(tracker, time, motion) for motion in motions)
    at = constants(measured)
    gain, expected = (quiet / lively)[at], (all_quiet / all_lively)[at]
    much = expected > GAIN
    assert much.sum() >= 2
    np.testing.assert_allclose(gain[much], expected[much], rtol=0.2)


def test_the_transition_is_the_cores(tracker: Tracker) -> None:
    core, noise = tracker.core_model, tracker.noise
    density, decay = continuous_noise(tracker.calibrated, noise, core.layout)
    variance, free = process_variance(noise, core.layout), core.layout.blocks["coordinates"][1]
    F, Q = transition(density, decay, variance, 0.1, free)
    settings = filter_settings(tracker.calibrated, noise, core.layout, tracker.estimate)
    kalman = _core.Filter(core, settings, tracker.calibrated.x0, MeasuredModel.of(tracker).prior)
    kalman.predict(0.1)
    expected = F @ MeasuredModel.of(tracker).prior @ F.T + Q
    np.testing.assert_allclose(kalman.covariance, expected, rtol=1e-9, atol=1e-15)
