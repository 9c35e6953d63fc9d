"""Each sensor error has its declared size, comes alone, and leaves the others' draws as they are."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from dynakin.errors import ConfigError
from dynakin.simulation.output import SimulatedTrial
from dynakin.simulation.sensors.sizes import SensorNoise, load_sensors
from dynakin.simulation.trial import simulate

PERFECT = SensorNoise.none()


def trial(duration_s: float = 6.0, model: str = "sagittal7", **changes: float) -> SimulatedTrial:
    return simulate(model, "squat", 4, duration_s, noise=dataclasses.replace(PERFECT, **changes))


@pytest.fixture(scope="module")
def perfect() -> SimulatedTrial:
    return trial()


def force_and_moment(one: SimulatedTrial, plate: int) -> np.ndarray:
    """The six channels (T, 6), moments about the plate's centre."""
    found = one.recording.plates[plate]
    centre = found.corners.mean(axis=0)
    return np.hstack([found.force, found.moment - np.cross(centre, found.force)])


SWITCHES = {
    "marker_sd_m": 0.001,
    "soft_tissue": 1.0,
    "misplacement_sd_m": 0.01,
    "hip_regression_sd_m": 0.01,
    "occlusion_per_min": 5.0,
    "swap_per_min": 60.0,
    "flying_per_min": 20.0,
    "plate_force_sd_n": 1.0,
    "plate_moment_sd_nm": 1.0,
    "plate_gain_sd": 0.01,
    "plate_drift_n_per_min": 5.0,
    "plate_drift_nm_per_min": 5.0,
    "plate_step_n": 1.0,
    "plate_step_nm": 1.0,
    "plate_lag_s": 0.02,
}


def test_every_size_is_a_switch_here() -> None:
    others = {"soft_tissue_random", "occlusion_mean_s", "swap_mean_s", "flying_mean_s", "flying_distance_m"}
    assert set(SWITCHES) | others == {field.name for field in dataclasses.fields(SensorNoise)}


@pytest.mark.parametrize("key", SWITCHES)
def test_an_error_is_off_or_on_and_never_touches_the_other_sensors(key: str, perfect: SimulatedTrial) -> None:
    spoilt = trial(**{key: SWITCHES[key]})
    of_plates = key.startswith("plate")
    same_markers = np.array_equal(spoilt.recording.markers, perfect.recording.markers, equal_nan=True)
    same_plates = all(
        np.array_equal(a.force, b.force) and np.array_equal(a.moment, b.moment)
        for a, b in zip(spoilt.recording.plates, perfect.recording.plates, strict=True)
    )
    assert (same_markers, same_plates) == (of_plates, not of_plates)
    for name in ("coordinates", "moments", "wrench"):
        assert spoilt.truth.data[name].identical(perfect.truth.data[name])


@pytest.mark.parametrize("other", ["plate_gain_sd", "swap_per_min", "misplacement_sd_m"])
def test_one_error_keeps_its_draws_when_another_is_switched(other: str) -> None:
    """Differences that noise makes, alone and beside another error: the same to rounding."""
    noise = {"marker_sd_m": 0.001, "plate_force_sd_n": 2.0}
    alone = trial(**noise), trial()
    beside = trial(**noise, **{other: SWITCHES[other]}), trial(**{other: SWITCHES[other]})
    steps = [x.recording.plates[1].force - y.recording.plates[1].force for x, y in (alone, beside)]
    np.testing.assert_allclose(*steps, atol=1e-9)
    if other != "swap_per_min":
        own = slice(0, -2)  # the virtual hips follow the pelvis markers, not evenly
        steps = [x.recording.markers[:, own] - y.recording.markers[:, own] for x, y in (alone, beside)]
        np.testing.assert_allclose(*steps, atol=1e-12)


def test_misplacement_moves_landmarks_once_and_only_them(perfect: SimulatedTrial) -> None:
    off = [trial(misplacement_sd_m=0.01, duration_s=5.0).truth for _ in range(2)]
    nominal = {site.name: site.place for site in perfect.truth.sites}
    moved = {site.name: site.place - nominal[site.name] for site in off[0].sites}
    assert np.std([v for s in off[0].sites if s.landmark for v in moved[s.name]]) == pytest.approx(0.01, rel=0.25)
    assert all(not moved[s.name].any() for s in off[0].sites if not s.landmark)
    assert off[0].parameters["marker/r_knee/x"] == pytest.approx(nominal["r_knee"][0] + moved["r_knee"][0])
    assert off[0].parameters == off[1].parameters


def test_virtual_hips_inherit_what_happens_to_the_pelvis_markers(perfect: SimulatedTrial) -> None:
    """Whoever estimates starts from hips on displaced markers, not from the true ones."""

    def hip_error(one: SimulatedTrial) -> np.ndarray:
        middle = 0.5 * (one.recording.marker("R_HJC_reg") + one.recording.marker("L_HJC_reg"))
        true = one.truth.data["joint_centres"].sel(joint="hip").values + one.truth.origin_L
        return np.linalg.norm(middle - true, axis=1)

    assert hip_error(perfect).max() < 1e-12
    assert hip_error(trial(misplacement_sd_m=0.006))[0] > 1e-3
    assert hip_error(trial(hip_regression_sd_m=0.006))[0] > 1e-3
    assert hip_error(trial(soft_tissue=1.0)).max() > 5e-3
    gaps = trial(30.0, occlusion_per_min=20.0)
    lost = np.isnan(gaps.recording.marker("r.PSIS")).any(axis=1)
    assert lost.any()
    assert np.isnan(gaps.recording.marker("R_HJC_reg")[lost]).all()


