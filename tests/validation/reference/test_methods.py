"""`reference_methods` as `compare` uses it: beside the filter, on a simulated and on a real squat."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dynakin
from dynakin.errors import ConfigError
from dynakin.model.calibration.how import Calibration
from dynakin.recordings.formats.mot import read_table
from dynakin.results.measures.fit import signal_fit, truth_error
from dynakin.simulation.trial import simulate_squat
from dynakin.validation.reference.least_squares import identify, inertia_of, predicted_wrench
from dynakin.validation.reference.methods import reference_methods
from support.perfect import MASS_KG, Perfect

Squats = tuple[dynakin.Recording, dynakin.ModelDefinition, dynakin.CalibratedModel, dynakin.Estimate]
PLANE = ["fx", "fy", "mz"]


@pytest.fixture(scope="module")
def squats1(data_dir: Path) -> Squats:
    folder = data_dir / "opencap_subject4"
    recording = dynakin.read(folder / "squats1.trc", forces=folder / "squats1_grf.mot")
    model = dynakin.load_model("sagittal7", subject=dynakin.Subject(mass_kg=60.05), markers="opencap")
    estimate, tracker = dynakin.Estimator(model).track(recording)
    return recording, model, tracker.calibrated, estimate


def test_arrays_line_up_with_an_estimates() -> None:
    trial = simulate_squat(seed=1, duration_s=6.0)
    model = dynakin.load_model("sagittal7", dynakin.Subject(mass_kg=70.0, height_m=1.75, sex="male"), markers="opencap")
    estimate, tracker = dynakin.Estimator(model).track(trial.recording)
    reference = reference_methods(trial.recording, tracker.calibrated, model)
    for name in ("coordinates", "speeds", "accelerations", "moments", "wrench_estimated", "wrench_measured"):
        ours, theirs = reference.data[name], estimate.data[name]
        assert ours.dims == theirs.dims, name
        for dim in ours.dims:
            np.testing.assert_array_equal(ours[dim].values, theirs[dim].values)
        assert (np.isnan(ours.values) == np.isnan(theirs.values)).all(), name
    np.testing.assert_allclose(reference.data["wrench_measured"], estimate.data["wrench_measured"], atol=1e-9)


def test_soft_tissue_spoils_angles_and_the_wrench_shows_it(perfect: Perfect) -> None:
    """The same subject and motion; the classical method has no defence against skin."""
    errors = {}
    for name, trial in (("bones", perfect.trial), ("skin", simulate_squat(seed=2, duration_s=10.0, mass_kg=MASS_KG))):
        reference = reference_methods(trial.recording, perfect.definition.calibrate(trial.recording),
                                      perfect.definition)  # fmt: skip
        truth = trial.truth.data["coordinates"]
        errors[name] = [
            truth_error(truth.sel(coordinate=c).values, reference.data["coordinates"].sel(coordinate=c).values)
            for c in ("ankle", "knee", "hip")
        ]
    for bones, skin in zip(errors["bones"], errors["skin"], strict=True):
        assert bones.rms is not None and skin.rms is not None
        assert np.degrees(bones.rms) < 0.1 < 0.5 < np.degrees(skin.rms) < 15.0


def test_without_plates_there_is_no_measured_wrench(perfect: Perfect) -> None:
    reference = reference_methods(
        replace(perfect.trial.recording, plates=()), perfect.initial, perfect.definition, None
    )
    assert "wrench_measured" not in reference.data
    assert "not filtered" in reference.notes[0]
    np.testing.assert_array_equal(reference.data["coordinates"], reference.data["coordinates_unfiltered"])


def test_gaps_are_filled_or_left_and_both_said(perfect: Perfect) -> None:
    recording = perfect.trial.recording
    markers = recording.markers.copy()
    knee = recording.marker_names.index("r_knee")
    markers[300:305, knee] = markers[600:640, knee] = np.nan
    gappy = replace(recording, markers=markers)
    initial = perfect.definition.calibrate(gappy, how=Calibration(side="right"))
    reference = reference_methods(gappy, initial, perfect.definition)
    missing = np.isnan(reference.data["wrench_estimated"].sel(component="fy").values)
    assert missing.nonzero()[0].tolist() == list(range(600, 640))
    assert "knee: 5 frames in gaps of at most 0.1 s interpolated." in reference.notes
    assert "knee: 40 frames missing, in longer gaps or at the ends." in reference.notes
    assert np.isfinite(reference.data["coordinates"].sel(coordinate="lumbar").values).all()


def test_an_unknown_way_to_take_lengths_is_refused(perfect: Perfect) -> None:
    with pytest.raises(ConfigError, match="'mean', expected constant or frame"):
        reference_methods(perfect.trial.recording, perfect.initial, perfect.definition, lengths="mean")  # type: ignore[arg-type]


def test_squats1_table_wrench_errs_as_classical_pipelines_do_and_the_filters_does_not(
    squats1: Squats,
) -> None:
    """Measured: constant lengths 22, 31 N, 22 N m; lengths of each frame 10, 11 N, 17 N m (a prototype: 17, 21, 19;
    the paper's Figure 6: 11, 10, 16). The thigh's projection shortens by up to 8 cm, which constant lengths deny."""
    recording, model, initial, estimate = squats1
    late = recording.time >= recording.time[0] + 2.0
    rms: dict[str, list[float]] = {}
    for lengths in ("constant", "frame"):
        data = reference_methods(recording, initial, model, lengths=lengths).data  # type: ignore[arg-type]
        error = (data["wrench_estimated"] - data["wrench_measured"]).sel(component=PLANE).values[late]
        rms[lengths] = np.sqrt(np.mean(error**2, axis=0)).tolist()
    np.testing.assert_allclose(rms["constant"], [21.8, 30.9, 22.0], rtol=0.05)
    np.testing.assert_allclose(rms["frame"], [10.3, 10.9, 17.1], rtol=0.05)
    filtered = (estimate.data["wrench_estimated"] - estimate.data["wrench_measured"]).sel(component=PLANE).values[late]
    assert (np.sqrt(np.mean(filtered**2, axis=0)) < 0.5 * np.array(rms["constant"])).all()


def test_squats1_classical_knee_moves_as_another_system_says(squats1: Squats, data_dir: Path) -> None:
    recording, model, initial, _ = squats1
    knee = reference_methods(recording, initial, model).data["coordinates"].sel(coordinate="knee")
    table = read_table(data_dir / "opencap_subject4" / "squats1_ik.mot")
    error = truth_error(table.column("knee_angle_r"), knee.values)
    assert error.rms_about_mean is not None and np.degrees(error.rms_about_mean) < 5.0


def test_squats1_parameters_of_one_half_predict_the_other(
    squats1: Squats,
) -> None:
    """Free least squares fits what it has not seen better than the table, with bodies that cannot exist."""
    recording, model, initial, _ = squats1
    middle = recording.time[recording.n_frames // 2]
    first, second = (
        reference_methods(part, initial, model)
        for part in (
            recording.window(recording.time[0], middle),
            recording.window(middle, recording.time[-1]),
        )
    )
    found = identify(
        first.chain,
        initial.plan,
        first.kinematics,
        first.data["wrench_measured"].values,
        mass_kg=initial.mass_kg,
    )
    assert found.base.rank == 22
    unheld = inertia_of(first.chain, found.free).values()
    assert len(found.at_bound) > 5 and any(body.mass != 0.0 and not body.possible_in_plane() for body in unheld)
    measured = second.data["wrench_measured"].values
    for component, better in ((0, 0.8), (5, 0.6)):
        table, free = (
            signal_fit(measured[:, component], predicted_wrench(second.chain, second.kinematics, phi)[:, component]).rms
            for phi in (found.table, found.free)
        )
        assert table is not None and free is not None and free < better * table
