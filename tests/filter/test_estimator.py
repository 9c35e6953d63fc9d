"""The estimator on a simulated squat, whose truth is known, and on bad input."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import dynakin
from dynakin.bindings import _core
from dynakin.errors import ConfigError, DivergenceError, RecordingError
from dynakin.filter.measurements import Measurements
from dynakin.pipeline.result import Result
from dynakin.results.measures.metrics import compute_metrics
from dynakin.results.measures.sources import DERIVED, MEASURED, wrench_sources
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise
from dynakin.simulation.trial import simulate_squat
from support.squat_estimator import estimator, samples, with_markers


@pytest.fixture(scope="module")
def trial() -> SimulatedTrial:
    return simulate_squat(seed=3, duration_s=6.0)


@pytest.mark.parametrize(("preset", "rows"), [("paper", 38), ("default", 37)])  # the paper's total mass is a row
def test_live_steps_equal_the_run(trial: SimulatedTrial, preset: str, rows: int) -> None:
    noise = dynakin.presets.preset(preset)
    offline = estimator(noise=noise).run(trial.recording, lag_s=0.0)
    live = estimator(noise=noise).start(trial.recording)
    for k, sample in enumerate(samples(trial.recording)[:200]):
        step = live.step(sample)
        np.testing.assert_allclose(step.coordinates, offline.data["coordinates"].values[k], rtol=0, atol=1e-12)
        np.testing.assert_allclose(step.moments, offline.data["moments"].values[k], rtol=0, atol=1e-8)
    assert step.report.n_rows == rows


def test_a_sample_without_plates_or_markers_is_ridden_through(trial: SimulatedTrial) -> None:
    live = estimator(noise=dynakin.presets.paper()).start(trial.recording)
    first, second, third, *_ = samples(trial.recording)
    live.step(first)
    assert live.step(dataclasses.replace(second, plates={})).report.n_rows == 35
    assert live.step(dataclasses.replace(third, markers={})).report.n_rows == 4


def test_by_default_plates_alone_do_not_move_the_estimate(trial: SimulatedTrial) -> None:
    live = estimator().start(trial.recording)
    first, second, third, *_ = samples(trial.recording)
    live.step(first)
    assert live.step(dataclasses.replace(second, plates={})).report.n_rows == 34
    blind = live.step(dataclasses.replace(third, markers={})).report
    assert (blind.n_rows, blind.status, blind.tracking) == (0, "nothing measured", "following")


def test_without_sensor_noise_the_posture_comes_out(trial: SimulatedTrial) -> None:
    # Landmarks are not joint centres, so angles keep an offset; their movement must be the truth's.
    clean = simulate_squat(seed=3, duration_s=6.0, noise=SensorNoise.none())
    result = estimator().run(clean.recording)
    error = result.data["coordinates"].values - clean.truth.data["coordinates"].values
    error -= error.mean(axis=0)
    names = result.coordinate_names
    rms_deg = np.degrees(np.sqrt(np.mean(error**2, axis=0)))
    assert rms_deg[names.index("knee")] < 3.0, dict(zip(names, rms_deg, strict=True))
    assert compute_metrics(result)["markers"]["mean_rms_mm"] < 2.0


def test_deviations_of_parameters_never_grow_and_coordinates_stay_finite(trial: SimulatedTrial) -> None:
    noise = dynakin.presets.default().changed(length_drift_density_m2_s=0.0)
    result = estimator(noise=noise).run(trial.recording, lag_s=0.0)
    sd = result.data["state_sd"].values
    constants = [k for k, name in enumerate(result.data["element"].values) if str(name).startswith("length/")]
    held = result.data["constrained"].values > 0  # a restricted gain may widen what it holds
    steps = np.diff(sd[:, constants], axis=0)[~held[1:]]
    assert (steps <= 1e-12).all()


def test_noise_settings_reach_the_filter(trial: SimulatedTrial) -> None:
    plain = estimator().run(trial.recording)
    trusting = estimator(noise=dynakin.presets.paper().changed(marker_variance_m2={"r_knee": 1e-6})).run(
        trial.recording
    )
    rms = [compute_metrics(r)["markers"]["rms_mm"]["r_knee"] for r in (plain, trusting)]
    assert rms[1] < 0.5 * rms[0]


@pytest.mark.parametrize("preset", ["paper", "default"])
def test_bounds_are_kept_at_every_frame(trial: SimulatedTrial, preset: str) -> None:
    bounds = dynakin.Bounds(marker_threshold_m=0.002, length_fraction=0.01)
    tight = estimator(noise=dynakin.presets.preset(preset), bounds=bounds)
    result, tracker = tight.track(trial.recording, lag_s=0.0)
    initial = tracker.calibrated
    state = result.data["state"].values
    assert (state >= initial.lower).all() and (state <= initial.upper).all()
    assert result.data["constrained"].values.sum() > 0
    elements = [k for k, name in enumerate(initial.names) if name.startswith(("length/", "marker/"))]
    held = (state[:, elements] <= initial.lower[elements]) | (state[:, elements] >= initial.upper[elements])
    assert held.any()


def test_a_model_survives_pickling(trial: SimulatedTrial) -> None:
    spec = estimator().start(trial.recording).calibrated.spec
    model = _core.Model(spec)
    again = pickle.loads(pickle.dumps(model))
    assert again.layout.names == model.layout.names
    np.testing.assert_array_equal(again.initial_state(), model.initial_state())


def test_a_recording_without_plates_is_refused(trial: SimulatedTrial) -> None:
    with pytest.raises(RecordingError, match="no force plates, expected at least one"):
        estimator().run(trial.recording.with_plates(()))


def test_a_frame_without_any_marker_is_named(trial: SimulatedTrial) -> None:
    def blind(markers: np.ndarray) -> None:
        markers[250] = np.nan

    with pytest.raises(RecordingError, match=r"frame 251 \(2\.500 s\) has none of the model's 17 markers"):
        estimator(noise=dynakin.presets.paper()).run(with_markers(trial.recording, blind))


def test_by_default_a_frame_without_any_marker_is_ridden_through(trial: SimulatedTrial) -> None:
    def blind(markers: np.ndarray) -> None:
        markers[250:255] = np.nan

    through = estimator().run(with_markers(trial.recording, blind))
    whole = estimator().run(trial.recording)
    difference = through.data["coordinates"].values - whole.data["coordinates"].values
    assert (np.abs(difference[400:]) < whole.data["coordinates_sd"].values[400:]).all()
    assert (through.data["coordinates_sd"].values[254] > whole.data["coordinates_sd"].values[254]).all()


def test_what_each_sensor_said_is_in_steps_run_and_file(trial: SimulatedTrial, tmp_path: Path) -> None:
    """Innovation, its deviation, test ratio and verdict: of a marker that jumps, of the others and of the plates."""
    knee = trial.recording.marker_names.index("r_knee")

    def broken(markers: np.ndarray) -> None:
        markers[50, knee] += 0.3

    recording = with_markers(trial.recording, broken)
    result = estimator().run(recording)
    data = result.data
    axes = result.modelled_axes()
    for name in ("markers", "wrench"):
        expected = (data[f"{name}_measured"] - data[f"{name}_predicted"]).values
        np.testing.assert_allclose(data[f"{name}_innovation"].values, expected, rtol=0, atol=1e-9)
        assert (data[f"{name}_innovation_sd"].values[np.isfinite(expected)] > 0.0).all()
    assert np.isfinite(data["markers_innovation_sd"].values[..., axes]).all()
    ratio, verdict = data["test_ratio"].values, data["verdict"].values
    jumped = [str(name) for name in data["sensor"].values].index("r_knee")
    assert ratio[50, jumped] > 1.0 and verdict[50, jumped] == 2
    assert (ratio[verdict == 1] <= 1.0).all() and (ratio[verdict == 2] > 1.0).all()
    live = estimator().start(recording)
    for k, sample in enumerate(samples(recording)[:60]):
        live.step(sample)
        sensors = live.sensors
        np.testing.assert_allclose(sensors["test_ratio"], ratio[k], rtol=1e-9)
        for name in ("innovation", "innovation_sd"):
            both = [data[f"{of}_{name}"].values[k].ravel() for of in ("markers", "wrench")]
            np.testing.assert_allclose(sensors[name], np.concatenate(both), rtol=1e-9, atol=1e-12)
    with xr.open_dataset(Result(result).save(tmp_path / "out") / "estimate.nc") as stored:
        np.testing.assert_allclose(stored["test_ratio"].values, ratio, rtol=3e-4)
        np.testing.assert_allclose(stored["markers_innovation_sd"].values, data["markers_innovation_sd"].values, 3e-4)
        assert stored["verdict"].attrs["flag_meanings"] == "missing accepted refused"


@pytest.mark.parametrize(("frames", "warned"), [(300, True), (1, False)])
def test_where_plates_are_refused_moments_are_derived(trial: SimulatedTrial, frames: int, warned: bool) -> None:
    """From frame 301 on they lie 0.25 m off: in flags, counts, words, the total wrench, and live."""
    off = np.zeros((601, 3))
    off[301 : 301 + frames, 0] = 0.25
    moved = [dataclasses.replace(p, moment=p.moment + np.cross(off, p.force)) for p in trial.recording.plates]
    recording = trial.recording.with_plates(tuple(moved))
    found = estimator().run(recording)
    refused = found.data["verdict"].values[:, -1] == 2
    assert refused[301 : 301 + frames].all() and refused.sum() <= frames + 2
    for name in ("moment_source", "joint_source"):
        assert ((found.data[name].values == DERIVED) == refused[:, None]).all()
    assert (wrench_sources(found.data)[refused] != MEASURED).all()
    metrics = compute_metrics(found)["moments"]
    assert metrics["legs"][""] == {
        "measured": 601 - refused.sum(), "derived": refused.sum(), "prior": 0, "absent": 0
    }  # fmt: skip
    said = [message for message in found.messages if "The plates contradict the motion" in message.text]
    assert [message.level == "warning" for message in said] == [warned]
    assert f"in {refused.sum()} of 601 frames" in metrics["reasons"][0]
    live = estimator().start(recording)
    for k, sample in enumerate(samples(recording)[:310]):
        assert (live.step(sample).moment_sources == DERIVED).all() == (live.verdicts[-1] == "refused"), k


def test_a_marker_far_beyond_all_numbers_is_divergence_at_its_frame(trial: SimulatedTrial) -> None:
    knee = trial.recording.marker_names.index("r_knee")

    def broken(markers: np.ndarray) -> None:
        markers[250, knee] = 9e3  # a recording holds nothing that is further away

    filtering = estimator(noise=dynakin.presets.paper())
    tracker = filtering.start(trial.recording)
    markers, wrench, _ = filtering.measured(trial.recording, tracker.calibrated)
    markers[250, tracker.calibrated.recorded_markers.index("r_knee")] = 1e200
    with pytest.raises(DivergenceError, match=r"diverged at frame 250 \(2\.500000 s\)"):
        tracker.run_arrays(Measurements(trial.recording.time, markers, wrench))
    gated = estimator().run(with_markers(trial.recording, broken))
    assert [(e.kind, e.frame) for e in gated.events if e.subject == "r_knee"] == [("gated", 250)]


def test_plates_upside_down_are_refused_with_the_number(trial: SimulatedTrial) -> None:
    turned = [dataclasses.replace(p, force=-p.force, moment=-p.moment) for p in trial.recording.plates]
    with pytest.raises(RecordingError, match=r"vertical force is -\d+\.\d N"):
        estimator().run(trial.recording.with_plates(tuple(turned)))


def test_plates_that_are_not_there_are_refused_where_all_are_taken_together(trial: SimulatedTrial) -> None:
    first = trial.recording.plates[0].name
    for plates, words in (({"plate 9": "right"}, "'plate 9' is not in"), ({first: "middle"}, "given to 'middle'")):
        with pytest.raises(ConfigError, match=words):
            estimator(plates=plates).run(trial.recording)
    estimator(plates={first: "right"}).prepare(trial.recording)


def test_noise_for_a_marker_that_is_not_used_is_refused(trial: SimulatedTrial) -> None:
    with pytest.raises(ConfigError, match=r"noise\.marker_variance_m2: r_nose not among the markers used"):
        estimator(noise=dynakin.presets.paper().changed(marker_variance_m2={"r_nose": 1e-3})).run(trial.recording)


def test_an_unknown_preset_lists_the_known_ones() -> None:
    with pytest.raises(ConfigError, match="preset 'papr' is unknown; expected default, paper"):
        dynakin.presets.preset("papr")


def test_steps_go_forward_in_time(trial: SimulatedTrial) -> None:
    live = estimator().start(trial.recording)
    first, second, *_ = samples(trial.recording)
    live.step(second)
    with pytest.raises(RecordingError, match="older than the one before"):
        live.step(first)


@pytest.mark.parametrize(("lag_s", "frames"), [(0.0, 601), (0.02, 601), (np.inf, 2 * 601)])  # inf: and back
def test_progress_reaches_the_end(trial: SimulatedTrial, lag_s: float, frames: int) -> None:
    seen: list[tuple[int, int]] = []
    estimator().run(trial.recording, lag_s=lag_s, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (frames, frames)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