def test_gaps_are_as_many_and_as_long_as_asked() -> None:
    gaps = trial(120.0, occlusion_per_min=6.0, occlusion_mean_s=0.25)
    faults = gaps.truth.faults
    assert {fault.kind for fault in faults} == {"occluded"}
    assert len(faults) == pytest.approx(45 * 2 * 6.0, rel=0.1)
    assert np.mean([fault.end_s - fault.start_s for fault in faults]) == pytest.approx(0.25, rel=0.15)
    missing = np.isnan(gaps.recording.markers).any(axis=2)
    expected = np.zeros_like(missing)
    names = list(gaps.recording.marker_names)
    for fault in faults:
        within = (gaps.recording.time > fault.start_s - 1e-6) & (gaps.recording.time < fault.end_s - 1e-6)
        expected[within, names.index(fault.markers[0])] = True
    assert np.array_equal(missing[:, :-2], expected[:, :-2])  # the last two are the virtual hips


def test_swapped_and_flying_markers_are_what_the_faults_say() -> None:
    clean, spoilt = trial(60.0), trial(60.0, swap_per_min=10.0, flying_per_min=20.0, flying_distance_m=0.4)
    time, names = clean.recording.time, list(clean.recording.marker_names)
    touched = np.zeros((len(time), len(names)), dtype=bool)
    for fault in spoilt.truth.faults:
        within = (time > fault.start_s - 1e-6) & (time < fault.end_s - 1e-6)
        touched[np.ix_(within, [names.index(m) for m in fault.markers])] = True
    off = np.linalg.norm(spoilt.recording.markers - clean.recording.markers, axis=2)[:, :-2]
    assert (off[~touched[:, :-2]] == 0.0).all()
    assert (off[touched[:, :-2]] > 1e-3).all()
    kinds = [fault.kind for fault in spoilt.truth.faults]
    assert 3 <= kinds.count("swapped") <= 20
    assert 10 <= kinds.count("flying") <= 32
    lone = next(f for f in spoilt.truth.faults if f.kind == "swapped")
    k = int(np.searchsorted(time, lone.start_s - 1e-6))
    a, b = (names.index(m) for m in lone.markers)
    np.testing.assert_array_equal(spoilt.recording.markers[k, [a, b]], clean.recording.markers[k, [b, a]])
    assert np.linalg.norm(clean.recording.markers[k, a] - clean.recording.markers[k, b]) <= 0.30


def test_gains_and_drifts_are_those_of_the_truth(perfect: SimulatedTrial) -> None:
    spoilt = trial(plate_gain_sd=0.02, plate_drift_n_per_min=6.0, plate_drift_nm_per_min=3.0)
    time = spoilt.recording.time
    for k, (name, errors) in enumerate(spoilt.truth.plate_errors.items()):
        expected = force_and_moment(perfect, k) * errors.gain + np.outer(time, errors.drift)
        np.testing.assert_allclose(force_and_moment(spoilt, k), expected, atol=1e-9, err_msg=name)
        assert (errors.gain != 1.0).all()
    gains = [
        e.gain - 1.0
        for seed in range(20)
        for e in simulate(
            "sagittal7", "sway", seed, 3.0, 20.0, noise=dataclasses.replace(PERFECT, plate_gain_sd=0.02)
        ).truth.plate_errors.values()
    ]
    assert np.std(gains) == pytest.approx(0.02, rel=0.15)


def test_channels_are_rounded_to_their_steps() -> None:
    channels = force_and_moment(trial(plate_step_n=0.5, plate_step_nm=0.1), 0)
    for values, step in ((channels[:, :3], 0.5), (channels[:, 3:], 0.1)):
        np.testing.assert_allclose(values / step, np.round(values / step), atol=1e-6)


@pytest.mark.parametrize("frames", [-4, 7])
def test_plates_are_late_by_the_lag(frames: int, perfect: SimulatedTrial) -> None:
    shifted = trial(plate_lag_s=0.01 * frames)
    late = shifted.recording.plates[0].force[50:-50]
    np.testing.assert_allclose(late, perfect.recording.plates[0].force[50 - frames : -50 - frames], atol=1e-9)


def test_presets_and_files(tmp_path: Path) -> None:
    assert load_sensors("none") == PERFECT
    assert load_sensors("default") == SensorNoise()
    assert load_sensors("laboratory").misplacement_sd_m > 0.0
    (tmp_path / "mine.toml").write_text("plate_lag_s = 0.01\nmarker_sd_m = 0\n")
    assert load_sensors(str(tmp_path / "mine.toml")) == SensorNoise(plate_lag_s=0.01, marker_sd_m=0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "plate_lagg_s = 0.01",
            r"mine\.toml: sensor noise: unknown key 'plate_lagg_s' \(did you mean 'plate_lag_s'\?\)",
        ),
        ("plate_lag_s = 2.0", r"mine\.toml: sensor noise: plate_lag_s is 2, expected -0\.5 to 0\.5"),
        ("marker_sd_m = 'x'", "marker_sd_m is 'x', expected a number"),
        ("marker_sd_m = true", "marker_sd_m is True, expected a number"),
        ("swap_mean_s = 0.0", "swap_mean_s is 0, expected 0.001 or more"),
        ("marker_sd_m = nan", "marker_sd_m is nan"),
        ("marker_sd_m = inf", "marker_sd_m is inf"),
        ("marker_sd_m =", r"mine\.toml: cannot be read as TOML"),
    ],
)
def test_a_wrong_file_is_named(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(ConfigError, match=said):
        load_sensors(str(tmp_path / "mine.toml"))


def test_no_such_preset() -> None:
    with pytest.raises(ConfigError, match=r"sensors is 'perfect', expected none, default, laboratory or a \.toml file"):
        load_sensors("perfect")
